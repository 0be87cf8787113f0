// Images of all encodings and shapes as GL has them, beside what their blocks say, and what surfaces and surroundings
// make of them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <random>
#include <vector>

#include "client/draw/store/BlockPixels.h"
#include "client/draw/store/EnvironmentTexture.h"
#include "client/draw/store/TextureCache.h"
#include "tests/unit/draw/RendererStage.h"

namespace tessera {
namespace {

using Block = std::vector<std::uint8_t>;

/// Fields of so many bits, the lowest first.
Block bitBlock(std::initializer_list<std::pair<std::uint64_t, int>> fields) {
    Block block(16);
    int at = 0;
    for (const auto& [value, bits] : fields)
        for (int i = 0; i < bits; ++i, ++at)
            block[static_cast<std::size_t>(at / 8)] |= static_cast<std::uint8_t>((value >> i & 1) << at % 8);
    return block;
}
/// Two ends of 5, 6, 5 bits, the same index for all.
Block bc1Block(unsigned first, unsigned second, unsigned index) {
    const auto row = static_cast<std::uint8_t>(0x55 * index);
    return {static_cast<std::uint8_t>(first),
            static_cast<std::uint8_t>(first >> 8),
            static_cast<std::uint8_t>(second),
            static_cast<std::uint8_t>(second >> 8),
            row,
            row,
            row,
            row};
}
/// One colour: mode 11, ten bits an end; 495 is 1 (half 0x3c00 = 31 · (64 · 495 + 32) / 64).
Block bc6hBlock(unsigned r, unsigned g, unsigned b) {
    return bitBlock({{3, 5}, {r, 10}, {g, 10}, {b, 10}, {r, 10}, {g, 10}, {b, 10}});
}

Image imageOf(std::int64_t encoding, std::int64_t width, std::int64_t height, const std::vector<std::uint8_t>& bytes) {
    return {.pixels = Blob::of(std::span<const std::uint8_t>(bytes)),
            .widthPx = width,
            .heightPx = height,
            .encoding = encoding};
}
Image ofOne(std::int64_t encoding, const Block& block) {
    return imageOf(encoding, 4, 4, block);
}
std::vector<std::uint8_t> randomBytes(std::mt19937& random, std::size_t count) {
    std::vector<std::uint8_t> bytes(count);
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random());
    return bytes;
}

class TextureTest : public RendererTest {
protected:
    void SetUp() override {
        RendererTest::SetUp();
        ASSERT_TRUE(surface_->makeCurrent());
        gl_ = GlState(GlFunctions::load(*surface_).value());
    }
    /// What GL decodes of a level, all slices and faces.
    std::vector<std::uint8_t> read(GLuint texture, GLint level, std::size_t pixels) {
        std::vector<std::uint8_t> bytes(4 * pixels);
        gl_.GetTextureImage(texture, level, GL_RGBA, GL_UNSIGNED_BYTE, static_cast<GLsizei>(bytes.size()),
                            bytes.data());
        EXPECT_TRUE(gl_.check("reading a texture"));
        return bytes;
    }
    Rgb shown(const Material& material, const Image& image, ObjectId Material::*where) {
        TestScene scene;
        scene.setDark();
        Material with = material;
        with.*where = scene.add(image);
        scene.place(scene.add(makeSheet(4, 4, 1), scene.add(with)), Vec3d::Zero());
        return center(draw(scene));
    }
    GlState gl_;
    UseClock clock_;
};

unsigned seedOf() {
    const char* given = std::getenv("TESSERA_SEED");
    return given ? static_cast<unsigned>(std::strtoul(given, nullptr, 10)) : 1;
}

TEST_F(TextureTest, BlocksAreTheirPixelsInEveryShape) {
    SCOPED_TRACE("TESSERA_SEED=" + std::to_string(seedOf()) + " unit_draw --gtest_filter=TextureTest.BlocksAre*");
    std::mt19937 random(seedOf());
    TextureCache cache(gl_, clock_, 1);
    for (const std::int64_t encoding : {Image::kBc1, Image::kBc2, Image::kBc3, Image::kBc4, Image::kBc5})
        for (const std::int64_t shape : {Image::kFlat, Image::kLine, Image::kSolid, Image::kCube})
            for (const ImageUse use : {ImageUse::kColor, ImageUse::kNumbers}) {
                Image image{.widthPx = 9,
                            .heightPx = shape == Image::kLine   ? 1
                                        : shape == Image::kCube ? 9
                                                                : 7,
                            .encoding = encoding,
                            .shape = shape};
                image.depthPx = shape == Image::kSolid ? 5 : 1;
                image.mipmaps = 3;
                const ImageLevel last = levelsOf(image).back();
                const std::vector<std::uint8_t> bytes = randomBytes(random, last.offset + last.sizeBytes);
                image.pixels = Blob::of(std::span<const std::uint8_t>(bytes));
                ASSERT_TRUE(checkImage(image)) << checkImage(image).error().message;
                const TextureCache::Found found = cache.find(image, use);
                const GLuint texture = found ? found->name : 0;
                ASSERT_NE(texture, 0u);
                const std::vector<ImageLevel> levels = levelsOf(image);
                for (std::size_t i = 0; i < levels.size(); ++i) {
                    const auto area = static_cast<std::size_t>(levels[i].widthPx * levels[i].heightPx),
                               slices = static_cast<std::size_t>(levels[i].depthPx);
                    const std::vector<std::uint8_t> seen = read(texture, static_cast<GLint>(i), area * slices);
                    int worst = 0;
                    for (std::size_t slice = 0; slice < slices; ++slice) {
                        const Bytes wanted =
                            decodeBlocks(image.pixels.bytes().subspan(levels[i].offset + slice * levels[i].sliceBytes,
                                                                      levels[i].sliceBytes),
                                         encoding, levels[i].widthPx, levels[i].heightPx);
                        for (std::size_t k = 0; k < wanted.size(); ++k) {
                            // Of bc4 GL reads red; the others are taken from it where it is looked up.
                            if (encoding == Image::kBc4 && use == ImageUse::kNumbers && k % 4 != 0) continue;
                            worst = std::max(
                                worst, std::abs(std::to_integer<int>(wanted[k]) - int{seen[4 * slice * area + k]}));
                        }
                    }
                    // A driver may cut off each of the two products that make thirds, fifths and sevenths by itself.
                    EXPECT_LE(worst, 2) << "encoding " << encoding << ", shape " << shape << ", level " << i;
                }
            }
    EXPECT_TRUE(gl_.check("uploading"));
}

TEST_F(TextureTest, PlainSlicesAndFacesStandInTheirOrder) {
    TextureCache cache(gl_, clock_, 1);
    std::vector<std::uint8_t> bytes;
    for (std::uint8_t slice = 0; slice < 6; ++slice)
        bytes.insert(bytes.end(), 2 * 2 * 4, static_cast<std::uint8_t>(40 * slice));
    for (const std::int64_t shape : {Image::kSolid, Image::kCube}) {
        Image image = imageOf(Image::kSrgb, 2, 2, bytes);
        image.shape = shape;
        image.depthPx = shape == Image::kSolid ? 6 : 1;
        const GLuint texture = cache.find(image, ImageUse::kNumbers)->name;
        ASSERT_NE(texture, 0u);
        EXPECT_EQ(read(texture, 0, 24), bytes) << shape;
        EXPECT_EQ(textureTarget(image),
                  static_cast<GLenum>(shape == Image::kSolid ? GL_TEXTURE_3D : GL_TEXTURE_CUBE_MAP));
    }
    Image line = imageOf(Image::kSrgb, 24, 1, bytes);
    line.shape = Image::kLine;
    EXPECT_EQ(read(cache.find(line, ImageUse::kNumbers)->name, 0, 24), bytes);
    // The same bytes, three ways: three textures, counted with their mipmaps.
    EXPECT_GE(cache.residentBytes(), 3 * bytes.size());
    EXPECT_LE(cache.residentBytes(), 5 * bytes.size());
}

TEST_F(TextureTest, WhatDoesNotFitIsNone) {
    TextureCache cache(gl_, clock_, 1);
    const std::vector<std::uint8_t> bytes(64);
    const auto found = [&](const Image& image) { return cache.find(image, ImageUse::kColor) != nullptr; };
    Image image = imageOf(Image::kSrgb, 4, 4, bytes);
    EXPECT_NE(found(image), 0u);
    for (const auto change :
         {+[](Image& i) { i.encoding = Image::kBc1; }, +[](Image& i) { i.shape = Image::kCube; },
          +[](Image& i) { i.shape = Image::kLine; }, +[](Image& i) { i.mipmaps = 2; }, +[](Image& i) { i.widthPx = 0; },
          +[](Image& i) { i.widthPx = 65536, i.heightPx = 65536; }, +[](Image& i) { i.depthPx = 2; }}) {
        Image other = image;
        change(other);
        EXPECT_EQ(found(other), 0u);
    }
}

TEST_F(TextureTest, OpaqueIsWhatGlReadsSo) {
    SCOPED_TRACE("TESSERA_SEED=" + std::to_string(seedOf()) + " unit_draw --gtest_filter=TextureTest.Opaque*");
    std::mt19937 random(seedOf());
    std::size_t opaque = 0, open = 0, unsure = 0;
    for (int i = 0; i < 3000; ++i) {
        const std::int64_t encoding = std::array{Image::kBc1, Image::kBc2, Image::kBc3, Image::kBc7}[random() % 4];
        Block block = randomBytes(random, encoding == Image::kBc1 ? 8 : 16);
        // Blocks at random are never opaque but for bc1, so what alpha is made of is filled.
        if (encoding == Image::kBc2 && random() % 2) std::fill_n(block.begin(), 8, std::uint8_t{255});
        if (encoding == Image::kBc3 && random() % 2) block[0] = block[1] = 255;
        if (encoding == Image::kBc3 && random() % 2) std::fill_n(block.begin(), 8, std::uint8_t{255});
        if (encoding == Image::kBc7) {
            const unsigned mode = random() % 8;
            block[0] = static_cast<std::uint8_t>(1u << mode | (mode < 7 ? (block[0] >> (mode + 1)) << (mode + 1) : 0));
            if (random() % 2) std::fill(block.begin() + 1, block.end(), std::uint8_t{255});
        }
        const Image image = ofOne(encoding, block);
        TextureCache cache(gl_, clock_, 1);
        const std::vector<std::uint8_t> seen = read(cache.find(image, ImageUse::kNumbers)->name, 0, 16);
        bool full = true;
        for (std::size_t k = 3; k < 64; k += 4) full = full && seen[k] == 255;
        EXPECT_TRUE(full || !isOpaque(image)) << "encoding " << encoding << ", try " << i;
        // bc7 alone is judged by its ends, not by its pixels.
        EXPECT_TRUE(encoding == Image::kBc7 || isOpaque(image) == full) << "encoding " << encoding << ", try " << i;
        (isOpaque(image) ? opaque : full ? unsure : open)++;
    }
    EXPECT_GT(opaque, 500u);
    EXPECT_GT(open, 500u);
    EXPECT_LT(unsure, 100u);
}

TEST_F(TextureTest, SurfacesShowThemAsTheyShowPixels) {
    Material lit;
    lit.unlit = true;
    lit.baseColor = Vec4f::Ones();
    // 5, 6, 5 bits: 0xf81f is red and blue.
    expectNear(shown(lit, ofOne(Image::kBc1, bc1Block(0xf81f, 0, 0)), &Material::baseColorImage), {255, 0, 255});
    Block bc4(8);
    bc4[0] = 128;
    expectNear(shown(lit, ofOne(Image::kBc4, bc4), &Material::baseColorImage), {128, 128, 128});
    // Emission of half the light: 0.5 is half 0x3800, so 31 · c / 64 = 14336, and c = 64 · 462 + 32.
    const Rgb glow = shown(unlit(Vec3f::Ones()), ofOne(Image::kBc6h, bc6hBlock(462, 0, 462)), &Material::emissiveImage);
    const Rgb wanted = expectedOf(Vec3f(0.5f, 0, 0.5f));
    EXPECT_NEAR(glow.r, wanted.r, 2) << glow;
    EXPECT_NEAR(glow.g, wanted.g, 2) << glow;
    // Floats, which share an exponent, mean light and not what is encoded: four times as bright as white, and darkened;
    // as emission; far beyond what halves hold.
    const auto floats = [](int r, int g, int b, int e) {
        return imageOf(Image::kRgbe, 1, 1,
                       std::vector<std::uint8_t>{static_cast<std::uint8_t>(r), static_cast<std::uint8_t>(g),
                                                 static_cast<std::uint8_t>(b), static_cast<std::uint8_t>(e)});
    };
    Material darkened = lit;
    darkened.baseColor = Vec4f(0.25f, 0.25f, 0.25f, 1);
    for (const auto& [material, where, image] :
         {std::tuple(lit, &Material::baseColorImage, floats(128, 32, 0, 128)),
          std::tuple(darkened, &Material::baseColorImage, floats(128, 32, 0, 130)),
          std::tuple(unlit(Vec3f::Ones()), &Material::emissiveImage, floats(128, 32, 0, 128))}) {
        const Rgb seen = shown(material, image, where), half = expectedOf(Vec3f(0.5f, 0.125f, 0));
        EXPECT_NEAR(seen.r, half.r, 2) << seen;
        EXPECT_NEAR(seen.g, half.g, 2) << seen;
        EXPECT_EQ(seen.b, half.b) << seen;
    }
    expectNear(shown(lit, floats(255, 255, 255, 255), &Material::baseColorImage), {255, 255, 255});
    expectNear(shown(lit, floats(255, 255, 255, 0), &Material::baseColorImage), {0, 0, 0});
    // A cube on a surface is as no image.
    Image cube = imageOf(Image::kSrgb, 1, 1, std::vector<std::uint8_t>(24, 0));
    cube.shape = Image::kCube;
    expectNear(shown(lit, cube, &Material::baseColorImage), {255, 255, 255});
}

TEST_F(TextureTest, NormalMapsOfTwoChannelsAreUnitNormals) {
    Block flat(16);
    flat[0] = flat[1] = flat[8] = flat[9] = 128;
    const Bytes pixels = decodeBlocks(std::as_bytes(std::span(flat)), Image::kBc5, 4, 4);
    EXPECT_EQ(std::to_integer<int>(pixels[0]), 128);
    EXPECT_EQ(std::to_integer<int>(pixels[2]), 255);
    flat[0] = flat[1] = 255;
    EXPECT_EQ(std::to_integer<int>(decodeBlocks(std::as_bytes(std::span(flat)), Image::kBc5, 4, 4)[2]), 128)
        << "x is 1, and z 0";
}

TEST_F(TextureTest, BlendedBlocksWithoutHolesAreDrawnAsOpaque) {
    for (const bool holes : {false, true}) {
        TestScene scene;
        Material material;
        material.alphaMode = Material::kBlend;
        material.baseColorImage =
            scene.add(ofOne(Image::kBc1, holes ? bc1Block(0, 0xffff, 3) : bc1Block(0xffff, 0, 3)));
        scene.place(scene.add(makeSheet(4, 4, 1), scene.add(material)), Vec3d::Zero());
        const DrawList list = listOf(scene.take(), cameraOf(kSidePx, kSidePx));
        EXPECT_EQ(list.opaque.size(), holes ? 0u : 1u);
    }
}

/// Lit from +Y by a red face, from -Z by a blue one; the others are black.
TEST_F(TextureTest, CubesSurroundAsTheirFacesLie) {
    const auto faceColor = [](int face) {
        return face == 2   ? std::array<unsigned, 3>{495, 0, 0}
               : face == 5 ? std::array<unsigned, 3>{0, 0, 495}
                           : std::array<unsigned, 3>{0, 0, 0};
    };
    std::vector<std::uint8_t> blocks, plain;
    for (int face = 0; face < 6; ++face) {
        const auto color = faceColor(face);
        const Block block = bc6hBlock(color[0], color[1], color[2]);
        blocks.insert(blocks.end(), block.begin(), block.end());
        for (int i = 0; i < 16; ++i)
            plain.insert(plain.end(), {static_cast<std::uint8_t>(color[0] ? 128 : 0), 0,
                                       static_cast<std::uint8_t>(color[2] ? 128 : 0), 129});
    }
    Image cube = imageOf(Image::kRgbe, 4, 4, plain);
    cube.shape = Image::kCube;
    const EnvironmentLight light = EnvironmentLight::of(cube).value();
    EXPECT_LT((light.radiance(Vec3d::UnitY()) - Vec3d(1, 0, 0)).norm(), 1e-3);
    EXPECT_LT((light.radiance(-Vec3d::UnitZ()) - Vec3d(0, 0, 1)).norm(), 1e-3);
    for (const Vec3d& dark : {Vec3d(1, 0, 0), Vec3d(-1, 0, 0), Vec3d(0, -1, 0), Vec3d(0, 0, 1)})
        EXPECT_LT(light.radiance(dark).norm(), 1e-3);
    // The mean over all directions is a sixth of each face's.
    EXPECT_NEAR(light.harmonics()[0].x(), 1.0 / 6, 0.01);
    EXPECT_NEAR(light.harmonics()[0].z(), 1.0 / 6, 0.01);

    TestScene scene;
    Image packed = imageOf(Image::kBc6h, 4, 4, blocks);
    packed.shape = Image::kCube;
    Environment environment;
    environment.image = scene.add(packed);
    const Aspect aspect = scene.take();
    EnvironmentTexture texture(gl_);
    ASSERT_TRUE(texture.begin(aspect, environment)) << texture.trouble();
    for (std::size_t i = 0; i < 9; ++i)
        for (std::size_t c = 0; c < 3; ++c)
            EXPECT_NEAR(texture.block()[i][c], light.harmonics()[i][static_cast<Eigen::Index>(c)], 1e-3);
}

/// The same sky as a cube and as a panorama.
TEST_F(TextureTest, CubesAndPanoramasOfOneSkyGiveOneLight) {
    const auto sky = [](const Vec3d& d) { return Vec3d(0.5 + 0.4 * d.x(), 0.5 + 0.4 * d.y(), 0.5 - 0.4 * d.z()); };
    SurroundingsPicture cube{.cube = true, .width = 64, .height = 64, .pixels = {}};
    // By hand: what OpenGL says of each face's s and t.
    for (int face = 0; face < 6; ++face)
        for (int y = 0; y < 64; ++y)
            for (int x = 0; x < 64; ++x) {
                const double s = (x + 0.5) / 32 - 1, t = (y + 0.5) / 32 - 1;
                const std::array<Vec3d, 6> directions = {Vec3d(1, -t, -s), Vec3d(-1, -t, s), Vec3d(s, 1, t),
                                                         Vec3d(s, -1, -t), Vec3d(s, -t, 1),  Vec3d(-s, -t, -1)};
                cube.pixels.push_back(sky(directions[static_cast<std::size_t>(face)].normalized()).cast<float>());
            }
    double worst = 0;
    for (int i = 0; i < 5000; ++i) {
        const Vec3d d = Vec3d(std::sin(1.7 * i), std::sin(2.3 * i + 1), std::sin(3.1 * i + 2)).normalized();
        worst = std::max(worst, (cube.at(d) - sky(d)).cwiseAbs().maxCoeff());
    }
    // Half a pixel's turn (1/64 at a face's middle) times the sky's slope, across seams too.
    EXPECT_LT(worst, 0.4 / 64);
}

}  // namespace
}  // namespace tessera

// Texture layers: each mode, strength and source beside its formula, in the base colour's order; what makes no layer.
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "tests/unit/draw/RendererStage.h"

namespace tessera {
namespace {

using Texel = std::array<std::uint8_t, 4>;

double decoded(int srgb) {
    const double s = srgb / 255.0;
    return s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4);
}

class LayerTest : public RendererTest {
protected:
    static constexpr int kImagePx = 32;
    /// One that says where it is looked up: red grows along u, green along v, six steps a pixel.
    static Image ramp() {
        std::vector<std::uint8_t> pixels;
        for (int y = 0; y < kImagePx; ++y)
            for (int x = 0; x < kImagePx; ++x)
                pixels.insert(pixels.end(),
                              {static_cast<std::uint8_t>(40 + 6 * x), static_cast<std::uint8_t>(40 + 6 * y), 128, 255});
        return {.pixels = Blob::of(std::span<const std::uint8_t>(pixels)),
                .widthPx = kImagePx,
                .heightPx = kImagePx,
                .magnification = Image::kNearest,
                .minification = Image::kNearestAlone};
    }
    static Image uniform(const Texel& texel) {
        return {.pixels = Blob::of(std::span<const std::uint8_t>(texel)), .widthPx = 1, .heightPx = 1};
    }
    struct Said {
        Image image;
        TextureLayer layer;
    };
    /// Its own colour, in the picture's middle.
    Picture shown(const std::vector<Said>& layers, Material material = bare(), const MeshData& mesh = makeSheet(4, 4),
                  const Quatd& turned = Quatd::Identity()) {
        TestScene scene;
        scene.setDark();
        for (Said said : layers) {
            said.layer.image = scene.add(said.image);
            material.layers.push_back(scene.addCore(said.layer));
        }
        scene.place(scene.add(mesh, scene.add(material)), {0, 0, -0.001}, turned);
        return draw(scene);
    }
    static Material bare() {
        Material material{.baseColor = {0.5f, 0.3f, 0.1f, 1}};
        material.unlit = true;
        return material;
    }
    /// Colours are kept as bytes of their roots, which are 255 · 2.2 / 2 steps apart at most: 2 of 255.
    static void expectShown(const Rgb& is, const Vec3d& linear, int allowed = 2) {
        const auto byte = [](double v) {
            return static_cast<int>(
                std::lround(255 * (v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055)));
        };
        EXPECT_LE(std::max({std::abs(is.r - byte(linear.x())), std::abs(is.g - byte(linear.y())),
                            std::abs(is.b - byte(linear.z()))}),
                  allowed)
            << is << " and not " << byte(linear.x()) << ' ' << byte(linear.y()) << ' ' << byte(linear.z());
    }
    /// Where a pixel of `ramp` lies: within its texel, and what rounding makes of its edge.
    static void expectAt(const Rgb& is, double u, double v) {
        EXPECT_NEAR(is.r, 40 + 6 * (kImagePx * (u - std::floor(u)) - 0.5), 3 + 2) << "u " << u;
        EXPECT_NEAR(is.g, 40 + 6 * (kImagePx * (v - std::floor(v)) - 0.5), 3 + 2) << "v " << v;
    }
    /// In world coordinates, where the picture's plane shows pixel (x, y).
    static Vec3d placeOf(int x, int y) {
        return {3.2 * ((x + 0.5) / kSidePx - 0.5), -3.2 * ((y + 0.5) / kSidePx - 0.5), 0};
    }
};

TEST_F(LayerTest, ModesAndStrengthAreAsTheirHeaderSays) {
    const Texel texel{200, 120, 60, 128};
    const Vec3d t(decoded(200), decoded(120), decoded(60)), base(0.5, 0.3, 0.1);
    for (const int samples : {1, 4}) {
        restart({.samples = samples});
        for (const float strength : {0.0f, 0.4f, 1.0f}) {
            const auto mixed = [&](const Vec3d& made) {
                return Vec3d(base + static_cast<double>(strength) * (made - base));
            };
            const auto is = [&](std::int64_t mode) {
                return center(shown({{uniform(texel), {.mode = mode, .strength = strength}}}));
            };
            expectShown(is(TextureLayer::kModulate), mixed(base.cwiseProduct(t)));
            expectShown(is(TextureLayer::kAdd), mixed(base + t).cwiseMin(1.0));
            expectShown(is(TextureLayer::kDecal), mixed(base + (128 / 255.0) * (t - base)));
            expectShown(is(TextureLayer::kReplace), mixed(t));
        }
    }
}

TEST_F(LayerTest, LieOverEachOtherInTheirOrderAndOverTheImageAndTheVerticesColours) {
    const Said replace{uniform({100, 150, 200, 255}), {.mode = TextureLayer::kReplace, .strength = 0.5f}},
        modulate{uniform({128, 255, 128, 255}), {}}, add{uniform({30, 30, 30, 255}), {.mode = TextureLayer::kAdd}},
        decal{uniform({255, 0, 0, 64}), {.mode = TextureLayer::kDecal}};
    const auto linear = [](const Said& said) {
        const auto bytes = said.image.pixels.as<std::uint8_t>();
        return Vec3d(decoded(bytes[0]), decoded(bytes[1]), decoded(bytes[2]));
    };
    std::vector<const Said*> order{&replace, &modulate, &add, &decal};
    std::sort(order.begin(), order.end());
    int orders = 0;
    do {
        Vec3d c(0.5, 0.3, 0.1);
        std::vector<Said> layers;
        for (const Said* said : order) {
            layers.push_back(*said);
            const Vec3d t = linear(*said);
            c = said == &replace    ? Vec3d(0.5 * c + 0.5 * t)
                : said == &modulate ? Vec3d(c.cwiseProduct(t))
                : said == &add      ? Vec3d(c + t)
                                    : Vec3d(c + (64 / 255.0) * (t - c));
        }
        expectShown(center(shown(layers)), c);
    } while (++orders < 24 && std::next_permutation(order.begin(), order.end()));
    MeshData painted = makeSheet(4, 4);
    for (int i = 0; i < 4; ++i) painted.colors.insert(painted.colors.end(), {255, 128, 255, 255});
    const Picture coloured = shown({add}, bare(), painted);
    const Picture without = shown({}, bare(), painted);
    EXPECT_GT(center(without).r, 100);
    EXPECT_GT(center(coloured).g, center(without).g) << "over the vertices' colours";
}

TEST_F(LayerTest, TexcoordsAndPlacesInTheNodeLieAsTheImageSays) {
    Image image = ramp();
    image.scale = {0.5f, 0.25f};
    image.offset = {0.1f, 0.3f};
    image.rotation = 0.4f;
    const auto laid = [&](double u, double v) {
        const Vec2d at = Eigen::Rotation2Dd(-0.4) * Vec2d(0.5 * u, 0.25 * v);
        return Vec2d(at.x() + 0.1, at.y() + 0.3);
    };
    const Picture byTexcoords = shown({{image, {.mode = TextureLayer::kReplace}}});
    const Quatd turned(Eigen::AngleAxisd(0.3, Vec3d::UnitZ()));
    const Picture byPosition = shown({{image, {.mode = TextureLayer::kReplace, .source = TextureLayer::kPosition}}},
                                     bare(), makeSheet(6, 6), turned);
    for (int y = 3; y < kSidePx; y += 7)
        for (int x = 2; x < kSidePx; x += 5) {
            const Vec3d at = placeOf(x, y);
            const Vec2d uv = laid(at.x() / 4 + 0.5, 0.5 - at.y() / 4);
            expectAt(pixel(byTexcoords, x, y), uv.x(), uv.y());
            // In the node's own coordinates, its picture upright.
            const Vec3d inNode = turned.inverse() * at;
            const Vec2d placed = laid(inNode.x(), -inNode.y());
            expectAt(pixel(byPosition, x, y), placed.x(), placed.y());
        }
}

TEST_F(LayerTest, SphereMapsAndReflectionsFollowTheNormalAndTheEye) {
    for (const double angle : {-0.9, -0.3, 0.0, 0.5, 1.0}) {
        const Quatd turned(Eigen::AngleAxisd(angle, Vec3d(1, 2, 0.5).normalized()));
        MeshData sheet = makeSheet(1, 1);
        const Picture sphere =
            shown({{ramp(), {.mode = TextureLayer::kReplace, .source = TextureLayer::kSphere}}}, bare(), sheet, turned);
        const Picture around = shown({{ramp(), {.mode = TextureLayer::kReplace, .source = TextureLayer::kReflection}}},
                                     bare(), sheet, turned);
        const Vec3d n = turned * Vec3d::UnitZ(),
                    v = (Vec3d(0, 0, 2.4) - placeOf(kSidePx / 2, kSidePx / 2)).normalized();
        const Vec3d right = Vec3d::UnitY().cross(v).normalized(), up = v.cross(right);
        expectAt(center(sphere), 0.5 + 0.5 * n.dot(right), 0.5 - 0.5 * n.dot(up));
        const Vec3d r = 2 * n.dot(v) * n - v;
        expectAt(center(around), 0.5 + std::atan2(r.x(), -r.z()) / (2 * std::numbers::pi),
                 std::acos(r.y()) / std::numbers::pi);
    }
}

// The sides of a picture of all around meet without a line, mipmaps and all.
TEST_F(LayerTest, APictureOfAllAroundHasNoSeam) {
    // Grey, with a single dark column opposite of its sides: a line of a coarse mipmap would be darker than its
    // neighbours.
    std::vector<std::uint8_t> pixels;
    for (int y = 0; y < 32; ++y)
        for (int x = 0; x < 64; ++x) {
            const auto grey = static_cast<std::uint8_t>(x > 24 && x < 40 ? 0 : 200);
            pixels.insert(pixels.end(), {grey, grey, grey, 255});
        }
    const Image image{.pixels = Blob::of(std::span<const std::uint8_t>(pixels)), .widthPx = 64, .heightPx = 32};
    // A ball mirrors +Z, the sides of the picture, in its middle.
    const Picture picture = shown({{image, {.mode = TextureLayer::kReplace, .source = TextureLayer::kReflection}}},
                                  bare(), makeSphere(1, 64));
    for (int y = 24; y < 40; ++y)
        for (int x = 26; x < 38; ++x) EXPECT_NEAR(pixel(picture, x, y).g, 200, 2) << x << ' ' << y;
}

TEST_F(LayerTest, CoverWhatTheBaseColourCoversAlone) {
    Material glass = bare();
    glass.baseColor.w() = 0.5f;
    Material cut = bare();
    cut.alphaMode = Material::kMask;
    const Said clear{uniform({255, 0, 0, 0}), {.mode = TextureLayer::kDecal}},
        solid{uniform({0, 255, 0, 255}), {.mode = TextureLayer::kReplace}};
    expectNear(center(shown({clear}, glass)), center(shown({}, glass)));
    expectNear(center(shown({clear}, cut)), center(shown({}, cut)));
    Material green = glass;
    green.baseColor.head<3>() = Vec3f(0, 1, 0);
    expectNear(center(shown({solid}, glass)), center(shown({}, green)));
}

TEST_F(LayerTest, WhatSaysNothingIsNothing) {
    const Rgb plain = center(shown({}));
    // No image, and one that has no place by that source.
    TestScene scene;
    scene.setDark();
    Material material = bare();
    material.layers = {scene.addCore(TextureLayer{.mode = TextureLayer::kReplace})};
    scene.place(scene.add(makeSheet(4, 4), scene.add(material)), {0, 0, -0.001});
    expectNear(center(draw(scene)), plain);
    EXPECT_EQ(renderer_->lastCounts().untextured, 0u);
    Image cube = uniform({255, 255, 255, 255});
    cube.shape = Image::kCube;
    expectNear(center(shown({{cube, {.mode = TextureLayer::kReplace}}})), plain);
    EXPECT_EQ(renderer_->lastCounts().untextured, 1u);
    // The fifth is beyond what a material has.
    std::vector<Said> many(4, {uniform({128, 255, 255, 255}), {}});
    const Rgb four = center(shown(many));
    many.push_back({uniform({0, 0, 0, 255}), {}});
    expectNear(center(shown(many)), four);
}

// Lit, below glass, with a normal map; the programs for other lights made in between.
TEST_F(LayerTest, TilesArePartsOfThePicture) {
    restart({.samples = 4});
    TestScene scene;
    Material material;
    material.normalImage = scene.add(uniform({150, 110, 240, 255}));
    material.roughness = 0.3f;
    for (const std::int64_t source :
         {TextureLayer::kTexcoords, TextureLayer::kSphere, TextureLayer::kReflection, TextureLayer::kPosition})
        material.layers.push_back(scene.addCore(
            TextureLayer{.image = scene.add(ramp()), .mode = source, .strength = 0.6f, .source = source}));
    Material glass = material;
    glass.baseColor.w() = 0.6f;
    scene.place(scene.add(makeSphere(0.9, 30), scene.add(material)), {-0.4, 0, -1});
    scene.place(scene.add(makeSphere(0.4, 30), scene.add(glass)), {0.5, 0.1, -0.3});
    const Aspect aspect = scene.take();
    const ScreenCamera camera = cameraOf(320, 200);
    const Picture picture = draw(aspect, camera);
    while (renderer_->prepare()) continue;
    const PixelRect rect{.x = 77, .y = 41, .width = 150, .height = 101};
    auto tile = renderer_->draw(aspect, listOf(aspect, camera), camera, rect);
    ASSERT_TRUE(tile);
    int differing = 0;
    for (int y = 0; y < rect.height; ++y)
        for (int x = 0; x < rect.width; ++x) {
            const Rgb a = pixel(*tile, x, y), b = pixel(picture, x + rect.x, y + 200 - rect.y - rect.height);
            differing += a.r != b.r || a.g != b.g || a.b != b.b;
        }
    EXPECT_EQ(differing, 0);
}

}  // namespace
}  // namespace tessera

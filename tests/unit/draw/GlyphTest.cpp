/// Glyphs beside one Geometry of the same triangles: lit, in shadow, transparent, by culled runs, on tiles.
#include <gtest/gtest.h>

#include <random>

#include "common/drawable/Drawable.h"
#include "common/drawable/GlyphArrays.h"
#include "common/geometry/MeshCopies.h"
#include "tests/unit/draw/MaterialStage.h"

namespace tessera {
namespace {

constexpr int kGlyphWidthPx = 320, kGlyphHeightPx = 240;

Glyphs someArrows(std::size_t count, std::int64_t shape) {
    std::mt19937 random(7);
    std::uniform_real_distribution<float> anywhere(-1, 1);
    std::vector<float> places, vectors, scalars;
    for (std::size_t i = 0; i < count; ++i) {
        places.insert(places.end(), {1.4F * anywhere(random), anywhere(random), anywhere(random)});
        for (int axis = 0; axis < 3; ++axis) vectors.push_back(anywhere(random));
        scalars.push_back(anywhere(random));
    }
    Glyphs g;
    g.positions = Blob::of(std::span<const float>(places));
    g.vectors = Blob::of(std::span<const float>(vectors));
    g.scalars = Blob::of(std::span<const float>(scalars));
    const std::array<std::uint8_t, 8> stops{20, 60, 255, 255, 255, 120, 10, 255};
    g.transfer = Blob::of(std::span<const std::uint8_t>(stops));
    g.low = -1;
    g.shape = shape;
    g.size = 0.2;
    g.widthBy = Glyphs::kNothing;
    return g;
}

/// All their triangles in single precision, as a shader finds them.
MeshData trianglesOf(const Glyphs& g) {
    const MeshArrays arrays = drawableOf(Object::of(g)).at(kGlyphsOnScreens).arrays();
    MeshData mesh;
    const std::span<const float> corners = arrays.positions.as<float>(), normals = arrays.normals.as<float>();
    const std::size_t count = corners.size() / 3;
    const auto add = [](std::vector<float>& to, const Vec3f& v) { to.insert(to.end(), v.begin(), v.end()); };
    for (std::size_t k = 0; k < copyCount(arrays); ++k) {
        const MeshCopy& copy = arrays.copies.as<MeshCopy>()[k];
        const Vec3f axis(copy.turn[0], copy.turn[1], copy.turn[2]);
        const auto turned = [&](const Vec3f& v) -> Vec3f {
            return v + 2 * axis.cross(axis.cross(v) + copy.turn[3] * v);
        };
        const float width = copy.width, length = copy.length;
        for (std::size_t c = 0; c < count; ++c) {
            const Vec3f corner(corners[3 * c], corners[3 * c + 1], corners[3 * c + 2]);
            const Vec3f normal(normals[3 * c], normals[3 * c + 1], normals[3 * c + 2]);
            add(mesh.positions, Vec3f(copy.place[0], copy.place[1], copy.place[2]) +
                                    turned(Vec3f(width, length, width).cwiseProduct(corner)));
            add(mesh.normals, turned(Vec3f(length, width, length).cwiseProduct(normal)));
            for (std::size_t i = 0; i < 4; ++i) mesh.colors.push_back(arrays.colors.as<std::uint8_t>()[4 * k + i]);
        }
        const std::span<const float> texcoords = arrays.texcoords.as<float>();
        mesh.texcoords.insert(mesh.texcoords.end(), texcoords.begin(), texcoords.end());
        for (const std::uint32_t index : arrays.indices.as<std::uint32_t>())
            mesh.indices.push_back(static_cast<std::uint32_t>(count * k) + index);
    }
    return mesh;
}

class GlyphTest : public RendererTest {
protected:
    /// Over a floor, below a sun that casts shadows; one of them.
    static Aspect sceneOf(const Glyphs& glyphs, bool asMesh, const Material& material) {
        TestScene scene;
        scene.setEnvironment(Vec3f(0.3F, 0.35F, 0.4F), Vec3f(0.1F, 0.1F, 0.1F), Vec3f(0.02F, 0.02F, 0.05F));
        scene.addDirectionalLight(Vec3d(-0.4, -1, -0.3), Vec3f::Ones(), 2, true);
        Material worn = material;
        if (worn.alphaMode == Material::kMask && worn.alphaCutoff < 1) worn.baseColorImage = scene.add(holes());
        const ObjectId look = scene.add(worn);
        const ObjectId plain = scene.add(Material());
        scene.place(scene.add(makeBox({4, 0.1, 4}), plain), {0, -1.4, 0});
        // The scene is of one size, and so are the pixels of the sun's maps, whatever is known of the glyphs' boxes.
        for (const double end : {-4, 4}) scene.place(scene.add(makeBox(Vec3d::Constant(0.1)), plain), {end, end, end});
        Glyphs own = glyphs;
        own.material = look;
        const ObjectId core = asMesh ? scene.add(trianglesOf(glyphs), look) : scene.addCore(own);
        scene.place(core, {0.1, 0.05, -0.5}, Quatd(Eigen::AngleAxisd(0.3, Vec3d(1, 2, 3).normalized())), {1, 1.2, 0.9});
        return scene.take();
    }
    /// Squares of three colours, and of nothing.
    static Image holes() {
        return imageOf(64, [](int x, int y) {
            static constexpr std::array<std::array<std::uint8_t, 4>, 4> kSquares{
                {{255, 40, 30, 255}, {30, 200, 60, 255}, {255, 255, 255, 0}, {40, 60, 255, 255}}};
            return kSquares[static_cast<std::size_t>(x / 16 % 2 + 2 * (y / 16 % 2))];
        });
    }
    static Material painted() {
        Material material;
        material.baseColor = Vec4f(0.9F, 0.9F, 0.9F, 1);
        material.roughness = 0.4F;
        return material;
    }
    /// Culled by its clusters, as a wall does.
    Picture drawPart(const Aspect& aspect, const PixelRect& part) {
        RenderScene scene;
        scene.update(aspect, nullptr);
        const ScreenCamera camera = cameraOf(kGlyphWidthPx, kGlyphHeightPx);
        RenderAction action(CullerKind::kMasked);
        auto picture = renderer_->draw(aspect, action.run(scene, camera, part, nullptr), camera, part);
        EXPECT_TRUE(picture) << picture.error().message;
        return picture ? *picture : Picture::filled(part.width, part.height, 0, 0, 0);
    }
    Picture drawWhole(const Aspect& aspect) {
        return drawPart(aspect, {.x = 0, .y = 0, .width = kGlyphWidthPx, .height = kGlyphHeightPx});
    }
    /// How many pixels differ by more than so many of 255.
    static std::size_t differing(const Picture& a, const Picture& b, int most) {
        std::size_t pixels = 0;
        for (std::size_t i = 0; i < a.rgb.size(); i += 3)
            for (std::size_t c = 0; c < 3; ++c)
                if (std::abs(a.rgb[i + c] - b.rgb[i + c]) > most) {
                    ++pixels;
                    break;
                }
        return pixels;
    }
};

TEST_F(GlyphTest, LookAsOneGeometryOfTheirTriangles) {
    restart({.samples = 4});
    for (const std::int64_t shape : {Glyphs::kArrow, Glyphs::kBox, Glyphs::kBall}) {
        SCOPED_TRACE(shape);
        const Glyphs glyphs = someArrows(3000, shape);
        const Picture ours = drawWhole(sceneOf(glyphs, false, painted())),
                      theirs = drawWhole(sceneOf(glyphs, true, painted()));
        Material none = painted();
        none.alphaMode = Material::kMask;
        none.alphaCutoff = 2;
        const Picture without = drawWhole(sceneOf(glyphs, true, none));
        EXPECT_GT(differing(theirs, without, 30), 20000u) << "there is little to be seen";
        // Corners are rounded otherwise: some samples at edges, no more.
        EXPECT_LT(differing(ours, theirs, 3), 80u);
    }
}

/// Holes of the image are holes of their shadows, too.
TEST_F(GlyphTest, WearImagesAsAGeometryDoes) {
    restart({.samples = 4});
    const MeshData box = makeBox(Vec3d(1, 1.5, 0.5));
    Glyphs glyphs = someArrows(600, Glyphs::kMesh);
    glyphs.shapePositions = Blob::of(std::span<const float>(box.positions));
    glyphs.shapeNormals = Blob::of(std::span<const float>(box.normals));
    glyphs.shapeIndices = Blob::of(std::span<const std::uint32_t>(box.indices));
    glyphs.transfer = {};
    glyphs.colors = Blob::of(std::span<const std::uint8_t>(std::vector<std::uint8_t>(std::size_t{4} * 600, 255)));
    glyphs.shapeTexcoords = Blob::of(std::span<const float>(box.texcoords));
    Material leaves = painted();
    leaves.alphaMode = Material::kMask;
    leaves.doubleSided = true;
    const Picture ours = drawWhole(sceneOf(glyphs, false, leaves)), theirs = drawWhole(sceneOf(glyphs, true, leaves));
    EXPECT_LT(differing(ours, theirs, 8), 200u);
    glyphs.shapeTexcoords = {};
    const Picture plain = drawWhole(sceneOf(glyphs, false, leaves));
    EXPECT_GT(differing(ours, plain, 30), 20000u) << "of one colour";
}

TEST_F(GlyphTest, OnTilesTheyArePartsOfThePicture) {
    restart({.samples = 4});
    const Aspect aspect = sceneOf(someArrows(3000, Glyphs::kArrow), false, painted());
    const Picture whole = drawWhole(aspect);
    const int width = kGlyphWidthPx / 4, height = kGlyphHeightPx / 3;
    for (int y = 0; y < 3; ++y)
        for (int x = 0; x < 4; ++x) {
            const Picture tile = drawPart(aspect, {.x = x * width, .y = y * height, .width = width, .height = height});
            for (int row = 0; row < height; ++row) {
                const std::size_t from = 3 * static_cast<std::size_t>(row * width),
                                  in = 3 * static_cast<std::size_t>(
                                               (kGlyphHeightPx - (y + 1) * height + row) * kGlyphWidthPx + x * width);
                ASSERT_TRUE(std::equal(tile.rgb.begin() + static_cast<std::ptrdiff_t>(from),
                                       tile.rgb.begin() + static_cast<std::ptrdiff_t>(from) + 3 * width,
                                       whole.rgb.begin() + static_cast<std::ptrdiff_t>(in)))
                    << x << ' ' << y << ' ' << row;
            }
        }
}

TEST_F(GlyphTest, TakeLittleMemoryAndFewCalls) {
    const Glyphs glyphs = someArrows(20000, Glyphs::kArrow);
    static_cast<void>(drawWhole(sceneOf(glyphs, false, painted())));
    const std::size_t ours = renderer_->residentBytes();
    restart({.samples = 1});
    static_cast<void>(drawWhole(sceneOf(glyphs, true, painted())));
    EXPECT_LT(30 * ours, renderer_->residentBytes());
}

// One of one's own, without normals: faceted; transparent; edited.
TEST_F(GlyphTest, AMeshOfOnesOwnIsFacetedAndFollowsEdits) {
    const std::array<float, 12> corners{0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
    const std::array<std::uint32_t, 12> indices{0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
    Glyphs glyphs = someArrows(40, Glyphs::kMesh);
    glyphs.shapePositions = Blob::of(std::span<const float>(corners));
    glyphs.shapeIndices = Blob::of(std::span<const std::uint32_t>(indices));
    Material glass = painted();
    glass.baseColor.w() = 0.5F;
    const Picture solid = drawWhole(sceneOf(glyphs, false, painted())), thin = drawWhole(sceneOf(glyphs, false, glass));
    EXPECT_GT(differing(solid, thin, 10), 300u);
    glyphs.size = 0;
    const Picture gone = drawWhole(sceneOf(glyphs, false, painted()));
    EXPECT_GT(differing(solid, gone, 10), 300u);
    glyphs.positions = {};
    glyphs.vectors = {};
    glyphs.scalars = {};
    EXPECT_EQ(drawWhole(sceneOf(glyphs, false, painted())).rgb, gone.rgb);
}

}  // namespace
}  // namespace tessera

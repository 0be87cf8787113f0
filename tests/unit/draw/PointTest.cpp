// What points take: bytes, calls, uploads. What they look like is BallTest.cpp's.
#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "client/draw/store/MeshBuffers.h"
#include "tests/unit/draw/RendererStage.h"

namespace tessera {
namespace {

constexpr std::size_t kBytesPerTexel = 16;

class PointTest : public RendererTest {
protected:
    double between(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
    std::size_t below(std::size_t count) { return static_cast<std::size_t>(random_() % count); }
    MeshData cloud(std::size_t count, double radius) {
        MeshData points{.primitive = Primitive::kPoints, .pointRadius = radius};
        for (std::size_t i = 0; i < 3 * count; ++i) points.positions.push_back(static_cast<float>(between(-1, 1)));
        for (std::size_t i = 0; i < 4 * count; ++i)
            points.colors.push_back(i % 4 == 3 ? 255 : static_cast<std::uint8_t>(random_()));
        return points;
    }
    /// Those [begin, end).
    static MeshData partOf(const MeshData& all, std::size_t begin, std::size_t end) {
        const auto cut = [&](const auto& from, std::size_t width) {
            return std::decay_t<decltype(from)>(from.begin() + static_cast<std::ptrdiff_t>(width * begin),
                                                from.begin() + static_cast<std::ptrdiff_t>(width * end));
        };
        return {.positions = cut(all.positions, 3),
                .colors = cut(all.colors, 4),
                .primitive = Primitive::kPoints,
                .pointRadius = all.pointRadius};
    }

    std::mt19937 random_;
};

// More than share their indices, and more than 65,536: several calls of GL an instance, and instances one after the
// other.
TEST_F(PointTest, HundredThousandsOfThemLookAsAFewAtATime) {
    restart({.samples = 4});
    for (const std::size_t count : {std::size_t{kPointsAtOnce}, std::size_t{kPointsAtOnce} + 1, std::size_t{150'000}}) {
        random_.seed(static_cast<unsigned>(count));
        const MeshData points = cloud(count, 0.004);
        const ScreenCamera camera = cameraOf(300, 200);
        for (const bool bothSides : {false, true}) {
            const auto drawnBy = [&](std::size_t atOnce) {
                TestScene scene;
                const ObjectId paint = scene.add(Material{.doubleSided = bothSides});
                for (std::size_t first = 0; first < count; first += atOnce) {
                    const ObjectId core = scene.add(partOf(points, first, std::min(count, first + atOnce)), paint);
                    for (const double x : {-0.5, 0.6}) scene.place(core, {x, 0, -1});
                }
                return draw(scene.take(), camera);
            };
            const Picture all = drawnBy(count);
            const std::uint64_t calls = renderer_->lastCounts().glCalls;
            EXPECT_EQ(calls, 2 * ((count - 1) / kPointsAtOnce + 1));
            EXPECT_EQ(renderer_->lastCounts().triangles, 2 * count);
            ASSERT_TRUE(all == drawnBy(5000)) << count << " points";
        }
    }
}

// What is added to the largest floats stays one, and still something is seen.
TEST_F(PointTest, AtTheEndOfWhatAFloatHoldsLookAsThoseOfAMetre) {
    const float most = std::numeric_limits<float>::max();
    const auto drawn = [&](float unit) {
        const MeshData points{.positions = {unit, -unit, 0, -unit, unit, unit / 2, 0, 0, unit, unit / 3, unit, -unit},
                              .primitive = Primitive::kPoints};
        TestScene scene;
        scene.setDark();
        scene.place(scene.add(points, scene.add(unlit({0.5f, 0, 0}))), {0, 0, -2}, Quatd::Identity(),
                    Vec3d::Constant(1 / double{unit}));
        return draw(scene.take(), cameraOf(640, 400, {0, 0, 0.5}, 0.3));
    };
    const Picture far = drawn(most), near = drawn(1);
    std::size_t shown = 0, others = 0;
    for (std::size_t i = 0; i < near.rgb.size(); i += 3) {
        shown += near.rgb[i] > 0;
        others += near.rgb[i] != far.rgb[i];
    }
    EXPECT_GE(shown, 3u);
    EXPECT_LE(others, 1u) << "but for rounding";
}

TEST_F(PointTest, TakeATexelForEachOfWhatTheyHave) {
    constexpr std::size_t kCount = 5000;
    random_.seed(4);
    for (const bool colors : {false, true})
        for (const bool normals : {false, true})
            for (const bool texcoords : {false, true}) {
                restart({.samples = 1});
                MeshData points{.positions = std::vector<float>(3 * kCount, 0.25f),
                                .primitive = Primitive::kPoints,
                                .pointRadius = 0.1};
                if (colors) points.colors.assign(4 * kCount, 200);
                if (normals) points.normals.assign(3 * kCount, 1);
                if (texcoords) points.texcoords.assign(2 * kCount, 0.5f);
                TestScene scene;
                scene.place(scene.add(points), {0, 0, -2});
                (void)draw(scene);
                const std::size_t texels = 1 + normals + texcoords;
                EXPECT_EQ(renderer_->uploadedMeshBytes(), kCount * texels * kBytesPerTexel);
                // What is fetched by its number lies at a multiple of its size.
                EXPECT_LE(renderer_->residentBytes(), (kCount * texels + texels - 1) * kBytesPerTexel);
                EXPECT_EQ(renderer_->lastCounts().glCalls, 1u);
            }
}

/// Those of one cloud, in one scene.
TEST_F(PointTest, OfAnotherRadiusShareTheMemory) {
    random_.seed(9);
    MeshData points{.primitive = Primitive::kPoints, .pointRadius = 0.03};
    for (int i = 0; i < 900; ++i) points.positions.push_back(static_cast<float>(between(-1, 1)));
    const MeshArrays arrays = points.toArrays();
    TestScene built;
    for (const double radius : {0.0, 0.01, 0.05}) {
        MeshArrays of = arrays;
        of.pointRadius = radius;
        built.place(built.add(of), {radius * 20 - 0.5, 0, -3});
    }
    const ObjectId wide{built.add(arrays)};
    built.place(wide, {0, 0.5, -3});
    Aspect aspect = built.take();
    const ScreenCamera camera = cameraOf(120, 90);
    RenderScene scene;
    scene.update(aspect, nullptr);
    RenderAction action(CullerKind::kFrustum);
    const auto drawNow = [&](Renderer& renderer) {
        return renderer.draw(aspect, action.run(scene, camera, whole(camera), nullptr), camera, whole(camera)).value();
    };
    const Picture before = drawNow(*renderer_);
    const std::uint64_t bytes = renderer_->uploadedMeshBytes();
    EXPECT_EQ(bytes, sizeOf(arrays).bytes());
    Picture last = before;
    for (const double radius : {0.2, 0.05, 0.0, 0.07}) {
        ChangeListBuilder edits;
        edits.set(wide, typeOf<Geometry>(), fieldId<&Geometry::pointRadius>, toValue(radius));
        const ChangeList list = edits.take();
        ASSERT_TRUE(aspect.apply(list));
        scene.update(aspect, &list);
        const Picture now = drawNow(*renderer_);
        EXPECT_NE(now, last) << "it is seen";
        EXPECT_EQ(renderer_->uploadedMeshBytes(), bytes) << radius;
        auto surface = test::pooledSurface();
        EXPECT_EQ(now, drawNow(*Renderer::create(*surface, {.samples = 1}).value()));
        last = now;
    }
}

// Ranges of each of their arrays, as a renderer shows them that has seen the points before and one that has not.
TEST_F(PointTest, OfWhichRangesChangeUploadThoseAndLookAsNew) {
    random_.seed(12);
    constexpr std::size_t kCount = 400, kTexels = 3;
    MeshData points{.primitive = Primitive::kPoints, .pointRadius = 0.06};
    const auto fill = [&](std::vector<float>& to, std::size_t width) {
        for (std::size_t i = 0; i < width * kCount; ++i) to.push_back(static_cast<float>(between(-1, 1)));
    };
    fill(points.positions, 3);
    fill(points.normals, 3);
    fill(points.texcoords, 2);
    fill(points.texcoords1, 2);
    for (std::size_t i = 0; i < 4 * kCount; ++i) points.colors.push_back(static_cast<std::uint8_t>(random_() | 3));
    TestScene built;
    std::vector<std::uint8_t> pixels;
    for (int i = 0; i < 64; ++i)
        pixels.insert(pixels.end(),
                      {static_cast<std::uint8_t>(4 * i), static_cast<std::uint8_t>(255 - 3 * i), 90, 255});
    Image image{.pixels = Blob::of(std::span<const std::uint8_t>(pixels)), .widthPx = 8, .heightPx = 8};
    Material painted;
    painted.baseColorImage = built.add(image);
    image.texcoordSet = 1;
    painted.emissiveImage = built.add(image);
    painted.emissive = Vec3f::Constant(0.3f);
    const ObjectId core = built.add(points, built.add(painted));
    built.place(core, {0, 0, -2.5});
    Aspect aspect = built.take();
    const ScreenCamera camera = cameraOf(120, 90);
    RenderScene scene;
    scene.update(aspect, nullptr);
    const auto drawNow = [&](Renderer& renderer) {
        return renderer
            .draw(aspect, RenderAction(CullerKind::kFrustum).run(scene, camera, whole(camera), nullptr), camera,
                  whole(camera))
            .value();
    };
    Picture last = drawNow(*renderer_);
    const std::pair<FieldId, std::size_t> fields[] = {{fieldId<&Geometry::positions>, 3},
                                                      {fieldId<&Geometry::normals>, 3},
                                                      {fieldId<&Geometry::texcoords>, 2},
                                                      {fieldId<&Geometry::texcoords1>, 2}};
    int seen = 0;
    for (std::size_t turn = 0; turn < 20; ++turn) {
        const std::size_t count = 30 + below(100);
        std::size_t first = 0, numbers = 4;  // in the array that is edited; colours are bytes
        ChangeListBuilder edits;
        if (turn % 5 == 4) {
            std::vector<std::uint8_t> bytes(count);
            for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random_());
            first = below(4 * kCount - count);
            edits.setRange(core, typeOf<Geometry>(), fieldId<&Geometry::colors>, first,
                           Blob::of(std::span<const std::uint8_t>(bytes)));
        } else {
            const auto& [field, width] = fields[turn % 5];
            std::vector<float> values(count);
            for (float& value : values) value = static_cast<float>(between(-1, 1));
            numbers = width;
            first = below(width * kCount - count);
            edits.setRange(core, typeOf<Geometry>(), field, first * sizeof(float),
                           Blob::of(std::span<const float>(values)));
        }
        const ChangeList list = edits.take();
        ASSERT_TRUE(aspect.apply(list));
        scene.update(aspect, &list);
        const std::uint64_t before = renderer_->uploadedMeshBytes();
        const Picture now = drawNow(*renderer_);
        const std::size_t touched = (first + count - 1) / numbers - first / numbers + 1;
        EXPECT_EQ(renderer_->uploadedMeshBytes() - before, touched * kTexels * kBytesPerTexel) << turn;
        auto surface = test::pooledSurface();
        ASSERT_EQ(now, drawNow(*Renderer::create(*surface, {.samples = 1}).value())) << turn;
        seen += now != last;
        last = now;
    }
    EXPECT_GT(seen, 15);
}

TEST_F(PointTest, ThatAreSaidToBeSomethingElseAreLeftOutAndCounted) {
    TestScene scene;
    scene.setDark();
    scene.place(scene.add(MeshData{.positions = {0, 0, 0}, .primitive = Primitive::kPoints, .pointRadius = 1},
                          scene.add(unlit({0.5f, 0, 0}))),
                {0, 0, -2});
    const Aspect aspect = scene.take();
    const ScreenCamera camera = cameraOf(kSidePx, kSidePx);
    DrawList list = listOf(aspect, camera);
    for (const DrawKindRow& row : kDrawKinds) {
        list.opaque.at(0).kind = row.kind;
        const auto picture = renderer_->draw(aspect, list, camera, whole(camera));
        ASSERT_TRUE(picture) << picture.error().message;
        EXPECT_EQ(renderer_->lastCounts().skipped, row.kind == MeshKind::kPoints ? 0u : 1u);
        EXPECT_EQ(center(*picture).r > 0, row.kind == MeshKind::kPoints);
    }
}

// GL fetches from a texture of so many texels and no more: what has no room is left out and said, and the rest is
// drawn.
TEST_F(PointTest, BeyondWhatGlCanFetchAreLeftOut) {
    ASSERT_TRUE(surface_->makeCurrent());
    GlState gl(GlFunctions::load(*surface_).value());
    gl.GetIntegerv = [](GLenum, GLint* value) { *value = 10'000; };
    GLuint array = 0;
    gl.CreateVertexArrays(1, &array);
    TestScene built;
    const auto points = [&](std::size_t count, float at) {
        return built.add(MeshData{
            .positions = std::vector<float>(3 * count, at), .primitive = Primitive::kPoints, .pointRadius = 1});
    };
    const ObjectId most = points(10'001, 1), some = points(6000, 2), others = points(4001, 3), few = points(4000, 4),
                   box = built.add(makeBox({1, 1, 1}));
    const Aspect aspect = built.take();
    {
        UseClock clock;
        MeshBuffers meshes(gl, clock, array);
        clock.beginDraw();
        meshes.beginDraw();
        const auto found = [&](ObjectId id) { return meshes.find(*drawMeshOf(drawableOf(aspect, id))) != nullptr; };
        EXPECT_FALSE(found(most));
        EXPECT_TRUE(found(some));
        EXPECT_FALSE(found(others));
        EXPECT_TRUE(found(box));
        EXPECT_TRUE(found(few));
        EXPECT_EQ(meshes.prepare(*drawMeshOf(drawableOf(aspect, others)), nullptr, 1000), 0u);
        meshes.expect(sizeOf(drawableOf(aspect, most).arrays()));
        EXPECT_TRUE(gl.check("that"));
    }
    gl.DeleteVertexArrays(1, &array);
}

}  // namespace
}  // namespace tessera

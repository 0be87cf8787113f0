/// Where arrays were edited in ranges, the ranges go to GL, and the picture is that of who has never seen anything
/// else.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <random>

#include "client/draw/passes/Renderer.h"
#include "client/draw/store/MeshBuffers.h"
#include "client/render/order/RenderAction.h"
#include "tests/golden/TestScene.h"
#include "tests/support/surface/PooledSurface.h"

namespace tessera {
namespace {

using test::cameraOf;
using test::TestScene;

// Two geometries begin with the same arrays; ranges of one or the other change, and each picture is that of a renderer
// which has never seen anything else.
TEST(RangeUpload, AnEditOfARangeUploadsTheRange) {
    const auto surface = test::pooledSurface();
    auto renderer = Renderer::create(*surface, {.samples = 1});
    ASSERT_TRUE(renderer) << renderer.error().message;
    TestScene built;
    MeshData mesh = makeSphere(0.7, 48);
    mesh.colors.assign(mesh.positions.size() / 3 * 4, 200);
    const MeshArrays arrays = mesh.toArrays();
    const std::array<ObjectId, 2> balls = {built.add(arrays), built.add(arrays)};
    built.place(balls[0], {-0.8, 0, -3});
    built.place(balls[1], {0.8, 0, -3});
    Aspect aspect = built.take();
    const ScreenCamera camera = cameraOf(64, 64);
    const PixelRect whole{.x = 0, .y = 0, .width = camera.pixels.width, .height = camera.pixels.height};
    RenderScene scene;
    scene.update(aspect, nullptr);
    RenderAction action(CullerKind::kNone);
    const auto drawNow = [&](Renderer& with, const RenderScene& from) {
        auto picture = with.draw(aspect, action.run(from, camera, whole, nullptr), camera, whole);
        EXPECT_TRUE(picture) << picture.error().message;
        return *picture;
    };
    (void)drawNow(**renderer, scene);

    std::mt19937 random(1);
    const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random() % n); };
    int narrow = 0;
    for (int turn = 0; turn < 24; ++turn) {
        const ObjectId ball = balls[below(2)];
        const Geometry& core = *aspect.get<Geometry>(ball);
        ChangeListBuilder edits;
        for (std::size_t several = 1 + below(2); several > 0; --several) {
            const std::size_t count = 1 + below(60);
            const auto numbers = [&](const Blob& blob, FieldId field, float by) {
                const std::span<const float> all = blob.as<float>();
                const std::size_t first = below(all.size() - count);
                std::vector<float> moved(all.begin() + std::ptrdiff_t(first),
                                         all.begin() + std::ptrdiff_t(first + count));
                for (float& number : moved) number += by * (float(below(100)) / 100 - 0.5f);
                edits.setRange(ball, typeOf<Geometry>(), field, first * sizeof(float),
                               Blob::of(std::span<const float>(moved)));
                return all.size();
            };
            switch (below(4)) {
                case 0:
                    numbers(core.positions, fieldId<&Geometry::positions>, 0.3f);
                    break;
                case 1:
                    numbers(core.normals, fieldId<&Geometry::normals>, 0.5f);
                    break;
                case 2: {
                    const std::vector<std::uint8_t> other(count, static_cast<std::uint8_t>(below(256)));
                    edits.setRange(ball, typeOf<Geometry>(), fieldId<&Geometry::colors>,
                                   below(core.colors.sizeBytes() - count),
                                   Blob::of(std::span<const std::uint8_t>(other)));
                    break;
                }
                default: {
                    std::vector<std::uint32_t> other(count);
                    for (std::uint32_t& index : other)
                        index = static_cast<std::uint32_t>(below(core.positions.sizeBytes() / 12));
                    const std::size_t first = below(core.indices.sizeBytes() / 4 - count);
                    edits.setRange(ball, typeOf<Geometry>(), fieldId<&Geometry::indices>, 4 * first,
                                   Blob::of(std::span<const std::uint32_t>(other)));
                }
            }
        }
        const ChangeList list = edits.take();
        ASSERT_TRUE(aspect.apply(list));
        scene.update(aspect, &list);
        const std::uint64_t before = (*renderer)->uploadedMeshBytes();
        const Picture picture = drawNow(**renderer, scene);
        const std::uint64_t uploaded = (*renderer)->uploadedMeshBytes() - before;
        std::map<FieldId, ByteRange> touched;
        for (const RangeEdit& range : list.ranges) {
            ByteRange& all = touched.try_emplace(range.field, ByteRange{range.offset, range.offset}).first->second;
            all = {std::min(all.begin, range.offset), std::max(all.end, range.offset + range.bytes.sizeBytes())};
        }
        std::uint64_t most = 0;
        for (const auto& [field, bytes] : touched) {
            const bool indices = field == fieldId<&Geometry::indices>, colors = field == fieldId<&Geometry::colors>;
            const ByteRange which = elementsOf(bytes, colors || indices ? 4 : 12);
            most += (which.end - which.begin) * (indices ? 4 : sizeof(MeshVertex));
        }
        EXPECT_GT(uploaded, 0u);
        // While both balls have the same arrays, the one that is drawn first has its place still.
        if (uploaded <= most) ++narrow;
        if (aspect.get<Geometry>(balls[0])->positions != aspect.get<Geometry>(balls[1])->positions && narrow > 0) {
            EXPECT_LE(uploaded, most) << turn;
        }
        const auto another = test::pooledSurface();
        auto fresh = Renderer::create(*another, {.samples = 1});
        ASSERT_TRUE(fresh);
        RenderScene anew;
        anew.update(aspect, nullptr);
        EXPECT_EQ(scene.bounds().lower, anew.bounds().lower) << turn;
        EXPECT_EQ(scene.bounds().upper, anew.bounds().upper) << turn;
        ASSERT_EQ(picture, drawNow(**fresh, anew)) << turn;
    }
    EXPECT_GT(narrow, 18);
}

// Points go to GL as they are. Without a radius of their own they have one by their bounds: where these change all look
// otherwise, and nothing else goes to GL for that.
TEST(RangeUpload, OfPointsUploadsThose) {
    for (const double radius : {0.05, 0.0}) {
        const auto surface = test::pooledSurface();
        auto renderer = Renderer::create(*surface, {.samples = 1});
        ASSERT_TRUE(renderer) << renderer.error().message;
        MeshData points{.primitive = Primitive::kPoints, .pointRadius = radius};
        constexpr int kSide = 12;
        for (int i = 0; i < kSide * kSide; ++i)
            points.positions.insert(points.positions.end(),
                                    {0.13f * float(i % kSide) - 0.8f, 0.13f * float(i / kSide) - 0.8f, 0});
        points.colors.assign(points.positions.size() / 3 * 4, 255);
        TestScene built;
        const ObjectId cloud = built.add(points);
        built.place(cloud, {0, 0, -2});
        Aspect aspect = built.take();
        const ScreenCamera camera = cameraOf(96, 96);
        const PixelRect whole{.x = 0, .y = 0, .width = camera.pixels.width, .height = camera.pixels.height};
        RenderScene scene;
        scene.update(aspect, nullptr);
        RenderAction action(CullerKind::kFrustum);
        const auto drawNow = [&](Renderer& with, const RenderScene& from) {
            auto picture = with.draw(aspect, action.run(from, camera, whole, nullptr), camera, whole);
            EXPECT_TRUE(picture) << picture.error().message;
            return *picture;
        };
        Picture last = drawNow(**renderer, scene);
        EXPECT_EQ((*renderer)->uploadedMeshBytes(), std::uint64_t{kSide} * kSide * sizeof(PointTexel));
        const auto edit = [&](FieldId field, std::uint64_t offset, const Blob& bytes) {
            ChangeListBuilder edits;
            edits.setRange(cloud, typeOf<Geometry>(), field, offset, bytes);
            const ChangeList list = edits.take();
            EXPECT_TRUE(aspect.apply(list));
            scene.update(aspect, &list);
            const std::uint64_t before = (*renderer)->uploadedMeshBytes();
            const Picture picture = drawNow(**renderer, scene);
            const auto another = test::pooledSurface();
            auto fresh = Renderer::create(*another, {.samples = 1});
            RenderScene anew;
            anew.update(aspect, nullptr);
            EXPECT_EQ(scene.bounds().lower, anew.bounds().lower);
            EXPECT_EQ(scene.bounds().upper, anew.bounds().upper);
            EXPECT_EQ(picture, drawNow(**fresh, anew));
            if (radius > 0) {
                EXPECT_NE(picture, last) << "it is seen";
            }
            last = picture;
            return (*renderer)->uploadedMeshBytes() - before;
        };
        const std::vector<float> near = {0, -0.05f}, far = {-3.0f};
        const std::vector<std::uint8_t> red = {255, 0, 0, 255, 255, 0, 0, 255};
        // The middle of the middle row: the end of one point and the beginning of the next.
        const std::uint64_t at = (kSide / 2 * kSide + kSide / 2) * 12;
        const std::uint64_t two = 2 * sizeof(PointTexel);
        EXPECT_EQ(edit(fieldId<&Geometry::colors>, at / 3, Blob::of(std::span<const std::uint8_t>(red))), two)
            << radius;
        EXPECT_EQ(edit(fieldId<&Geometry::positions>, at + 8, Blob::of(std::span<const float>(near))), two) << radius;
        EXPECT_EQ(edit(fieldId<&Geometry::positions>, at, Blob::of(std::span<const float>(far))), two / 2) << radius;
    }
}

}  // namespace
}  // namespace tessera

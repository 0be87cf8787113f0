// Glass in glass: triangles are sorted together. The truth is the same glass in triangles so small that their order is
// right in every pixel.
#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <set>

#include "client/draw/Renderer.h"
#include "client/render/RenderAction.h"
#include "client/render/TransparentOrder.h"
#include "tests/golden/TestScene.h"

namespace tessera::test {
namespace {

/// Each triangle in four, so often.
MeshData divided(MeshData mesh, int times) {
    for (; times > 0; --times) {
        MeshData finer;
        const auto add = [&](const Vec3d& p, const Vec3d& n) {
            for (int i = 0; i < 3; ++i) finer.positions.push_back(static_cast<float>(p[i]));
            for (int i = 0; i < 3; ++i) finer.normals.push_back(static_cast<float>(n[i]));
            finer.indices.push_back(static_cast<std::uint32_t>(finer.indices.size()));
        };
        for (std::size_t t = 0; t < mesh.indices.size(); t += 3) {
            Vec3d p[6], n[6];
            for (std::size_t i = 0; i < 3; ++i) {
                const std::size_t at = 3 * std::size_t{mesh.indices[t + i]};
                p[i] = {mesh.positions[at], mesh.positions[at + 1], mesh.positions[at + 2]};
                n[i] = {mesh.normals[at], mesh.normals[at + 1], mesh.normals[at + 2]};
            }
            for (std::size_t i = 0; i < 3; ++i) {
                p[3 + i] = 0.5 * (p[i] + p[(i + 1) % 3]);
                n[3 + i] = 0.5 * (n[i] + n[(i + 1) % 3]);
            }
            for (const std::size_t i : {0, 3, 5, 3, 1, 4, 5, 4, 2, 3, 4, 5}) add(p[i], n[i]);
        }
        mesh = finer;
    }
    return mesh;
}

/// Balls, rings and panes of glass in each other, seen from both sides, some inside others.
Aspect makeGlass(unsigned seed, int times) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> u(-1, 1);
    TestScene scene;
    scene.setEnvironment(Vec3f::Constant(0.7f), Vec3f::Constant(0.5f), Vec3f(0.1f, 0.1f, 0.15f));
    const MeshData shapes[] = {makeSphere(0.5, 16), makeTorus(0.5, 0.2, 16, 10), makeBox({0.7, 0.7, 0.7}), makeSphere(0.3, 12)};
    for (int i = 0; i < 7; ++i) {
        Material glass;
        glass.baseColor = {static_cast<float>(0.5 + 0.5 * u(random)), static_cast<float>(0.5 + 0.5 * u(random)),
                           static_cast<float>(0.5 + 0.5 * u(random)), static_cast<float>(0.5 + 0.2 * u(random))};
        glass.roughness = 1;
        glass.doubleSided = i % 2;
        scene.place(scene.add(divided(shapes[i % 4], times), scene.add(glass)),
                    {0.7 * u(random), 0.4 * u(random), -0.5 + 0.5 * u(random)},
                    Quatd(u(random), u(random), u(random), u(random)).normalized());
    }
    scene.addDirectionalLight({0.4, -1, -0.5}, Vec3f::Ones(), 1);
    return scene.take();
}

/// Mean difference of the channels, in steps of 255.
double apart(const Picture& a, const Picture& b) {
    double sum = 0;
    for (std::size_t i = 0; i < a.rgb.size(); ++i) sum += std::abs(static_cast<double>(a.rgb[i]) - static_cast<double>(b.rgb[i]));
    return sum / static_cast<double>(a.rgb.size());
}

class Glass : public testing::TestWithParam<unsigned> {
protected:
    static constexpr PixelRect kRect{.x = 0, .y = 0, .width = 320, .height = 200};
    DrawList listOf(const Aspect& aspect) {
        RenderScene all;
        all.update(aspect, nullptr);
        return RenderAction(CullerKind::kNone).run(all, camera_, kRect, nullptr);
    }
    Picture draw(const Aspect& aspect, const DrawList& list) {
        auto picture = renderer_->draw(aspect, list, camera_, kRect);
        EXPECT_TRUE(picture);
        return *picture;
    }
    ScreenCamera camera_ = test::cameraOf(320, 200, {0.1, 0.05, 1.5});
    std::unique_ptr<Surface> surface_ = makeSurface("osmesa").value();
    std::unique_ptr<Renderer> renderer_ = Renderer::create(*surface_, {.samples = 1}).value();
};

TEST_P(Glass, InGlassIsNearTheTruthWhereWholeThingsAreNot) {
    const Aspect coarse = makeGlass(GetParam(), 0);
    const Aspect fine = makeGlass(GetParam(), 3);
    const DrawList sorted = listOf(coarse);
    // As it was: whole things, by the middles of their boxes.
    DrawList whole = sorted;
    whole.transparent.clear();
    std::set<ObjectId> known;
    RenderScene all;
    all.update(coarse, nullptr);
    for (DrawItem item : RenderAction(CullerKind::kFrustum).run(all, camera_, kRect, nullptr).transparent) {
        item.sortedCount = 0;
        if (known.insert(item.node).second) whole.transparent.push_back(item);
    }
    ASSERT_EQ(whole.transparent.size(), 7u);
    const auto depth = [&](const DrawItem& item) { return (camera_.eye_T_world * item.box.center()).z(); };
    std::sort(whole.transparent.begin(), whole.transparent.end(),
              [&](const DrawItem& a, const DrawItem& b) { return depth(a) < depth(b); });
    const Picture truth = draw(fine, listOf(fine));
    const double byTriangles = apart(draw(coarse, sorted), truth), byThings = apart(draw(coarse, whole), truth);
    EXPECT_LT(byTriangles, 0.5 * byThings) << "seed " << GetParam();
    EXPECT_GT(byThings, 0.5) << "seed " << GetParam() << ": a scene in which the order hardly matters";
    RecordProperty("byTriangles", std::to_string(byTriangles));
    RecordProperty("byThings", std::to_string(byThings));
    std::printf("seed %u: by triangles %.3f, by things %.3f of 255\n", GetParam(), byTriangles, byThings);
}

TEST_P(Glass, IsDrawnInOneOrderOnAllTilesAndByAllCullers) {
    const Aspect glass = makeGlass(GetParam(), 0);
    RenderScene all;
    all.update(glass, nullptr);
    const Picture whole = draw(glass, listOf(glass));
    for (const CullerKind kind : {CullerKind::kNone, CullerKind::kFrustum, CullerKind::kMasked})
        for (const PixelRect& rect : {PixelRect{0, 0, 130, 200}, PixelRect{130, 77, 190, 123}}) {
            const DrawList list = RenderAction(kind).run(all, camera_, rect, nullptr);
            const auto part = renderer_->draw(glass, list, camera_, rect);
            ASSERT_TRUE(part);
            for (int y = 0; y < rect.height; ++y)
                for (int x = 0; x < 3 * rect.width; ++x) {
                    const int row = 200 - rect.y - rect.height + y;
                    ASSERT_EQ(part->rgb[static_cast<std::size_t>(3 * rect.width * y + x)],
                              whole.rgb[static_cast<std::size_t>(3 * 320 * row + 3 * rect.x + x)])
                        << nameOf(kind) << " at " << rect.x + x / 3 << "," << row;
                }
        }
}

INSTANTIATE_TEST_SUITE_P(Seeds, Glass, testing::Range(0u, 6u));

}  // namespace
}  // namespace tessera::test

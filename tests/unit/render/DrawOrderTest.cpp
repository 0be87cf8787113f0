#include <cmath>
#include <random>
#include <tuple>

#include "tests/support/words/Words.h"
#include "tests/unit/render/TestScene.h"

namespace tessera {
namespace {

/// Boxes all around the eye, some of them several times in the very same place, some transparent.
void fill(TestScene& scene, int count, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> place(-20, 20), size(0.2, 3);
    const ObjectId glass = scene.material(0.5f);
    for (int i = 0; i < count; ++i) {
        const Vec3d center(place(random), place(random), place(random));
        const Vec3d extent(size(random), size(random), size(random));
        const ObjectId core = scene.geometry(makeBox(extent), i % 7 == 0 ? glass : ObjectId{});
        for (int copies = i % 5 == 0 ? 3 : 1; copies > 0; --copies) scene.put(core, center);
    }
    scene.apply();
}

TEST(CullerNames, GoThereAndBackAndUnknownOnesAreRefused) {
    for (const CullerKind kind : kAllCullers) EXPECT_EQ(parseCuller(nameOf(kind)).value(), kind);
    const auto unknown = parseCuller("magic");
    ASSERT_FALSE(unknown);
    EXPECT_EQ(unknown.error().code, ErrorCode::kUsage);
    EXPECT_WORDS(unknown.error().message);
}

TEST(DrawOrder, OpaqueFrontToBackTransparentBackToFrontTiesByNode) {
    TestScene scene;
    const ObjectId glass = scene.material(0.5f);
    const ObjectId solid = scene.geometry(makeBox({1, 1, 1}));
    const ObjectId pane = scene.geometry(makeBox({1, 1, 1}), glass);
    const ObjectId far = scene.put(solid, {0, 0, -30});
    const ObjectId farPane = scene.put(pane, {0, 0, -28});
    const ObjectId near = scene.put(solid, {4, 0, -10});
    const ObjectId nearToo = scene.put(solid, {-4, 0, -10});
    const ObjectId nearPane = scene.put(pane, {1, 0, -8});
    const ObjectId nearPaneToo = scene.put(pane, {-1, 0, -8});
    scene.apply();
    const DrawList list = cull(scene, CullerKind::kFrustum, TestCamera());
    EXPECT_EQ(nodesOf(list.opaque), (std::vector<ObjectId>{near, nearToo, far}));
    EXPECT_EQ(nodesOf(list.transparent), (std::vector<ObjectId>{farPane, nearPane, nearPaneToo}));
}

TEST(DrawOrder, TrianglesOfGlassAreSortedTogetherUnlessTheyAreTooMany) {
    TestScene scene;
    const ObjectId glass = scene.material(0.5f);
    // Two rings in each other, and a row of balls that make them too many.
    const ObjectId ring = scene.geometry(makeTorus(1, 0.3, 20, 12), glass);
    const ObjectId a = scene.put(ring, {0, 0, -5}), b = scene.put(ring, {0.8, 0, -5});
    scene.apply();
    const DrawList few = cull(scene, CullerKind::kFrustum, TestCamera());
    EXPECT_EQ(few.sortedTriangles.size(), 2u * 2 * 20 * 12);
    EXPECT_GT(few.transparent.size(), 10u) << "they lie among each other";
    const Affine3d eye_T_world = TestCamera().camera().eye_T_world;
    double before = -HUGE_VAL;
    for (const DrawItem& item : few.transparent) {
        ASSERT_TRUE(item.node == a || item.node == b);
        const auto* mesh = scene.aspect.get<Geometry>(item.geometry);
        for (std::uint32_t i = 0; i < item.sortedCount; ++i) {
            Vec3d middle = Vec3d::Zero();
            for (std::size_t corner = 0; corner < 3; ++corner) {
                const std::size_t vertex =
                    mesh->indices.as<std::uint32_t>()[3 * few.sortedTriangles[item.sortedFrom + i] + corner];
                for (int axis = 0; axis < 3; ++axis)
                    middle[axis] +=
                        static_cast<double>(mesh->positions.as<float>()[3 * vertex + static_cast<std::size_t>(axis)]) /
                        3;
            }
            const double z = (eye_T_world * item.world_T_item * middle).z();
            ASSERT_GE(z, before - 1e-9) << "nearer ones come later";
            before = z;
        }
    }
    // Apart they are two groups, each in its order.
    TestScene apart;
    const ObjectId thin = apart.material(0.5f);
    const ObjectId one = apart.geometry(makeTorus(1, 0.3, 20, 12), thin);
    const ObjectId left = apart.put(one, {-1.4, 0, -5}), right = apart.put(one, {1.4, 0, -6});
    apart.apply();
    const DrawList two = cull(apart, CullerKind::kFrustum, TestCamera());
    EXPECT_EQ(nodesOf(two.transparent), (std::vector<ObjectId>{right, left}));
    EXPECT_EQ(two.transparent.size(), 2u);
    EXPECT_EQ(two.sortedTriangles.size(), 2u * 2 * 20 * 12);

    const ObjectId ball = scene.geometry(makeSphere(0.5, 200), glass);
    for (int i = 0; i < 6; ++i) scene.put(ball, {0.3 * i, 2, 100});
    scene.apply();
    const DrawList many = cull(scene, CullerKind::kFrustum, TestCamera());
    EXPECT_TRUE(many.sortedTriangles.empty()) << "what is behind the eye counts, too: it is before another tile's";
    EXPECT_EQ(many.transparent.size(), 2u);
}

TEST(DrawOrder, BandsAreHalfAnOctaveAndGrowWithTheDepth) {
    EXPECT_EQ(depthBand(-5), depthBand(0));
    EXPECT_EQ(depthBand(std::nan("")), depthBand(0));
    EXPECT_EQ(depthBand(1), depthBand(1.41));
    EXPECT_EQ(depthBand(1) + 1, depthBand(1.42));
    EXPECT_EQ(depthBand(1) + 2, depthBand(2));
    EXPECT_EQ(depthBand(1), depthBand(2e9) - 61);
    std::mt19937 random(4);
    std::uniform_real_distribution<double> exponent(-20, 60);
    for (int i = 0; i < 10'000; ++i) {
        const double near = std::exp2(exponent(random)), far = near * std::exp2(std::abs(exponent(random)) / 60);
        ASSERT_LE(depthBand(near), depthBand(far)) << near << ' ' << far;
        ASSERT_LE(depthBand(0), depthBand(near)) << near;
    }
}

TEST(DrawOrder, EachSortingIsWhatItsNameSays) {
    TestScene scene;
    std::mt19937 random(8);
    std::uniform_real_distribution<double> place(-8, 8);
    std::vector<ObjectId> cores;
    for (int i = 0; i < 6; ++i)
        cores.push_back(scene.geometry(makeBox({1, 1, 1}), i < 4 ? scene.material(1) : ObjectId{}));
    for (int i = 0; i < 300; ++i)
        scene.put(cores[random() % cores.size()], {place(random), place(random), -12 + place(random)});
    scene.apply();
    const TestCamera camera;
    const auto depthOf = [&](const DrawItem& item) {
        return -(camera.camera().eye_T_world * item.world_T_item.translation()).z();
    };
    const auto stateOf = [](const DrawItem& item) { return std::tuple(item.material, item.geometry); };
    RenderScene all;
    all.update(scene.aspect, nullptr);
    for (const DrawSorting sorting : kAllDrawSortings) {
        const DrawList list =
            RenderAction(CullerKind::kNone, sorting).run(all, camera.camera(), camera.tile(), nullptr);
        ASSERT_EQ(list.opaque.size(), 300u);
        std::size_t states = 1, bands = 1;
        for (std::size_t i = 1; i < list.opaque.size(); ++i) {
            const DrawItem& a = list.opaque[i - 1];
            const DrawItem& b = list.opaque[i];
            const bool sameState = stateOf(a) == stateOf(b), sameBand = depthBand(depthOf(a)) == depthBand(depthOf(b));
            states += !sameState;
            bands += !sameBand;
            if (sorting == DrawSorting::kDepth || (sameState && (sorting == DrawSorting::kState || sameBand))) {
                ASSERT_LE(depthOf(a), depthOf(b) + 1e-9) << nameOf(sorting);
            }
            if (sorting == DrawSorting::kBoth) {
                ASSERT_LE(depthBand(depthOf(a)), depthBand(depthOf(b)));
            }
        }
        if (sorting == DrawSorting::kState) {
            EXPECT_EQ(states, cores.size());
        } else if (sorting == DrawSorting::kBoth) {
            EXPECT_LE(states, bands * cores.size());
            EXPECT_GT(bands, 4u);
        } else {
            EXPECT_GT(states, 150u);
        }
    }
}

class SortedDrawOrder : public testing::TestWithParam<DrawSorting> {};
INSTANTIATE_TEST_SUITE_P(All, SortedDrawOrder, testing::ValuesIn(kAllDrawSortings),
                         [](const auto& of) { return std::string(nameOf(of.param)); });

TEST_P(SortedDrawOrder, EveryTileAndCullerDrawsASubsequenceOfOneOrder) {
    TestScene scene;
    fill(scene, 300, 3);
    TestCamera camera(160, 100, 3, 2);
    camera.user.position += Vec3d(0.3, -0.2, 0);
    RenderScene all;
    all.update(scene.aspect, nullptr);
    for (const Eye eye : {Eye::kCenter, Eye::kLeft, Eye::kRight}) {
        const ScreenCamera view = camera.camera(eye);
        const DrawList whole = RenderAction(CullerKind::kNone, GetParam()).run(all, view, camera.tile(), nullptr);
        ASSERT_GT(whole.opaque.size(), 300u);
        for (const CullerKind kind : kAllCullers) {
            RenderAction action(kind, GetParam());
            for (int column = 0; column < 3; ++column) {
                for (int row = 0; row < 2; ++row) {
                    DepthFake device(scene.aspect);
                    const DrawList part = action.run(all, view, camera.tile(column, row), &device, nullptr).value();
                    EXPECT_TRUE(isSubsequence(nodesOf(part.opaque), nodesOf(whole.opaque)));
                    EXPECT_TRUE(isSubsequence(transparentParts(part), transparentParts(whole)));
                }
            }
        }
    }
}

TEST(FrustumCulling, KeepsExactlyTheBoxesThatAreNotBehindAPlane) {
    TestScene scene;
    fill(scene, 800, 11);
    TestCamera camera(160, 100, 2, 2);
    RenderScene all;
    all.update(scene.aspect, nullptr);
    const ScreenCamera view = camera.camera();
    const DrawList whole = RenderAction(CullerKind::kNone).run(all, view, camera.tile(), nullptr);
    RenderAction action(CullerKind::kFrustum);
    for (int column = 0; column < 2; ++column) {
        for (int row = 0; row < 2; ++row) {
            CullCounts counts;
            DepthFake device(scene.aspect);
            const DrawList part = action.run(all, view, camera.tile(column, row), &device, &counts).value();
            const Frustum frustum = tileFrustum(view, camera.tile(column, row));
            std::vector<ObjectId> expected;
            for (const DrawItem& item : whole.opaque) {
                const Blob positions = scene.aspect.get<Geometry>(item.geometry)->positions;
                const Box box = boundsOf(positions.as<float>()).transformed(item.world_T_item);
                if (!frustum.classify(box).outside) expected.push_back(item.node);
            }
            EXPECT_EQ(nodesOf(part.opaque), expected);
            EXPECT_LT(expected.size(), whole.opaque.size() / 2);
            EXPECT_EQ(counts.inFrustum, nodesOf(part).size());
            EXPECT_EQ(counts.drawn, nodesOf(part).size());
            EXPECT_EQ(counts.trianglesDrawn, 12 * counts.drawn);
        }
    }
}

}  // namespace
}  // namespace tessera

#include "server/collision/pipeline/Way.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/unit/collision/SceneMaker.h"

namespace tessera {
namespace {

struct Chain : SceneMaker {
    std::mt19937 random;
    std::vector<ObjectId> transforms;
    ObjectHandler handler{std::make_shared<ShapeCache>(), 16};
    std::vector<Way> ways;

    /// A body below `depth` transforms, the `moving` ones of which get a way.
    Chain(unsigned seed, int depth, int moving) : random(seed) {
        ObjectId parent = node(kRootNode);
        const ObjectId top = parent;
        for (int i = 0; i < depth; ++i) {
            const Way way = randomWay();
            transforms.push_back(transform(way.start.translation, way.start.rotation, way.start.scale));
            parent = node(parent, transforms.back());
            if (i < moving) ways.push_back(way);
        }
        node(parent, geometry(shapes::box(Vec3d(0.4, 0.8, 1.2))));
        interest(top);
        handler.update(aspect, nullptr);
    }
    double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); }
    Vec3d vector(double low, double high) { return {uniform(low, high), uniform(low, high), uniform(low, high)}; }
    Way randomWay() {
        std::normal_distribution<double> n;
        const auto value = [&] {
            return Pose{vector(-2, 2), Quatd(n(random), n(random), n(random), n(random)).normalized(),
                                  vector(0.5, 1.5)};
        };
        Way way{value(), value()};
        if (uniform(0, 1) < 0.4) way.end.rotation = way.start.rotation;
        if (uniform(0, 1) < 0.4) way.end.scale = way.start.scale;
        return way;
    }
    const Way* wayOf(ObjectId id) const {
        for (std::size_t i = 0; i < ways.size(); ++i)
            if (transforms[i] == id) return &ways[i];
        return nullptr;
    }
    std::vector<Vec3d> corners(const Affine3d& world) const {
        std::vector<Vec3d> out;
        const TriangleMesh& mesh = handler.parts()[0].shape->mesh();
        for (std::uint32_t f = 0; f < mesh.faceCount(); ++f)
            for (unsigned k = 0; k < 3; ++k) out.push_back(world * mesh.corner(f, k));
        return out;
    }
};

TEST(Way, EndsAreExactAndBetweenIsBetween) {
    Way way;
    way.start = {Vec3d(1, 2, 3), Quatd(0.3, 0.2, 0.1, 0.7), Vec3d(1, 2, 3)};
    way.end = {Vec3d(3, 2, 1), Quatd(-0.3, 0.5, 0.1, 0.2), Vec3d(2, 2, 2)};
    EXPECT_EQ(way.at(0).rotation.coeffs(), way.start.rotation.coeffs()) << "not even normalised";
    EXPECT_EQ(way.at(1).translation, way.end.translation);
    EXPECT_EQ(way.at(0.5).translation, Vec3d(2, 2, 2));
    EXPECT_EQ(way.at(0.5).scale, Vec3d(1.5, 2, 2.5));
    const Quatd half = way.at(0.5).rotation;
    EXPECT_NEAR(half.angularDistance(way.start.rotation.normalized()),
                half.angularDistance(way.end.rotation.normalized()), 1e-12);
}

TEST(Way, NoPointLeavesItsChordByMoreThanTheBound) {
    double tightest = 0;
    for (unsigned seed = 0; seed < 60; ++seed) {
        Chain scene(seed, 3, 1);
        const WayBound bound = boundWay(scene.handler, 0, [&](ObjectId id) { return scene.wayOf(id); });
        ASSERT_EQ(bound.bends, 1);
        const PartOnTheWay part(scene.handler, 0, scene.transforms[0]);
        const auto at = [&](double f) { return scene.corners(part.world(localOf(scene.ways[0].at(f)))); };
        for (const double from : {0.0, 0.2, 0.7})
            for (const double to : {0.3, 0.75, 1.0}) {
                if (to <= from) continue;
                const auto first = at(from), last = at(to);
                const double h = to - from;
                for (int k = 1; k < 16; ++k) {
                    const auto now = at(from + h * k / 16);
                    for (std::size_t i = 0; i < now.size(); ++i) {
                        const double off = (now[i] - (first[i] + (last[i] - first[i]) * k / 16)).norm();
                        EXPECT_LE(off, bound.curvature * h * h / 8 + 1e-12);
                        EXPECT_LE((now[i] - first[i]).norm(), bound.length * h * k / 16 + 1e-12);
                        if (bound.curvature > 0) tightest = std::max(tightest, off / (bound.curvature * h * h / 8));
                    }
                }
            }
    }
    EXPECT_GT(tightest, 0.3) << "a bound that says nothing";
}

TEST(Way, TheBoxHoldsThePartWhereverEachTransformIs) {
    for (unsigned seed = 0; seed < 60; ++seed) {
        const int moving = 1 + static_cast<int>(seed % 5);
        Chain scene(seed, 5, moving);
        const WayLookup wayOf = [&](ObjectId id) { return scene.wayOf(id); };
        const Box box = boxOnAllWays(scene.handler, 0, wayOf);
        const WayBound bound = boundWay(scene.handler, 0, wayOf);
        const auto start = scene.corners(scene.handler.parts()[0].world);
        EXPECT_EQ(bound.bends, moving);
        for (int trial = 0; trial < 200; ++trial) {
            Affine3d world = Affine3d::Identity();
            for (int i = 0; i < 5; ++i) {
                const Transform& t = scene.at(scene.transforms[static_cast<std::size_t>(i)]);
                const bool onTheWay = i < moving;
                world = world * (onTheWay ? localOf(scene.ways[static_cast<std::size_t>(i)].at(scene.uniform(0, 1)))
                                          : composeTransform(t.translation, t.rotation, t.scale));
            }
            const auto now = scene.corners(world);
            for (std::size_t k = 0; k < now.size(); ++k) {
                EXPECT_TRUE(box.contains(now[k])) << seed;
                EXPECT_LE((now[k] - start[k]).norm(), bound.length);
            }
        }
    }
}

TEST(Way, AStraightMoveHasNoBend) {
    Chain scene(3, 3, 1);
    scene.ways[0].end = scene.ways[0].start;
    scene.ways[0].end.translation += Vec3d(3, 0, 0);
    const WayBound bound = boundWay(scene.handler, 0, [&](ObjectId id) { return scene.wayOf(id); });
    EXPECT_NEAR(bound.length, 3, 1e-9);
    EXPECT_EQ(bound.curvature, 0);
    EXPECT_EQ(bound.bow, 0);
}

}  // namespace
}  // namespace tessera

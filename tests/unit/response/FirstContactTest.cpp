/// When parts first touch, below chains of transforms of every kind: against dense samples and brute force.
#include <gtest/gtest.h>

#include <array>
#include <map>
#include <numbers>

#include "tests/unit/response/TrialScene.h"

namespace tessera {
namespace {

enum class Kind {
    kSingle,
    kCrane,
    kStraight,
    kNested,
    kUnevenAbove,
    kMirrored,
    kOneCoreTwice,
    kOneCoreBoth,
    kSharedMoves
};

/// Two bodies, each below three transforms of its own and two that they share, of which some are on their ways.
struct Chains : TrialScene {
    Dice dice;
    std::map<ObjectId, Way> ways;
    Thing a, b;

    Chains(unsigned seed, Kind kind) : dice(seed) {
        const auto pick = [&]() -> bodies::Body {
            switch (static_cast<int>(dice.uniform(0, 4))) {
                case 0:
                    return bodies::sphere(0.7, 5, 7);
                case 1:
                    return bodies::box(Vec3d(1, 0.7, 1.4));
                case 2:
                    return bodies::soup(dice.engine(), 20);
                default:
                    return bodies::torus(0.7, 0.3, 8, 5);
            }
        };
        ObjectId shared = node(kRootNode);
        for (int i = 0; i < 2; ++i) shared = node(shared, still(kind == Kind::kSharedMoves ? 0.6 : 0.2));
        if (kind == Kind::kSharedMoves) ways[last] = turning(last, 1.0);
        const double evenly = kind == Kind::kUnevenAbove ? 0.7 : 0;
        ObjectId tops[2], transforms[2][3];
        for (int side = 0; side < 2; ++side) {
            ObjectId at = shared;
            for (int i = 0; i < 3; ++i) {
                // Uneven scales above what turns on one side only: both cannot be undone at once.
                transforms[side][i] = still(i == 0 && (side == 0 || kind == Kind::kNested) ? evenly : 0);
                if (kind == Kind::kOneCoreTwice && side == 1 && i == 2) transforms[1][2] = transforms[1][1];
                if (kind == Kind::kOneCoreBoth && side == 1 && i == 1) transforms[1][1] = transforms[0][1];
                if (kind == Kind::kMirrored && i == 0 && side == 0) mirror(transforms[0][0]);
                at = node(at, transforms[side][i]);
            }
            tops[side] = at;
        }
        a = thing(tops[0], Vec3d::Zero(), soupOf(pick()));
        b = thing(tops[1], Vec3d::Zero(), soupOf(pick()));
        watch(tops[0]);
        // Apart at the start, on the average; across each other.
        const Vec3d away = dice.direction();
        ways[transforms[1][0]] = shift(transforms[1][0], 3.2 * away, -2.5 * away + 1.5 * dice.vector(-1, 1));
        switch (kind) {
            case Kind::kStraight:
                ways[transforms[0][1]] = shift(transforms[0][1], Vec3d::Zero(), dice.vector(-1, 1));
                break;
            case Kind::kSingle:
            case Kind::kSharedMoves:
            case Kind::kMirrored:
            case Kind::kUnevenAbove:
                ways[transforms[0][1]] = turning(transforms[0][1], 2.5);
                ways[transforms[1][2]] = turning(transforms[1][2], 2.5);
                break;
            case Kind::kCrane:
                ways[transforms[0][0]] = shift(transforms[0][0], Vec3d::Zero(), dice.vector(-1, 1));
                ways[transforms[0][1]] = shift(transforms[0][1], Vec3d::Zero(), dice.vector(-1, 1));
                ways[transforms[0][2]] = turning(transforms[0][2], 2.5);
                break;
            case Kind::kNested:
                for (int i = 0; i < 3; ++i) ways[transforms[0][i]] = turning(transforms[0][i], 1.2);
                break;
            case Kind::kOneCoreTwice:
                ways[transforms[1][2]] = turning(transforms[1][2], 1.0);
                break;
            case Kind::kOneCoreBoth:
                ways[transforms[0][1]] = turning(transforms[0][1], 1.5);
                break;
        }
        for (const auto& [id, way] : ways) put(id, way.start);
    }

    ObjectId last;
    /// A transform with a small offset; uneven scales by up to `uneven`.
    ObjectId still(double uneven) {
        const double scale = dice.uniform(0.8, 1.25);
        Vec3d scales = Vec3d::Constant(scale);
        if (uneven > 0) scales = scale * Vec3d(1 + uneven * dice.uniform(-1, 1), 1 + uneven * dice.uniform(-1, 1), 1);
        last = transform(0.3 * dice.vector(-1, 1), dice.rotation(), scales);
        return last;
    }
    void mirror(ObjectId id) {
        Pose pose = at(id);
        pose.scale *= -1;
        put(id, pose);
    }
    Way shift(ObjectId id, const Vec3d& from, const Vec3d& to) {
        Way way{at(id), at(id)};
        way.start.translation = from;
        way.end.translation = to;
        return way;
    }
    Way turning(ObjectId id, double most) {
        Way way{at(id), at(id)};
        way.end.translation += 0.5 * dice.vector(-1, 1);
        way.end.rotation = dice.rotation(most) * way.start.rotation;
        if (dice.chance(0.3)) way.end.scale *= dice.uniform(0.7, 1.3);
        return way;
    }
    [[nodiscard]] WayLookup lookup() const {
        return [this](ObjectId id) -> const Way* {
            const auto found = ways.find(id);
            return found == ways.end() ? nullptr : &found->second;
        };
    }
    /// Straight from the scene's nodes and the ways.
    [[nodiscard]] Affine3d worldAt(ObjectId nodeId, double t) const {
        Affine3d world = Affine3d::Identity();
        for (ObjectId id = nodeId; id; id = aspect.get<Node>(id)->parent) {
            const ObjectId core = aspect.get<Node>(id)->core;
            if (!core || !aspect.get<Transform>(core)) continue;
            const auto way = ways.find(core);
            world = (way == ways.end() ? at(core).matrix() : way->second.at(t).matrix()) * world;
        }
        return world;
    }
};

class FirstContact : public testing::TestWithParam<Kind> {};

TEST_P(FirstContact, IsNeverMissedAndNeverLate) {
    int hits = 0, misses = 0, unfinished = 0;
    constexpr unsigned kTrials = 60;
    for (unsigned i = 0; i < kTrials; ++i) {
        const unsigned seed = 1000 * (1 + static_cast<unsigned>(GetParam())) + i;
        const auto again = [&] { return testing::Message() << "seed " << seed; };
        Chains scene(seed, GetParam());
        const std::uint32_t partA = scene.part(scene.a.shape), partB = scene.part(scene.b.shape);
        ASSERT_NE(partA, kNobody);
        ASSERT_NE(partB, kNobody);
        const double tolerance = i % 3 ? 1e-4 : 1e-7;
        QueryWork work;
        const Impact found = firstContact(scene.handler, partA, partB, scene.lookup(), tolerance, work);
        const TriangleMesh meshA = scene.meshOf(scene.a.shape), meshB = scene.meshOf(scene.b.shape);
        const auto facesOfA = bodies::facesOf(meshA, Affine3d::Identity());
        constexpr int kSamples = 150;
        for (int s = 0; s <= kSamples; ++s) {
            const double t = static_cast<double>(s) / kSamples;
            if ((found.hit || !found.complete) && t >= found.t) break;
            const Affine3d a_T_b = scene.worldAt(scene.a.shape, t).inverse() * scene.worldAt(scene.b.shape, t);
            ASSERT_FALSE(bodies::touching(facesOfA, bodies::facesOf(meshB, a_T_b))) << again() << ", t = " << t;
        }
        if (!found.complete) {
            ++unfinished;
            continue;
        }
        if (!found.hit) {
            ++misses;
            continue;
        }
        ++hits;
        const Affine3d worldA = scene.worldAt(scene.a.shape, found.t), worldB = scene.worldAt(scene.b.shape, found.t);
        const double distance = bodies::distance(bodies::facesOf(meshA, worldA), bodies::facesOf(meshB, worldB));
        ASSERT_LE(distance, tolerance) << again();
        ASSERT_LE(found.distance, tolerance) << again();
        ASSERT_GE(found.distance, distance - 1e-12) << again();
        ASSERT_NEAR(found.normal.norm(), 1, 1e-9) << again();
        const Triangle a = transformed(worldA, meshA.triangle(found.faces.a)),
                       b = transformed(worldB, meshB.triangle(found.faces.b));
        const auto off = [&](const Triangle& t) {
            // Of a triangle without area: of its sides.
            double least = isDegenerate(t) ? 1e300 : (nearestOnTriangle(t, found.point) - found.point).norm();
            for (std::size_t k = 0; k < 3; ++k)
                least = std::min(least, nearestOnSegments(t[k], t[(k + 1) % 3], found.point, found.point).distance);
            return least;
        };
        ASSERT_LE(off(a), tolerance + 1e-9) << again();
        ASSERT_LE(off(b), tolerance + 1e-9) << again();
        // The other way round the same, to within what the tolerance leaves open.
        const Impact swapped = firstContact(scene.handler, partB, partA, scene.lookup(), tolerance, work);
        ASSERT_TRUE(swapped.hit || !swapped.complete) << again();
    }
    EXPECT_GT(hits, 15);
    EXPECT_GT(misses, 2);
    EXPECT_LT(unfinished, 6);
    std::printf("%d hits, %d misses, %d unfinished\n", hits, misses, unfinished);
}

INSTANTIATE_TEST_SUITE_P(Kinds, FirstContact,
                         testing::Values(Kind::kSingle, Kind::kCrane, Kind::kStraight, Kind::kNested,
                                         Kind::kUnevenAbove, Kind::kMirrored, Kind::kOneCoreTwice, Kind::kOneCoreBoth,
                                         Kind::kSharedMoves));

/// A unit box that waits, and one on a transform of its own.
struct TwoBoxes : TrialScene {
    Thing rest = body(kRootNode, bodies::box(Vec3d::Ones()), Vec3d::Zero());
    Thing mover = body(kRootNode, bodies::box(Vec3d::Ones()), Vec3d(4, 0, 0));
    TwoBoxes() { watch(rest.node); }
    Impact contact(const WayLookup& wayOf, double tolerance = 1e-6) {
        QueryWork unlimited;
        return firstContact(handler, part(rest.shape), part(mover.shape), wayOf, tolerance, unlimited);
    }
};

TEST(FirstContactOf, BoxesIsWhereItShouldBeAndSaysWhere) {
    TwoBoxes scene;
    const Way here{scene.at(scene.rest.transform), {Vec3d(1, 0.2, 0), Quatd::Identity(), Vec3d::Ones()}};
    const Way there{scene.at(scene.mover.transform), {Vec3d(-1, 0, 0), Quatd::Identity(), Vec3d::Ones()}};
    const Impact found = scene.contact([&](ObjectId id) {
        return id == scene.mover.transform ? &there : id == scene.rest.transform ? &here : nullptr;
    });
    ASSERT_TRUE(found.hit);
    EXPECT_LE(found.t, 0.5);  // 3 apart, closing 5 and 1
    EXPECT_NEAR(found.t, 0.5, 1e-6);
    EXPECT_NEAR(found.normal.x(), 1, 1e-9);
    EXPECT_NEAR(found.point.x(), 1.0, 1e-6);
}

TEST(FirstContactOf, WhatRestsIsAtZeroOrNever) {
    TwoBoxes scene;
    const WayLookup none = [](ObjectId) { return nullptr; };
    EXPECT_FALSE(scene.contact(none).hit);
    scene.put(scene.mover.transform, {Vec3d(1, 0, 0), Quatd::Identity(), Vec3d::Ones()});
    const Impact touching = scene.contact(none);
    EXPECT_TRUE(touching.hit);
    EXPECT_EQ(touching.t, 0);
    EXPECT_EQ(touching.distance, 0);
    EXPECT_NEAR((touching.normal - Vec3d::UnitX()).norm(), 0, 1e-12);
    // A way that leads nowhere is rest, wherever that is.
    Way nowhere{scene.at(scene.mover.transform), scene.at(scene.mover.transform)};
    const WayLookup still = [&](ObjectId id) { return id == scene.mover.transform ? &nowhere : nullptr; };
    EXPECT_EQ(scene.contact(still).t, 0);
    nowhere.start.translation.x() = nowhere.end.translation.x() = 1.1;
    EXPECT_FALSE(scene.contact(still).hit);
}

TEST(FirstContactOf, TheSameWayAboveBothIsNoMotionAgainstEachOther) {
    TwoBoxes scene;
    const ObjectId carrier = scene.transform();
    const ObjectId top = scene.node(kRootNode, carrier);
    scene.place(scene.rest.node, top);
    scene.place(scene.mover.node, top);
    Way way;
    way.end = {Vec3d(100, 3, 7), Quatd(0.3, 0.5, -0.2, 0.1).normalized(), Vec3d(2, 2, 2)};
    QueryWork work;
    const Impact found = firstContact(
        scene.handler, scene.part(scene.rest.shape), scene.part(scene.mover.shape),
        [&](ObjectId id) { return id == carrier ? &way : nullptr; }, 1e-6, work);
    EXPECT_FALSE(found.hit);
    EXPECT_TRUE(found.complete);
    EXPECT_LT(work.boxTests + work.triangleTests, 10u);
}

TEST(FirstContactOf, ALimitOfWorkLeavesItOpenAtATimeThatIsFree) {
    for (const Kind kind : {Kind::kSingle, Kind::kNested}) {
        Chains scene(7, kind);
        const std::uint32_t a = scene.part(scene.a.shape), b = scene.part(scene.b.shape);
        QueryWork unlimited, little{.limit = 3};
        const Impact truth = firstContact(scene.handler, a, b, scene.lookup(), 1e-6, unlimited);
        const Impact open = firstContact(scene.handler, a, b, scene.lookup(), 1e-6, little);
        EXPECT_FALSE(open.hit);
        EXPECT_FALSE(open.complete);
        EXPECT_LE(open.t, truth.t);
    }
}

enum class Bends { kAlone, kWhileBothShift, kWhileItTurns, kBoth, kTheSecond };

/// A body whose vertices are about to be elsewhere.
class DeformingContact : public testing::TestWithParam<Bends> {};

TEST_P(DeformingContact, IsNeverMissedAndNeverLate) {
    int hits = 0, misses = 0;
    for (unsigned i = 0; i < 40; ++i) {
        const unsigned seed = 20000 + 1000 * static_cast<unsigned>(GetParam()) + i;
        const auto again = [&] { return testing::Message() << "seed " << seed; };
        Dice dice(seed);
        TrialScene scene;
        const ObjectId frame =
            scene.node(kRootNode, scene.transform(dice.vector(-1, 1), dice.rotation(), Vec3d(1, 1.3, -0.8)));
        const bodies::Body ball = bodies::sphere(0.7, 6, 8);
        const auto a = scene.body(frame, GetParam() == Bends::kTheSecond ? bodies::box(Vec3d(0.8, 1, 1.2)) : ball,
                                  Vec3d::Zero(), dice.rotation());
        const Vec3d away = dice.direction();
        const auto b = scene.body(kRootNode, GetParam() == Bends::kTheSecond ? ball : bodies::torus(0.7, 0.25, 8, 6),
                                  Vec3d::Zero(), dice.rotation());
        scene.put(b.transform, {scene.aspect.get<Transform>(b.transform)->translation, scene.at(b.transform).rotation,
                                Vec3d::Ones()});
        const Vec3d middle = worldTransform(scene.aspect, a.shape).translation();
        scene.put(b.transform, {middle + 2.2 * away, scene.at(b.transform).rotation, Vec3d(1, 1, 1)});
        scene.watch(frame);
        const auto deforming = [&](ObjectId node) {
            CollisionObject value;
            value.node = node;
            value.kind = CollisionObject::kDeforming;
            scene.object(value);
        };
        const bool bendsA = GetParam() != Bends::kTheSecond,
                   bendsB = GetParam() == Bends::kTheSecond || GetParam() == Bends::kBoth;
        if (bendsA) deforming(a.node);
        if (bendsB) deforming(b.node);
        (void)scene.handler.takeMoved();
        // What the frame wants: vertices by a list, transforms by ways.
        const auto start = [&](ObjectId shape) {
            const TriangleMesh mesh = scene.meshOf(shape);
            return std::vector<Vec3d>(mesh.positions().begin(), mesh.positions().end());
        };
        const std::vector<Vec3d> startA = start(a.shape), startB = start(b.shape);
        const TriangleMesh meshA = scene.meshOf(a.shape), meshB = scene.meshOf(b.shape);
        const auto bend = [&](const ObjectScene::Thing& what, const std::vector<Vec3d>& from) {
            const Vec3d pull = (worldTransform(scene.aspect, what.shape).linear().inverse() *
                                ((what.shape == a.shape ? 1.0 : -1.0) * away))
                                   .normalized();
            const double most = GetParam() == Bends::kBoth ? 0.9 : 1.6;
            Soup out;
            for (const Vec3d& p : from)
                out.vertex(p + dice.uniform(0.2, most) * std::max(0.0, p.dot(pull)) * pull + 0.1 * dice.vector(-1, 1));
            scene.set<Geometry>(what.geometry, fieldId<&Geometry::positions>, out.positionBlob());
        };
        if (bendsA) bend(a, startA);
        if (bendsB) bend(b, startB);
        const std::vector<Vec3d> endA = start(a.shape), endB = start(b.shape);
        ASSERT_EQ(scene.handler.deformations().size(), std::size_t{bendsA} + std::size_t{bendsB}) << again();
        std::map<ObjectId, Way> ways;
        if (GetParam() != Bends::kAlone) {
            Way& way = ways[b.transform] = {scene.at(b.transform), scene.at(b.transform)};
            way.end.translation -= dice.uniform(0, 1) * away;
            if (GetParam() == Bends::kWhileItTurns) way.end.rotation = dice.rotation(1.5) * way.start.rotation;
            if (GetParam() == Bends::kWhileBothShift) {
                Way& other = ways[a.transform] = {scene.at(a.transform), scene.at(a.transform)};
                other.end.translation += dice.vector(-0.5, 0.5);
            }
        }
        const WayLookup lookup = [&](ObjectId id) { return ways.contains(id) ? &ways[id] : nullptr; };
        const auto trianglesAt = [&](const ObjectScene::Thing& what, const TriangleMesh& mesh,
                                     const std::vector<Vec3d>& from, const std::vector<Vec3d>& to, double t) {
            Affine3d world = Affine3d::Identity();
            for (ObjectId id = what.shape; id; id = scene.aspect.get<Node>(id)->parent) {
                const ObjectId core = scene.aspect.get<Node>(id)->core;
                if (core && scene.aspect.get<Transform>(core))
                    world = (ways.contains(core) ? ways[core].at(t).matrix() : scene.at(core).matrix()) * world;
            }
            std::vector<Triangle> out;
            for (std::uint32_t f = 0; f < mesh.faceCount(); ++f) {
                Triangle& triangle = out.emplace_back();
                for (unsigned k = 0; k < 3; ++k) {
                    const std::uint32_t v = mesh.vertexOf(f, k);
                    triangle[k] = world * (from[v] + t * (to[v] - from[v]));
                }
            }
            return out;
        };
        const auto sample = [&](double t) {
            return std::pair(trianglesAt(a, meshA, startA, endA, t), trianglesAt(b, meshB, startB, endB, t));
        };
        constexpr double kTolerance = 1e-5;
        QueryWork work;
        const Impact found =
            firstContact(scene.handler, scene.part(a.shape), scene.part(b.shape), lookup, kTolerance, work);
        ASSERT_TRUE(found.complete) << again();
        for (int s = 0; s <= 150; ++s) {
            const double t = s / 150.0;
            if (found.hit && t >= found.t) break;
            const auto [x, y] = sample(t);
            ASSERT_FALSE(bodies::touching(x, y)) << again() << ", t = " << t;
        }
        if (!found.hit) {
            ++misses;
            continue;
        }
        ++hits;
        const auto [x, y] = sample(found.t);
        ASSERT_LE(bodies::distance(x, y), kTolerance) << again();
        ASSERT_LE(nearestPoints(x[found.faces.a], y[found.faces.b]).distance, kTolerance)
            << again() << ": the faces named";
        ASSERT_NEAR(found.normal.norm(), 1, 1e-9) << again();
    }
    EXPECT_GT(hits, 8);
    EXPECT_GT(misses, 0);
    std::printf("%d hits, %d misses\n", hits, misses);
}

INSTANTIATE_TEST_SUITE_P(Kinds, DeformingContact,
                         testing::Values(Bends::kAlone, Bends::kWhileBothShift, Bends::kWhileItTurns, Bends::kBoth,
                                         Bends::kTheSecond));

}  // namespace
}  // namespace tessera

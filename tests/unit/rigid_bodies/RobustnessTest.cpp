/// The same answers for any number of threads and any order; defined ones for bad input.
#include <algorithm>
#include <limits>

#include "tests/unit/rigid_bodies/World.h"

namespace tessera::rigidbodytest {
namespace {

struct Heap {
    Shape bowl = terrain(4, 24, [](double x, double z) { return 0.2 * (x * x + z * z); });
    Shape box = hullShape(boxPoints({0.4, 0.3, 0.35})), ball = hullShape(spherePoints(0.2, 20));
    Shape block = boxMesh({0.4, 0.3, 0.3});
    World w;
    explicit Heap(Workers* workers = nullptr) : w({}, workers) {
        w.add(bowl, Vec3d(0, 0, 0), 0);
        std::mt19937_64 random(3);
        std::uniform_real_distribution<double> u(-1, 1);
        for (int i = 0; i < 80; ++i)
            w.add(i % 20 == 19 ? block
                  : i % 2 == 0 ? box
                               : ball,
                  Vec3d(-0.8 + 0.5 * (i % 4), 0.8 + 0.5 * (i / 16), -0.8 + 0.5 * (i / 4 % 4)), 1,
                  Quatd(u(random), u(random), u(random), u(random)).normalized());
    }
};

bool sameWorlds(const World& a, const World& b) {
    for (std::size_t i = 0; i < a.bodies.size(); ++i)
        if (a.bodies[i].velocity != b.bodies[i].velocity || a.bodies[i].spin != b.bodies[i].spin ||
            a.parts[i].world.matrix() != b.parts[i].world.matrix())
            return false;
    return a.work.boxTests == b.work.boxTests && a.work.triangleTests == b.work.triangleTests;
}

TEST(Determinism, ThreadsChangeNoBit) {
    Workers two(2), three(3);
    Heap one, other(&two), third(&three);
    for (int i = 0; i < 150; ++i) {
        one.w.step();
        other.w.step();
        third.w.step();
        ASSERT_TRUE(sameWorlds(one.w, other.w)) << i;
        ASSERT_TRUE(sameWorlds(one.w, third.w)) << i;
    }
    EXPECT_GT(one.w.last.contactPoints, 100U);
}

/// Bodies, parts and encounters are passed in another order in every frame; the ids stay.
TEST(Determinism, OrderChangesNoBit) {
    Heap straight, shuffled;
    std::mt19937_64 random(5);
    for (int frame = 0; frame < 100; ++frame) {
        straight.w.step();
        World& w = shuffled.w;
        w.findEncounters(kFrame);
        const std::size_t n = w.bodies.size();
        std::vector<std::uint32_t> order(n), where(n), partOrder(n), partWhere(n);
        for (std::uint32_t i = 0; i < n; ++i) order[i] = partOrder[i] = i;
        std::shuffle(order.begin(), order.end(), random);
        std::shuffle(partOrder.begin(), partOrder.end(), random);
        for (std::uint32_t i = 0; i < n; ++i) {
            where[order[i]] = i;
            partWhere[partOrder[i]] = i;
        }
        std::vector<RigidBody> bodies;
        std::vector<RigidPart> parts;
        for (std::uint32_t i = 0; i < n; ++i) {
            bodies.push_back(w.bodies[order[i]]);
            bodies.back().parts = {partWhere[w.bodies[order[i]].parts[0]]};
            parts.push_back(w.parts[partOrder[i]]);
            parts.back().body = where[parts.back().body];
        }
        std::vector<RigidEncounter> encounters = w.encounters;
        for (RigidEncounter& e : encounters) e = {partWhere[e.partB], partWhere[e.partA], e.law};
        std::shuffle(encounters.begin(), encounters.end(), random);
        const RigidFrame result = w.stage->advance(bodies, parts, encounters, w.gravity, kFrame, w.work);
        w.last.motions.resize(n);
        for (std::uint32_t i = 0; i < n; ++i) w.last.motions[i] = result.motions[where[i]];
        w.apply(kFrame);
        ASSERT_TRUE(sameWorlds(straight.w, w)) << frame;
    }
}

void expectFinite(const World& w) {
    for (const RigidMotion& m : w.last.motions) {
        EXPECT_TRUE(m.world_T_before.matrix().allFinite());
        EXPECT_TRUE(m.velocity.allFinite() && m.spin.allFinite());
    }
}

TEST(BadInput, NumbersThatAreNoneStayWhereTheyAre) {
    const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
    for (int what = 0; what < 8; ++what) {
        Heap h;
        h.w.run(3);
        RigidBody& bad = h.w.bodies[5];
        if (what == 0) bad.velocity.x() = nan;
        if (what == 1) bad.spin.y() = inf;
        if (what == 2) bad.mass = nan;
        if (what == 3) h.w.pose(5).translation().z() = nan;
        if (what == 4) h.w.pose(5).linear().setZero();
        if (what == 5) bad.parts.clear();
        if (what == 6) bad.id = h.w.bodies[6].id;
        if (what == 7) bad.restitution = bad.friction = nan;
        h.w.findEncounters(kFrame);
        h.w.last = h.w.stage->advance(h.w.bodies, h.w.parts, h.w.encounters, h.w.gravity, kFrame, h.w.work);
        expectFinite(h.w);
        if (what != 7) {
            EXPECT_TRUE(h.w.last.motions[5].world_T_before.matrix() == Mat4d::Identity() || what == 6) << what;
        }
        // The others go on.
        EXPECT_LT(h.w.last.motions[30].velocity.y(), -0.1) << what;
    }
}

TEST(BadInput, ExtremeMassesAndSpeedsStayFinite) {
    Heap h;
    h.w.bodies[3].mass = 1e-30;
    h.w.bodies[4].mass = 1e30;
    h.w.bodies[7].velocity = Vec3d(1e200, -1e300, 0);
    h.w.bodies[8].spin = Vec3d(0, 1e100, 1e99);
    h.w.bodies[9].mass = -2;
    for (int i = 0; i < 60; ++i) {
        h.w.step();
        expectFinite(h.w);
    }
}

TEST(BadInput, GravityAndTimeThatAreNone) {
    Heap h;
    h.w.gravity.x() = std::numeric_limits<double>::quiet_NaN();
    h.w.findEncounters(kFrame);
    h.w.step();
    expectFinite(h.w);
    for (const double seconds : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
        h.w.last = h.w.stage->advance(h.w.bodies, h.w.parts, h.w.encounters, kGravity, seconds, h.w.work);
        EXPECT_EQ(h.w.last.motions.size(), h.w.bodies.size());
        for (const RigidMotion& m : h.w.last.motions) EXPECT_TRUE(m.world_T_before.matrix() == Mat4d::Identity());
    }
}

TEST(BadInput, IndicesOutOfRangeAreNoEncounters) {
    Heap h;
    h.w.findEncounters(kFrame);
    h.w.encounters.push_back({4'000'000'000U, 2, ContactLaw::kBounce});
    h.w.encounters.push_back({3, 3, ContactLaw::kBounce});
    h.w.parts[10].body = 77'777;
    h.w.last = h.w.stage->advance(h.w.bodies, h.w.parts, h.w.encounters, h.w.gravity, kFrame, h.w.work);
    expectFinite(h.w);
    EXPECT_TRUE(h.w.last.motions[10].world_T_before.matrix() == Mat4d::Identity());
}

/// Many bodies in one place: every pair meets. None gets faster than three of its sizes in a second (a turned box is up
/// to 3 long).
TEST(BadInput, ManyCoincidentBodiesComeApartSlowly) {
    World w;
    w.gravity.setZero();
    const Shape box = hullShape(boxPoints({1, 1, 1}));
    for (int i = 0; i < 150; ++i) w.add(box, Vec3d(0, 0, 0), 1);
    for (int i = 0; i < 20; ++i) {
        w.step();
        expectFinite(w);
        for (const RigidBody& b : w.bodies) EXPECT_LT(b.velocity.norm(), 9);
    }
}

TEST(BadInput, WhatALimitLeavesUnknownStaysWhereItIs) {
    Heap h;
    h.w.run(40);
    ASSERT_GT(h.w.encounters.size(), 20U);
    QueryWork little;
    little.limit = 300;
    h.w.findEncounters(kFrame);
    const RigidFrame out = h.w.stage->advance(h.w.bodies, h.w.parts, h.w.encounters, h.w.gravity, kFrame, little);
    ASSERT_FALSE(out.notLookedAt.empty());
    EXPECT_LT(out.notLookedAt.size(), h.w.encounters.size());
    for (const RigidFrame::Left& pair : out.notLookedAt)
        for (const std::uint64_t id : {pair.partA, pair.partB}) {
            const std::uint32_t body = std::ranges::find(h.w.parts, id, &RigidPart::id)->body;
            if (h.w.bodies[body].mass == 0) continue;
            EXPECT_TRUE(out.motions[body].world_T_before.matrix() == Mat4d::Identity());
            EXPECT_EQ(out.motions[body].velocity, h.w.bodies[body].velocity);
        }
    h.w.run(5);
    expectFinite(h.w);
    EXPECT_TRUE(h.w.last.notLookedAt.empty());
}

}  // namespace
}  // namespace tessera::rigidbodytest

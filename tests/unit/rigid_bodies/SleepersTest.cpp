/// Sleepers need not be passed: what is left out comes back when something wakes it, and no bit is another one.
#include <map>

#include "tests/unit/rigid_bodies/World.h"

namespace tessera::rigidbodytest {
namespace {

/// Passes what is awake, what it may meet and what has changed; gives the rest when it is asked.
struct LeftOut final : RigidSource {
    explicit LeftOut(World& world) : w(world) {}

    bool body(std::uint64_t id, RigidBody& body, std::vector<RigidPart>& its) override {
        for (const RigidBody& one : w.bodies)
            if (one.id == id && one.mass > 0) return copy(one, body, its);
        return false;
    }
    bool support(std::uint64_t part, RigidBody& body, std::vector<RigidPart>& its) override {
        for (const RigidPart& one : w.parts)
            if (one.id == part) return copy(w.bodies[one.body], body, its);
        return false;
    }
    bool copy(const RigidBody& one, RigidBody& body, std::vector<RigidPart>& its) {
        body = one;
        body.parts.clear();
        for (const std::uint32_t p : one.parts) its.push_back(w.parts[p]);
        return true;
    }
    void pass(std::uint32_t index) {
        if (!placeOf.emplace(index, bodies.size()).second) return;
        RigidBody one = w.bodies[index];
        for (std::uint32_t& p : one.parts) {
            partOf[p] = static_cast<std::uint32_t>(parts.size());
            parts.push_back(w.parts[p]);
            parts.back().body = static_cast<std::uint32_t>(bodies.size());
            p = partOf[p];
        }
        bodies.push_back(std::move(one));
        indices.push_back(index);
    }
    void step(const std::vector<std::uint32_t>& changed) {
        w.findEncounters(kFrame);
        bodies.clear();
        parts.clear();
        placeOf.clear();
        partOf.clear();
        indices.clear();
        for (std::uint32_t i = 0; i < w.bodies.size(); ++i)
            if (w.bodies[i].mass > 0 && (w.bodies[i].disturbed || !w.stage->asleep(w.bodies[i].id))) pass(i);
        for (const std::uint32_t i : changed) pass(i);
        std::vector<RigidEncounter> encounters;
        for (const RigidEncounter& e : w.encounters) {
            pass(w.parts[e.partA].body);
            pass(w.parts[e.partB].body);
            encounters.push_back({partOf[e.partA], partOf[e.partB], e.law});
        }
        most = std::max(most, bodies.size());
        least = std::min(least, bodies.size());
        const RigidFrame out = w.stage->advance(bodies, parts, encounters, w.gravity, kFrame, w.work, this);
        fetched += out.fetched.size();
        for (const std::uint64_t id : out.fetched)
            indices.push_back(
                static_cast<std::uint32_t>(std::ranges::find(w.bodies, id, &RigidBody::id) - w.bodies.begin()));
        w.last.asleep = out.asleep;
        w.last.motions.assign(w.bodies.size(), {});
        for (std::size_t i = 0; i < indices.size(); ++i) w.last.motions[indices[i]] = out.motions[i];
        w.apply(kFrame);
    }

    World& w;
    std::vector<RigidBody> bodies;
    std::vector<RigidPart> parts;
    std::map<std::uint32_t, std::size_t> placeOf;
    std::map<std::uint32_t, std::uint32_t> partOf;
    std::vector<std::uint32_t> indices;
    std::size_t most = 0, least = 1000, fetched = 0;
};

/// Towers on two floors, some of which lean on each other.
struct Towers {
    Shape floor = boxMesh({30, 1, 30}), box = hullShape(boxPoints({0.5, 0.5, 0.5})),
          flat = hullShape(boxPoints({1.2, 0.2, 0.5}));
    Shape block = boxMesh({0.5, 0.5, 0.5});
    World w;
    explicit Towers(Workers* workers = nullptr) : w({}, workers) {
        w.add(floor, Vec3d(0, -0.5, 0), 0);
        w.add(floor, Vec3d(31, -1.5, 0), 0);
        for (int i = 0; i < 12; ++i)
            for (int k = 0; k < 1 + i % 4; ++k)
                w.add(k == 1 && i % 3 == 0 ? flat
                      : i % 5 == 4         ? block
                                           : box,
                      Vec3d(0.501 * (i % 6) + (i > 8 ? 22 : 0), 0.25 + 0.5 * k - (i > 8 ? 1 : 0), 0.501 * (i / 6)),
                      1 + i % 2);
    }
};

TEST(Sleepers, MayBeLeftOutAndNoBitIsAnotherOne) {
    std::size_t most = 0, least = 1000, fetched = 0;
    for (std::uint32_t seed = 1; seed <= 4; ++seed) {
        Workers two(2);
        Towers all, some(seed % 2 == 0 ? &two : nullptr);
        LeftOut leftOut(some.w);
        std::mt19937_64 random(seed);
        std::vector<std::uint32_t> changed;
        for (int frame = 0; frame < 500; ++frame) {
            changed.clear();
            if (frame > 80 && random() % 40 == 0) {
                const auto n = static_cast<std::uint32_t>(random() % 7);
                const auto which = static_cast<std::uint32_t>(2 + random() % (all.w.bodies.size() - 2));
                const double by = 0.001 * static_cast<double>(random() % 1000);
                for (World* w : {&all.w, &some.w}) {
                    RigidBody& body = w->bodies[which];
                    if (n == 0) w->pose(which).translation() += Vec3d(0, by, 0.1);
                    if (n == 1) body.velocity = Vec3d(3 * by, 1, 0);
                    if (n == 2) body.friction = by;
                    if (n == 3) w->gravity = Vec3d(0, -9 - by, 0);
                    if (n == 4) w->pose(0).translation().y() -= 0.05 * by;
                    if (n == 5) w->add(all.box, Vec3d(by * 3, 2, 0.2), 1);
                    if (n < 3) body.disturbed = true;
                    if (n == 6) {  // from now on nothing moves it
                        if (body.mass > 0) w->stage->gone(body.id);
                        body.mass = 0;
                        body.velocity = body.spin = Vec3d::Zero();
                    }
                }
                changed.push_back(n == 4 ? 0 : which);
            }
            all.w.step();
            leftOut.step(changed);
            ASSERT_EQ(all.w.last.asleep, some.w.last.asleep) << seed << ' ' << frame;
            for (std::size_t i = 0; i < all.w.bodies.size(); ++i) {
                ASSERT_TRUE(all.w.parts[i].world.matrix() == some.w.parts[i].world.matrix())
                    << seed << ' ' << frame << ' ' << i;
                ASSERT_EQ(all.w.bodies[i].velocity, some.w.bodies[i].velocity) << seed << ' ' << frame << ' ' << i;
            }
            ASSERT_EQ(all.w.work.boxTests, some.w.work.boxTests) << seed << ' ' << frame;
            ASSERT_EQ(all.w.work.triangleTests, some.w.work.triangleTests) << seed << ' ' << frame;
        }
        most = std::max(most, leftOut.most);
        least = std::min(least, leftOut.least);
        fetched += leftOut.fetched;
    }
    EXPECT_GT(most, 25U);
    EXPECT_EQ(least, 0U);
    EXPECT_GT(fetched, 100U);
}

}  // namespace
}  // namespace tessera::rigidbodytest

/// Whatever has become of free bodies: no bit depends on threads, nor on how many bodies are looked at in a frame.
#include <set>
#include <string>
#include <utility>

#include "common/base/Workers.h"
#include "tests/unit/pipeline/BodyHistory.h"

namespace tessera {
namespace {

void expectSame(const StepResult& x, const StepResult& y) {
    ASSERT_EQ(x.accepted.size(), y.accepted.size());
    for (std::size_t i = 0; i < x.accepted.size(); ++i) {
        ASSERT_EQ(x.accepted[i].transform, y.accepted[i].transform);
        ASSERT_EQ(x.accepted[i].translation, y.accepted[i].translation);
        ASSERT_EQ(x.accepted[i].rotation.coeffs(), y.accepted[i].rotation.coeffs());
    }
    ASSERT_EQ(x.velocities.size(), y.velocities.size());
    for (std::size_t i = 0; i < x.velocities.size(); ++i) {
        ASSERT_EQ(x.velocities[i].core, y.velocities[i].core);
        ASSERT_EQ(x.velocities[i].velocity, y.velocities[i].velocity);
        ASSERT_EQ(x.velocities[i].spin, y.velocities[i].spin);
    }
    ASSERT_EQ(x.contacts.size(), y.contacts.size());
    for (std::size_t i = 0; i < x.contacts.size(); ++i) {
        ASSERT_EQ(x.contacts[i].objectA, y.contacts[i].objectA);
        ASSERT_EQ(x.contacts[i].objectB, y.contacts[i].objectB);
        ASSERT_EQ(x.contacts[i].point, y.contacts[i].point);
    }
    ASSERT_EQ(x.events.size(), y.events.size());
    ASSERT_EQ(x.counters.freeBodies, y.counters.freeBodies);
    ASSERT_EQ(x.counters.asleep, y.counters.asleep);
    ASSERT_EQ(x.counters.neighbours, y.counters.neighbours);
    ASSERT_EQ(x.counters.boxTests, y.counters.boxTests);
    ASSERT_EQ(x.counters.triangleTests, y.counters.triangleTests);
}

/// Says of every object in every frame that its friction has been set, to what it is: all are looked at again.
void lookAtAll(BodyHistory& history) {
    ChangeListBuilder b;
    for (const ObjectId id : history.aspect.ids())
        if (const CollisionObject* object = history.aspect.get<CollisionObject>(id))
            b.set(id, typeOf<CollisionObject>(), fieldId<&CollisionObject::friction>, toValue(object->friction));
    const ChangeList list = b.take();
    history.pipeline.sceneChanged(history.aspect, &list);
}

TEST(BodyHistory, NoBitDependsOnThreadsNorOnWhoIsLookedAt) {
    std::size_t rests = 0, wakes = 0, few = 0, before = 0;
    for (std::uint64_t seed = 1; seed <= 8; ++seed) {
        Workers two(2), three(3);
        BodyHistory one(seed), other(seed, {}, seed % 2 == 0 ? &two : &three);
        for (int frame = 0; frame < 900; ++frame) {
            SCOPED_TRACE("seed " + std::to_string(seed) + ", frame " + std::to_string(frame));
            lookAtAll(other);
            const StepResult mine = one.next();
            expectSame(mine, other.next());
            if (testing::Test::HasFatalFailure()) return;
            const StepCounters& c = mine.counters;
            rests += c.asleep == c.freeBodies && c.freeBodies > 0;
            wakes += c.asleep < before;
            few += c.asleep > 5 && c.asleep < c.freeBodies && c.handedOver < c.freeBodies;
            before = c.asleep;
        }
        EXPECT_EQ(one.aspect.stateHash(), other.aspect.stateHash());
    }
    EXPECT_GT(rests, 50u);
    EXPECT_GT(wakes, 100u);
    EXPECT_GT(few, 1000u) << "frames in which some are awake and most are not handed over";
}

/// What is beyond a limit is counted, and who has begun to touch is who did not touch in the frame before.
TEST(BodyHistory, ContactsAreKeptFromFrameToFrame) {
    using NodePair = std::pair<ObjectId, ObjectId>;
    std::size_t begun = 0, leftOut = 0, exact = 0;
    for (std::uint64_t seed = 11; seed <= 16; ++seed) {
        CollisionLimits limits;
        limits.maxContacts = 4;
        BodyHistory all(seed), some(seed, limits);
        std::set<NodePair> before;
        for (int frame = 0; frame < 600; ++frame) {
            SCOPED_TRACE("seed " + std::to_string(seed) + ", frame " + std::to_string(frame));
            const StepResult every = all.next(), few = some.next();
            ASSERT_EQ(every.counters.contactsLeftOut, 0u);
            // (What rests and has also stopped a motion is counted for both where it is not listed.)
            const std::size_t counted = few.contacts.size() + few.counters.contactsLeftOut;
            ASSERT_GE(counted, every.contacts.size());
            exact += counted == every.contacts.size();
            for (std::size_t i = 0; i < few.contacts.size(); ++i) {
                ASSERT_EQ(every.contacts[i].objectA, few.contacts[i].objectA);
                ASSERT_EQ(every.contacts[i].objectB, few.contacts[i].objectB);
                ASSERT_EQ(every.contacts[i].point, few.contacts[i].point);
            }
            std::set<NodePair> now;
            std::size_t fresh = 0;
            for (const Contact& contact : every.contacts)
                if (now.emplace(contact.objectA, contact.objectB).second)
                    fresh += !before.contains({contact.objectA, contact.objectB});
            ASSERT_EQ(every.contactsBegun, fresh);
            ASSERT_EQ(few.contactsBegun, fresh);
            before = std::move(now);
            begun += fresh;
            leftOut += few.counters.contactsLeftOut;
        }
    }
    EXPECT_GT(begun, 300u);
    EXPECT_GT(leftOut, 1000u);
    EXPECT_GT(exact, 6 * 600 * 9 / 10u);
}

/// So many boxes asleep on a floor, each by itself.
struct Asleep : SceneMaker {
    std::vector<Body> boxes;
    ObjectId core, lastCore;
    std::size_t count;

    explicit Asleep(std::size_t n) : count(n) {
        gravity(Vec3d(0, -9.81, 0));
        (void)body(kRootNode, shapes::box(Vec3d(400, 1, 10)), Vec3d(0, -0.5, 0));
        const shapes::Soup soup = shapes::box(Vec3d(1, 1, 1));
        for (std::size_t i = 0; i < n; ++i) create(soup, Vec3d(1.5 * static_cast<double>(i) - 150, 0.499, 0));
        Interest fields;
        fields.object = kRootNode;
        fields.response = Interest::kBounce;
        interest(fields);
        rest();
    }
    void create(const shapes::Soup& soup, const Vec3d& where) {
        boxes.push_back(body(kRootNode, soup, where));
        CollisionObject fields;
        fields.node = boxes.back().node;
        fields.mass = 1;
        fields.shape = CollisionObject::kHull;
        fields.restitution = 0;
        core = object(fields);
        if (!lastCore) lastCore = core;
    }
    void rest() {
        for (int frames = 0; frames < 400; ++frames) (void)frame();
        const StepResult result = frame();
        ASSERT_EQ(result.counters.asleep, count);
        ASSERT_EQ(result.counters.handedOver, 0u);
    }
    /// Handed over until all rest again.
    std::size_t handedOver() {
        std::size_t most = 0;
        for (int frames = 0; frames < 200; ++frames) most = std::max(most, frame().counters.handedOver);
        rest();
        return most;
    }
};

TEST(BodyHistory, OneThatChangesAmongSleepersIsHandedOverWithItsNeighboursOnly) {
    for (const std::size_t n : {10u, 150u}) {
        SCOPED_TRACE(n);
        Asleep scene(n);
        scene.commit({.transform = scene.boxes[4].transform, .translation = Vec3d(1.5 * 4 - 150, 1, 0.2)});
        EXPECT_LE(scene.handedOver(), 4u) << "moved";
        scene.set<CollisionObject>(scene.lastCore, fieldId<&CollisionObject::velocity>, Vec3d(0, 1, 0));
        EXPECT_LE(scene.handedOver(), 4u) << "woken";
        scene.create(shapes::box(Vec3d(1, 1, 1)), Vec3d(1.5 * 5 - 150, 2, 0));
        ++scene.count;
        EXPECT_LE(scene.handedOver(), 4u) << "created, and falls on another one";
        scene.destroy(scene.boxes[7].shape);
        --scene.count;
        EXPECT_LE(scene.handedOver(), 4u) << "removed";
    }
}

}  // namespace
}  // namespace tessera

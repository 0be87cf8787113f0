// The whole scene for who joins: made beside the frames, and the same as the scene.
#include "server/sim/records/Snapshots.h"

#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <thread>
#include <utility>

#include "common/codec/ChangeCodec.h"
#include "common/codec/SnapshotCodec.h"
#include "common/cores/Geometry.h"
#include "common/cores/Transform.h"
#include "common/scene/FieldTable.h"
#include "server/sim/commit/EditHistory.h"
#include "tests/unit/session/ServerFixture.h"
#include "tests/unit/sim/SceneForTests.h"

namespace tessera {
namespace {

class SnapshotsOfAScene : public testing::Test {
protected:
    /// Adds so many nodes below the root, in one frame.
    void grow(std::size_t nodes) {
        test::ListMaker maker;
        for (std::size_t i = 0; i < nodes; ++i) maker.node("n" + std::to_string(i), kRootNode);
        ASSERT_TRUE(committer.apply(maker.builder.take()));
        const CommittedFrame frame = committer.closeFrame();
        snapshots.follow(frame);
        (void)server.session.beginFrame({.frame = server.session.nextFrame(), .payload = nullptr, .list = frame.sent},
                                        server.now);
    }
    SnapshotMade wait() { return *made.popFor(60s); }
    void give(SnapshotMade snapshot) { server.take(snapshots.made(std::move(snapshot), server.now)); }
    ConnectionId join(const std::string& name) {
        const ConnectionId connection = server.hello(name);
        server.take(snapshots.wanted(connection, server.now));
        return connection;
    }
    [[nodiscard]] StateHash hashOf(const message::Snapshot& told) const {
        CommittedListPtr whole = told.list;
        if (told.content.sizeBytes > 0) whole = decodeSnapshot(blobs.find(told.content.id)).value();
        EXPECT_EQ(whole->sequence, told.list->sequence);
        Aspect aspect;
        EXPECT_TRUE(aspect.apply(decodeChangeList(whole->encoded, blobs).value()));
        return aspect.stateHash();
    }

    BlobStore blobs;
    Committer committer;
    ServerFixture server;
    Channel<SnapshotMade> made{16};
    Snapshots snapshots{server.session, blobs, [this](SnapshotMade snapshot) { made.push(std::move(snapshot)); }};
};

TEST_F(SnapshotsOfAScene, AreTheSceneWhetherSmallOrLarge) {
    for (const std::size_t nodes : {3u, 20'000u}) {
        grow(nodes);
        snapshots.sceneReady();
        const ConnectionId a = join(nodes == 3u ? "a" : "b");
        give(wait());
        const auto told = server.sent<message::Snapshot>(a);
        ASSERT_EQ(told.size(), 1u);
        EXPECT_EQ(told[0].content.sizeBytes > Snapshots::kSmallBytes, nodes > 3u);
        EXPECT_EQ(told[0].list->sequence, committer.sequence());
        EXPECT_EQ(told[0].list->stateHash, committer.scene().stateHash());
        EXPECT_EQ(hashOf(told[0]), committer.scene().stateHash());
    }
}

TEST_F(SnapshotsOfAScene, WaitForTheSceneAndOneServesAllWhoCome) {
    const ConnectionId a = join("a");
    const ConnectionId b = join("b");
    EXPECT_FALSE(made.popFor(20ms));
    grow(20'000);
    snapshots.sceneReady();
    give(wait());
    grow(1);  // a list that is small beside the scene
    const ConnectionId app = server.hello("viewer", PeerRole::kApplication);
    server.take(snapshots.wanted(app, server.now));
    EXPECT_FALSE(made.popFor(20ms)) << "nothing is made anew";
    const BlobInfo content = server.sent<message::Snapshot>(a).at(0).content;
    EXPECT_EQ(server.sent<message::Snapshot>(b).at(0).content, content);
    EXPECT_EQ(server.sent<message::Snapshot>(app).at(0).content, content);
    EXPECT_EQ(server.sent<message::Changes>(app).size(), 1u);
}

/// A mesh's array is another one, and then another one, as when a file is read again; no history has any of them.
TEST_F(SnapshotsOfAScene, HoldWhatTheyAndTheListsSinceName) {
    const auto arrayOf = [this](float number) {
        return blobs.add(Blob::of(std::span<const float>(std::vector(9, number))));
    };
    const auto commit = [this](ChangeList list) {
        const auto applied = committer.apply(std::move(list));
        ASSERT_TRUE(applied);
        const CommittedFrame frame = committer.closeFrame();
        snapshots.follow(frame);
        (void)server.session.beginFrame({.frame = server.session.nextFrame(), .payload = nullptr, .list = frame.sent},
                                        server.now);
    };
    grow(500);  // beside which the lists since are few
    test::ListMaker maker;
    const ObjectId shape = maker.create<Geometry>();
    setField<&Geometry::positions>(maker.builder, shape, arrayOf(1));
    commit(maker.builder.take());
    ObjectId made;
    for (const ObjectId id : committer.scene().ids())
        if (committer.scene().get<Geometry>(id)) made = id;
    snapshots.sceneReady();
    (void)join("a");
    give(wait());
    for (const float number : {2.0f, 3.0f}) {
        ChangeListBuilder another;
        setField<&Geometry::positions>(another, made, arrayOf(number));
        commit(another.take());
    }
    std::promise<void> gone;
    snapshots.look(committer.sequence(), [&](const Aspect*) { gone.set_value(); });
    gone.get_future().wait();
    const ConnectionId b = join("b");
    const auto told = server.sent<message::Snapshot>(b);
    ASSERT_EQ(told.size(), 1u) << "the one that was made";
    std::vector<BlobInfo> named = told[0].list->blobs;
    for (const auto& changes : server.sent<message::Changes>(b))
        named.insert(named.end(), changes.list->blobs.begin(), changes.list->blobs.end());
    EXPECT_EQ(named.size(), 3u);
    for (const BlobInfo& each : named) EXPECT_TRUE(blobs.find(each.id).resident()) << toHex(each.id);
}

TEST_F(SnapshotsOfAScene, AreMadeAnewWhenMoreHasHappenedThanTheyHold) {
    grow(1'500);
    snapshots.sceneReady();
    (void)join("a");
    give(wait());
    grow(20'000);
    (void)join("b");
    const SnapshotMade second = wait();
    EXPECT_EQ(second.snapshot.list->sequence, committer.sequence());
}

TEST_F(SnapshotsOfAScene, ThatAreOvertakenByTheListsSinceAreMadeAgain) {
    grow(3);
    snapshots.sceneReady();
    const ConnectionId a = join("a");
    SnapshotMade old = wait();
    for (int i = 0; i < 5'000; ++i) grow(1);  // more than the session keeps for who waits
    give(std::move(old));
    EXPECT_TRUE(server.sent<message::Snapshot>(a).empty());
    ASSERT_EQ(server.actions<server_action::SnapshotWanted>().size(), 2u);
    server.take(snapshots.wanted(a, server.now));
    give(wait());
    ASSERT_EQ(server.sent<message::Snapshot>(a).size(), 1u);
    EXPECT_EQ(server.sent<message::Snapshot>(a)[0].list->stateHash, committer.scene().stateHash());
}

TEST_F(SnapshotsOfAScene, TheSceneOfAListIsLookedAtAsItWasThen) {
    struct Seen {
        std::optional<StateHash> hash;
    };
    Channel<Seen> seen{16};
    const auto lookAt = [&](std::optional<Sequence> sequence) {
        snapshots.look(sequence, [&](const Aspect* scene) {
            seen.push({scene ? std::optional(scene->stateHash()) : std::nullopt});
        });
        return seen.popFor(60s)->hash;
    };
    std::vector<std::pair<Sequence, StateHash>> past;
    for (int i = 0; i < 300; ++i) {
        grow(1);
        past.emplace_back(committer.sequence(), committer.scene().stateHash());
    }
    // The frames of a second or so back, whether the thread has been handed them or not.
    for (std::size_t back : {40u, 20u, 3u, 0u}) {
        const auto& [sequence, hash] = past[past.size() - 1 - back];
        EXPECT_EQ(lookAt(sequence), std::optional(hash)) << back;
    }
    EXPECT_EQ(lookAt(past[5].first), std::nullopt) << "it has gone on";
    EXPECT_EQ(lookAt(past.back().first), std::optional(past.back().second));
    EXPECT_EQ(lookAt(std::nullopt), std::optional(past.back().second));
    EXPECT_EQ(lookAt(past.back().first.next()), std::nullopt) << "nothing of it is known";
    // Who joins gets the newest, and the one before it cannot be seen any more.
    grow(1);
    grow(1);
    snapshots.sceneReady();
    (void)join("a");
    EXPECT_EQ(wait().snapshot.list->sequence, committer.sequence());
    EXPECT_EQ(lookAt(past.back().first), std::nullopt);
}

TEST_F(SnapshotsOfAScene, TheNewestListIsTheOneThatWasFollowedLast) {
    const auto newest = [&] {
        std::promise<std::pair<Sequence, StateHash>> seen;
        snapshots.lookAtNewest([&](const Aspect& scene, Sequence at) { seen.set_value({at, scene.stateHash()}); });
        return seen.get_future().get();
    };
    EXPECT_EQ(newest(), std::pair(Sequence(), Aspect().stateHash()));
    for (int i = 0; i < 100; ++i) {
        grow(1);
        if (i % 9 > 0) continue;
        EXPECT_EQ(newest(), std::pair(committer.sequence(), committer.scene().stateHash()));
    }
    const auto followed = newest();
    test::ListMaker maker;
    maker.node("unfollowed", kRootNode);
    ASSERT_TRUE(committer.apply(maker.builder.take()));
    (void)committer.closeFrame();
    EXPECT_EQ(newest(), followed) << "of others nobody can ask";
}

/// The thread makes a snapshot for as long as the wall is busy.
TEST_F(SnapshotsOfAScene, AThreadThatIsFarBehindHoldsWhatTheListsSetAndNotAllLists) {
    std::promise<void> goOn;
    std::atomic<bool> stalled{false};
    Channel<SnapshotMade> late{16};
    Snapshots slow{server.session, blobs, [&, wait = goOn.get_future().share()](SnapshotMade snapshot) {
                       stalled = true;
                       wait.wait();
                       late.push(std::move(snapshot));
                   }};
    struct AtTheEnd {  // a test that fails must not wait for a thread that waits for it
        std::promise<void>* goOn;
        void now() {
            if (std::promise<void>* once = std::exchange(goOn, nullptr)) once->set_value();
        }
        ~AtTheEnd() { now(); }
    } release{&goOn};
    const ConnectionId a = server.hello("a");
    slow.sceneReady();
    server.take(slow.wanted(a, server.now));
    while (!stalled) std::this_thread::yield();
    test::ListMaker maker;
    std::vector<ObjectId> places;
    for (int i = 0; i < 20; ++i) places.push_back(maker.transform(Vec3d::Zero()));
    for (const ObjectId place : places) maker.node("moves", kRootNode, place);
    const auto built = committer.apply(maker.builder.take());
    ASSERT_TRUE(built);
    std::vector<ObjectId> ids;
    for (const auto& [placeholder, id] : built->ids)
        if (committer.scene().get<Transform>(id)) ids.push_back(id);
    ASSERT_EQ(ids.size(), 20u);
    slow.follow(committer.closeFrame());
    std::size_t all = 0, most = 0;
    CommittedListPtr last;
    for (int i = 0; i < 100'000; ++i) {
        ChangeListBuilder list;
        for (const ObjectId id : ids)
            list.set(id, typeOf<Transform>(), fieldId<&Transform::translation>, toValue(Vec3d(i, 0, 1)));
        ASSERT_TRUE(committer.apply(list.take()));
        const CommittedFrame frame = committer.closeFrame();
        all += memoryOf(*frame.list);
        slow.follow(frame);
        last = frame.sent;
        most = std::max(most, slow.waitingBytes());
    }
    constexpr std::size_t kFew = std::size_t{17} << 20;
    EXPECT_GT(all, 4 * kFew) << "or nothing was shown";
    EXPECT_LT(most, kFew);
    release.now();
    auto first = late.popFor(60s);
    ASSERT_TRUE(first);
    (void)server.session.beginFrame({.frame = server.session.nextFrame(), .payload = nullptr, .list = last},
                                    server.now);
    server.take(slow.made(std::move(*first), server.now));
    const ConnectionId b = server.hello("b");
    server.take(slow.wanted(b, server.now));
    std::optional<SnapshotMade> snapshot;
    for (int frame = 0; frame < 6'000 && !snapshot; ++frame) {  // what waits goes over with later frames
        slow.follow(committer.closeFrame());
        snapshot = late.popFor(10ms);
    }
    ASSERT_TRUE(snapshot);
    EXPECT_EQ(snapshot->snapshot.list->sequence, committer.sequence());
    EXPECT_EQ(snapshot->snapshot.list->stateHash, committer.scene().stateHash());
    EXPECT_EQ(slow.waitingBytes(), 0u);
}

TEST_F(SnapshotsOfAScene, AreForgottenAtRestOnceNobodyCanBeServed) {
    grow(20'000);
    snapshots.sceneReady();
    (void)join("a");
    give(wait());
    grow(1);
    const auto rest = [&] {
        for (int frame = 0; frame < 200; ++frame) snapshots.follow(committer.closeFrame());
    };
    rest();
    EXPECT_TRUE(snapshots.keepsLast()) << "the list since then is kept for who comes";
    server.run(70s);
    rest();
    EXPECT_FALSE(snapshots.keepsLast());
    // Whoever comes then is served all the same.
    const ConnectionId b = join("b");
    give(wait());
    EXPECT_EQ(server.sent<message::Snapshot>(b).size(), 1u);
}

}  // namespace
}  // namespace tessera

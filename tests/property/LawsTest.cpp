// The laws of change lists (architecture): each holds for random scripts of edits over all types.
#include <gtest/gtest.h>

#include <algorithm>
#include <thread>

#include "common/base/Channel.h"
#include "common/codec/ChangeCodec.h"
#include "tests/property/SceneModel.h"

namespace tessera {
namespace {

constexpr std::uint64_t kSeeds = 200;
constexpr int kListsPerScript = 40;

void mustApply(Aspect& aspect, const ChangeList& list) {
    const Expected<void> done = aspect.apply(list);
    ASSERT_TRUE(done) << done.error().message;
}

std::vector<ChangeListPtr> randomScript(Random& random, int lists = kListsPerScript) {
    SceneModel model;
    std::vector<ChangeListPtr> script;
    for (int i = 0; i < lists; ++i) script.push_back(std::make_shared<const ChangeList>(model.nextList(random)));
    return script;
}

Aspect after(std::span<const ChangeListPtr> script) {
    Aspect aspect;
    for (const ChangeListPtr& list : script) mustApply(aspect, *list);
    return aspect;
}

void expectSameScene(const Aspect& a, const Aspect& b) {
    EXPECT_EQ(a.stateHash(), b.stateHash());
    EXPECT_EQ(a.leafHashes(), b.leafHashes());
    EXPECT_EQ(a.ids(), b.ids());
    EXPECT_EQ(a.nextFreeId(), b.nextFreeId());
    EXPECT_TRUE(snapshot(a) == snapshot(b));
}

TEST(Laws, AnAspectFollowsThePlainModel) {
    forSeeds(kSeeds, [](Random& random) {
        SceneModel model;
        Aspect aspect;
        for (int i = 0; i < kListsPerScript; ++i) {
            mustApply(aspect, model.nextList(random));
            model.expectEqual(aspect);
            if (testing::Test::HasFailure()) return;
        }
    });
}

TEST(Laws, TheInverseRestoresTheStateAndItsInverseRedoes) {
    forSeeds(kSeeds, [](Random& random) {
        SceneModel model;
        Aspect aspect;
        std::vector<ChangeList> undoStack;
        std::vector<StateHash> hashes = {aspect.stateHash()};
        for (int i = 0; i < kListsPerScript; ++i) {
            auto undo = aspect.applyWithInverse(model.nextList(random));
            ASSERT_TRUE(undo) << undo.error().message;
            undoStack.push_back(std::move(*undo));
            hashes.push_back(aspect.stateHash());
        }
        // All the way back, at each step forward once and back again.
        for (std::size_t step = undoStack.size(); step-- > 0;) {
            const auto redo = aspect.applyWithInverse(undoStack[step]);
            ASSERT_TRUE(redo) << redo.error().message;
            ASSERT_EQ(aspect.stateHash(), hashes[step]);
            const auto undoAgain = aspect.applyWithInverse(*redo);
            ASSERT_TRUE(undoAgain) << undoAgain.error().message;
            ASSERT_EQ(aspect.stateHash(), hashes[step + 1]);
            mustApply(aspect, *undoAgain);
            ASSERT_EQ(aspect.stateHash(), hashes[step]);
        }
        EXPECT_EQ(aspect.objectCount(), 1u);
    });
}

TEST(Laws, DecodingAnEncodedListGivesItBack) {
    forSeeds(kSeeds, [](Random& random) {
        for (const ChangeListPtr& list : randomScript(random)) {
            const Bytes bytes = encodeChangeList(*list);
            const auto decoded = decodeChangeList(bytes, blobStore());
            ASSERT_TRUE(decoded) << decoded.error().message;
            ASSERT_EQ(*decoded, *list);
            ASSERT_EQ(encodeChangeList(*decoded), bytes);
        }
    });
}

TEST(Laws, ACompactedListHasTheSameEffect) {
    std::size_t before = 0, after_ = 0;
    forSeeds(kSeeds, [&](Random& random) {
        // Undo steps among them, so that destroyed ids come back.
        SceneModel model;
        Aspect aspect;
        std::vector<ChangeListPtr> history;
        while (history.size() < kListsPerScript) {
            const auto list = std::make_shared<const ChangeList>(model.nextList(random));
            auto undo = aspect.applyWithInverse(*list);
            ASSERT_TRUE(undo) << undo.error().message;
            history.push_back(list);
            if (oneIn(random, 3)) {
                const auto back = std::make_shared<const ChangeList>(std::move(*undo));
                auto redo = aspect.applyWithInverse(*back);
                ASSERT_TRUE(redo) << redo.error().message;
                mustApply(aspect, *redo);  // the model has not gone back
                history.push_back(back);
                history.push_back(std::make_shared<const ChangeList>(std::move(*redo)));
            }
        }
        const std::size_t start = below(random, history.size());
        Aspect late = after(std::span(history).first(start));
        const auto compacted = compact(std::span(history).subspan(start));
        for (const ChangeList& list : compacted) mustApply(late, list);
        expectSameScene(late, aspect);
        for (std::size_t i = start; i < history.size(); ++i) before += history[i]->changeCount();
        for (const ChangeList& list : compacted) after_ += list.changeCount();
    });
    EXPECT_LT(after_, before) << "compaction left nothing away";
}

TEST(Laws, ASnapshotAppliedToTheEmptySceneEqualsTheScene) {
    forSeeds(kSeeds, [](Random& random) {
        const Aspect aspect = after(randomScript(random));
        Aspect copy;
        mustApply(copy, snapshot(aspect));
        expectSameScene(copy, aspect);

        const auto sent = decodeChangeList(encodeChangeList(snapshot(aspect)), blobStore());
        ASSERT_TRUE(sent) << sent.error().message;
        Aspect far;
        mustApply(far, *sent);
        expectSameScene(far, aspect);
    });
}

TEST(Laws, TheIncrementalHashIsTheHashOfTheSceneAsItStands) {
    forSeeds(kSeeds / 4, [](Random& random) {
        SceneModel model;
        Aspect aspect;
        for (int i = 0; i < kListsPerScript; ++i) {
            mustApply(aspect, model.nextList(random));
            Aspect recomputed;
            mustApply(recomputed, snapshot(aspect));
            ASSERT_EQ(recomputed.stateHash(), aspect.stateHash());
        }
    });
}

TEST(Laws, ReplayReproducesTheHashOfEveryFrame) {
    forSeeds(kSeeds, [](Random& random) {
        const std::vector<ChangeListPtr> script = randomScript(random);
        Aspect server, replay;
        for (const ChangeListPtr& list : script) {
            ASSERT_TRUE(server.applyWithInverse(*list));
            mustApply(replay, *decodeChangeList(encodeChangeList(*list), blobStore()));
            ASSERT_EQ(replay.stateHash(), server.stateHash());
        }
    });
}

/// An application follows without the arrays; what travels says what they are called.
TEST(Laws, AFollowerWithoutArraysHasTheHashOfEveryFrame) {
    const BlobStore nothing;
    std::size_t ranges = 0;
    forSeeds(kSeeds / 2, [&](Random& random) {
        const std::vector<ChangeListPtr> script = randomScript(random);
        Aspect server, follower;
        std::vector<ChangeList> undo;
        const auto follow = [&](const ChangeList& list) {
            auto back = server.applyWithInverse(list);
            ASSERT_TRUE(back) << back.error().message;
            const auto decoded = decodeChangeList(encodeChangeList(list), nothing, AbsentBlobs::kKeepAbsent);
            ASSERT_TRUE(decoded) << decoded.error().message;
            const auto backThere = follower.applyWithInverse(*decoded);
            ASSERT_TRUE(backThere) << backThere.error().message;
            ASSERT_EQ(follower.stateHash(), server.stateHash());
            // Its own way back leads back too.
            const StateHash now = follower.stateHash();
            const auto again = follower.applyWithInverse(*backThere);
            ASSERT_TRUE(again) << again.error().message;
            mustApply(follower, *again);
            ASSERT_EQ(follower.stateHash(), now);
            undo.push_back(std::move(*back));
            ranges += list.ranges.size();
        };
        for (const ChangeListPtr& list : script) {
            follow(*list);
            if (testing::Test::HasFailure()) return;
        }
        // And all the way back, by the server's inverses.
        const std::vector<ChangeList> way(undo.rbegin(), undo.rend());
        for (const ChangeList& list : way) {
            follow(list);
            if (testing::Test::HasFailure()) return;
        }
        EXPECT_EQ(follower.objectCount(), 1u);
    });
    EXPECT_GT(ranges, 500u);
}

TEST(Laws, TheHashDoesNotDependOnHistory) {
    forSeeds(kSeeds / 4, [](Random& random) {
        const Aspect aspect = after(randomScript(random));
        // The same scene from single steps in another order, with other values on the way.
        ChangeList whole = snapshot(aspect);
        Aspect piecemeal;
        std::shuffle(whole.creations.begin(), whole.creations.end(), random);
        for (const Creation& creation : whole.creations) {
            ChangeListBuilder one;
            one.create(creation.id, creation.type);
            mustApply(piecemeal, one.take());
        }
        for (const Placement& placement : whole.placements) {
            ChangeListBuilder one;
            if (oneIn(random, 2)) one.place(placement.node, kRootNode, 0);
            one.place(placement.node, placement.parent);
            mustApply(piecemeal, one.take());
        }
        std::shuffle(whole.columns.begin(), whole.columns.end(), random);
        for (const FieldColumn& column : whole.columns)
            for (std::size_t row = column.ids.size(); row-- > 0;) {
                const FieldInfo& field = *findField(*findType(column.type), column.field);
                ChangeListBuilder detour, one;
                if (!field.holdsRefs())
                    detour.set(column.ids[row], column.type, field.id, SceneModel().someValue(field, random));
                one.set(column.ids[row], column.type, field.id, column.value(row));
                mustApply(piecemeal, detour.take());
                mustApply(piecemeal, one.take());
            }
        EXPECT_EQ(piecemeal.stateHash(), aspect.stateHash());
        EXPECT_EQ(piecemeal.leafHashes(), aspect.leafHashes());
    });
}

TEST(Laws, AspectsOnTwoThreadsEndInTheSameState) {
    forSeeds(10, [](Random& random) {
        Channel<ChangeListPtr> toSimulation(4), toDrawing(4);
        const auto follow = [](Channel<ChangeListPtr>& lists, std::vector<StateHash>& hashes) {
            Aspect aspect;
            while (const auto list = lists.pop()) {
                if (!aspect.apply(**list)) return;
                hashes.push_back(aspect.stateHash());
            }
        };
        std::vector<StateHash> simulation, drawing;
        std::thread first([&] { follow(toSimulation, simulation); });
        std::thread second([&] { follow(toDrawing, drawing); });
        SceneModel model;
        for (int i = 0; i < 200; ++i) {
            const auto list = std::make_shared<const ChangeList>(model.nextList(random));
            toSimulation.push(list);
            toDrawing.push(list);
        }
        toSimulation.close();
        toDrawing.close();
        first.join();
        second.join();
        EXPECT_EQ(simulation.size(), 200u);
        EXPECT_EQ(simulation, drawing);
    });
}

}  // namespace
}  // namespace tessera

/// The single writer by value: what is applied, what is handed on, what is kept.
#include "common/codec/ChangeCodec.h"
#include "common/cores/ApplicationData.h"
#include "common/cores/Material.h"
#include "common/cores/SurfaceParts.h"
#include "common/cores/Volume.h"
#include "server/sim/commit/Committer.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "server/sim/report/Report.h"
#include "tests/support/words/Words.h"
#include "tests/unit/sim/RandomTree.h"
#include "tests/unit/sim/SceneForTests.h"

namespace tessera {
namespace {

using test::ListMaker;
using test::RandomTree;

TEST(Committer, KeepsTheNumberOfNodesThatACountFindsAfterAnyHistory) {
    std::size_t destroyed = 0;
    forSeeds(30, [&](Random& random) {
        RandomTree tree(random);
        ASSERT_EQ(tree.committer.nodeCount(), 1u) << "the root";
        for (int step = 0; step < 200; ++step) {
            const ChangeListPtr list = tree.next();
            if (list) destroyed += list->destructions.size();
            if (oneIn(random, 3)) (void)tree.committer.closeFrame();
            ASSERT_EQ(tree.committer.nodeCount(), countScene(tree.scene()).nodes) << "step " << step;
        }
    });
    if (std::getenv("TESSERA_SEED")) return;
    EXPECT_GT(destroyed, 300u);
}

/// Replicas that apply the frames' lists: single ones as they are, several packed.
TEST(Committer, FramesListsLeadReplicasAlong) {
    forSeeds(20, [&](Random& random) {
        RandomTree tree(random);
        Aspect replica;
        for (int frame = 0; frame < 100; ++frame) {
            for (std::size_t lists = below(random, 3); lists > 0; --lists) (void)tree.next();
            const CommittedFrame closed = tree.committer.closeFrame();
            if (closed.list) {
                ASSERT_TRUE(replica.apply(*closed.list)) << "frame " << frame;
            }
            ASSERT_EQ(replica.stateHash(), closed.sent->stateHash) << "frame " << frame;
        }
    });
}

/// An animation edits ranges too, and is no step: what leads back from a person's edit finds another array than that
/// edit left.
TEST(Committer, WhatLeadsBackFromARangeLeavesWhatCameSince) {
    Committer committer;
    ListMaker make;
    const ObjectId core = make.create<ApplicationData>();
    setField<&ApplicationData::data>(make.builder, core, Blob(Bytes(100)));
    make.node("n", kRootNode, core);
    const ObjectId data = committer.apply(make.builder.take()).value().ids[0].second;
    Aspect replica;
    BlobStore blobs;
    std::vector<Blob> held;
    const auto frame = [&] {
        const CommittedFrame closed = committer.closeFrame();
        // As it comes over a wire: arrays of ranges are made there.
        const Expected<ChangeList> list = decodeChangeList(encodeChangeList(*closed.list), blobs);
        ASSERT_TRUE(list) << list.error().message;
        const Expected<void> applied = replica.apply(*list);
        ASSERT_TRUE(applied) << applied.error().message;
        ASSERT_EQ(replica.stateHash(), closed.sent->stateHash);
    };
    for (const Blob& blob : blobsOf(snapshot(committer.scene()))) held.push_back(blobs.add(blob));
    ASSERT_NO_FATAL_FAILURE(frame());
    const auto edit = [&](std::uint64_t offset, std::byte value, Committer::Inverse inverse) {
        ChangeListBuilder builder;
        builder.setRange(data, typeOf<ApplicationData>(), fieldId<&ApplicationData::data>, offset,
                         Blob(Bytes(10, value)));
        return committer.apply(builder.take(), inverse).value();
    };
    const Committer::Applied persons = edit(0, std::byte{1}, Committer::Inverse::kMade);
    (void)edit(50, std::byte{2}, Committer::Inverse::kNone);
    ASSERT_NO_FATAL_FAILURE(frame());
    ASSERT_TRUE(committer.applyInverse(std::make_shared<const ChangeList>(persons.inverse)));
    ASSERT_NO_FATAL_FAILURE(frame());
    Bytes left(100);
    std::fill_n(left.begin() + 50, 10, std::byte{2});
    EXPECT_EQ(committer.scene().get<ApplicationData>(data)->data, Blob(left));
}

TEST(Committer, ASingleListIsHandedOnAsItIs) {
    Committer committer;
    ListMaker make;
    make.node("a", kRootNode, make.transform(Vec3d::Ones()));
    const Committer::Applied applied = committer.apply(make.builder.take()).value();
    EXPECT_EQ(committer.closeFrame().list, applied.list) << "the very same";
    ASSERT_EQ(applied.ids.size(), 2u);
    EXPECT_EQ(applied.list->creations[0].id, applied.ids[0].second) << "numbered";
    EXPECT_EQ(committer.closeFrame().list, nullptr);
}

TEST(Committer, AListThatSaysNothingIsNoFrame) {
    Committer committer;
    ChangeList hollow;
    hollow.columns.push_back(
        FieldColumn::ofShape(typeOf<Transform>(), fieldId<&Transform::translation>, FieldKind::kDouble, 3));
    ASSERT_TRUE(committer.apply(hollow));
    const CommittedFrame frame = committer.closeFrame();
    EXPECT_EQ(frame.list, nullptr);
    EXPECT_EQ(frame.sent->sequence, Sequence(0));
}

TEST(Committer, TheWayBackIsMadeWhereItIsAskedForOnly) {
    Committer committer;
    ListMaker make, again;
    make.node("a", kRootNode);
    again.node("b", kRootNode);
    EXPECT_TRUE(committer.apply(make.builder.take()).value().inverse.empty());
    const StateHash before = committer.scene().stateHash();
    const Committer::Applied applied = committer.apply(again.builder.take(), Committer::Inverse::kMade).value();
    (void)committer.closeFrame();
    ASSERT_TRUE(committer.applyInverse(std::make_shared<const ChangeList>(applied.inverse)));
    EXPECT_EQ(committer.scene().stateHash(), before);
}

/// A box whose indices are replaced, whose positions are taken away, that is new, that goes in the same list.
TEST(Committer, AGeometryIsJudgedByWhatTheListLeavesBehind) {
    Committer committer;
    ListMaker make;
    const ObjectId placeholder = make.box(Vec3d::Ones());
    const Committer::Applied made = committer.apply(make.builder.take()).value();
    ASSERT_EQ(made.ids.front().first, placeholder);
    const ObjectId box = made.ids.front().second;
    const ObjectType type = typeOf<Geometry>();
    const StateHash before = committer.scene().stateHash();
    const auto tryOut = [&](auto&& fill) {
        ChangeListBuilder builder;
        fill(builder);
        const Expected<Committer::Applied> applied = committer.apply(builder.take());
        if (!applied) {
            EXPECT_WORDS(applied.error().message);
            EXPECT_EQ(committer.scene().stateHash(), before) << "no trace";
        }
        return applied.has_value();
    };
    const std::uint32_t wild[3] = {0, 1, 1'000'000}, tame[3] = {0, 1, 2};
    const Blob wildIndices = Blob::of(std::span<const std::uint32_t>(wild)),
               tameIndices = Blob::of(std::span<const std::uint32_t>(tame));
    EXPECT_FALSE(tryOut([&](auto& b) { b.set(box, type, fieldId<&Geometry::indices>, wildIndices); }));
    EXPECT_FALSE(tryOut([&](auto& b) { b.set(box, type, fieldId<&Geometry::positions>, Blob()); }))
        << "indices of nothing";
    EXPECT_FALSE(tryOut([&](auto& b) {
        const ObjectId fresh{kFirstPlaceholder};
        b.create(fresh, type);
        b.set(fresh, type, fieldId<&Geometry::indices>, tameIndices);
    })) << "a new one";
    EXPECT_TRUE(tryOut([&](auto& b) {
        b.set(box, type, fieldId<&Geometry::indices>, wildIndices);
        b.destroy(box);
    })) << "it goes in the same list";
}

// What a material names may not be more than it can have, and the scene stays as it was.
TEST(Committer, AMaterialHasAtMostFourLayers) {
    Committer committer;
    const auto layersOf = [](ListMaker& make, std::size_t count) {
        RefList layers;
        for (std::size_t i = 0; i < count; ++i) layers.push_back(make.create<TextureLayer>());
        return layers;
    };
    ListMaker make;
    const ObjectId placeholder = make.create<Material>();
    setField<&Material::layers>(make.builder, placeholder, layersOf(make, Material::kMostLayers));
    const Committer::Applied applied = committer.apply(make.builder.take()).value();
    const auto numbered = std::ranges::find(applied.ids, placeholder, [](const auto& pair) { return pair.first; });
    ASSERT_NE(numbered, applied.ids.end());
    const ObjectId material = numbered->second;
    const auto hash = committer.scene().stateHash();
    ListMaker more;
    setField<&Material::layers>(more.builder, material, layersOf(more, Material::kMostLayers + 1));
    const auto refused = committer.apply(more.builder.take());
    ASSERT_FALSE(refused);
    EXPECT_WORDS(refused.error().message);
    EXPECT_EQ(committer.scene().stateHash(), hash);
    ListMaker fewer;
    setField<&Material::layers>(fewer.builder, material, RefList());
    setField<&Material::shininess>(fewer.builder, material, 3.0f);
    EXPECT_TRUE(committer.apply(fewer.builder.take()));
}

TEST(Committer, PointsAreJudgedByWhatTheListLeavesBehind) {
    Committer committer;
    ListMaker make;
    (void)make.box(Vec3d::Ones());
    const ObjectId box = committer.apply(make.builder.take()).value().ids.front().second;
    const ObjectType type = typeOf<Geometry>();
    const auto tryOut = [&](auto&& fill) {
        ChangeListBuilder builder;
        fill(builder);
        const StateHash before = committer.scene().stateHash();
        const Expected<Committer::Applied> applied = committer.apply(builder.take());
        if (applied) return std::string();
        EXPECT_EQ(committer.scene().stateHash(), before) << "no trace";
        return applied.error().message;
    };
    const Blob indices = committer.scene().get<Geometry>(box)->indices;
    const auto become = [&](std::int64_t primitive) {
        return [&, primitive](auto& b) { b.set(box, type, fieldId<&Geometry::primitive>, toValue(primitive)); };
    };
    const auto have = [&](const Blob& blob) {
        return [&, blob](auto& b) { b.set(box, type, fieldId<&Geometry::indices>, blob); };
    };
    EXPECT_WORDS(tryOut(become(Geometry::kPoints)));
    EXPECT_EQ(tryOut([&](auto& b) {
                  become(Geometry::kPoints)(b);
                  have({})(b);
              }),
              "");
    EXPECT_WORDS(tryOut(have(indices)));
    const auto radius = [&](double value) {
        return [&, value](auto& b) { b.set(box, type, fieldId<&Geometry::pointRadius>, toValue(value)); };
    };
    EXPECT_WORDS(tryOut(radius(-1)));
    EXPECT_EQ(tryOut(radius(2)), "");
    const float wild[] = {std::numeric_limits<float>::infinity()};
    EXPECT_WORDS(tryOut([&](auto& b) {
        b.setRange(box, type, fieldId<&Geometry::positions>, 24, Blob::of(std::span<const float>(wild)));
    }));
    EXPECT_EQ(tryOut([&](auto& b) {
                  become(Geometry::kTriangles)(b);
                  have(indices)(b);
              }),
              "")
        << "back to what it was";
}

// What alters looks alone may make no sense either.
TEST(Committer, AVolumeIsJudgedByItsTransferFunctionToo) {
    Committer committer;
    ChangeListBuilder builder;
    const ObjectId volume = ObjectId{kFirstPlaceholder};
    builder.create(volume, typeOf<Volume>());
    const ObjectId id = committer.apply(builder.take()).value().ids.front().second;
    const auto low = [&](double value) {
        ChangeListBuilder edit;
        edit.set(id, typeOf<Volume>(), fieldId<&Volume::low>, toValue(value));
        return committer.apply(edit.take());
    };
    const Expected<Committer::Applied> refused = low(300);
    ASSERT_FALSE(refused);
    EXPECT_WORDS(refused.error().message);
    EXPECT_TRUE(low(200));
}

}  // namespace
}  // namespace tessera

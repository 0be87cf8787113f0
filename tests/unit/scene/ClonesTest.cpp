#include "common/cores/Animation.h"
#include "common/cores/Interest.h"
#include "common/scene/Clones.h"

#include "tests/unit/scene/SceneEdits.h"

namespace tessera {
namespace {

/// The next ids, in the order of the placeholders.
ObjectId clonedInto(Aspect& aspect, ObjectId node, const CloneOptions& options) {
    Expected<Clone> clone = cloneList(aspect, node, options);
    EXPECT_TRUE(clone) << clone.error().message;
    if (!clone) return {};
    const std::uint64_t first = aspect.nextFreeId();
    const auto given = [&](ObjectId id) {
        return isPlaceholder(id) ? ObjectId(id.value - kFirstPlaceholder + first) : id;
    };
    replaceIds(clone->list, given);
    mustApply(aspect, clone->list);
    return given(clone->node);
}

TEST(Clones, NodesAreNewAndCoresAreTheSame) {
    Aspect aspect = hall();
    const ObjectId copy = clonedInto(aspect, ObjectId(2), {});
    EXPECT_EQ(pathOf(aspect, copy), "/hall[1]");
    const Node& node = *aspect.get<Node>(copy);
    ASSERT_EQ(node.children.size(), 2u);
    EXPECT_EQ(aspect.get<Node>(node.children[0])->name, "crane");
    EXPECT_EQ(aspect.get<Node>(node.children[0])->core, ObjectId(5));
    EXPECT_EQ(aspect.useCount(ObjectId(6)), 2u);
}

TEST(Clones, ADeepCopyHasItsOwnCoresMaterialsAndReferences) {
    Aspect aspect = hall();
    Edits e;
    e.node(10, "hook again", 2).coreOfNode(10, 6);  // shared inside
    e.node(11, "watch", 2).core<Interest>(12, 11);  // refers inside
    e.value<Interest>(12, fieldId<&Interest::object>, ObjectId(3));
    e.value<Interest>(12, fieldId<&Interest::against>, ObjectId(13));  // and outside
    e.node(13, "floor");
    mustApply(aspect, e.take());
    const ObjectId copy = clonedInto(aspect, ObjectId(2), {.name = "hall of mirrors", .deep = true});
    EXPECT_EQ(pathOf(aspect, copy), "/hall of mirrors");
    const auto child = [&](std::size_t i) -> const Node& {
        return *aspect.get<Node>(aspect.get<Node>(copy)->children[i]);
    };
    EXPECT_NE(child(1).core, ObjectId(6));
    EXPECT_EQ(child(1).core, child(2).core) << "a core shared inside stays shared inside";
    EXPECT_NE(aspect.coreOf<Geometry>(child(1))->material, ObjectId(7));
    const Interest& watch = *aspect.coreOf<Interest>(child(3));
    EXPECT_EQ(watch.object, aspect.get<Node>(copy)->children[0]);
    EXPECT_EQ(watch.against, ObjectId(13));
    EXPECT_EQ(aspect.coreOf<Transform>(child(0))->translation, Vec3d(1, 2, 3));
}

TEST(Clones, WhatKeyFramesMoveIsTheCopysOwnWhereItIsInsideAndStaysWhereNot) {
    Aspect aspect = hall();
    Edits e;
    e.node(10, "clock", 2).core<Animation>(11, 10);
    e.core<KeyFrames>(12).core<KeyFrames>(13).core<Material>(14);
    e.value<Animation>(11, fieldId<&Animation::channels>, RefList{ObjectId(12), ObjectId(13)});
    e.value<KeyFrames>(12, fieldId<&KeyFrames::target>, ObjectId(5));
    e.value<KeyFrames>(13, fieldId<&KeyFrames::target>, ObjectId(14));
    mustApply(aspect, e.take());
    const ObjectId copy = clonedInto(aspect, ObjectId(2), {.deep = true});
    const Node& hallCopy = *aspect.get<Node>(copy);
    const Animation& film = *aspect.coreOf<Animation>(*aspect.get<Node>(hallCopy.children[2]));
    ASSERT_EQ(film.channels.size(), 2u);
    EXPECT_NE(film.channels[0], ObjectId(12));
    EXPECT_EQ(aspect.get<KeyFrames>(film.channels[0])->target, aspect.get<Node>(hallCopy.children[0])->core);
    EXPECT_EQ(aspect.get<KeyFrames>(film.channels[1])->target, ObjectId(14)) << "a material that nothing inside wears";
}

TEST(Clones, AShareListNamesTypesObjectsAndNodesForTheirCores) {
    {
        Aspect aspect = hall();
        const ObjectId copy = clonedInto(aspect, ObjectId(2), {.deep = true, .shareTypes = {typeOf<Material>()}});
        const Node& hook = *aspect.get<Node>(aspect.get<Node>(copy)->children[1]);
        EXPECT_NE(hook.core, ObjectId(6));
        EXPECT_EQ(aspect.coreOf<Geometry>(hook)->material, ObjectId(7));
    }
    for (const std::uint64_t shared : {4u, 6u}) {  // the node, and its core
        Aspect aspect = hall();
        const ObjectId copy = clonedInto(aspect, ObjectId(2), {.deep = true, .shareObjects = {ObjectId(shared)}});
        EXPECT_EQ(aspect.get<Node>(aspect.get<Node>(copy)->children[1])->core, ObjectId(6));
        EXPECT_NE(aspect.get<Node>(aspect.get<Node>(copy)->children[0])->core, ObjectId(5));
    }
}

TEST(Clones, WhatCannotBeIsRefusedInWords) {
    const Aspect aspect = hall();
    const auto refusal = [&](std::uint64_t node, const CloneOptions& options) {
        const Expected<Clone> clone = cloneList(aspect, ObjectId(node), options);
        EXPECT_FALSE(clone);
        return clone ? Error{} : clone.error();
    };
    EXPECT_EQ(refusal(1, {}).code, ErrorCode::kRefused);
    EXPECT_EQ(refusal(2, {.under = ObjectId(2)}).message, "/hall cannot be copied into itself");
    EXPECT_EQ(refusal(2, {.under = ObjectId(4)}).code, ErrorCode::kRefused);
    EXPECT_EQ(refusal(5, {}).code, ErrorCode::kNotFound) << "a core is no node";
    EXPECT_EQ(refusal(2, {.under = ObjectId(99)}).code, ErrorCode::kNotFound);
    EXPECT_EQ(refusal(2, {.deep = true, .shareObjects = {ObjectId(99)}}).code, ErrorCode::kNotFound);
    EXPECT_EQ(refusal(2, {.deep = true, .shareTypes = {typeOf<Node>()}}).code, ErrorCode::kUsage);
    EXPECT_EQ(refusal(2, {.deep = true, .shareTypes = {ObjectType(4999)}}).code, ErrorCode::kUsage);
    EXPECT_EQ(refusal(2, {.shareTypes = {typeOf<Material>()}}).code, ErrorCode::kUsage) << "not deep";
    EXPECT_EQ(refusal(2, {.maxChanges = 3}).message,
              "a copy of /hall would take more than 3 changes at once; copy it part by part");
}

}  // namespace
}  // namespace tessera

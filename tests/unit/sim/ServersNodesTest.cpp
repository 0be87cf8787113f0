/// What the server makes to be seen is nobody else's: whichever way an edit comes at it, it is refused, and handles go
/// on following.
#include "common/cores/CollisionObject.h"
#include "common/cores/InverseTransform.h"
#include "server/sim/commit/ServersNodes.h"

#include <gtest/gtest.h>

#include <utility>
#include <vector>

#include "common/scene/Action.h"
#include "common/scene/Clones.h"
#include "common/scene/Edits.h"
#include "common/scene/ServerNodes.h"
#include "server/sim/frame/Simulation.h"
#include "tests/unit/sim/SceneForTests.h"
#include "tests/unit/sim/SingleEdits.h"

namespace tessera {
namespace {

using test::ListMaker;
using test::moveTo;
using test::one;

/// A box on a Transform, its manipulator below a group of its own, and a free node beside them.
struct Bench {
    Bench() {
        ListMaker make;
        const ObjectId box = make.node("box", kRootNode, make.transform(Vec3d(1, 2, 3)));
        make.node("body", box, make.box(Vec3d::Ones()));
        const ObjectId manipulator = make.create<Manipulator>();
        setField<&Manipulator::target>(make.builder, manipulator, box);
        make.node("hand", make.node("hands", kRootNode), manipulator);
        make.node("free", kRootNode, make.transform(Vec3d::Zero()));
        EXPECT_TRUE(simulation.load({make.builder.take()}));
        (void)simulation.step(true, {});
        top = findNode(scene(), "/hands/hand/handles").value();
        (void)simulation.step(false, {});
    }
    [[nodiscard]] const Aspect& scene() const { return simulation.scene(); }
    [[nodiscard]] ObjectId at(const std::string& path) const { return findNode(scene(), path).value(); }
    Expected<answer::Committed> edit(ChangeList list) {
        return simulation.step(false, one(std::move(list))).outcomes.front().result;
    }
    /// Nodes, cores and materials of the handles.
    [[nodiscard]] std::vector<ObjectId> ours() const {
        std::vector<ObjectId> all;
        Action action;
        action.visitHidden(true);
        action.onNode([&](const Visit& visit) {
            all.push_back(visit.nodeId);
            all.push_back(visit.node.core);
            if (const Geometry* geometry = scene().coreOf<Geometry>(visit.node)) all.push_back(geometry->material);
            return Descend::kInto;
        });
        action.run(scene(), top);
        return all;
    }
    /// Refused because it is the server's, with nothing changed.
    void expectRefused(const std::string& what, ChangeList list) {
        const StateHash before = scene().stateHash();
        const Expected<answer::Committed> result = edit(std::move(list));
        ASSERT_FALSE(result) << what;
        EXPECT_NE(result.error().message.find("of the handles of /hands/hand"), std::string::npos)
            << what << ": " << result.error().message;
        EXPECT_EQ(result.error().code, ErrorCode::kRefused) << what;
        EXPECT_EQ(scene().stateHash(), before) << what;
    }
    void expectHandlesFollow() {
        static double x = 1;
        const ObjectId turn = scene().get<Node>(scene().get<Node>(top)->children[0])->core;
        const Vec3d was = scene().get<Transform>(turn)->translation;
        x += 1;
        ASSERT_TRUE(edit(moveTo(scene().get<Node>(at("/box"))->core, Vec3d(x, 2, 3))));
        EXPECT_NE(scene().get<Transform>(turn)->translation, was);
    }

    Simulation simulation;
    ObjectId top;
};

/// Whatever type of object refers, by whichever of its fields, to whichever of theirs.
TEST(ServersNodes, NothingComesToReferToThem) {
    Bench bench;
    std::size_t asked = 0;
    for (const TypeInfo& type : allTypes())
        for (const FieldEntry& field : type.fields) {
            if (!field.holdsRefs()) continue;
            for (const ObjectId ours : bench.ours()) {
                ChangeListBuilder list;
                const ObjectId fresh{kFirstPlaceholder};
                list.create(fresh, type.type);
                if (field.kind == FieldKind::kRef)
                    list.set(fresh, type.type, field.id, ours);
                else
                    list.set(fresh, type.type, field.id, RefList{bench.at("/free"), ours});
                bench.expectRefused(std::string(type.name) + "." + std::string(field.name), list.take());
                ++asked;
            }
        }
    EXPECT_GT(asked, 1000u);
    bench.expectHandlesFollow();
}

TEST(ServersNodes, NothingIsPutBelowThemAndNoneIsMovedOrTakenAway) {
    Bench bench;
    for (const ObjectId ours : bench.ours()) {
        const std::string what = "#" + std::to_string(ours.value);
        ChangeListBuilder gone;
        if (bench.scene().get<Node>(ours)) {
            ChangeListBuilder below, away;
            below.place(bench.at("/free"), ours);
            bench.expectRefused(what, below.take());
            away.place(ours, bench.at("/free"));
            bench.expectRefused(what, away.take());
            const Expected<ChangeList> removal = removalList(bench.scene(), ours);
            ASSERT_TRUE(removal);
            bench.expectRefused(what, *removal);
        }
        gone.destroy(ours);
        bench.expectRefused(what, gone.take());
    }
    Edit part{.ticket = 9, .list = {}, .kind = Edit::Kind::kLastPart, .objects = 1};
    ListMaker make;
    make.node("loaded", bench.top);
    part.list = make.builder.take();
    const Expected<answer::Committed> loaded =
        bench.simulation.step(false, one(std::move(part))).outcomes.front().result;
    ASSERT_FALSE(loaded);
    EXPECT_NE(loaded.error().message.find("of the handles of /hands/hand"), std::string::npos)
        << loaded.error().message;
    bench.expectHandlesFollow();
}

/// Every field of theirs, set to what it is.
TEST(ServersNodes, NoneOfTheirFieldsIsSet) {
    Bench bench;
    for (const ObjectId ours : bench.ours()) {
        const Object object = bench.scene().find(ours);
        for (const FieldEntry& field : object.info().fields) {
            ChangeListBuilder list;
            list.set(ours, object.info().type, field.id, field.load(object));
            bench.expectRefused(std::string(object.info().name) + "." + std::string(field.name), list.take());
        }
        if (const Geometry* geometry = object.as<Geometry>(); geometry && geometry->positions.resident()) {
            ChangeListBuilder list;
            list.setRange(ours, typeOf<Geometry>(), fieldId<&Geometry::positions>, 0, Blob(Bytes(4)));
            bench.expectRefused("a range", list.take());
        }
    }
    bench.expectHandlesFollow();
}

TEST(ServersNodes, WhatTheyBelongToIsCopiedMovedAndTakenAwayAsEver) {
    Bench bench;
    for (const bool deep : {false, true}) {
        for (const ObjectId ours : {bench.top, bench.scene().get<Node>(bench.top)->children[0]})
            for (const ObjectId under : {ObjectId(), bench.at("/free")}) {
                const Expected<Clone> clone = cloneList(bench.scene(), ours, {.under = under, .deep = deep});
                ASSERT_FALSE(clone);
                EXPECT_EQ(clone.error().code, ErrorCode::kRefused);
            }
        EXPECT_FALSE(cloneList(bench.scene(), bench.at("/free"), {.under = bench.top, .deep = deep}));
        const std::size_t before = bench.scene().objectCount();
        const Expected<Clone> clone = cloneList(bench.scene(), bench.at("/hands"), {.name = "copy", .deep = deep});
        ASSERT_TRUE(clone);
        EXPECT_EQ(clone->objects, deep ? 3u : 2u) << "without handles";
        ASSERT_TRUE(bench.edit(clone->list));
        EXPECT_TRUE(findNode(bench.scene(), "/copy/hand/handles")) << "it gets handles of its own";
        EXPECT_EQ(bench.scene().get<Node>(bench.at("/copy/hand"))->children.size(), 1u);
        ASSERT_TRUE(bench.edit(removalList(bench.scene(), bench.at("/copy")).value()));
        EXPECT_EQ(bench.scene().objectCount(), before);
    }
    ChangeListBuilder move;
    move.place(bench.at("/hands"), bench.at("/free"));
    ASSERT_TRUE(bench.edit(move.take()));
    bench.expectHandlesFollow();
    const StateHash before = bench.scene().stateHash();
    ASSERT_TRUE(bench.edit(removalList(bench.scene(), bench.at("/free/hands/hand")).value()));
    EXPECT_FALSE(bench.scene().find(bench.top));
    ASSERT_TRUE(bench.simulation.step(false, one(Edit::Kind::kUndo)).outcomes.front().result);
    EXPECT_EQ(bench.scene().stateHash(), before);
    bench.expectHandlesFollow();
}

/// What is called and built as the server's nodes are is a person's all the same: it is changed, moved, copied, taken
/// away and kept as anything else.
TEST(ServersNodes, NamesAndLooksAreNobodys) {
    Bench bench;
    ListMaker make;
    const ObjectId hand = bench.at("/hands/hand");
    std::vector<ObjectId> mine;
    for (const auto& [name, parent] :
         {std::pair(kHandlesName, hand), {kContactsName, kRootNode}, {kProgramNoticesName, kRootNode}}) {
        ObjectId core;
        if (name == kHandlesName) {
            core = make.create<InverseTransform>();
        } else {
            core = make.create<CollisionObject>();
            setField<&CollisionObject::layers>(make.builder, core, std::int64_t{0});
        }
        const ObjectId node = make.node(std::string(name), parent, core);
        if (name != kHandlesName) setField<&CollisionObject::node>(make.builder, core, node);
        make.node("mine", node, make.box(Vec3d::Ones()));
    }
    ASSERT_TRUE(bench.edit(make.builder.take()));
    for (int frame = 0; frame < 3; ++frame) (void)bench.simulation.step(false, {});
    for (const char* path : {"/contacts/mine", "/program-problems/mine"}) {
        ASSERT_TRUE(findNode(bench.scene(), path)) << path;
        mine.push_back(bench.at(path));
    }
    for (const ObjectId child : bench.scene().get<Node>(hand)->children)
        if (child != bench.top) mine.push_back(bench.scene().get<Node>(child)->children[0]);
    ASSERT_EQ(mine.size(), 3u);
    const StateHash before = bench.scene().stateHash();
    for (const ObjectId node : mine) {
        const ObjectId parent = bench.scene().get<Node>(node)->parent;
        ChangeListBuilder name;
        setField<&Node::name>(name, parent, std::string("else"));
        ASSERT_TRUE(bench.edit(name.take()));
        ASSERT_TRUE(bench.edit(removalList(bench.scene(), parent).value()));
        for (int i = 0; i < 2; ++i)
            ASSERT_TRUE(bench.simulation.step(false, one(Edit::Kind::kUndo)).outcomes.front().result);
        EXPECT_EQ(bench.scene().stateHash(), before);
        EXPECT_TRUE(cloneList(bench.scene(), node, {.under = bench.at("/free"), .deep = true}));
    }
    bench.expectHandlesFollow();
}

/// Whichever way a node comes to bear no manipulator, its handles go in that frame, and undo leads back to what was.
TEST(ServersNodes, HandlesGoWithTheirManipulator) {
    Bench bench;
    const ObjectId hand = bench.at("/hands/hand"), group = bench.at("/hands"),
                   manipulator = bench.scene().get<Node>(hand)->core;
    const auto setCore = [&](ObjectId node, ObjectId core) {
        ChangeListBuilder list;
        setField<&Node::core>(list, node, core);
        ASSERT_TRUE(bench.edit(list.take()));
    };
    const auto below = [&](ObjectId node) { return bench.scene().get<Node>(node)->children.size(); };
    const std::size_t objects = bench.scene().objectCount();
    for (const ObjectId other : {ObjectId(), bench.scene().get<Node>(bench.at("/free"))->core}) {
        setCore(hand, other);
        EXPECT_EQ(below(hand), 0u);
        EXPECT_LT(bench.scene().objectCount(), objects) << "cores and materials go too";
        ASSERT_TRUE(bench.simulation.step(false, one(Edit::Kind::kUndo)).outcomes.front().result);
        EXPECT_EQ(below(hand), 1u);
        EXPECT_EQ(bench.scene().objectCount(), objects);
    }
    const StateHash before = bench.scene().stateHash();
    setCore(group, manipulator);
    EXPECT_EQ(below(group), 2u);
    ASSERT_TRUE(bench.simulation.step(false, one(Edit::Kind::kUndo)).outcomes.front().result);
    EXPECT_EQ(below(group), 1u);
    EXPECT_EQ(bench.scene().stateHash(), before);
}

TEST(ServersNodes, NobodyElseSaysThatANodeIsTheServers) {
    Bench bench;
    for (const bool fresh : {false, true}) {
        ListMaker make;
        const ObjectId node = fresh ? make.node("mine", kRootNode) : bench.at("/free");
        setField<&Node::ofServer>(make.builder, node, true);
        const Expected<answer::Committed> result = bench.edit(make.builder.take());
        ASSERT_FALSE(result);
        EXPECT_NE(result.error().message.find("the server alone says"), std::string::npos) << result.error().message;
    }
}

/// Handles are made anew, with other numbers, for another kind: steps that take them away with their node go on leading
/// there.
TEST(ServersNodes, StepsSurviveHandlesMadeAnew) {
    Bench bench;
    const ObjectId hand = bench.at("/hands/hand");
    ChangeListBuilder kind;
    setField<&Manipulator::kind>(kind, bench.scene().get<Node>(hand)->core, Manipulator::kRotate);
    ASSERT_TRUE(bench.edit(kind.take()));
    ASSERT_TRUE(bench.edit(removalList(bench.scene(), hand).value()));
    const auto ask = [&](Edit::Kind what) {
        const EditOutcome outcome = bench.simulation.step(false, one(what)).outcomes.front();
        EXPECT_TRUE(outcome.result) << outcome.result.error().message;
    };
    for (int round = 0; round < 3; ++round) {
        for (int i = 0; i < 2; ++i) ask(Edit::Kind::kUndo);
        EXPECT_TRUE(findNode(bench.scene(), "/hands/hand/handles"));
        for (int i = 0; i < 2; ++i) ask(Edit::Kind::kRedo);
        EXPECT_FALSE(findNode(bench.scene(), "/hands/hand"));
    }
}

}  // namespace
}  // namespace tessera

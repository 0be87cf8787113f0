/// A manipulator that a list touches has something to move, or the list is refused in words.
#include "common/cores/ComponentTransform.h"
#include "common/cores/DirectionalLight.h"
#include "common/cores/Group.h"
#include "common/cores/Manipulator.h"
#include "common/cores/PointLight.h"
#include "common/cores/SpotLight.h"
#include "server/rules/ManipulatorCheck.h"

#include <gtest/gtest.h>

#include <array>

#include "tests/support/words/Words.h"
#include "tests/unit/sim/SceneForTests.h"

namespace tessera {
namespace {

using test::ListMaker;

/// One node of each kind of core that matters.
struct Cores {
    Cores() {
        ListMaker make;
        const auto add = [&](const char* name, ObjectId core) { (void)make.node(name, kRootNode, core); };
        add("transform", make.create<Transform>());
        add("component", make.create<ComponentTransform>());
        add("point", make.create<PointLight>());
        add("sun", make.create<DirectionalLight>());
        add("spot", make.create<SpotLight>());
        add("group", make.create<Group>());
        add("bare", {});
        add("handles", make.create<Manipulator>());
        ChangeList list = make.builder.take();
        replaceIds(list,
                   [](ObjectId id) { return isPlaceholder(id) ? ObjectId{id.value - kFirstPlaceholder + 10} : id; });
        EXPECT_TRUE(scene.apply(list));
        manipulator = core("/handles");
    }
    [[nodiscard]] ObjectId node(const std::string& path) const { return findNode(scene, path).value(); }
    [[nodiscard]] ObjectId core(const std::string& path) const { return scene.get<Node>(node(path))->core; }
    [[nodiscard]] std::string refusal(const ChangeList& list) const {
        const Sound checked = checkManipulators(scene, list);
        return checked ? std::string() : checked.error().why.message;
    }
    [[nodiscard]] std::string refusal(std::int64_t kind, const std::string& target) const {
        ChangeListBuilder list;
        setField<&Manipulator::kind>(list, manipulator, kind);
        setField<&Manipulator::target>(list, manipulator, node(target));
        return refusal(list.take());
    }
    Aspect scene;
    ObjectId manipulator;
};

TEST(ManipulatorCheck, EachKindWantsItsOwnCores) {
    const Cores cores;
    const std::array<const char*, 7> targets{"/transform", "/component", "/point", "/sun", "/spot", "/group", "/bare"};
    for (std::int64_t kind = Manipulator::kMove; kind <= Manipulator::kSpotLight; ++kind)
        for (const std::string target : targets) {
            const bool pose = target == "/component" || (target == "/transform" && kind != Manipulator::kCenterball);
            const bool right = kind == Manipulator::kPointLight         ? target == "/point"
                               : kind == Manipulator::kDirectionalLight ? target == "/sun"
                               : kind == Manipulator::kSpotLight        ? target == "/spot"
                                                                        : pose;
            EXPECT_EQ(cores.refusal(kind, target).empty(), right)
                << kind << " at " << target << ": " << cores.refusal(kind, target);
        }
    EXPECT_WORDS(cores.refusal(Manipulator::kCenterball, "/transform"));
    EXPECT_WORDS(cores.refusal(Manipulator::kMove, "/bare"));
    EXPECT_WORDS(cores.refusal(Manipulator::kSpotLight, "/sun"));
}

TEST(ManipulatorCheck, WhatCountsIsWhatTheListLeavesBehind) {
    const Cores cores;
    // The target gets its core in the same list.
    ChangeListBuilder both;
    const ObjectId fresh{kFirstPlaceholder};
    both.create(fresh, typeOf<Transform>());
    setField<&Node::core>(both, cores.node("/bare"), fresh);
    setField<&Manipulator::target>(both, cores.manipulator, cores.node("/bare"));
    EXPECT_EQ(cores.refusal(both.take()), "");
    // And loses it.
    ChangeListBuilder loses;
    setField<&Node::core>(loses, cores.node("/transform"), ObjectId());
    setField<&Manipulator::target>(loses, cores.manipulator, cores.node("/transform"));
    EXPECT_NE(cores.refusal(loses.take()), "");
    // Another kind alone is judged by the target that is there: there is none.
    ChangeListBuilder kind;
    setField<&Manipulator::kind>(kind, cores.manipulator, Manipulator::kSpotLight);
    EXPECT_EQ(cores.refusal(kind.take()), "");
    // What is destroyed by the same list need not be right.
    ChangeListBuilder gone;
    setField<&Manipulator::target>(gone, cores.manipulator, cores.node("/bare"));
    gone.destroy(cores.manipulator);
    EXPECT_EQ(cores.refusal(gone.take()), "");
    // Other edits of a manipulator say nothing of its target.
    ChangeListBuilder size;
    setField<&Manipulator::size>(size, cores.manipulator, 2.0);
    EXPECT_EQ(cores.refusal(size.take()), "");
}

}  // namespace
}  // namespace tessera

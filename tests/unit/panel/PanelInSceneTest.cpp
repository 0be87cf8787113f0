// What a panel reaches in a scene, and nothing else.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <limits>

#include "common/cores/Interest.h"
#include "common/cores/Node.h"
#include "common/cores/PointLight.h"
#include "common/cores/SpotLight.h"
#include "common/cores/Transform.h"
#include "common/scene/FieldTable.h"
#include "server/panel/PanelInScene.h"
#include "tests/support/words/Words.h"

namespace tessera {
namespace {

constexpr ObjectId kLamp{10}, kLight{11}, kCart{12}, kPlace{13}, kOther{14}, kOtherLight{15}, kWatch{16}, kWatched{17};

class PanelReaches : public testing::Test {
protected:
    PanelReaches() {
        ChangeListBuilder list;
        const auto node = [&](ObjectId id, const std::string& name, ObjectId core, ObjectType type) {
            list.create(core, type);
            list.create(id, typeOf<Node>());
            setField<&Node::name>(list, id, name);
            setField<&Node::core>(list, id, core);
            list.place(id, kRootNode);
        };
        node(kLamp, "lamp", kLight, typeOf<PointLight>());
        node(kCart, "cart", kPlace, typeOf<Transform>());
        node(kOther, "other", kOtherLight, typeOf<PointLight>());
        node(kWatch, "watch", kWatched, typeOf<Interest>());
        EXPECT_TRUE(scene.apply(list.take()));
    }
    static Panel read(const std::string& text) {
        Expected<Panel> panel = parsePanel(text, "x.panel");
        EXPECT_TRUE(panel) << panel.error().message;
        return panel ? *panel : Panel();
    }
    /// Whether it may write that.
    template <auto kMember>
    bool may(ObjectId id, const typename FieldMember<decltype(kMember)>::Type& value) {
        ChangeListBuilder list;
        setField<kMember>(list, id, value);
        return !PanelInScene(panel, scene).whyNot(list.take());
    }

    Aspect scene;
    Panel panel = read(R"(title: "Hall"
controls { label: "bright" node: "/lamp" field: "intensity" slider { least: 0.1 greatest: 0.7 } }
controls { label: "on" node: "/lamp" field: "on" toggle {} }
controls { label: "colour" node: "/lamp" field: "color" colour {} }
controls { label: "name" node: "/cart" field: "name" text { bytes: 3 } }
controls { label: "place" node: "/cart" field: "translation"
  choice { options { value: "0 0 0" } options { value: "0.1 -2 3e0" } } }
controls { label: "dark" press { sets { node: "/lamp" field: "intensity" value: "0" } } }
)");
};

TEST_F(PanelReaches, WhatItsControlsGive) {
    ASSERT_TRUE(PanelInScene(panel, scene).faults().empty()) << PanelInScene(panel, scene).faults().front();
    for (const float good : {0.1f, 0.3f, 0.7f, 0.0f, -0.0f})
        EXPECT_TRUE(may<&PointLight::intensity>(kLight, good)) << good;
    for (const float bad : {0.05f, 0.70001f, -1.0f, 1e9f, std::numeric_limits<float>::infinity(),
                            std::numeric_limits<float>::quiet_NaN()})
        EXPECT_FALSE(may<&PointLight::intensity>(kLight, bad)) << bad;
    EXPECT_TRUE(may<&PointLight::on>(kLight, false));
    EXPECT_TRUE(may<&PointLight::color>(kLight, Vec3f(1, 0, 0.5f)));
    EXPECT_FALSE(may<&PointLight::color>(kLight, Vec3f(1, 0, 1.5f)));
    EXPECT_TRUE(may<&Node::name>(kCart, "abc"));
    EXPECT_FALSE(may<&Node::name>(kCart, "abcd"));
    EXPECT_TRUE(may<&Transform::translation>(kPlace, Vec3d(0.1, -2, 3)));
    EXPECT_FALSE(may<&Transform::translation>(kPlace, Vec3d(0.1, -2, 3.01)));
}

TEST_F(PanelReaches, NothingElse) {
    EXPECT_FALSE(may<&PointLight::range>(kLight, 1.0f)) << "another field";
    EXPECT_FALSE(may<&PointLight::intensity>(kOtherLight, 0.5f)) << "another node's";
    EXPECT_FALSE(may<&Node::name>(kLamp, "a"));
    EXPECT_FALSE(may<&Node::core>(kCart, kLight));
    const auto refuses = [&](const auto& say) {
        ChangeListBuilder list;
        say(list);
        return PanelInScene(panel, scene).whyNot(list.take()).has_value();
    };
    EXPECT_TRUE(refuses([](ChangeListBuilder& list) { list.destroy(kOtherLight); }));
    EXPECT_TRUE(refuses([](ChangeListBuilder& list) { list.place(kCart, kLamp); }));
    EXPECT_TRUE(refuses([](ChangeListBuilder& list) { list.create(ObjectId(kFirstPlaceholder), typeOf<Node>()); }));
    EXPECT_TRUE(refuses([](ChangeListBuilder& list) {  // one good value hides no bad one
        setField<&PointLight::intensity>(list, kLight, 0.5f);
        setField<&PointLight::intensity>(list, kOtherLight, 0.5f);
    }));
    ChangeListBuilder known;
    setField<&PointLight::intensity>(known, kLight, 0.5f);
    ChangeList list = known.take();
    list.columns[0].type = typeOf<SpotLight>();  // a field of that number, of another type
    EXPECT_TRUE(PanelInScene(panel, scene).whyNot(list));
    list.columns[0].type = typeOf<PointLight>();
    list.columns[0].ids = {ObjectId(999)};
    EXPECT_TRUE(PanelInScene(panel, scene).whyNot(list)) << "nothing";
}

TEST_F(PanelReaches, EachControlIsToldWhereItLeads) {
    const PanelInScene there(panel, scene);
    ASSERT_EQ(there.controls().size(), panel.controls.size());
    const PanelInScene::Target& bright = there.controls()[0].targets.at(0);
    EXPECT_EQ(bright.object, kLight);
    EXPECT_EQ(bright.node, kLamp);
    EXPECT_EQ(bright.field->name, "intensity");
    EXPECT_FALSE(bright.value);
    EXPECT_EQ(there.controls()[3].targets.at(0).object, kCart) << "a field of the node itself";
    const std::vector<PanelInScene::Target>& places = there.controls()[4].targets;
    ASSERT_EQ(places.size(), 2u);
    EXPECT_EQ(std::get<Doubles>(*places[1].value).values[0], 0.1);

    // Of two options one is none: the other one is still there, at its place.
    const Panel half = read(R"(controls {
  label: "x" node: "/lamp" field: "on" choice { options { value: "maybe" } options { value: "false" } }
}
controls { label: "y" node: "/gone" field: "on" toggle {} })");
    const PanelInScene in(half, scene);
    EXPECT_EQ(in.controls()[0].targets.at(0).field, nullptr);
    EXPECT_EQ(in.controls()[0].targets.at(1).value, std::optional<FieldValue>(false));
    EXPECT_WORDS(in.controls()[0].fault);
    EXPECT_EQ(in.controls()[1].fault, "there is no /gone now") << "and no word about other nodes";
    EXPECT_WORDS(in.faults().back());  // whoever checks a file is told what there is
}

TEST_F(PanelReaches, WhatHasComeToStandAtItsPath) {
    ChangeListBuilder list;
    setField<&Node::name>(list, kLamp, std::string("old"));
    setField<&Node::name>(list, kOther, std::string("lamp"));
    ASSERT_TRUE(scene.apply(list.take()));
    EXPECT_TRUE(may<&PointLight::intensity>(kOtherLight, 0.5f));
    EXPECT_FALSE(may<&PointLight::intensity>(kLight, 0.5f));
}

TEST_F(PanelReaches, ControlsThatAreNothingHereAreNamed) {
    const auto faults = [&](const std::string& control) {
        const Panel one = read("controls { label: \"x\" " + control + "}");
        const PanelInScene there(one, scene);
        return there.faults().empty() ? "" : there.faults().front();
    };
    EXPECT_WORDS(faults(R"(node: "/lamb" field: "on" toggle {})"));
    EXPECT_WORDS(faults(R"(node: "/lamp" field: "of" toggle {})"));
    EXPECT_WORDS(faults(R"(node: "/lamp" field: "color" slider { greatest: 1 })"));
    EXPECT_WORDS(faults(R"(node: "/lamp" field: "color" toggle {})"));
    EXPECT_WORDS(faults(R"(node: "/lamp" field: "intensity" colour {})"));
    EXPECT_WORDS(faults(R"(node: "/lamp" field: "on" text {})"));
    EXPECT_WORDS(faults(R"(node: "/lamp" field: "ofServer" toggle {})"));
    EXPECT_WORDS(faults(R"(node: "/lamp" field: "core" choice { options { value: "#3" } })"));
    EXPECT_WORDS(faults(R"(press { sets { node: "/cart" field: "translation" value: "1 2" } })"));
    EXPECT_WORDS(faults(R"(press { sets { node: "/lamp" field: "intensity" value: "-1" } })"));
    // Beyond what a number may be: read as far as it goes it would be 0.
    constexpr std::string_view kBright = R"(press {{ sets {{ node: "/lamp" field: "intensity" value: "{}" }} }})";
    for (const char* number : {"1e999", "-1e999", "1e-999", "1e300", "inf", "nan"})
        EXPECT_NE(faults(fmt::format(kBright, number)), "") << number;
    EXPECT_WORDS(faults(R"(press { sets { node: "/cart" field: "translation" value: "1e999 0 0" } })"));
    EXPECT_WORDS(faults(R"(node: "/watch" field: "response" choice { options { value: "99999999999999999999" } })"));
    EXPECT_EQ(faults(R"(press { sets { node: "/lamp" field: "intensity" value: "1" } })"), "");
}

}  // namespace
}  // namespace tessera

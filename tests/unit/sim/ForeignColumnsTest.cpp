/// Proposals with values of another kind than their field has: refused in words, beside whatever the server itself adds
/// to a list before it is applied.
#include <gtest/gtest.h>

#include <array>

#include "common/cores/Text.h"
#include "common/scene/WrittenByServer.h"
#include "server/sim/frame/Simulation.h"
#include "tests/unit/sim/SceneForTests.h"
#include "tests/unit/sim/SingleEdits.h"

namespace tessera {
namespace {

/// A column of a shape, with one value for one object.
FieldColumn columnOf(ObjectType type, FieldId field, FieldKind kind, std::uint8_t width, ObjectId object) {
    FieldColumn column = FieldColumn::ofShape(type, field, kind, width);
    column.ids = {object};
    std::visit([&](auto& values) { values.resize(width); }, column.values);
    return column;
}

/// A crane that a motion drives, another thing that one drives, and a text.
struct DrivenStage {
    DrivenStage() {
        test::ListMaker make;
        for (const char* name : {"crane", "other"}) {
            const ObjectId place = make.transform(Vec3d::Zero());
            make.node("hook", make.node(name, kRootNode, place), make.box(Vec3d::Ones()));
            make.node(std::string(name) + " motion", kRootNode, make.motion(place, {{0, 0, 0, 0}, {1e5, 1e5, 0, 0}}));
        }
        const ObjectId text = make.create<Text>();
        setField<&Text::text>(make.builder, text, "words");
        make.node("sign", kRootNode, text);
        EXPECT_TRUE(simulation.load({make.builder.take()}));
        (void)simulation.step(true, {});
    }
    [[nodiscard]] ObjectId coreOf(const std::string& path) const {
        const Aspect& scene = simulation.scene();
        return scene.get<Node>(findNode(scene, path).value())->core;
    }
    /// Returns a person's edit of the crane, which pauses its motion, and of the text, which is set anew.
    [[nodiscard]] ChangeList handling() const {
        ChangeListBuilder said;
        setField<&Transform::translation>(said, coreOf("/crane"), Vec3d(5, 0, 0));
        setField<&Text::text>(said, coreOf("/sign"), "other words");
        return said.take();
    }
    [[nodiscard]] Expected<answer::Committed> propose(ChangeList list) {
        return simulation.step(false, test::one(std::move(list))).outcomes.at(0).result;
    }
    Simulation simulation;
};

void replaceColumn(ChangeList& list, FieldColumn column) {
    std::erase_if(list.columns,
                  [&](const FieldColumn& other) { return other.type == column.type && other.field == column.field; });
    list.columns.push_back(std::move(column));
}

TEST(ForeignColumns, OfThePlayingOfAMotionThatAnEditPauses) {
    DrivenStage stage;
    ChangeList list = stage.handling();
    replaceColumn(list, columnOf(typeOf<Motion>(), fieldId<&Motion::playing>, FieldKind::kDouble, 1,
                                 stage.coreOf("/other motion")));
    const auto answer = stage.propose(std::move(list));
    ASSERT_FALSE(answer);
    EXPECT_EQ(answer.error().code, ErrorCode::kBadInput);
    EXPECT_TRUE(stage.propose(stage.handling())) << "and the next one is taken";
}

TEST(ForeignColumns, OfTheOutlinesOfATextThatAnEditSetsAnew) {
    DrivenStage stage;
    ChangeList list = stage.handling();
    replaceColumn(list, columnOf(typeOf<Text>(), fieldId<&Text::outlines>, FieldKind::kInt, 1, ObjectId(77)));
    const auto answer = stage.propose(std::move(list));
    ASSERT_FALSE(answer);
    EXPECT_EQ(answer.error().code, ErrorCode::kBadInput);
}

TEST(ForeignColumns, OfAnyFieldInAnyOtherShape) {
    DrivenStage stage;
    std::size_t refused = 0;
    for (const TypeInfo& type : allTypes())
        for (const FieldEntry& field : type.fields)
            for (std::size_t kind = 0; kind < kFieldKinds; ++kind)
                for (const std::uint8_t width : {1, 3, 4}) {
                    const auto other = static_cast<FieldKind>(kind);
                    if (width > 1 && other != FieldKind::kFloat && other != FieldKind::kDouble) continue;
                    if (other == field.kind && width == field.width) continue;
                    ChangeList list = stage.handling();
                    replaceColumn(list, columnOf(type.type, field.id, other, width, stage.coreOf("/other motion")));
                    const auto answer = stage.propose(std::move(list));
                    ASSERT_FALSE(answer) << type.name << "." << field.name << " as " << nameOf(other) << width;
                    EXPECT_EQ(answer.error().code, ErrorCode::kBadInput) << answer.error().message;
                    ++refused;
                }
    EXPECT_GT(refused, 1000u);
    EXPECT_TRUE(stage.propose(stage.handling()));
}

/// The list says of one object that it is of two types. Who gathers what a list says of an object must not write a
/// field of one type into an object of the other: it may lie behind its end.
TEST(ForeignColumns, OfOneObjectAsTwoTypes) {
    DrivenStage stage;
    const std::array objects = {stage.coreOf("/crane/hook"), stage.coreOf("/sign"), ObjectId(100'000)};
    const auto say = [](ChangeListBuilder& list, const TypeInfo& type, ObjectId object) {
        for (const FieldEntry& field : type.fields)
            if (!fieldOfServer(type.type, field.id))
                list.set(object, type.type, field.id, field.load(type.freshObject()));
    };
    std::size_t refused = 0;
    const auto expectRefusal = [&](ChangeListBuilder list, const TypeInfo& one, const TypeInfo& other) {
        const auto answer = stage.propose(list.take());
        ASSERT_FALSE(answer) << one.name << " and " << other.name;
        EXPECT_FALSE(answer.error().message.empty());
        ++refused;
    };
    for (const TypeInfo& one : allTypes())
        for (const TypeInfo& other : allTypes()) {
            if (&one == &other || one.fields.empty() || other.fields.empty()) continue;
            const ObjectId object = objects[refused % objects.size()];
            ChangeListBuilder both;
            say(both, one, object);
            say(both, other, object);
            ASSERT_NO_FATAL_FAILURE(expectRefusal(std::move(both), one, other));
            for (const FieldEntry& field : other.fields) {
                if (field.kind != FieldKind::kBlob) continue;
                ChangeListBuilder range;
                say(range, one, object);
                range.setRange(object, other.type, field.id, std::uint64_t{1} << 40, Blob(Bytes(8)));
                ASSERT_NO_FATAL_FAILURE(expectRefusal(std::move(range), one, other));
            }
        }
    EXPECT_GT(refused, 3000u);
    EXPECT_TRUE(stage.propose(stage.handling()));
}

}  // namespace
}  // namespace tessera

#include "server/text/TextFields.h"

#include <gtest/gtest.h>

#include "tests/unit/scene/SceneEdits.h"

namespace tessera {
namespace {

std::vector<std::string> ignoredNotes;

Expected<void> set(ChangeList& list, const Aspect& scene) {
    Typesetter typesetter;
    return setTexts(list, scene, typesetter, ignoredNotes);
}

Edits saying(std::uint64_t id, const std::string& text) {
    Edits edits;
    edits.value<Text>(id, fieldId<&Text::text>, toValue(text));
    return edits;
}

TextOutlines outlinesIn(const Aspect& scene, std::uint64_t id) {
    const Expected<TextOutlines> made = TextOutlines::of(scene.get<Text>(ObjectId(id))->outlines);
    return made ? *made : TextOutlines();
}

TEST(TextFields, AnEditOfATextBringsItsOutlinesAndTakesThemBack) {
    Aspect scene = hall();
    Edits first = saying(20, "Hello");
    first.core<Text>(20);
    ChangeList list = first.take();
    ASSERT_TRUE(set(list, scene));
    mustApply(scene, list);
    EXPECT_EQ(outlinesIn(scene, 20).letters.size(), 5u);
    const auto before = scene.stateHash();

    list = saying(20, "Hi").take();
    ASSERT_TRUE(set(list, scene));
    const Expected<ChangeList> back = scene.applyWithInverse(list);
    ASSERT_TRUE(back);
    EXPECT_EQ(outlinesIn(scene, 20).letters.size(), 2u);
    mustApply(scene, *back);
    EXPECT_EQ(scene.stateHash(), before) << "one step back is text and letters";
    EXPECT_EQ(outlinesIn(scene, 20).letters.size(), 5u);
}

TEST(TextFields, OnlyWhatLettersFollowSetsThemAnew) {
    Aspect scene = hall();
    ChangeList list = saying(20, "Hello").core<Text>(20).take();
    ASSERT_TRUE(set(list, scene));
    mustApply(scene, list);
    Edits size;
    size.value<Text>(20, fieldId<&Text::size>, toValue(3.0)).value<Text>(20, fieldId<&Text::depth>, toValue(0.5));
    list = size.take();
    const ChangeList asItWas = list;
    ASSERT_TRUE(set(list, scene));
    EXPECT_EQ(list, asItWas);
    Edits right;
    right.value<Text>(20, fieldId<&Text::alignment>, toValue(Text::kRight));
    list = right.take();
    ASSERT_TRUE(set(list, scene));
    mustApply(scene, list);
    EXPECT_LT(outlinesIn(scene, 20).letters[0].at.x, 0) << "set with the text that stands";
    ChangeList other = Edits().node(30, "other").take();
    const ChangeList same = other;
    ASSERT_TRUE(set(other, scene));
    EXPECT_EQ(other, same);
}

TEST(TextFields, OutlinesThatComeAlongStay) {
    Aspect scene = hall();
    Typesetter typesetter;
    Text saved;
    saved.text = "Saved elsewhere";
    const Blob outlines = typesetter.set(saved, ignoredNotes)->toBlob();
    Edits edits;
    edits.core<Text>(20).core<Text>(21);
    edits.value<Text>(20, fieldId<&Text::text>, toValue(std::string("in another font")))
        .value<Text>(20, fieldId<&Text::outlines>, toValue(outlines));
    edits.value<Text>(21, fieldId<&Text::text>, toValue(std::string("four")));
    ChangeList list = edits.take();
    ASSERT_TRUE(set(list, scene));
    mustApply(scene, list);
    EXPECT_EQ(scene.get<Text>(ObjectId(20))->outlines, outlines);
    EXPECT_EQ(outlinesIn(scene, 21).letters.size(), 4u);
}

TEST(TextFields, WhatCannotBeSetIsRefusedAndChangesNothing) {
    const Aspect scene = hall();
    ChangeList list = saying(20, "bad \xFF").core<Text>(20).take();
    const ChangeList asItWas = list;
    const Expected<void> refused = set(list, scene);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().message, "Text #20: the text is no UTF-8: its byte 4 begins no character");
    EXPECT_EQ(list, asItWas);
}

}  // namespace
}  // namespace tessera

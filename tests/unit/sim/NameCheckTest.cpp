/// Names of nodes are lines.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include "common/cores/Transform.h"
#include "server/rules/NameCheck.h"
#include "server/sim/commit/Committer.h"
#include "tests/support/words/Words.h"

namespace tessera {
namespace {

constexpr ObjectId kNamed{kFirstPlaceholder};

std::string refusalOf(const std::string& name) {
    Committer committer;
    ChangeListBuilder builder;
    builder.create(kNamed, typeOf<Node>());
    builder.set(kNamed, typeOf<Node>(), fieldId<&Node::name>, FieldValue(name));
    builder.place(kNamed, kRootNode);
    const auto applied = committer.apply(builder.take());
    return applied ? "" : applied.error().message;
}

std::string utf8Of(char32_t point) {
    const auto byte = [](char32_t bits) { return static_cast<char>(bits); };
    if (point < 0x80) return {byte(point)};
    if (point < 0x800) return {byte(0xC0 | point >> 6), byte(0x80 | (point & 0x3F))};
    if (point < 0x10000)
        return {byte(0xE0 | point >> 12), byte(0x80 | (point >> 6 & 0x3F)), byte(0x80 | (point & 0x3F))};
    return {byte(0xF0 | point >> 18), byte(0x80 | (point >> 12 & 0x3F)), byte(0x80 | (point >> 6 & 0x3F)),
            byte(0x80 | (point & 0x3F))};
}

TEST(NameCheck, AnEditCannotBreakTheLinesOfAList) {
    EXPECT_EQ(refusalOf("crane 1"), "");
    EXPECT_EQ(refusalOf(""), "");
    EXPECT_EQ(refusalOf("Kräne → 起重机"), "");
    for (const char* name : {"a\nb", "\ra", "a\t", "\x1b[2J", "a\x7f", "a\u0085", "\u009b31m", "a\u2028b", "\u2029"})
        EXPECT_WORDS(refusalOf(name));
    EXPECT_WORDS(refusalOf("a\xff\n"));
}

/// A saved scene whose root had a name came back a level deeper: every path in it was another one.
TEST(NameCheck, TheRootHasNone) {
    Committer committer;
    const auto renamed = [&](const std::string& name) {
        ChangeListBuilder builder;
        builder.set(kRootNode, typeOf<Node>(), fieldId<&Node::name>, FieldValue(name));
        const auto applied = committer.apply(builder.take(), Committer::Inverse::kMade);
        return applied ? "" : applied.error().message;
    };
    EXPECT_EQ(renamed("hall"),
              "Node #1: it is the root, which has no name: all paths begin there; name a node below it");
    EXPECT_EQ(committer.scene().root().name, "");
    EXPECT_EQ(renamed(""), "") << "it is so already";
}

/// With a core, and so a place of its own, it came back a level deeper too. What has one from an earlier version may
/// lose it.
TEST(NameCheck, TheRootHasNoCore) {
    Aspect old;
    ChangeListBuilder builder;
    builder.create(ObjectId{7}, typeOf<Transform>());
    builder.set(kRootNode, typeOf<Node>(), fieldId<&Node::core>, ObjectId{7});
    ASSERT_TRUE(old.apply(builder.take()));
    Committer committer;
    committer.goOnFrom(std::move(old), Sequence(3));
    const auto given = [&](ObjectId core) {
        builder.set(kRootNode, typeOf<Node>(), fieldId<&Node::core>, core);
        const auto applied = committer.apply(builder.take(), Committer::Inverse::kMade);
        return applied ? "" : applied.error().message;
    };
    EXPECT_EQ(
        given(ObjectId{7}),
        "Node #1: it is the root, which has no core: all places and paths begin there; give it to a node below it");
    EXPECT_EQ(given(ObjectId{}), "");
    EXPECT_EQ(committer.scene().root().core, ObjectId{});
    EXPECT_WORDS(given(ObjectId{7}));
    builder.create(kNamed, typeOf<Transform>());
    EXPECT_WORDS(given(kNamed));
}

TEST(NameCheck, OfEveryCharacterItIsSaidWhetherItIsOneAndWhatStandsForItIsNone) {
    for (char32_t point = 0; point <= 0x10FFFF; ++point) {
        if (point >= 0xD800 && point <= 0xDFFF) continue;
        const bool control = point < 0x20 || (point >= 0x7F && point < 0xA0) || point == 0x2028 || point == 0x2029;
        const std::string name = "a" + utf8Of(point) + "z";
        ASSERT_EQ(isOneLine(name), !control) << fmt::format("U+{:04X}", static_cast<std::uint32_t>(point));
        ASSERT_EQ(asOneLine(name), control ? "a?z" : name)
            << fmt::format("U+{:04X}", static_cast<std::uint32_t>(point));
    }
    for (int first = 0x80; first < 0x100; ++first)
        for (const char* rest : {"", "\n", "a", "\x80"})
            EXPECT_TRUE(isOneLine(asOneLine(std::string(1, static_cast<char>(first)) + rest)));
}

}  // namespace
}  // namespace tessera

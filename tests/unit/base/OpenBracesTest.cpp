#include "common/base/OpenBraces.h"

#include <gtest/gtest.h>

namespace tessera {
namespace {

std::string namesOf(std::string_view text, int line, int column) {
    std::string names;
    for (const OpenBrace& brace : openBraces(text, line, column))
        names += (names.empty() ? "" : " ") + brace.name + "@" + std::to_string(brace.line);
    return names;
}

TEST(OpenBraces, AreThoseThatNobodyHasClosed) {
    const std::string_view text = "node {\n  name: \"} {\"  # }\n  transform { scale: 1 }\n  geometry: {\n";
    EXPECT_EQ(namesOf(text, 0, 0), "");
    EXPECT_EQ(namesOf(text, 0, 5), "") << "the one at the place itself is not before it";
    EXPECT_EQ(namesOf(text, 1, 0), "node@0");
    EXPECT_EQ(namesOf(text, 2, 0), "node@0") << "of texts and comments none counts";
    EXPECT_EQ(namesOf(text, 2, 20), "node@0 transform@2");
    EXPECT_EQ(namesOf(text, 9, 0), "node@0 geometry@3");
    EXPECT_EQ(namesOf("a { \"\\\"{\" b <\n", 1, 0), "a@0 b@0");
    EXPECT_EQ(namesOf("\ta {\n\t\tb {", 1, 18), "a@0") << "a tab is eight wide at most";
    EXPECT_EQ(namesOf("}}}} {", 1, 0), "@0") << "more are closed than were open";
    EXPECT_EQ(namesOf("a { \"never ends\n b {", 2, 0), "a@0 b@1");
    EXPECT_LE(openBraces(std::string(1'000'000, '{'), 1, 0).size(), 10'000u);
}

TEST(OpenBraces, AreNamedForPeople) {
    EXPECT_EQ(askForBrace({"transform", 2}), "is the '{' of transform in line 3 closed?");
    EXPECT_EQ(endsInside({"", 0}), "the file ends here, and the '{' in line 1 is not closed");
}

}  // namespace
}  // namespace tessera

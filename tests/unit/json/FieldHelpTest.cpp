/// Each type and each of its fields has a sentence.
#include "common/json/FieldHelp.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "common/scene/FieldTable.h"

namespace tessera {
namespace {

void expectSentence(std::string_view help, const std::string& of) {
    ASSERT_FALSE(help.empty()) << of << " has none";
    EXPECT_EQ(help.back(), '.') << of;
    EXPECT_TRUE(help.front() >= 'A' && help.front() <= 'Z') << of << ": " << help;
    EXPECT_LE(std::count(help.begin(), help.end(), ' '), 24) << of << ": " << help;
}

TEST(FieldHelp, SaysWhatEachFieldIsFor) {
    for (const TypeInfo& type : allTypes()) {
        expectSentence(helpOfType(type.name), std::string(type.name));
        for (const FieldEntry& field : type.fields)
            expectSentence(helpOfField(type.name, field.name), std::string(type.name) + "." + std::string(field.name));
    }
    EXPECT_EQ(helpOfType("Nothing"), "");
    EXPECT_EQ(helpOfField("Material", "nothing"), "");
}

}  // namespace
}  // namespace tessera

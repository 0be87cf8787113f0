/// What descriptions of requests, answers and notices have to be.
#include <gtest/gtest.h>

#include <cctype>
#include <map>
#include <set>
#include <string>

#include "common/request/Catalogue.h"
#include "common/request/Requests.h"

namespace tessera {
namespace {

/// Fields are written in the order in which they are described, which has to be protobuf's: that of their numbers.
void expectSound(std::string_view owner, const std::vector<MemberText>& members, bool isRecord) {
    int last = 0;
    bool parts = false;
    std::set<std::string> names;
    for (const MemberText& member : members) {
        if (member.type == "reserved") continue;
        EXPECT_TRUE(names.insert(member.name).second) << owner << " has two members " << member.name;
        for (const char c : member.name)
            EXPECT_TRUE(std::islower(c) || std::isdigit(c) || c == '_') << owner << "." << member.name;
        if (isRecord || member.isPart) {
            EXPECT_EQ(member.number, 0) << owner << "." << member.name << " is no field of a head";
        } else {
            EXPECT_GT(member.number, last) << owner << "." << member.name;
            last = member.number;
        }
        EXPECT_FALSE(parts && !member.isPart) << owner << "." << member.name << " stands behind a part";
        parts = parts || member.isPart;
        if (!member.members.empty()) expectSound(member.type, member.members, isRecord || member.isPart);
    }
}

TEST(Descriptions, NumberFieldsUpwardsAndNameThemOnce) {
    for (const RequestText& request : allRequests()) expectSound(request.info.name, request.members, false);
    for (const ToldText& answer : allAnswers()) expectSound(answer.info.name, answer.members, false);
    for (const ToldText& notice : allNotices()) expectSound(notice.info.name, notice.members, false);
}

TEST(Descriptions, HaveANumberANameAndALineOfHelpEach) {
    std::set<int> numbers(kFormerRequests.begin(), kFormerRequests.end());
    std::set<std::string_view> names;
    ASSERT_GE(allRequests().size(), 15u);
    for (const RequestText& request : allRequests()) {
        EXPECT_TRUE(numbers.insert(request.info.number).second)
            << request.info.name << " has a number that another has, or had";
        EXPECT_TRUE(names.insert(request.info.name).second) << request.info.name;
        EXPECT_GT(request.info.help.size(), 10u) << request.info.name;
        EXPECT_FALSE(request.info.help.ends_with('.')) << request.info.name;
    }
    for (const ToldText& answer : allAnswers()) EXPECT_FALSE(answer.info.help.empty()) << answer.info.name;
    for (const ToldText& notice : allNotices()) EXPECT_FALSE(notice.info.help.empty()) << notice.info.name;
}

void expectHelp(std::string_view owner, const std::vector<MemberText>& members) {
    for (const MemberText& member : members) {
        EXPECT_FALSE(member.help.empty() && !member.name.empty()) << owner << "." << member.name << " says nothing";
        expectHelp(member.type, member.members);
    }
}

TEST(Descriptions, SayWhatEachMemberIsFor) {
    for (const RequestText& request : allRequests()) expectHelp(request.info.name, request.members);
    for (const ToldText& answer : allAnswers()) expectHelp(answer.info.name, answer.members);
    for (const ToldText& notice : allNotices()) expectHelp(notice.info.name, notice.members);
}

/// What a type is made of; empty: it is one that everybody knows.
std::string contentOf(const MemberText& member) {
    std::string content;
    for (const MemberText& each : member.members) content += each.name + " " + each.type + "; ";
    return content;
}

void expectOneMeaning(const std::vector<MemberText>& members, std::map<std::string, std::string>& contents) {
    for (const MemberText& member : members) {
        const auto [known, isNew] = contents.emplace(member.type, contentOf(member));
        EXPECT_EQ(known->second, contentOf(member)) << "two types are called " << member.type;
        expectOneMeaning(member.members, contents);
    }
}

/// Clients in other languages know types by their names alone.
TEST(Descriptions, GiveNoTwoTypesOneName) {
    std::map<std::string, std::string> contents;
    for (const char* known :
         {"bool", "word", "double", "text", "Place", "Vector", "Rotation", "bytes", "fixed64", "reserved", "int8",
          "int16", "int32", "int64", "uint8", "uint16", "uint32", "uint64", "float"})
        contents[known] = "";
    const std::size_t atFirst = contents.size();
    for (const RequestText& request : allRequests()) expectOneMeaning(request.members, contents);
    for (const ToldText& answer : allAnswers()) expectOneMeaning(answer.members, contents);
    for (const ToldText& notice : allNotices()) expectOneMeaning(notice.members, contents);
    EXPECT_GT(contents.size(), atFirst + 20);
    EXPECT_EQ(contents.count("NodePlace"), 1u);
}

/// A viewer changes nothing; what changes the scene or the view is an editor's, but for files, which an operator loads.
TEST(Descriptions, GiveEachRequestOneRole) {
    for (const RequestText& request : allRequests()) {
        const bool changes = request.info.changes != Changes::kNothing;
        EXPECT_FALSE(changes && request.info.role == Role::kViewer) << request.info.name;
        EXPECT_TRUE(request.info.role != Role::kOperator || !changes ||
                    request.info.number == request::LoadFile::kInfo.number)
            << request.info.name;
        EXPECT_FALSE(request.info.bringsArrays && request.info.role == Role::kViewer) << request.info.name;
    }
}

}  // namespace
}  // namespace tessera

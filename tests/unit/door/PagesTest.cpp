/// The page that describes the API.
#include "server/door/Pages.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <set>
#include <string>

#include <nlohmann/json.hpp>

#include "common/json/ApiJson.h"
#include "common/request/Catalogue.h"
#include "common/scene/FieldTable.h"
#include "common/scene/WrittenByServer.h"

namespace tessera {
namespace {

void expectMembers(const std::string& part, const std::vector<MemberText>& members, const std::string& within) {
    for (const MemberText& member : members) {
        if (member.isRest || member.name.empty()) continue;
        const std::string name = within + std::string(member.name);
        EXPECT_NE(part.find("<tr><td>" + name + "</td>"), std::string::npos) << name;
        expectMembers(part, member.members, name + (member.many ? "[]." : "."));
    }
}

/// From its heading to the next one.
std::string partOf(const std::string& page, std::string_view name) {
    const std::size_t from = page.find("<h2 id=\"" + std::string(name) + "\">");
    if (from == std::string::npos) return {};
    return page.substr(from, page.find("<h", from + 3) - from);
}

TEST(ApiPage, HasEachRequestAnswerAndNoticeWithAllTheirMembers) {
    const std::string page = apiPage("<wall>").body;
    EXPECT_EQ(page.find("<wall>"), std::string::npos);
    for (const RequestText& request : allRequests()) {
        SCOPED_TRACE(request.info.name);
        expectMembers(partOf(page, request.info.name), request.members, "");
    }
    for (const ToldText& told : allAnswers()) {
        SCOPED_TRACE(told.info.name);
        expectMembers(partOf(page, told.info.name), told.members, "");
    }
    const std::string notices = page.substr(page.find("<h1>Notices</h1>"));
    for (const ToldText& told : allNotices()) {
        SCOPED_TRACE(told.info.name);
        EXPECT_NE(notices.find(">" + std::string(told.info.name) + "<"), std::string::npos);
        expectMembers(partOf(page, told.info.name), told.members, "");
    }
    EXPECT_NE(page.find("<td>ray.direction</td>"), std::string::npos);
}

/// Who offers fields to be edited leaves out what would be refused.
TEST(ApiPage, MarksWhatTheServerAloneWrites) {
    const Json types = typesJson()["types"];
    ASSERT_EQ(types.size(), allTypes().size());
    std::set<std::string> marked;
    for (std::size_t t = 0; t < types.size(); ++t) {
        const TypeInfo& type = allTypes()[t];
        ASSERT_EQ(types[t]["fields"].size(), type.fields.size());
        for (std::size_t f = 0; f < type.fields.size(); ++f) {
            const Json& field = types[t]["fields"][f];
            const std::string name = fmt::format("{}.{}", type.name, type.fields[f].name);
            EXPECT_EQ(field.contains("written_by"), fieldOfServer(type.type, type.fields[f].id) != nullptr) << name;
            if (!field.contains("written_by")) continue;
            EXPECT_EQ(field["written_by"], "server") << name;
            marked.insert(name);
        }
    }
    for (const char* name : {"Node.ofServer", "Node.levels", "Inline.state", "Movie.problem", "Manipulator.held"})
        EXPECT_TRUE(marked.contains(name)) << name;
    EXPECT_FALSE(marked.contains("Transform.translation"));
}

}  // namespace
}  // namespace tessera

#include "client/ctl/RequestsText.h"

#include <nlohmann/json.hpp>

#include "client/ctl/Answer.h"
#include "client/ctl/TextTable.h"
#include "client/ctl/WireText.h"
#include "common/base/Version.h"
#include "common/request/Catalogue.h"
#include "common/request/Requests.h"

namespace tessera {
namespace {

using Json = nlohmann::ordered_json;

Json fieldsJson(const std::vector<MemberText>& members);

Json fieldJson(const MemberText& member) {
    Json json{{"name", member.name}};
    const auto say = [&](const char* key, const auto& value, bool says) {
        if (says) json[key] = value;
    };
    say("number", member.number, member.number > 0);
    json["type"] = member.type;
    say("unit", member.unit, !member.unit.empty());
    if (member.least) json["least"] = *member.least;
    if (member.greatest) json["greatest"] = *member.greatest;
    if (member.orElse) json["or"] = *member.orElse;
    say("bounds", member.bounds, !member.bounds.empty());
    say("words", member.words, !member.words.empty());
    say("help", member.help, !member.help.empty());
    say("when", member.when, !member.when.empty());
    say("optional", true, member.optional);
    say("many", true, member.many);
    say("part", true, member.isPart);
    say("rest", true, member.isRest);
    say("bytes", member.bytes, member.bytes > 0);
    say("count", member.count, member.count > 1);
    if (!member.members.empty()) json["fields"] = fieldsJson(member.members);
    return json;
}

Json fieldsJson(const std::vector<MemberText>& members) {
    Json fields = Json::array();
    for (const MemberText& member : members) fields.push_back(fieldJson(member));
    return fields;
}

Json toldJson(std::span<const ToldText> told, std::uint8_t ToldInfo::*number) {
    Json all = Json::array();
    for (const ToldText& each : told)
        all.push_back({{"number", each.info.*number},
                       {"name", each.info.name},
                       {"help", each.info.help},
                       {"fields", fieldsJson(each.members)}});
    return all;
}

}  // namespace

std::string requestsText() {
    TextTable table({"NUMBER", "REQUEST", "ROLE", "CHANGES", "ANSWER", "HELP"});
    for (const RequestText& request : allRequests()) {
        const RequestInfo& info = request.info;
        table.add({std::to_string(info.number), std::string(info.name), std::string(nameOf(info.role)),
                   info.changes == Changes::kNothing ? "-" : std::string(nameOf(info.changes)),
                   std::string(request.answer) + (info.answered == Answered::kLater ? ", later" : ""),
                   std::string(info.help)});
    }
    return table.text();
}

std::string requestsJson() {
    Json requests = Json::array();
    for (const RequestText& request : allRequests()) {
        const RequestInfo& info = request.info;
        requests.push_back({{"number", info.number},
                            {"name", info.name},
                            {"role", nameOf(info.role)},
                            {"changes", nameOf(info.changes)},
                            {"answer", request.answer},
                            {"stays_open", info.answered == Answered::kLater},
                            {"brings_arrays", info.bringsArrays},
                            {"help", info.help},
                            {"fields", fieldsJson(request.members)}});
    }
    return jsonLine({{"protocol", kProtocolVersion},
                     {"requests", std::move(requests)},
                     {"answers", toldJson(allAnswers(), &ToldInfo::answer)},
                     {"notices", toldJson(allNotices(), &ToldInfo::notice)},
                     {"former", kFormerRequests},
                     {"wire", wireJson()}});
}

}  // namespace tessera

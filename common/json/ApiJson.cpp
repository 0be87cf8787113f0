#include "common/json/ApiJson.h"

#include <fmt/format.h>
#include <cmath>
#include <nlohmann/json.hpp>

#include "common/base/Hash.h"
#include "common/base/Version.h"
#include "common/json/ChangeJson.h"
#include "common/json/FieldHelp.h"
#include "common/request/Catalogue.h"
#include "common/request/Requests.h"
#include "common/scene/FieldTable.h"
#include "common/scene/WrittenByServer.h"

namespace tessera {
namespace {

// ---- requests

Json fieldsJson(const std::vector<MemberText>& members);

Json fieldJson(const MemberText& member) {
    Json json{{"name", member.name}};
    const auto say = [&](const char* key, const auto& value, bool says) {
        if (says) json[key] = value;
    };
    say("number", member.number, member.number > 0);
    json["type"] = member.type;
    if (member.holds == Holds::kChanges) json["holds"] = "changes";
    if (member.holds == Holds::kPicture) json["holds"] = "png";
    if (member.holds == Holds::kJpeg) json["holds"] = "jpeg";
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

// ---- types

Json fieldJson(const TypeInfo& type, const FieldEntry& field) {
    Json json = {
        {"name", field.name},   {"number", field.id.value},         {"kind", nameOf(field.kind)},
        {"width", field.width}, {"unit", nameOf(field.measuredIn)}, {"help", helpOfField(type.name, field.name)}};
    if (field.numbersEach > 0) json[field.doubles ? "doubles_each" : "floats_each"] = field.numbersEach;
    if (field.integersEach > 0) json[fmt::format("uint{}_each", 8 * field.integerBytes)] = field.integersEach;
    if (field.holdsRefs()) json["to"] = targetName(field);
    json["default"] = valueJson(field.load(type.freshObject()));
    if (std::isfinite(field.least)) json["least"] = field.least;
    if (std::isfinite(field.greatest)) json["greatest"] = field.greatest;
    if (field.wordUse == WordUse::kFlags) json["flags"] = true;
    if (field.wordUse != WordUse::kNone)
        for (const FieldWord& word : field.words()) json["words"][std::string(word.word)] = word.number;
    if (const FieldOfServer* known = fieldOfServer(type.type, field.id)) {
        json["written_by"] = "server";
        if (!known->instead.empty()) json["instead"] = known->instead;
    }
    return json;
}

}  // namespace

std::string_view targetName(const FieldInfo& field) {
    if (field.refType) return findType(*field.refType)->name;
    return field.anyObject ? "anything" : "any core";
}

Json requestsJson() {
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
                            {"own_link", info.ownLink},
                            {"help", info.help},
                            {"example", Json::parse(info.example)},
                            {"fields", fieldsJson(request.members)}});
    }
    return {{"protocol", kProtocolVersion},
            {"requests", std::move(requests)},
            {"answers", toldJson(allAnswers(), &ToldInfo::answer)},
            {"notices", toldJson(allNotices(), &ToldInfo::notice)},
            {"former", kFormerRequests}};
}

Json typesJson() {
    Json types = Json::array();
    for (const TypeInfo& type : allTypes()) {
        Json fields = Json::array();
        for (const FieldEntry& field : type.fields) fields.push_back(fieldJson(type, field));
        types.push_back({{"name", type.name},
                         {"number", type.type.value},
                         {"core", type.isCore},
                         {"help", helpOfType(type.name)},
                         {"fields", std::move(fields)}});
    }
    return {{"schema", toHex(schemaHash())}, {"types", std::move(types)}};
}

Json apiJson() {
    Json api{{"api", kApiVersion},
             {"version", versionText("Tessera")},
             {"rules",
              "Requests, answers, notices, types and fields may come; a program leaves alone what it does not know. "
              "None goes, changes its meaning or "
              "gets narrower bounds without a higher number of `api`. A field that is not said has its default."},
             {"errors", Json::array()}};
    for (int code = 0; code <= static_cast<int>(ErrorCode::kFailed); ++code)
        api["errors"].push_back(wordOf(static_cast<ErrorCode>(code)));
    api.update(requestsJson());
    api.update(typesJson());
    return api;
}

}  // namespace tessera

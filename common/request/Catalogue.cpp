#include "common/request/Catalogue.h"

#include <algorithm>

#include "common/request/Check.h"
#include "common/request/MemberHelp.h"
#include "common/request/Said.h"

namespace tessera {
namespace {

std::vector<MemberText> membersTextOf(const Description& of, bool inRecord, int before = 0);

std::string typeText(const ValueType& type) {
    switch (type.kind) {
        case ValueKind::kBool:
            return "bool";
        case ValueKind::kWord:
            return "word";
        case ValueKind::kNumber:
            return "double";
        case ValueKind::kText:
            return "text";
        case ValueKind::kPlace:
            return "Place";
        case ValueKind::kVector:
            return "Vector";
        case ValueKind::kRotation:
            return "Rotation";
        case ValueKind::kBytes:
            return "bytes";
        case ValueKind::kRow:
            return typeText(*type.each);
        case ValueKind::kValue:
            return std::string(type.described->name);
        case ValueKind::kSigned:
            return "int" + std::to_string(8 * type.bytes);
        case ValueKind::kUnsigned:
            break;
    }
    return "uint" + std::to_string(8 * type.bytes);
}

/// Of one member by itself.
MemberText textOfMember(const MemberEntry& m, bool inRecord, int number) {
    MemberText text{.number = number, .name = std::string(m.name), .type = typeText(m.held)};
    text.unit = m.unit;
    text.help = m.help;
    text.when = m.whenText;
    if (m.bounds.any()) {
        text.bounds = textOf(m.bounds);
        if (m.bounds.least != -NumberBounds::kNone) text.least = m.bounds.least;
        if (m.bounds.greatest != NumberBounds::kNone) text.greatest = m.bounds.greatest;
        text.orElse = m.bounds.orElse;
    }
    text.optional = m.manner == Manner::kOptional;
    text.many = m.manner == Manner::kMany;
    text.words.assign(m.held.words.begin(), m.held.words.end());
    if (m.form == MemberForm::kFixed) text.type = "fixed64";
    const bool isRecord = inRecord || (m.form == MemberForm::kPart && m.held.kind != ValueKind::kBytes);
    if (m.held.kind == ValueKind::kValue) text.members = membersTextOf(*m.held.described, isRecord);
    if (m.held.kind == ValueKind::kRow) text.count = m.held.bytes / m.held.each->bytes;
    if (isRecord) text.bytes = m.held.recordBytes;
    text.isPart = m.form == MemberForm::kPart || m.form == MemberForm::kRest;
    text.isRest = m.form == MemberForm::kRest;
    text.holds = m.holds;
    return text;
}

/// `first` and `second`, behind a flag where there is one.
void addNumbers(std::vector<MemberText>& texts, const MemberEntry& m, bool inRecord, int number) {
    MemberText text = textOfMember(m, inRecord, number);
    text.optional = false;
    if (!m.flag.empty()) {
        texts.push_back({.number = number++, .name = std::string(m.flag), .type = "bool"});
        text.when = "where there is one";
    }
    text.type = "double";
    text.number = number;
    texts.push_back(text);
    text.number = number + 1;
    text.name = m.second;
    text.help.clear();
    texts.push_back(std::move(text));
}

std::vector<MemberText> membersTextOf(const Description& of, bool inRecord, int before) {
    std::vector<MemberText> texts;
    for (const MemberEntry& m : of.members) {
        if (m.form == MemberForm::kReserved) {
            texts.push_back({.name = "", .type = "reserved", .bytes = m.held.recordBytes});
        } else if (m.form == MemberForm::kSpread) {
            for (MemberText& inner : membersTextOf(*m.held.described, inRecord, before + m.number - 1)) {
                if (!m.whenText.empty()) inner.when = m.whenText;
                texts.push_back(std::move(inner));
            }
        } else if (m.form == MemberForm::kNumbers) {
            addNumbers(texts, m, inRecord, before + m.number);
        } else {
            texts.push_back(textOfMember(m, inRecord, inRecord || m.number == 0 ? 0 : before + m.number));
        }
    }
    return texts;
}

/// What a description leaves unsaid.
std::vector<MemberText> explained(std::string_view owner, std::vector<MemberText> members) {
    for (MemberText& member : members) {
        member.members = explained(member.type, std::move(member.members));
        if (member.help.empty() && !member.name.empty()) member.help = memberHelp(owner, member.name);
    }
    return members;
}

template <typename Text, typename Variant>
std::vector<Text> textsOf(Text (*made)(const SaidKind<Variant>&)) {
    std::vector<SaidKind<Variant>> kinds(kindsOf<Variant>().begin(), kindsOf<Variant>().end());
    std::ranges::sort(kinds, {}, &SaidKind<Variant>::number);
    std::vector<Text> all;
    for (const SaidKind<Variant>& kind : kinds) all.push_back(made(kind));
    return all;
}
template <typename Variant>
ToldText toldText(const SaidKind<Variant>& kind) {
    return {*kind.told, explained(kind.name, membersTextOf(*kind.description, false))};
}

}  // namespace

std::span<const RequestText> allRequests() {
    static const std::vector<RequestText> all =
        textsOf<RequestText, ApplicationRequest>([](const SaidKind<ApplicationRequest>& kind) {
            return RequestText{*kind.info, kind.answer, explained(kind.name, membersTextOf(*kind.description, false))};
        });
    return all;
}
std::span<const ToldText> allAnswers() {
    static const std::vector<ToldText> all = textsOf<ToldText, ApplicationAnswer>(toldText);
    return all;
}
std::span<const ToldText> allNotices() {
    static const std::vector<ToldText> all = textsOf<ToldText, ApplicationNotice>(toldText);
    return all;
}

std::string_view nameOf(Changes changes) {
    constexpr std::array<std::string_view, 3> kNames{"nothing", "scene", "view"};
    return kNames[static_cast<std::size_t>(changes)];
}

}  // namespace tessera

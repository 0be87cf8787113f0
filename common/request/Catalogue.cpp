#include "common/request/Catalogue.h"

#include <algorithm>

#include "common/request/Check.h"
#include "common/request/MemberHelp.h"
#include "common/request/Requests.h"

namespace tessera {
namespace {

template <HasMembers T, bool InRecord>
std::vector<MemberText> membersTextOf(int before);

template <typename T>
std::string typeText() {
    constexpr ValueKind kind = valueKindOf<T>();
    if constexpr (kind == ValueKind::kBool)
        return "bool";
    else if constexpr (kind == ValueKind::kWord)
        return "word";
    else if constexpr (kind == ValueKind::kNumber)
        return "double";
    else if constexpr (kind == ValueKind::kText)
        return "text";
    else if constexpr (kind == ValueKind::kPlace)
        return "Place";
    else if constexpr (kind == ValueKind::kVector)
        return "Vector";
    else if constexpr (kind == ValueKind::kRotation)
        return "Rotation";
    else if constexpr (kind == ValueKind::kBytes)
        return "bytes";
    else if constexpr (kind == ValueKind::kRow)
        return typeText<typename T::value_type>();
    else if constexpr (kind == ValueKind::kValue)
        return std::string(nameOfDescribed<T>());
    else
        return (kind == ValueKind::kSigned ? "int" : "uint") + std::to_string(8 * sizeof(T));
}

/// Of one member by itself.
template <bool InRecord, typename M>
MemberText textOfMember(const M& m, int number) {
    using Held = HeldType<M>;
    MemberText text{.number = number, .name = std::string(m.name), .type = typeText<Held>()};
    text.unit = m.unit;
    text.help = m.help;
    text.when = m.whenText;
    if (m.bounds.any()) {
        text.bounds = textOf(m.bounds);
        if (m.bounds.least != -NumberBounds::kNone) text.least = m.bounds.least;
        if (m.bounds.greatest != NumberBounds::kNone) text.greatest = m.bounds.greatest;
        text.orElse = m.bounds.orElse;
    }
    text.optional = kIsOptional<typename M::Type>;
    text.many = kIsMany<typename M::Type>;
    if constexpr (std::is_enum_v<Held>) text.words.assign(WordsOf<Held>::kWords.begin(), WordsOf<Held>::kWords.end());
    if constexpr (M::kForm == MemberForm::kFixed) text.type = "fixed64";
    constexpr bool kIsRecord = InRecord || (M::kForm == MemberForm::kPart && valueKindOf<Held>() != ValueKind::kBytes);
    if constexpr (HasMembers<Held>) text.members = membersTextOf<Held, kIsRecord>(0);
    if constexpr (valueKindOf<Held>() == ValueKind::kRow) text.count = std::tuple_size_v<Held>;
    if constexpr (kIsRecord) text.bytes = sizeInRecord<Held>();
    text.isPart = M::kForm == MemberForm::kPart || M::kForm == MemberForm::kRest;
    text.isRest = M::kForm == MemberForm::kRest;
    text.holds = m.holds;
    return text;
}

template <HasMembers T, bool InRecord>
std::vector<MemberText> membersTextOf(int before) {
    std::vector<MemberText> texts;
    forEachMember<T>([&]<typename M>(const M& m) {
        if constexpr (M::kForm == MemberForm::kReserved) {
            texts.push_back({.name = "", .type = "reserved", .bytes = M::kBytes});
        } else if constexpr (M::kForm == MemberForm::kSpread) {
            for (MemberText& inner : membersTextOf<typename M::Type, InRecord>(before + m.number - 1)) {
                if (!m.whenText.empty()) inner.when = m.whenText;
                texts.push_back(std::move(inner));
            }
        } else if constexpr (M::kForm == MemberForm::kNumbers) {
            int number = before + m.number;
            MemberText text = textOfMember<InRecord>(m, number);
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
        } else {
            texts.push_back(textOfMember<InRecord>(m, InRecord || m.number == 0 ? 0 : before + m.number));
        }
    });
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

template <typename... R>
std::vector<RequestText> requestsOf(std::type_identity<std::variant<R...>>) {
    std::vector<RequestText> all{
        {R::kInfo, R::Answer::kInfo.name, explained(R::kInfo.name, membersTextOf<R, false>(0))}...};
    std::ranges::sort(all, {}, [](const RequestText& request) { return request.info.number; });
    return all;
}
template <std::uint8_t ToldInfo::*Number, typename... A>
std::vector<ToldText> toldOf(std::type_identity<std::variant<A...>>) {
    std::vector<ToldText> all{{A::kInfo, explained(A::kInfo.name, membersTextOf<A, false>(0))}...};
    std::ranges::sort(all, {}, [](const ToldText& told) { return told.info.*Number; });
    return all;
}

}  // namespace

std::span<const RequestText> allRequests() {
    static const std::vector<RequestText> all = requestsOf(std::type_identity<ApplicationRequest>{});
    return all;
}
std::span<const ToldText> allAnswers() {
    static const std::vector<ToldText> all = toldOf<&ToldInfo::answer>(std::type_identity<ApplicationAnswer>{});
    return all;
}
std::span<const ToldText> allNotices() {
    static const std::vector<ToldText> all = toldOf<&ToldInfo::notice>(std::type_identity<ApplicationNotice>{});
    return all;
}

std::string_view nameOf(Changes changes) {
    constexpr std::array<std::string_view, 3> kNames{"nothing", "scene", "view"};
    return kNames[static_cast<std::size_t>(changes)];
}

}  // namespace tessera

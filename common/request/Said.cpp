#include "common/request/Said.h"

#include <algorithm>
#include <array>

namespace tessera {
namespace {

template <typename A, typename Variant>
SaidKind<Variant> kindOf() {
    SaidKind<Variant> kind{.description = &descriptionOf<A>(),
                           .make = [](Variant& said) -> void* { return &said.template emplace<A>(); }};
    kind.name = A::kInfo.name;
    if constexpr (std::is_same_v<Variant, ApplicationRequest>) {
        kind.number = A::kInfo.number;
        kind.info = &A::kInfo;
        kind.answer = A::Answer::kInfo.name;
    } else {
        kind.number = std::is_same_v<Variant, ApplicationAnswer> ? A::kInfo.answer : A::kInfo.notice;
        kind.told = &A::kInfo;
    }
    return kind;
}

template <typename... A>
std::span<const SaidKind<std::variant<A...>>> kinds(std::type_identity<std::variant<A...>>) {
    static const std::array<SaidKind<std::variant<A...>>, sizeof...(A)> all{kindOf<A, std::variant<A...>>()...};
    return all;
}

template <typename... R>
constexpr bool requestNumbersDiffer(std::type_identity<std::variant<R...>>) {
    return numbersDiffer({R::kInfo.number...}) && ((R::kInfo.number > 0) && ...);
}
template <std::uint8_t ToldInfo::*Number, typename... A>
constexpr bool toldNumbersDiffer(std::type_identity<std::variant<A...>>) {
    return numbersDiffer({A::kInfo.*Number...}) && ((A::kInfo.*Number > 0) && ...);
}
static_assert(requestNumbersDiffer(std::type_identity<ApplicationRequest>()), "each has a number of its own");
static_assert(toldNumbersDiffer<&ToldInfo::answer>(std::type_identity<ApplicationAnswer>()));
static_assert(toldNumbersDiffer<&ToldInfo::notice>(std::type_identity<ApplicationNotice>()));

template <typename Variant>
const void* addressIn(const Variant& said) {
    return std::visit([](const auto& value) -> const void* { return &value; }, said);
}

}  // namespace

template <>
std::span<const SaidKind<ApplicationRequest>> kindsOf() {
    return kinds(std::type_identity<ApplicationRequest>());
}
template <>
std::span<const SaidKind<ApplicationAnswer>> kindsOf() {
    return kinds(std::type_identity<ApplicationAnswer>());
}
template <>
std::span<const SaidKind<ApplicationNotice>> kindsOf() {
    return kinds(std::type_identity<ApplicationNotice>());
}

const void* valueIn(const ApplicationRequest& request) {
    return addressIn(request);
}
const void* valueIn(const ApplicationAnswer& answer) {
    return addressIn(answer);
}
const void* valueIn(const ApplicationNotice& notice) {
    return addressIn(notice);
}

const SaidKind<ApplicationRequest>* requestKind(int number) {
    const auto all = kindsOf<ApplicationRequest>();
    const auto found = std::ranges::find(all, number, &SaidKind<ApplicationRequest>::number);
    return found == all.end() ? nullptr : &*found;
}
const SaidKind<ApplicationRequest>* requestKind(std::string_view name) {
    const auto all = kindsOf<ApplicationRequest>();
    const auto found = std::ranges::find(all, name, &SaidKind<ApplicationRequest>::name);
    return found == all.end() ? nullptr : &*found;
}

}  // namespace tessera

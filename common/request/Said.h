/// All that can be said, as tables: which requests, answers and notices there are, and how a value of one is made.
#pragma once

#include <span>

#include "common/request/Description.h"
#include "common/request/Requests.h"

namespace tessera {

/// An alternative of ApplicationRequest, ApplicationAnswer or ApplicationNotice.
template <typename Variant>
struct SaidKind {
    int number = 0;
    std::string_view name = {};
    const RequestInfo* info = nullptr;  ///< of a request
    std::string_view answer = {};       ///< of a request: the name of what answers it
    const ToldInfo* told = nullptr;     ///< of an answer or a notice
    const Description* description = nullptr;
    /// A fresh one in `said`, and where it is.
    void* (*make)(Variant& said) = nullptr;
};

/// In the order of the variant's alternatives: at its `index()`. Made once; from any thread.
template <typename Variant>
[[nodiscard]] std::span<const SaidKind<Variant>> kindsOf();
template <>
std::span<const SaidKind<ApplicationRequest>> kindsOf();
template <>
std::span<const SaidKind<ApplicationAnswer>> kindsOf();
template <>
std::span<const SaidKind<ApplicationNotice>> kindsOf();

/// The value in a variant, whichever it is.
[[nodiscard]] const void* valueIn(const ApplicationRequest& request);
[[nodiscard]] const void* valueIn(const ApplicationAnswer& answer);
[[nodiscard]] const void* valueIn(const ApplicationNotice& notice);

/// Null where there is none.
[[nodiscard]] const SaidKind<ApplicationRequest>* requestKind(int number);
[[nodiscard]] const SaidKind<ApplicationRequest>* requestKind(std::string_view name);

}  // namespace tessera

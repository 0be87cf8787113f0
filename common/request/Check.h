/// What is wrong with what somebody says: the bounds of its description, told with the member's name. Who says it asks
/// before it is sent, and who hears it asks again.
#pragma once

#include <cmath>
#include <optional>

#include "common/base/Error.h"
#include "common/request/Members.h"

namespace tessera {

/// "at least 0", "from 0.1 to 60000, or 0".
[[nodiscard]] std::string textOf(const NumberBounds& bounds);

/// "ProposeEdit is for an editor; this link is of a viewer"
[[nodiscard]] Error roleRefusal(const RequestInfo& info, Role role);

/// Finds what is wrong first, in the order of the members.
class FaultFinder {
public:
    explicit FaultFinder(const ApplicationLimits& limits) : limits_(limits) {}

    template <HasMembers T>
    void look(const T& value) {
        forEachMember<T>([&](const auto& m) {
            if (!fault_) lookAt(m, value);
        });
        if constexpr (requires { value.fault(); })
            if (!fault_)
                if (const std::optional<std::string> wrong = value.fault()) say(ErrorCode::kBadInput, *wrong);
    }
    [[nodiscard]] std::optional<Error> take() { return std::move(fault_); }

private:
    template <typename M, typename T>
    void lookAt(const M& m, const T& owner) {
        if constexpr (M::kForm != MemberForm::kReserved) {
            if (m.when != nullptr && !m.when(owner)) return;
            const auto& value = M::of(owner);
            if constexpr (M::kForm == MemberForm::kSpread) {
                look(value);
            } else if constexpr (kIsOptional<typename M::Type>) {
                if (value) lookAtOne(m, *value);
            } else if constexpr (kIsMany<typename M::Type>) {
                if (m.most != nullptr && value.size() > limits_.*m.most)
                    return tooMany(m.name, value.size(), limits_.*m.most);
                if constexpr (canBeWrong<HeldType<M>>())
                    for (const auto& each : value) {
                        lookAtOne(m, each);
                        if (fault_) return;
                    }
            } else {
                lookAtOne(m, value);
            }
        }
    }
    template <typename M, typename T>
    void lookAtOne(const M& m, const T& value) {
        constexpr ValueKind kind = valueKindOf<T>();
        if constexpr (kind == ValueKind::kNumber) {
            number(m, value);
        } else if constexpr (kind == ValueKind::kUnsigned) {
            if constexpr (std::is_integral_v<T>)
                if (m.bounds.any()) number(m, static_cast<double>(value));
        } else if constexpr (kind == ValueKind::kPlace || kind == ValueKind::kVector) {
            for (const double each : value) number(m, each);
        } else if constexpr (kind == ValueKind::kRotation) {
            if (!tellsRotation(value.squaredNorm())) noRotation(m.name);
        } else if constexpr (kind == ValueKind::kWord) {
            if (static_cast<std::uint64_t>(value) >= WordsOf<T>::kWords.size())
                noWord(m.name, static_cast<std::uint64_t>(value));
        } else if constexpr (kind == ValueKind::kText) {
            if (value.size() > limits_.maxTextBytes) tooLong(m.name, value.size(), limits_.maxTextBytes);
        } else if constexpr (kind == ValueKind::kValue) {
            look(value);
            if (fault_) fault_->message = std::string(m.name) + "." + fault_->message;
        }
    }
    /// Whether looking at one says anything.
    template <typename T>
    static constexpr bool canBeWrong() {
        constexpr ValueKind kind = valueKindOf<T>();
        return kind != ValueKind::kUnsigned && kind != ValueKind::kSigned && kind != ValueKind::kBool &&
               kind != ValueKind::kBytes;
    }
    template <typename M>
    void number(const M& m, double value) {
        if (!std::isfinite(value) || !m.bounds.hold(value)) beyond(m.name, m.bounds, value);
    }

    void say(ErrorCode code, std::string message) {
        if (!fault_) fault_ = Error{code, std::move(message)};
    }
    void beyond(std::string_view name, const NumberBounds& bounds, double value);
    void noRotation(std::string_view name);
    void noWord(std::string_view name, std::uint64_t value);
    void tooLong(std::string_view name, std::size_t bytes, std::size_t most);
    void tooMany(std::string_view name, std::size_t count, std::size_t most);

    const ApplicationLimits& limits_;
    std::optional<Error> fault_;
};

/// kBadInput: numbers out of their bounds or none at all, quaternions that tell no rotation; kUnsupported: words that
/// this version does not know; kLimit: too long, or too many.
template <HasMembers T>
[[nodiscard]] std::optional<Error> findFault(const T& value, const ApplicationLimits& limits = {}) {
    FaultFinder finder(limits);
    finder.look(value);
    return finder.take();
}

/// With the request's name in front: "REQUEST: budget_ms must be from 0.1 to 60000, or 0, not -3".
template <typename Request>
[[nodiscard]] Expected<void> checkRequest(const Request& request) {
    if (const std::optional<Error> fault = findFault(request)) return failWith(Request::kInfo.name, *fault);
    return {};
}

}  // namespace tessera

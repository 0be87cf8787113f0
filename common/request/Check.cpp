#include "common/request/Check.h"

#include <fmt/format.h>

#include <cmath>

#include "common/request/Said.h"

namespace tessera {

std::string textOf(const NumberBounds& bounds) {
    const bool low = bounds.least != -NumberBounds::kNone, high = bounds.greatest != NumberBounds::kNone;
    std::string text;
    if (low && high)
        text = fmt::format("from {:g} to {:g}", bounds.least, bounds.greatest);
    else if (low)
        text = fmt::format("at least {:g}", bounds.least);
    else if (high)
        text = fmt::format("at most {:g}", bounds.greatest);
    if (bounds.notZero) text += text.empty() ? "other than 0" : ", but not 0";
    if (bounds.orElse) text += fmt::format(", or {:g}", *bounds.orElse);
    return text;
}

namespace {

/// Finds what is wrong first, in the order of the members.
class FaultFinder {
public:
    explicit FaultFinder(const ApplicationLimits& limits) : limits_(limits) {}

    void look(const Description& description, const void* value) {
        for (const MemberEntry& m : description.members) {
            if (fault_) return;
            if (m.form != MemberForm::kReserved && description.calledFor(m, value)) lookAt(m, m.in(value));
        }
        if (!fault_ && description.fault != nullptr)
            if (const std::optional<std::string> wrong = description.fault(value)) say(ErrorCode::kBadInput, *wrong);
    }
    [[nodiscard]] std::optional<Error> take() { return std::move(fault_); }

private:
    void lookAt(const MemberEntry& m, const void* member) {
        if (m.form == MemberForm::kSpread) return look(*m.held.described, member);
        const std::size_t count = m.count(member);
        if (m.manner == Manner::kMany && m.most != nullptr && count > limits_.*m.most)
            return say(ErrorCode::kLimit,
                       fmt::format("{} has {} entries; at most {} are allowed", m.name, count, limits_.*m.most));
        if (!m.canBeWrong() && !m.bounds.any()) return;
        for (std::size_t i = 0; i < count && !fault_; ++i) lookAtOne(m, m.at(member, i));
    }
    void lookAtOne(const MemberEntry& m, const void* value) {
        const auto* const numbers = static_cast<const double*>(value);
        switch (m.held.kind) {
            case ValueKind::kNumber:
                return number(m, *numbers);
            case ValueKind::kPlace:
            case ValueKind::kVector:
                for (std::size_t i = 0; i < m.held.bytes / sizeof(double); ++i) number(m, numbers[i]);
                return;
            case ValueKind::kRotation:
                if (!tellsRotation(static_cast<const Quatd*>(value)->squaredNorm()))
                    say(ErrorCode::kBadInput, fmt::format("{} is a quaternion that cannot be normalised", m.name));
                return;
            case ValueKind::kUnsigned:
                if (m.held.id == IdKind::kNone && m.bounds.any())
                    number(m, static_cast<double>(integerOf(m.held, value)));
                return;
            case ValueKind::kWord:
                if (const std::uint64_t word = integerOf(m.held, value); word >= m.held.words.size())
                    say(ErrorCode::kUnsupported,
                        fmt::format("{} says {}, which this version does not know", m.name, word));
                return;
            case ValueKind::kText:
                if (const std::size_t bytes = static_cast<const std::string*>(value)->size();
                    bytes > limits_.maxTextBytes)
                    say(ErrorCode::kLimit,
                        fmt::format("{} has {} bytes; at most {} are allowed", m.name, bytes, limits_.maxTextBytes));
                return;
            case ValueKind::kValue:
                look(*m.held.described, value);
                if (fault_) fault_->message = std::string(m.name) + "." + fault_->message;
                return;
            case ValueKind::kBool:
            case ValueKind::kSigned:
            case ValueKind::kBytes:
            case ValueKind::kRow:
                return;
        }
    }
    void number(const MemberEntry& m, double value) {
        if (!std::isfinite(value))
            say(ErrorCode::kBadInput, fmt::format("{} is a number that is not finite", m.name));
        else if (!m.bounds.hold(value))
            say(ErrorCode::kBadInput, fmt::format("{} must be {}, not {}", m.name, textOf(m.bounds), value));
    }
    void say(ErrorCode code, std::string message) {
        if (!fault_) fault_ = Error{code, std::move(message)};
    }

    const ApplicationLimits& limits_;
    std::optional<Error> fault_;
};

}  // namespace

std::optional<Error> findFault(const Description& description, const void* value, const ApplicationLimits& limits) {
    FaultFinder finder(limits);
    finder.look(description, value);
    return finder.take();
}

Expected<void> checkRequest(std::uint8_t number, const void* request) {
    const SaidKind<ApplicationRequest>& kind = *requestKind(number);
    if (const std::optional<Error> fault = findFault(*kind.description, request)) return failWith(kind.name, *fault);
    return {};
}

Error roleRefusal(const RequestInfo& info, Role role) {
    return {ErrorCode::kRefused, fmt::format("{} is for an {}; this link is of {} {}", info.name, nameOf(info.role),
                                             role == Role::kViewer ? "a" : "an", nameOf(role))};
}

}  // namespace tessera

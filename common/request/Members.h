/// The words in which requests, answers and notices are described, beside each of them: its number and name, who may
/// say it, and its members. The codec, the checks, the printed schema and `tessera-ctl requests` follow the
/// descriptions.
#pragma once

#include <array>
#include <concepts>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "common/base/ByteSlice.h"
#include "common/base/Role.h"
#include "common/base/StrongId.h"
#include "common/math/Types.h"
#include "common/request/ApplicationLimits.h"

namespace tessera {

// ---- what is said

enum class Answered : std::uint8_t {
    kAtOnce,
    kLater,  ///< it stays open: the answer comes with a frame, with a file or from hosts
};
enum class Changes : std::uint8_t { kNothing, kScene, kView };

/// A request R says as `R::Answer` what answers it.
struct RequestInfo {
    std::uint8_t number = 0;  ///< never reused, 0 never used
    std::string_view name;
    Role role = Role::kViewer;  ///< who may say it
    Answered answered = Answered::kAtOnce;
    Changes changes = Changes::kNothing;
    std::string_view help;      ///< one line for people
    bool bringsArrays = false;  ///< Uploads before it belong to it
    bool forPanels = false;     ///< whose token is of a panel may say it, as far as the panel reaches
    bool ownLink = false;  ///< it is about the link that it comes by: nothing for a door behind which many share one
    /// Its fields as JSON, as they may be said (common/json), in a scene with a /hall.
    std::string_view example = "{}";
};

/// An answer, a notice, or both. Each kind has numbers of its own; 0: it is none.
struct ToldInfo {
    std::string_view name;
    std::uint8_t answer = 0, notice = 0;
    std::string_view help = {};
};

// ---- members

/// How a member stands in a message: small ones in its head, which is a protobuf message, bulk as parts behind it
/// (common/codec/Parts.h).
enum class MemberForm : std::uint8_t {
    kHead,      ///< a field of the head, by its type
    kFixed,     ///< a number of 8 bytes there: hashes, epochs
    kNumbers,   ///< a Vec2d as two fields, behind a flag where it may be absent
    kSpread,    ///< a value's own members as if they were the owner's
    kPart,      ///< bytes, or records one behind the other; their texts are a part of their own
    kRest,      ///< all parts that are left
    kReserved,  ///< of a record: bytes that are zero
};

/// What the bytes of a member are, for those who say them in another language.
enum class Holds : std::uint8_t {
    kBytes,
    kChanges,  ///< an encoded list of changes (proto/change.proto)
    kPicture,  ///< a PNG
    kJpeg,
};

/// Of a number, or of each number of a vector; NaN never is within them.
struct NumberBounds {
    static constexpr double kNone = std::numeric_limits<double>::infinity();

    double least = -kNone, greatest = kNone;
    bool notZero = false;
    std::optional<double> orElse = {};  ///< allowed, too

    [[nodiscard]] constexpr bool any() const { return least != -kNone || greatest != kNone || notZero; }
    [[nodiscard]] constexpr bool hold(double value) const {
        if (orElse && value == *orElse) return true;
        return value >= least && value <= greatest && !(notZero && value == 0);
    }
};

template <typename Pointer>
struct PointedAt;
template <typename O, typename T>
struct PointedAt<T O::*> {
    using Owner = O;
    using Type = T;
};

/// The description of a member beside its type.
struct MemberWords {
    std::uint8_t number = 0;
    std::string_view name;  ///< as the schema and messages have it
    std::string_view unit = {}, help = {};
    NumberBounds bounds = {};
    /// How many there may be of what can be many; of a text, how many bytes.
    std::size_t ApplicationLimits::*most = nullptr;
    std::size_t ApplicationLimits::*mostBytes = nullptr;  ///< of each part
    std::string_view whenText = {};                       ///< for people: "with decision move"
    std::string_view second = {}, flag = {};              ///< kNumbers: the other names
    Holds holds = Holds::kBytes;
    bool around = false;  ///< a count that has no end: what is below 0 stands for the way back from 0
};

/// One member of a message, a value or a record. Fields of heads are numbered upwards within a message, and no number
/// is used again; parts, and what a record consists of, have none.
template <MemberForm Form, auto Pointer>
struct Member : MemberWords {
    using Owner = typename PointedAt<decltype(Pointer)>::Owner;
    using Type = typename PointedAt<decltype(Pointer)>::Type;
    static constexpr MemberForm kForm = Form;

    /// It is only said, and only heard, where the rest of the message says this.
    bool (*when)(const Owner&) = nullptr;

    [[nodiscard]] static constexpr const Type& of(const Owner& owner) { return owner.*Pointer; }
    [[nodiscard]] static constexpr Type& of(Owner& owner) { return owner.*Pointer; }

    [[nodiscard]] constexpr Member in(std::string_view what) const {
        Member member = *this;
        member.unit = what;
        return member;
    }
    [[nodiscard]] constexpr Member said(std::string_view line) const {
        Member member = *this;
        member.help = line;
        return member;
    }
    [[nodiscard]] constexpr Member between(double least, double greatest) const {
        Member member = *this;
        member.bounds.least = least;
        member.bounds.greatest = greatest;
        return member;
    }
    [[nodiscard]] constexpr Member atLeast(double least) const { return between(least, NumberBounds::kNone); }
    [[nodiscard]] constexpr Member orExactly(double value) const {
        Member member = *this;
        member.bounds.orElse = value;
        return member;
    }
    [[nodiscard]] constexpr Member butNotZero() const {
        Member member = *this;
        member.bounds.notZero = true;
        return member;
    }
    [[nodiscard]] constexpr Member atMost(std::size_t ApplicationLimits::*many) const {
        Member member = *this;
        member.most = many;
        return member;
    }
    [[nodiscard]] constexpr Member holding(Holds what) const {
        Member member = *this;
        member.holds = what;
        return member;
    }
    [[nodiscard]] constexpr Member countedAround() const {
        Member member = *this;
        member.around = true;
        return member;
    }
    [[nodiscard]] constexpr Member ofBytes(std::size_t ApplicationLimits::*bytes) const {
        Member member = *this;
        member.mostBytes = bytes;
        return member;
    }
    /// `text` for people: "with decision move".
    [[nodiscard]] constexpr Member onlyWhen(bool (*calledFor)(const Owner&), std::string_view text) const {
        Member member = *this;
        member.when = calledFor;
        member.whenText = text;
        return member;
    }
};

/// A field of the head.
template <auto Pointer>
constexpr Member<MemberForm::kHead, Pointer> member(std::uint8_t number, std::string_view name) {
    return {{number, name}};
}
/// A member of a record.
template <auto Pointer>
constexpr Member<MemberForm::kHead, Pointer> member(std::string_view name) {
    return {{0, name}};
}
template <auto Pointer>
constexpr Member<MemberForm::kFixed, Pointer> fixedMember(std::uint8_t number, std::string_view name) {
    return {{number, name}};
}
/// `number` and the next one; of an optional the flag's, and the next two.
template <auto Pointer>
constexpr Member<MemberForm::kNumbers, Pointer> numbersMember(std::uint8_t number, std::string_view first,
                                                              std::string_view second, std::string_view flag = {}) {
    Member<MemberForm::kNumbers, Pointer> member{{number, first}};
    member.second = second;
    member.flag = flag;
    return member;
}
/// The first of its members has this number, the others follow as they do there.
template <auto Pointer>
constexpr Member<MemberForm::kSpread, Pointer> spreadMember(std::uint8_t number) {
    return {{number, {}}};
}
template <auto Pointer>
constexpr Member<MemberForm::kPart, Pointer> partMember(std::string_view name) {
    return {{0, name}};
}
template <auto Pointer>
constexpr Member<MemberForm::kRest, Pointer> restMember(std::string_view name) {
    return {{0, name}};
}
/// Bytes of a record that mean nothing yet.
template <typename O, std::size_t Bytes>
struct ReservedMember {
    using Owner = O;
    static constexpr MemberForm kForm = MemberForm::kReserved;
    static constexpr std::size_t kBytes = Bytes;
};
template <typename Owner, std::size_t Bytes>
constexpr ReservedMember<Owner, Bytes> reservedMember() {
    return {};
}

// ---- types of members

/// `T::members(take)` calls `take` once, with all of T's members. It is a template, as most files that include a
/// description never ask for it: they compile in half the time.
struct AllMembers {
    template <typename... M>
    constexpr void operator()(const M&...) const {}
};
/// The members of a value of another module, where it cannot say them itself; and its name.
template <typename T>
struct MembersOf;
template <typename T>
concept DescribesItself = requires {
    T::members(AllMembers());
};
template <typename T>
concept HasMembers = DescribesItself<T> || requires {
    MembersOf<T>::members(AllMembers());
};

template <HasMembers T>
[[nodiscard]] constexpr std::string_view nameOfDescribed() {
    if constexpr (requires { T::kInfo; })
        return T::kInfo.name;
    else if constexpr (requires { T::kName; })
        return T::kName;
    else
        return MembersOf<T>::kName;
}
/// `visit(member)` for each of T's, in the order in which they are said.
template <HasMembers T, typename Visit>
constexpr void forEachMember(Visit&& visit) {
    const auto each = [&](const auto&... members) { (visit(members), ...); };
    if constexpr (DescribesItself<T>)
        T::members(each);
    else
        MembersOf<T>::members(each);
}

/// The words of an enumeration, from 0 up; what is beyond them is refused.
template <typename E>
struct WordsOf;

enum class ValueKind : std::uint8_t {
    kBool,
    kUnsigned,
    kSigned,
    kWord,
    kNumber,
    kText,
    kPlace,
    kVector,
    kRotation,
    kBytes,
    kRow,
    kValue
};

template <typename T>
inline constexpr bool kIsId = false;
template <typename Tag, typename Value>
inline constexpr bool kIsId<StrongId<Tag, Value>> = true;
template <typename T>
inline constexpr bool kIsOptional = false;
template <typename T>
inline constexpr bool kIsOptional<std::optional<T>> = true;
template <typename T>
inline constexpr bool kIsMany = false;
template <typename T>
inline constexpr bool kIsMany<std::vector<T>> = true;
template <typename T>
inline constexpr bool kIsRow = false;
template <typename T, std::size_t N>
inline constexpr bool kIsRow<std::array<T, N>> = true;

/// Of one value: what an optional, or a vector, holds.
template <typename T>
[[nodiscard]] constexpr ValueKind valueKindOf() {
    if constexpr (std::is_same_v<T, bool>)
        return ValueKind::kBool;
    else if constexpr (std::is_enum_v<T>)
        return ValueKind::kWord;
    else if constexpr (kIsId<T>)
        return ValueKind::kUnsigned;
    else if constexpr (std::is_integral_v<T>)
        return std::is_signed_v<T> ? ValueKind::kSigned : ValueKind::kUnsigned;
    else if constexpr (std::is_same_v<T, double>)
        return ValueKind::kNumber;
    else if constexpr (std::is_same_v<T, std::string>)
        return ValueKind::kText;
    else if constexpr (std::is_same_v<T, Vec2d>)
        return ValueKind::kPlace;
    else if constexpr (std::is_same_v<T, Vec3d>)
        return ValueKind::kVector;
    else if constexpr (std::is_same_v<T, Quatd>)
        return ValueKind::kRotation;
    else if constexpr (std::is_same_v<T, ByteSlice>)
        return ValueKind::kBytes;
    else if constexpr (kIsRow<T>)
        return ValueKind::kRow;
    else {
        static_assert(HasMembers<T>, "a type without a description");
        return ValueKind::kValue;
    }
}

/// What one holds: T of an optional or a vector of T.
template <typename T>
struct HeldBy {
    using Type = T;
};
template <typename T>
struct HeldBy<std::optional<T>> {
    using Type = T;
};
template <typename T>
struct HeldBy<std::vector<T>> {
    using Type = T;
};
template <typename M>
using HeldType = typename HeldBy<typename M::Type>::Type;

/// What holds all requests, answers or notices has each number once.
template <typename Info>
[[nodiscard]] constexpr bool numbersDiffer(std::initializer_list<Info> numbers) {
    for (auto a = numbers.begin(); a != numbers.end(); ++a)
        for (auto b = numbers.begin(); b != a; ++b)
            if (*a == *b) return false;
    return true;
}

}  // namespace tessera

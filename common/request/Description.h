/// Described types (Members.h) as data: what each member is, and where it lies in a value. Whoever reads or writes
/// values of any described type walks over these tables, and is compiled once.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/change/Value.h"
#include "common/request/Members.h"

namespace tessera {

struct Description;

enum class IdKind : std::uint8_t { kNone, kObject, kObjectType, kOther };

/// The type of one value: a member itself, or one of those that an optional or a vector holds.
struct ValueType {
    ValueKind kind = ValueKind::kBytes;
    IdKind id = IdKind::kNone;
    std::size_t bytes = 0;                         ///< in memory
    std::size_t recordBytes = 0;                   ///< in a record
    std::span<const std::string_view> words = {};  ///< kWord: from 0 up
    const Description* described = nullptr;        ///< kValue
    const ValueType* each = nullptr;               ///< kRow
};

enum class Manner : std::uint8_t { kOne, kOptional, kMany };

/// Access to the values in an optional or a vector, which lie one behind the other.
struct Holder {
    std::size_t (*size)(const void* holder) = nullptr;
    const void* (*data)(const void* holder) = nullptr;
    /// New ones are as they are in a fresh value.
    void (*resize)(void* holder, std::size_t size) = nullptr;
};

struct MemberEntry : MemberWords {
    MemberForm form = MemberForm::kHead;
    Manner manner = Manner::kOne;
    std::size_t offset = 0;  ///< in its owner
    ValueType held;          ///< kReserved: how many bytes
    Holder holder;
    void (*assign)(void* to, const void* from) = nullptr;
    /// `onlyWhen` of the description, for `Description::calledFor`.
    void (*when)() = nullptr;

    [[nodiscard]] const void* in(const void* owner) const { return static_cast<const std::byte*>(owner) + offset; }
    [[nodiscard]] void* in(void* owner) const { return static_cast<std::byte*>(owner) + offset; }
    /// How many values it holds, and each of them.
    [[nodiscard]] std::size_t count(const void* member) const {
        return manner == Manner::kOne ? 1 : holder.size(member);
    }
    [[nodiscard]] const void* at(const void* member, std::size_t i) const {
        return manner == Manner::kOne ? member : static_cast<const std::byte*>(holder.data(member)) + i * held.bytes;
    }
    [[nodiscard]] void* at(void* member, std::size_t i) const {
        return const_cast<void*>(at(static_cast<const void*>(member), i));
    }
    /// One more, as it is in a fresh value; of an optional the one that it has, if it has one.
    [[nodiscard]] void* add(void* member) const {
        if (manner == Manner::kOne) return member;
        const std::size_t before = manner == Manner::kMany ? holder.size(member) : 0;
        if (holder.size(member) == before) holder.resize(member, before + 1);
        return at(member, before);
    }
    /// Fields of the head, and what is spread among them.
    [[nodiscard]] bool isOfHead() const {
        return form != MemberForm::kPart && form != MemberForm::kRest && form != MemberForm::kReserved;
    }
    /// Whether looking at one value may find something wrong.
    [[nodiscard]] bool canBeWrong() const {
        return held.kind != ValueKind::kUnsigned && held.kind != ValueKind::kSigned && held.kind != ValueKind::kBool &&
               held.kind != ValueKind::kBytes && held.kind != ValueKind::kRow;
    }
};

/// How a value's bytes go into a record's, one step after the other; neighbours that are copied are one step.
struct RecordStep {
    enum class Way : std::uint8_t { kCopy, kFlag, kWord, kText, kRotation, kReserved };
    Way way = Way::kCopy;
    std::size_t offset = 0;  ///< in the value
    std::size_t bytes = 0;   ///< kCopy, kReserved: how many; kWord: as it lies in memory
    std::size_t words = 0;   ///< kWord: how many there are
};

struct Description {
    std::string_view name = {};
    std::vector<MemberEntry> members = {};
    std::size_t bytes = 0;  ///< of a value in memory
    const void* fresh = nullptr;
    bool (*calls)(void (*when)(), const void* owner) = nullptr;
    /// Says in words why the whole is wrong; null: it cannot be.
    std::optional<std::string> (*fault)(const void* value) = nullptr;
    // Where it stands in records: as many bytes in each, little-endian; texts in a part of their own.
    std::size_t recordBytes = 0;
    bool recordHasTexts = false;
    std::vector<RecordStep> record = {};

    /// Whether a member is said in a message like this one.
    [[nodiscard]] bool calledFor(const MemberEntry& member, const void* owner) const {
        return member.when == nullptr || calls(member.when, owner);
    }
};

// ---- numbers of any type as 64 bits

/// kBool, kUnsigned, kSigned, kWord.
[[nodiscard]] std::uint64_t integerOf(const ValueType& type, const void* value);
/// False where `number` is none of them; then it is 0.
bool setInteger(const ValueType& type, void* value, std::uint64_t number);

// ---- made of what the types say of themselves

class DescriptionMaker {
public:
    template <HasMembers T>
    [[nodiscard]] static Description make() {
        static const T fresh{};
        Description made{.name = nameOfDescribed<T>(), .members = {}, .bytes = sizeof(T), .fresh = &fresh};
        made.calls = [](void (*when)(), const void* owner) {
            return reinterpret_cast<bool (*)(const T&)>(when)(*static_cast<const T*>(owner));
        };
        if constexpr (requires { fresh.fault(); })
            made.fault = [](const void* value) -> std::optional<std::string> {
                return static_cast<const T*>(value)->fault();
            };
        forEachMember<T>([&]<typename M>(const M& m) {
            MemberEntry& entry = made.members.emplace_back();
            entry.form = M::kForm;
            if constexpr (M::kForm == MemberForm::kReserved) {
                entry.held.recordBytes = M::kBytes;
            } else {
                static_cast<MemberWords&>(entry) = m;
                entry.when = reinterpret_cast<void (*)()>(m.when);
                const auto* const owner = reinterpret_cast<const std::byte*>(&fresh);
                entry.offset = static_cast<std::size_t>(reinterpret_cast<const std::byte*>(&M::of(fresh)) - owner);
                describeMember<typename M::Type>(entry);
            }
        });
        finish(made);
        return made;
    }

private:
    template <typename T>
    static void describeMember(MemberEntry& entry) {
        entry.assign = [](void* to, const void* from) { *static_cast<T*>(to) = *static_cast<const T*>(from); };
        if constexpr (kIsOptional<T>) {
            entry.manner = Manner::kOptional;
            entry.holder = {
                [](const void* holder) -> std::size_t { return static_cast<const T*>(holder)->has_value() ? 1 : 0; },
                [](const void* holder) -> const void* { return std::addressof(**static_cast<const T*>(holder)); },
                [](void* holder, std::size_t size) {
                    if (size == 0)
                        static_cast<T*>(holder)->reset();
                    else if (!*static_cast<T*>(holder))
                        static_cast<T*>(holder)->emplace();
                }};
        } else if constexpr (kIsMany<T>) {
            entry.manner = Manner::kMany;
            entry.holder = {[](const void* holder) { return static_cast<const T*>(holder)->size(); },
                            [](const void* holder) -> const void* { return static_cast<const T*>(holder)->data(); },
                            [](void* holder, std::size_t size) { static_cast<T*>(holder)->resize(size); }};
        }
        entry.held = valueType<typename HeldBy<T>::Type>();
    }
    template <typename T>
    static ValueType valueType();

    /// Sizes and steps of its records.
    static void finish(Description& made);
};

/// Made once. From any thread.
template <HasMembers T>
[[nodiscard]] const Description& descriptionOf() {
    static const Description description = DescriptionMaker::make<T>();
    return description;
}

template <typename T>
ValueType DescriptionMaker::valueType() {
    constexpr ValueKind kind = valueKindOf<T>();
    ValueType type{.kind = kind, .bytes = sizeof(T), .recordBytes = sizeof(T)};
    if constexpr (kind == ValueKind::kWord)
        type.words = WordsOf<T>::kWords;
    else if constexpr (kIsId<T>)
        type.id = std::is_same_v<T, ObjectId>     ? IdKind::kObject
                  : std::is_same_v<T, ObjectType> ? IdKind::kObjectType
                                                  : IdKind::kOther;
    else if constexpr (kIsRow<T>) {
        static const ValueType each = valueType<typename T::value_type>();
        type.each = &each;
    } else if constexpr (kind == ValueKind::kValue) {
        type.described = &descriptionOf<T>();
        type.recordBytes = type.described->recordBytes;
    }
    if (kind == ValueKind::kBool || kind == ValueKind::kWord || kind == ValueKind::kText)
        type.recordBytes = sizeof(std::uint32_t);
    return type;
}

}  // namespace tessera

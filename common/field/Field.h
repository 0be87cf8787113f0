/// How a type of object says what its fields are: once, beside its struct. Everything else (table, storage, hash,
/// codec, snapshot, inverse, schema hash, files, `tessera-ctl`) is derived from it.
///
///     struct PointLight { static constexpr ObjectType kType{9}; Vec3f color…; float range…; };
///     template <>
///     inline constexpr auto kSaid<PointLight> = []<typename T>(Describing<T>) {
///         return describe("PointLight",
///             field<&T::color>(1, "color").affects(Effect::kLight),
///             field<&T::range>(3, "range").unit(Unit::kWorld).atLeast(0).affects(Effect::kLight));
///     };
///
/// Numbers of types and fields are on the wire and in files: they are never reused.
#pragma once

#include <algorithm>
#include <array>
#include <initializer_list>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/change/Value.h"
#include "common/math/Types.h"

namespace tessera {

/// What a change of a field may alter in whatever is derived from a scene. Who derives something says which effects it
/// follows, and names no types.
enum class Effect : std::uint16_t {
    kNone = 0,
    kName = 1,        ///< what a node is called
    kStructure = 2,   ///< which core a node has; every placement besides
    kVisibility = 4,  ///< which children are shown
    kPose = 8,        ///< where what is below a node stands
    kShape = 16,      ///< the surface of a drawable
    kLook = 32,       ///< its colours, material, images; the order in which it is drawn
    kLight = 64,      ///< lights, and the light of the surroundings
    kRules = 128,     ///< who takes part in collisions, with whom
    kTerms = 256,     ///< how they collide: masses, responses, thresholds
    kTime = 512,      ///< what moves by itself
    kView = 1024,     ///< cameras
};
[[nodiscard]] constexpr Effect operator|(Effect a, Effect b) {
    return static_cast<Effect>(static_cast<std::uint16_t>(a) | static_cast<std::uint16_t>(b));
}
/// Whether two sets of effects share one.
[[nodiscard]] constexpr bool operator&(Effect a, Effect b) {
    return (static_cast<std::uint16_t>(a) & static_cast<std::uint16_t>(b)) != 0;
}

enum class Unit : std::uint8_t {
    kNone,
    kWorld,
    kSecond,
    kFrame,
    kRadian,
    kPixel,
    kWorldPerSecond,
    kWorldPerSecond2,
    kRadianPerSecond,
    kWorldPerMetre
};
/// "world units per s", …; empty for kNone.
[[nodiscard]] std::string_view nameOf(Unit unit);

/// A number that has a name, in code, on the wire and in files.
struct FieldWord {
    std::int64_t number = 0;
    std::string_view word;
};
/// What the words of a whole number are.
enum class WordUse : std::uint8_t {
    kNone,
    kOneOf,  ///< it is one of them
    kNamed,  ///< some numbers have names, others are good too
    kFlags,  ///< each is a bit; 0 is called "none"
};

struct FieldInfo {
    static constexpr std::size_t kMaxWords = 16;

    FieldId id;             ///< unique within its type; never reused
    std::string_view name;  ///< e.g. "translation"
    FieldKind kind = FieldKind::kFloat;
    std::uint8_t width = 1;
    /// For refs and lists of them: what may be referred to (none: any core, or any object). A ref may always be "none".
    std::optional<ObjectType> refType;
    bool anyObject = false;        ///< of one without a refType: materials, images and nodes too
    bool quaternion = false;       ///< width 4, must not be zero
    std::uint8_t numbersEach = 0;  ///< of an array of floats or doubles: how many an element has; 0: it is none
    bool doubles = false;          ///< of such an array
    std::uint8_t integersEach = 0,
                 integerBytes = 0;  ///< of an array of unsigned integers: how many an element has, of which size
    Effect effects = Effect::kNone;
    Unit measuredIn = Unit::kNone;
    /// What a number of this field may be (each scalar of it). Every number must be finite besides.
    double least = -std::numeric_limits<double>::infinity();
    double greatest = std::numeric_limits<double>::infinity();
    /// Where a file has another number, its reader takes the nearest good one and says so; edits are refused. Of looks:
    /// a scene is not lost for them.
    bool nearestFromFiles = false;
    WordUse wordUse = WordUse::kNone;
    std::array<FieldWord, kMaxWords> wordStore{};
    std::uint8_t wordCount = 0;

    std::string_view member;  ///< the C++ member; see memberKey

    /// On a struct of this type, wherever it lies. `write` expects kind and width to be right.
    FieldValue (*read)(const void*) = nullptr;
    void (*write)(void*, const FieldValue&) = nullptr;
    /// Where the value lies: `width` floats or doubles, or one value of the C++ type of its kind. Quaternions lie there
    /// as x y z w, while values say w x y z.
    void* (*at)(void*) = nullptr;

    [[nodiscard]] std::span<const FieldWord> words() const { return std::span(wordStore).first(wordCount); }
    [[nodiscard]] bool holdsRefs() const { return kind == FieldKind::kRef || kind == FieldKind::kRefs; }
    /// Of such: whether it may lead to objects of that type.
    [[nodiscard]] bool mayReferTo(ObjectType type, bool isCore) const {
        return refType ? type == *refType : isCore || anyObject;
    }

    // How a description says the rest.
    [[nodiscard]] constexpr FieldInfo affects(Effect effect) const {
        FieldInfo info = *this;
        info.effects = effect;
        return info;
    }
    [[nodiscard]] constexpr FieldInfo unit(Unit unit) const {
        FieldInfo info = *this;
        info.measuredIn = unit;
        return info;
    }
    [[nodiscard]] constexpr FieldInfo between(double low, double high) const {
        FieldInfo info = *this;
        info.least = low;
        info.greatest = high;
        return info;
    }
    /// The same, and files that have another number are taken with the nearest good one.
    [[nodiscard]] constexpr FieldInfo lookBetween(double low, double high) const {
        FieldInfo info = between(low, high).affects(Effect::kLook);
        info.nearestFromFiles = true;
        return info;
    }
    /// Of an array whose elements are so many floats, or doubles: people may say some of them (`tessera-ctl set`).
    [[nodiscard]] constexpr FieldInfo floats(std::uint8_t each) const {
        FieldInfo info = *this;
        info.numbersEach = each;
        return info;
    }
    [[nodiscard]] constexpr FieldInfo doublesEach(std::uint8_t each) const {
        FieldInfo info = floats(each);
        info.doubles = true;
        return info;
    }
    /// Of an array whose elements are so many unsigned integers of 1, 2 or 4 bytes: what programs that read it are
    /// told.
    [[nodiscard]] constexpr FieldInfo integers(std::uint8_t each, std::uint8_t bytes) const {
        FieldInfo info = *this;
        info.integersEach = each;
        info.integerBytes = bytes;
        return info;
    }
    /// Of an element of an array of floats or doubles.
    [[nodiscard]] constexpr std::size_t elementBytes() const {
        return numbersEach * (doubles ? sizeof(double) : sizeof(float));
    }
    [[nodiscard]] constexpr FieldInfo atLeast(double bound) const { return between(bound, greatest); }
    /// A reference to whatever a scene holds.
    [[nodiscard]] constexpr FieldInfo toAnything() const {
        FieldInfo info = *this;
        info.anyObject = true;
        return info;
    }
    /// What a reference leads to; without this, to any core.
    [[nodiscard]] constexpr FieldInfo to(ObjectType target) const {
        FieldInfo info = *this;
        info.refType = target;
        return info;
    }
    [[nodiscard]] constexpr FieldInfo oneOf(std::initializer_list<FieldWord> words) const {
        FieldInfo info = withWords(WordUse::kOneOf, words);
        info.least = info.greatest = static_cast<double>(words.begin()->number);
        for (const FieldWord& word : words) {
            info.least = std::min(info.least, static_cast<double>(word.number));
            info.greatest = std::max(info.greatest, static_cast<double>(word.number));
        }
        return info;
    }
    [[nodiscard]] constexpr FieldInfo named(std::initializer_list<FieldWord> words) const {
        return withWords(WordUse::kNamed, words);
    }
    [[nodiscard]] constexpr FieldInfo flags(std::initializer_list<FieldWord> words) const {
        FieldInfo info = withWords(WordUse::kFlags, words);
        std::int64_t all = 0;
        for (const FieldWord& word : words) all |= word.number;
        return info.between(0, static_cast<double>(all));
    }

private:
    [[nodiscard]] constexpr FieldInfo withWords(WordUse use, std::initializer_list<FieldWord> words) const {
        FieldInfo info = *this;
        info.wordUse = use;
        for (const FieldWord& word : words) info.wordStore[info.wordCount++] = word;
        return info;
    }
};

/// The C++ types that a field may have.
template <typename T>
struct FieldShape;

template <typename T, FieldKind kind>
struct SingleFieldShape {
    static constexpr FieldKind kKind = kind;
    static constexpr std::uint8_t kWidth = 1;
    static FieldValue load(const T& v) { return v; }
    static void store(T& to, const FieldValue& value) { to = std::get<T>(value); }
    static void* at(T& v) { return &v; }
};
template <>
struct FieldShape<std::int64_t> : SingleFieldShape<std::int64_t, FieldKind::kInt> {};
template <>
struct FieldShape<ObjectId> : SingleFieldShape<ObjectId, FieldKind::kRef> {};
template <>
struct FieldShape<std::string> : SingleFieldShape<std::string, FieldKind::kText> {};
template <>
struct FieldShape<Blob> : SingleFieldShape<Blob, FieldKind::kBlob> {};
template <>
struct FieldShape<bool> : SingleFieldShape<bool, FieldKind::kBool> {};
template <>
struct FieldShape<RefList> : SingleFieldShape<RefList, FieldKind::kRefs> {};

template <typename Scalar, std::size_t width>
struct NumbersFieldShape {
    using Packed = std::conditional_t<std::is_same_v<Scalar, float>, Floats, Doubles>;
    static constexpr FieldKind kKind = std::is_same_v<Scalar, float> ? FieldKind::kFloat : FieldKind::kDouble;
    static constexpr std::uint8_t kWidth = width;
    static FieldValue packed(const Scalar* from) {
        Packed values;
        std::copy_n(from, width, values.values.begin());
        values.width = width;
        return values;
    }
    static const Scalar* scalars(const FieldValue& value) { return std::get<Packed>(value).values.data(); }
    using Numbers = std::array<Scalar, width>;  ///< as they are said
};
template <>
struct FieldShape<float> : NumbersFieldShape<float, 1> {
    static FieldValue load(const float& v) { return packed(&v); }
    static Numbers numbers(const float& v) { return {v}; }
    static void store(float& to, const FieldValue& value) { to = *scalars(value); }
    static void* at(float& v) { return &v; }
};
template <>
struct FieldShape<double> : NumbersFieldShape<double, 1> {
    static FieldValue load(const double& v) { return packed(&v); }
    static Numbers numbers(const double& v) { return {v}; }
    static void store(double& to, const FieldValue& value) { to = *scalars(value); }
    static void* at(double& v) { return &v; }
};
template <typename Scalar, int size>
struct FieldShape<Eigen::Matrix<Scalar, size, 1>> : NumbersFieldShape<Scalar, std::size_t(size)> {
    using Vector = Eigen::Matrix<Scalar, size, 1>;
    static FieldValue load(const Vector& v) { return FieldShape::packed(v.data()); }
    static typename FieldShape::Numbers numbers(const Vector& v) {
        typename FieldShape::Numbers all;
        std::copy_n(v.data(), size, all.begin());
        return all;
    }
    static void store(Vector& to, const FieldValue& value) { std::copy_n(FieldShape::scalars(value), size, to.data()); }
    static void* at(Vector& v) { return v.data(); }
};
template <>
struct FieldShape<Quatd> : NumbersFieldShape<double, 4> {
    static Numbers numbers(const Quatd& q) { return {q.w(), q.x(), q.y(), q.z()}; }
    static FieldValue load(const Quatd& q) { return Doubles{numbers(q), 4}; }
    static void store(Quatd& to, const FieldValue& value) {
        const double* wxyz = scalars(value);
        to = Quatd(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
    }
    static void* at(Quatd& q) { return q.coeffs().data(); }
};
template <>
struct FieldShape<Eigen::Matrix4d> {
    static constexpr FieldKind kKind = FieldKind::kMatrix;
    static constexpr std::uint8_t kWidth = 1;
    static FieldValue load(const Eigen::Matrix4d& m) {
        Matrix values;
        std::copy_n(m.data(), 16, values.values.begin());
        return values;
    }
    static void store(Eigen::Matrix4d& to, const FieldValue& value) {
        std::copy_n(std::get<Matrix>(value).values.begin(), 16, to.data());
    }
    static void* at(Eigen::Matrix4d& m) { return m.data(); }
};

template <typename Member>
struct FieldMember;
template <typename Core_, typename Type_>
struct FieldMember<Type_ Core_::*> {
    using Core = Core_;
    using Type = Type_;
};

/// Reading and writing one member of one type.
template <auto kMember>
struct FieldAccess {
    using Core = typename FieldMember<decltype(kMember)>::Core;
    using Shape = FieldShape<typename FieldMember<decltype(kMember)>::Type>;
    static FieldValue read(const void* object) { return Shape::load(static_cast<const Core*>(object)->*kMember); }
    static void write(void* object, const FieldValue& value) {
        Shape::store(static_cast<Core*>(object)->*kMember, value);
    }
    static void* at(void* object) { return Shape::at(static_cast<Core*>(object)->*kMember); }
};

/// What tells members apart while compiling: under UBSan g++ does not compare the addresses of functions there.
template <auto kMember>
[[nodiscard]] consteval std::string_view memberKey() {
    return __PRETTY_FUNCTION__;
}

template <auto kMember>
[[nodiscard]] constexpr FieldInfo field(std::uint16_t number, std::string_view name) {
    using Access = FieldAccess<kMember>;
    FieldInfo info;
    info.id = FieldId{number};
    info.name = name;
    info.kind = Access::Shape::kKind;
    info.width = Access::Shape::kWidth;
    info.quaternion = std::is_same_v<typename FieldMember<decltype(kMember)>::Type, Quatd>;
    info.member = memberKey<kMember>();
    info.read = &Access::read;
    info.write = &Access::write;
    info.at = &Access::at;
    return info;
}

template <std::size_t count>
struct TypeDescription {
    std::string_view name;
    bool isCore = true;
    std::array<FieldInfo, count> fields;

    /// What stands beside the tree and is referred to: materials, images.
    [[nodiscard]] constexpr TypeDescription notACore() const {
        TypeDescription description = *this;
        description.isCore = false;
        return description;
    }
};
template <typename... Fields>
[[nodiscard]] constexpr TypeDescription<sizeof...(Fields)> describe(std::string_view name, Fields... fields) {
    return {name, true, {fields...}};
}

/// How every type describes itself; specialised beside its struct. A template of the type (`&T::color`): where a file
/// has the struct alone, nothing of this is compiled.
template <typename T>
inline constexpr int kSaid = 0;
template <typename T>
struct Describing {};
/// Every type's own description.
template <typename T>
inline constexpr auto kDescription = kSaid<T>(Describing<T>());

/// The number of a member among its type's fields.
template <auto kMember>
[[nodiscard]] consteval FieldId findFieldId() {
    for (const FieldInfo& info : kDescription<typename FieldMember<decltype(kMember)>::Core>.fields)
        if (info.member == memberKey<kMember>()) return info.id;
    throw "this member is no field";
}
template <auto kMember>
inline constexpr FieldId fieldId = findFieldId<kMember>();

template <typename... Types>
struct TypeList {};
template <typename... A, typename... B>
TypeList<A..., B...> joinTypes(TypeList<A...>, TypeList<B...>);
template <typename A, typename B>
using JoinedTypes = decltype(joinTypes(A(), B()));
template <typename T, typename... Types>
[[nodiscard]] consteval bool isIn(TypeList<Types...>) {
    return (std::is_same_v<T, Types> || ...);
}
template <typename T, typename... Types>
[[nodiscard]] consteval std::size_t placeIn(TypeList<Types...> list) {
    static_assert(isIn<T>(list), "this type is not in the list");
    const bool same[] = {std::is_same_v<T, Types>...};
    return static_cast<std::size_t>(std::ranges::find(same, true) - std::begin(same));
}

}  // namespace tessera

#include "common/scene/FieldTable.h"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <new>
#include <unordered_set>

#include "common/base/Hash.h"
#include "common/scene/Cores.h"

namespace tessera {

namespace {

static_assert(std::endian::native == std::endian::little, "canonical bytes are little-endian");

// ---- hashing -------------------------------------------------------------------------------------------------------

/// A sum of products of 128 bits, folded: two words each, with a key of their own for their place among the others.
/// None waits for the one before it. Not cryptographic.
class WordHash {
public:
    explicit WordHash(std::uint64_t seed) : key_(seed ^ 0x9E3779B97F4A7C15ull) {}

    void put(std::uint64_t a, std::uint64_t b) {
        key_ += 0xA0761D6478BD642Full;
        sum_ += fold(a ^ key_, b ^ std::rotl(key_, 32) ^ 0xE7037ED1A0B428DBull);
    }
    void put(std::uint64_t a) { put(a, 0x8EBC6AF09C88C6E3ull); }
    void putBytes(ByteSpan bytes) { put(hash64(bytes), bytes.size()); }
    [[nodiscard]] std::uint64_t value() const { return fold(sum_ ^ 0x589965CC75374CC3ull, key_); }

private:
    /// A factor of zero would forget the other one: the factors themselves are kept in the sum.
    [[nodiscard]] static std::uint64_t fold(std::uint64_t a, std::uint64_t b) {
        const unsigned __int128 product = static_cast<unsigned __int128>(a) * b;
        return static_cast<std::uint64_t>(product) ^ static_cast<std::uint64_t>(product >> 64) ^ std::rotl(a, 23) ^ b;
    }
    std::uint64_t key_;
    std::uint64_t sum_ = 0;
};

template <typename Real>
std::uint64_t canonicalBits(Real value) {
    return std::bit_cast<std::conditional_t<sizeof(Real) == 8, std::uint64_t, std::uint32_t>>(value +
                                                                                              Real(0));  // -0 + 0 is +0
}

template <typename Real>
[[gnu::always_inline]] inline void putReals(WordHash& hash, const Real* values, std::size_t count) {
    if constexpr (sizeof(Real) == 8) {
        std::size_t i = 0;
        for (; i + 1 < count; i += 2) hash.put(canonicalBits(values[i]), canonicalBits(values[i + 1]));
        if (i < count) hash.put(canonicalBits(values[i]));
    } else {
        const auto pair = [&](std::size_t i) {
            return canonicalBits(values[i]) | (i + 1 < count ? canonicalBits(values[i + 1]) << 32 : 0);
        };
        hash.put(pair(0), count > 2 ? pair(2) : 0);
    }
}

template <FieldKind kind, std::size_t width>
[[gnu::always_inline]] inline void putField(WordHash& hash, const void* at) {
    if constexpr (kind == FieldKind::kFloat)
        putReals(hash, static_cast<const float*>(at), width);
    else if constexpr (kind == FieldKind::kDouble)
        putReals(hash, static_cast<const double*>(at), width);
    else if constexpr (kind == FieldKind::kMatrix)
        putReals(hash, static_cast<const double*>(at), 16);
    else if constexpr (kind == FieldKind::kInt)
        hash.put(static_cast<std::uint64_t>(*static_cast<const std::int64_t*>(at)));
    else if constexpr (kind == FieldKind::kRef)
        hash.put(static_cast<const ObjectId*>(at)->value);
    else if constexpr (kind == FieldKind::kBool)
        hash.put(*static_cast<const bool*>(at) ? 1 : 0);
    else if constexpr (kind == FieldKind::kText)
        hash.putBytes(asBytes(*static_cast<const std::string*>(at)));
    else if constexpr (kind == FieldKind::kRefs)
        hash.putBytes(std::as_bytes(std::span(*static_cast<const RefList*>(at))));
    else
        hash.put(static_cast<const Blob*>(at)->id().low, static_cast<const Blob*>(at)->id().high);
}

// ---- the table -----------------------------------------------------------------------------------------------------

template <typename T>
concept HasPose = requires(const T& core) {
    { core.pose() } -> std::same_as<NodePose>;
};

template <typename T>
concept HasLight = requires(const T& core) {
    { core.light() } -> std::same_as<LightSource>;
};

template <typename T>
struct Derived {
    static constexpr auto& kSaid = kDescription<T>;
    static constexpr std::size_t kCount = std::tuple_size_v<decltype(kSaid.fields)>;

    static consteval bool sound() {
        for (std::size_t i = 0; i < kCount; ++i)
            for (std::size_t j = 0; j < i; ++j)
                if (kSaid.fields[i].id == kSaid.fields[j].id || kSaid.fields[i].name == kSaid.fields[j].name)
                    return false;
        return true;
    }
    static_assert(sound(), "two fields of one type share a number or a name");

    static const T& fresh() {
        static const T object{};
        return object;
    }
    static const std::array<FieldEntry, kCount>& entries() {
        static const std::array<FieldEntry, kCount> kEntries = [] {
            std::array<FieldEntry, kCount> entries;
            T object{};
            for (std::size_t i = 0; i < kCount; ++i) {
                static_cast<FieldInfo&>(entries[i]) = kSaid.fields[i];
                entries[i].offset = static_cast<std::uint32_t>(static_cast<std::byte*>(kSaid.fields[i].at(&object)) -
                                                               reinterpret_cast<std::byte*>(&object));
            }
            return entries;
        }();
        return kEntries;
    }
    template <std::size_t... kIndex>
    static void putFields(WordHash& hash, const T& object, std::index_sequence<kIndex...>) {
        // The description is a constant, so kinds, widths and places are known when this is compiled.
        (putField<kSaid.fields[kIndex].kind, kSaid.fields[kIndex].width>(
             hash, kSaid.fields[kIndex].at(const_cast<T*>(&object))),
         ...);
    }
    static std::uint64_t hash(const void* object, std::uint64_t seed) {
        WordHash hash(seed);
        const T& value = *static_cast<const T*>(object);
        putFields(hash, value, std::make_index_sequence<kCount>());
        if constexpr (std::is_same_v<T, Node>) {
            hash.put(value.parent.value, value.children.size());
            hash.put(value.children.orderHash());
        }
        return hash.value();
    }
    static NodePose pose(const void* object) {
        if constexpr (HasPose<T>) return static_cast<const T*>(object)->pose();
        return {};
    }
    static void place(const void* object, const Affine3d& world_T_parent, Affine3d& world_T_node) {
        if constexpr (HasPose<T>) placeBelow(*static_cast<const T*>(object), world_T_parent, world_T_node);
    }
    static LightSource light(const void* object) {
        if constexpr (HasLight<T>) return static_cast<const T*>(object)->light();
        return {};
    }
    static TypeInfo make() {
        TypeInfo info;
        info.type = T::kType;
        info.index = kTypeIndex<T>;
        info.name = kSaid.name;
        info.isCore = kSaid.isCore;
        info.fields = entries();
        for (const FieldInfo& field : kSaid.fields) {
            info.effects = info.effects | field.effects;
            info.refers = info.refers || field.holdsRefs();
        }
        info.size = sizeof(T);
        info.alignment = alignof(T);
        info.construct = [](void* at) { new (at) T(); };
        if constexpr (std::is_copy_constructible_v<T>)
            info.copy = [](void* at, const void* from) { new (at) T(*static_cast<const T*>(from)); };
        info.destroy = [](void* at) { static_cast<T*>(at)->~T(); };
        info.hash = &hash;
        if constexpr (HasPose<T>) {
            info.pose = &pose;
            info.place = &place;
        }
        if constexpr (HasLight<T>) info.light = &light;
        info.fresh = &fresh();
        return info;
    }
};

struct Table {
    template <typename... Types>
    explicit Table(TypeList<Types...>) : types{Derived<Types>::make()...} {
        for (const TypeInfo& type : types) {
            if (type.type.value >= byNumber.size()) byNumber.resize(type.type.value + std::size_t{1});
            TESSERA_CHECK(!byNumber[type.type.value], "two types share a number");
            byNumber[type.type.value] = &type;
        }
    }
    std::vector<TypeInfo> types;
    std::vector<const TypeInfo*> byNumber;
};

// Others speak of a type by its number without its struct.
template <typename... Types>
constexpr bool numberedAsListed(TypeList<Types...>) {
    return ((Types::kType == typeOf<Types>()) && ...);
}
static_assert(numberedAsListed(ShippedTypes()), "a type's kType is not its place in ShippedTypes");

const Table& table() {
    static const Table kTable{SceneTypes()};
    return kTable;
}

}  // namespace

std::span<const TypeInfo> allTypes() {
    return table().types;
}

const TypeInfo* findType(ObjectType type) {
    const auto& byNumber = table().byNumber;
    return type.value < byNumber.size() ? byNumber[type.value] : nullptr;
}

const TypeInfo* findType(std::string_view name) {
    const auto it = std::ranges::find(table().types, name, &TypeInfo::name);
    return it == table().types.end() ? nullptr : &*it;
}

const FieldEntry* findField(const TypeInfo& type, FieldId id) {
    for (const FieldEntry& info : type.fields)
        if (info.id == id) return &info;
    return nullptr;
}

const FieldEntry* findField(const TypeInfo& type, std::string_view name) {
    for (const FieldEntry& info : type.fields)
        if (info.name == name) return &info;
    return nullptr;
}

std::uint64_t schemaHash() {
    std::string text;
    for (const TypeInfo& type : allTypes()) {
        text += fmt::format("{} {} {}\n", type.name, type.type.value, type.isCore);
        for (const FieldInfo& info : type.fields) {
            text += fmt::format("{} {} {} {} {} {} {} {} {}", info.name, info.id.value, static_cast<int>(info.kind),
                                info.width, info.refType.value_or(ObjectType()).value, info.anyObject,
                                static_cast<int>(info.wordUse), info.least, info.greatest);
            for (const FieldWord& word : info.words()) text += fmt::format(" {}={}", word.word, word.number);
            text += '\n';
        }
    }
    return hash64(asBytes(text));
}

void forEachRef(const Object& object, const std::function<void(ObjectId)>& visit) {
    if (!object.info().refers) return;
    for (const FieldEntry& field : object.info().fields) {
        if (field.kind == FieldKind::kRef) {
            if (const ObjectId to = *field.in<ObjectId>(object.data())) visit(to);
        } else if (field.kind == FieldKind::kRefs) {
            for (const ObjectId to : *field.in<RefList>(object.data())) visit(to);
        }
    }
}

void setAllFields(ChangeListBuilder& list, ObjectId id, const Object& object) {
    const TypeInfo& type = object.info();
    for (const FieldEntry& field : type.fields) {
        const FieldValue value = field.load(object);
        if (value != field.load(type.freshObject())) list.set(id, type.type, field.id, value);
    }
}

// ---- effects -------------------------------------------------------------------------------------------------------

Effect effectsOf(ObjectType type, FieldId field) {
    const TypeInfo* info = findType(type);
    const FieldEntry* entry = info ? findField(*info, field) : nullptr;
    return entry ? entry->effects : Effect::kNone;
}

Effect effectsOf(const ChangeList& list) {
    Effect all = list.placements.empty() ? Effect::kNone : Effect::kStructure;
    for (const FieldColumn& column : list.columns) all = all | effectsOf(column);
    for (const RangeEdit& range : list.ranges) all = all | effectsOf(range.type, range.field);
    return all;
}

// ---- words ---------------------------------------------------------------------------------------------------------

std::optional<std::int64_t> numberOfWord(const FieldInfo& field, std::string_view word) {
    const auto one = [&](std::string_view name) -> std::optional<std::int64_t> {
        for (const FieldWord& known : field.words())
            if (known.word == name) return known.number;
        return std::nullopt;
    };
    if (field.wordUse != WordUse::kFlags) return one(word);
    if (word == "none") return 0;
    std::int64_t bits = 0;
    for (;;) {
        const std::size_t comma = word.find(',');
        const std::optional<std::int64_t> bit = one(word.substr(0, comma));
        if (!bit) return std::nullopt;
        bits |= *bit;
        if (comma == std::string_view::npos) return bits;
        word.remove_prefix(comma + 1);
    }
}

std::optional<std::string> wordOfNumber(const FieldInfo& field, std::int64_t number) {
    if (field.wordUse == WordUse::kFlags) {
        if (number == 0) return "none";
        std::string words;
        for (const FieldWord& known : field.words())
            if (number & known.number) {
                words.append(words.empty() ? "" : ",").append(known.word);
                number &= ~known.number;
            }
        return number == 0 ? std::optional(words) : std::nullopt;
    }
    for (const FieldWord& known : field.words())
        if (known.number == number) return std::string(known.word);
    return std::nullopt;
}

// ---- values --------------------------------------------------------------------------------------------------------

Expected<void> checkValue(const FieldInfo& field, const FieldValue& value) {
    const auto bad = [&](std::string why) { return fail(ErrorCode::kBadInput, fmt::format("{} {}", field.name, why)); };
    if (kindOf(value) != field.kind || widthOf(value) != field.width)
        return bad(fmt::format("holds {} {}, not {} {}", field.width, nameOf(field.kind), widthOf(value),
                               nameOf(kindOf(value))));
    const auto checkNumber = [&](double number) -> Expected<void> {
        if (!std::isfinite(number)) return bad("is not a finite number");
        if (number < field.least || number > field.greatest)
            return bad(std::isfinite(field.greatest)
                           ? fmt::format("must be between {} and {}, not {}", field.least, field.greatest, number)
                           : fmt::format("must be at least {}, not {}", field.least, number));
        return {};
    };
    if (const auto* floats = std::get_if<Floats>(&value)) {
        for (std::size_t i = 0; i < field.width; ++i)
            if (auto ok = checkNumber(floats->values[i]); !ok) return ok;
    } else if (const auto* doubles = std::get_if<Doubles>(&value)) {
        double squared = 0;
        for (std::size_t i = 0; i < field.width; ++i) {
            if (auto ok = checkNumber(doubles->values[i]); !ok) return ok;
            squared += doubles->values[i] * doubles->values[i];
        }
        // Below and above, the square of the length no longer tells a direction that can be normalised.
        if (field.quaternion && !(squared >= 1e-100 && squared < 1e100))
            return bad(squared < 1 ? "is zero, which has no direction" : "is too long to be normalised");
    } else if (const auto* matrix = std::get_if<Matrix>(&value)) {
        for (const double number : matrix->values)
            if (auto ok = checkNumber(number); !ok) return ok;
    } else if (const auto* whole = std::get_if<std::int64_t>(&value)) {
        if (auto ok = checkNumber(static_cast<double>(*whole)); !ok) return ok;
        if (field.wordUse == WordUse::kOneOf && !wordOfNumber(field, *whole))
            return bad(fmt::format("is {}, which is none of its words", *whole));
    } else if (const auto* refs = std::get_if<RefList>(&value)) {
        std::unordered_set<ObjectId> seen;
        for (const ObjectId id : *refs)
            if (!id || !seen.insert(id).second) return bad(id ? "names an object twice" : "names none among others");
    }
    return {};
}

std::string takeNearest(const FieldInfo& field, FieldValue& value) {
    std::string said;
    const auto bring = [&]<typename Number>(Number& number) {
        const auto nearest = static_cast<Number>(std::clamp(static_cast<double>(number), field.least, field.greatest));
        if (!std::isfinite(number) || nearest == number) return;
        if (said.empty())
            said = fmt::format("{} {} is not between {} and {}: {} is taken", field.name, number, field.least,
                               field.greatest, nearest);
        number = nearest;
    };
    if (!field.nearestFromFiles) return said;
    if (auto* floats = std::get_if<Floats>(&value))
        std::ranges::for_each(std::span(floats->values).first(floats->width), bring);
    if (auto* doubles = std::get_if<Doubles>(&value))
        std::ranges::for_each(std::span(doubles->values).first(doubles->width), bring);
    return said;
}

}  // namespace tessera

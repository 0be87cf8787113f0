/// Ids and field values: the alphabet of changes. Knows no scene; `common/scene/FieldTable.h` gives them meaning.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "common/base/Blob.h"
#include "common/base/HistoryIds.h"

namespace tessera {

/// Name of a node or core, the same on every host, never given to another object. Ids from kFirstPlaceholder up stand
/// for objects that a proposal wants to create; the committer replaces them.
using ObjectId = StrongId<struct ObjectIdTag>;
inline constexpr std::uint64_t kFirstPlaceholder = std::uint64_t{1} << 63;
[[nodiscard]] constexpr bool isPlaceholder(ObjectId id) {
    return id.value >= kFirstPlaceholder;
}

/// The node that every scene has: exists in the empty scene, cannot be moved or destroyed.
inline constexpr ObjectId kRootNode{1};

/// Of simulation time.
inline constexpr double kSecondsPerFrame = 1.0 / 60.0;

using ObjectType = StrongId<struct ObjectTypeTag, std::uint16_t>;
using FieldId = StrongId<struct FieldIdTag, std::uint16_t>;

/// The shapes a field can have. Width is the number of scalars: 1 to 4 for the two float kinds, else 1. The numbers
/// stand on the wire.
enum class FieldKind : std::uint8_t { kFloat, kDouble, kInt, kRef, kText, kBlob, kBool, kRefs, kMatrix };
inline constexpr std::size_t kFieldKinds = 9;
/// For messages: "float", "reference list", …
[[nodiscard]] std::string_view nameOf(FieldKind kind);

struct Floats {
    std::array<float, 4> values{};
    std::uint8_t width = 1;
    bool operator==(const Floats&) const = default;
};
struct Doubles {
    std::array<double, 4> values{};
    std::uint8_t width = 1;
    bool operator==(const Doubles&) const = default;
};

/// References in their order. None of them is "none", and none stands there twice.
using RefList = std::vector<ObjectId>;
/// 4 × 4, column by column; acts on column vectors.
struct Matrix {
    std::array<double, 16> values{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    bool operator==(const Matrix&) const = default;
};

/// One value of one field. The variant's index is the FieldKind.
using FieldValue = std::variant<Floats, Doubles, std::int64_t, ObjectId, std::string, Blob, bool, RefList, Matrix>;

[[nodiscard]] inline FieldKind kindOf(const FieldValue& value) {
    return static_cast<FieldKind>(value.index());
}
[[nodiscard]] inline std::uint8_t widthOf(const FieldValue& value) {
    if (const auto* f = std::get_if<Floats>(&value)) return f->width;
    if (const auto* d = std::get_if<Doubles>(&value)) return d->width;
    return 1;
}

}  // namespace tessera

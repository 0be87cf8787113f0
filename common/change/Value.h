/// Ids and field values: the alphabet of changes. Knows no scene; `common/scene/FieldTable.h` gives them meaning.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <variant>

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

/// The shapes a field can have. Width is the number of scalars: 1 to 4 for the two float kinds, else 1.
enum class FieldKind : std::uint8_t { kFloat, kDouble, kInt, kRef, kText, kBlob };

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

/// One value of one field. The variant's index is the FieldKind.
using FieldValue = std::variant<Floats, Doubles, std::int64_t, ObjectId, std::string, Blob>;

[[nodiscard]] inline FieldKind kindOf(const FieldValue& value) {
    return static_cast<FieldKind>(value.index());
}
[[nodiscard]] inline std::uint8_t widthOf(const FieldValue& value) {
    if (const auto* f = std::get_if<Floats>(&value)) return f->width;
    if (const auto* d = std::get_if<Doubles>(&value)) return d->width;
    return 1;
}

}  // namespace tessera

#include <algorithm>

#include "common/base/Error.h"
#include "common/change/ChangeList.h"

namespace tessera {

namespace {

template <typename Packed, typename Scalar>
Packed unpack(const std::vector<Scalar>& values, std::size_t row, std::uint8_t width) {
    Packed packed;
    packed.width = width;
    std::copy_n(values.begin() + static_cast<std::ptrdiff_t>(row * width), width, packed.values.begin());
    return packed;
}

/// What a value of one scalar is called in a FieldValue.
template <typename Scalar>
using Single = std::conditional_t<std::is_same_v<Scalar, std::uint8_t>, bool, Scalar>;

}  // namespace

FieldValue FieldColumn::value(std::size_t row) const {
    TESSERA_CHECK(row < ids.size(), "a column has no such row");
    return std::visit(
        [&](const auto& all) -> FieldValue {
            using Scalar = typename std::decay_t<decltype(all)>::value_type;
            if constexpr (std::is_same_v<Scalar, float>)
                return unpack<Floats>(all, row, width);
            else if constexpr (std::is_same_v<Scalar, double>)
                return unpack<Doubles>(all, row, width);
            else if constexpr (std::is_same_v<Scalar, std::uint8_t>)
                return all[row] != 0;
            else
                return all[row];
        },
        values);
}

void FieldColumn::append(ObjectId id, const FieldValue& value) {
    TESSERA_CHECK(kindOf(value) == kind() && widthOf(value) == width,
                  "a value of another kind or width than its column");
    ids.push_back(id);
    std::visit(
        [&](auto& all) {
            using Scalar = typename std::decay_t<decltype(all)>::value_type;
            if constexpr (std::is_same_v<Scalar, float> || std::is_same_v<Scalar, double>) {
                const auto& packed =
                    std::get<std::conditional_t<std::is_same_v<Scalar, float>, Floats, Doubles>>(value);
                all.insert(all.end(), packed.values.begin(), packed.values.begin() + packed.width);
            } else {
                all.push_back(std::get<Single<Scalar>>(value));
            }
        },
        values);
}

void FieldColumn::assign(std::size_t row, const FieldValue& value) {
    TESSERA_CHECK(row < ids.size(), "a column has no such row");
    TESSERA_CHECK(kindOf(value) == kind() && widthOf(value) == width,
                  "a value of another kind or width than its column");
    std::visit(
        [&](auto& all) {
            using Scalar = typename std::decay_t<decltype(all)>::value_type;
            if constexpr (std::is_same_v<Scalar, float> || std::is_same_v<Scalar, double>) {
                const auto& packed =
                    std::get<std::conditional_t<std::is_same_v<Scalar, float>, Floats, Doubles>>(value);
                std::copy_n(packed.values.begin(), packed.width,
                            all.begin() + static_cast<std::ptrdiff_t>(row * width));
            } else {
                all[row] = std::get<Single<Scalar>>(value);
            }
        },
        values);
}

std::size_t FieldColumn::scalarCount() const {
    return std::visit([](const auto& v) { return v.size(); }, values);
}

namespace {

template <std::size_t... kKind>
FieldColumn::Values emptyValues(FieldKind kind, std::index_sequence<kKind...>) {
    static_assert(sizeof...(kKind) == kFieldKinds);
    static_assert(((std::variant_size_v<FieldValue> == kFieldKinds) && ... && (kKind < kFieldKinds)));
    FieldColumn::Values values;
    ((static_cast<std::size_t>(kind) == kKind ? static_cast<void>(values.emplace<kKind>()) : void()), ...);
    return values;
}

}  // namespace

FieldColumn FieldColumn::ofShape(ObjectType type, FieldId field, FieldKind kind, std::uint8_t width) {
    FieldColumn column;
    column.type = type;
    column.field = field;
    column.width = width;
    column.values = emptyValues(kind, std::make_index_sequence<std::variant_size_v<Values>>());
    return column;
}

std::size_t ChangeList::changeCount() const {
    std::size_t count = creations.size() + placements.size() + ranges.size() + destructions.size();
    for (const FieldColumn& column : columns) count += column.ids.size();
    return count;
}

std::string_view nameOf(FieldKind kind) {
    static constexpr std::array<std::string_view, kFieldKinds> kNames = {
        "float", "double", "int", "ref", "text", "blob", "bool", "reference list", "matrix"};
    return kNames[static_cast<std::size_t>(kind)];
}

}  // namespace tessera

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

}  // namespace

FieldValue FieldColumn::value(std::size_t row) const {
    TESSERA_CHECK(row < ids.size(), "a column has no such row");
    switch (kind()) {
        case FieldKind::kFloat:
            return unpack<Floats>(std::get<std::vector<float>>(values), row, width);
        case FieldKind::kDouble:
            return unpack<Doubles>(std::get<std::vector<double>>(values), row, width);
        case FieldKind::kInt:
            return std::get<std::vector<std::int64_t>>(values)[row];
        case FieldKind::kRef:
            return std::get<std::vector<ObjectId>>(values)[row];
        case FieldKind::kText:
            return std::get<std::vector<std::string>>(values)[row];
        case FieldKind::kBlob:
            return std::get<std::vector<Blob>>(values)[row];
    }
    return {};
}

void FieldColumn::append(ObjectId id, const FieldValue& value) {
    TESSERA_CHECK(kindOf(value) == kind() && widthOf(value) == width,
                  "a value of another kind or width than its column");
    ids.push_back(id);
    std::visit(
        [&](const auto& v) {
            using V = std::decay_t<decltype(v)>;
            if constexpr (std::is_same_v<V, Floats>) {
                auto& all = std::get<std::vector<float>>(values);
                all.insert(all.end(), v.values.begin(), v.values.begin() + v.width);
            } else if constexpr (std::is_same_v<V, Doubles>) {
                auto& all = std::get<std::vector<double>>(values);
                all.insert(all.end(), v.values.begin(), v.values.begin() + v.width);
            } else {
                std::get<std::vector<V>>(values).push_back(v);
            }
        },
        value);
}

void FieldColumn::assign(std::size_t row, const FieldValue& value) {
    TESSERA_CHECK(row < ids.size(), "a column has no such row");
    TESSERA_CHECK(kindOf(value) == kind() && widthOf(value) == width,
                  "a value of another kind or width than its column");
    std::visit(
        [&](const auto& v) {
            using V = std::decay_t<decltype(v)>;
            const auto at = static_cast<std::ptrdiff_t>(row * width);
            if constexpr (std::is_same_v<V, Floats>) {
                std::copy_n(v.values.begin(), v.width, std::get<std::vector<float>>(values).begin() + at);
            } else if constexpr (std::is_same_v<V, Doubles>) {
                std::copy_n(v.values.begin(), v.width, std::get<std::vector<double>>(values).begin() + at);
            } else {
                std::get<std::vector<V>>(values)[row] = v;
            }
        },
        value);
}

std::size_t FieldColumn::scalarCount() const {
    return std::visit([](const auto& v) { return v.size(); }, values);
}

FieldColumn FieldColumn::ofShape(ObjectType type, FieldId field, FieldKind kind, std::uint8_t width) {
    FieldColumn column;
    column.type = type;
    column.field = field;
    column.width = width;
    switch (kind) {
        case FieldKind::kFloat:
            column.values = std::vector<float>();
            break;
        case FieldKind::kDouble:
            column.values = std::vector<double>();
            break;
        case FieldKind::kInt:
            column.values = std::vector<std::int64_t>();
            break;
        case FieldKind::kRef:
            column.values = std::vector<ObjectId>();
            break;
        case FieldKind::kText:
            column.values = std::vector<std::string>();
            break;
        case FieldKind::kBlob:
            column.values = std::vector<Blob>();
            break;
    }
    return column;
}

std::size_t ChangeList::changeCount() const {
    std::size_t count = creations.size() + placements.size() + destructions.size();
    for (const FieldColumn& column : columns) count += column.ids.size();
    return count;
}

}  // namespace tessera

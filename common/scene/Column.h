/// New values of one member for many objects, written straight into the packed column of a change list.
#pragma once

#include "common/scene/FieldTable.h"

namespace tessera {

/// `Column<&Transform::translation> column(n); column.add(id, t); … list.columns.push_back(column.take());` No look-up
/// per value as in a ChangeListBuilder, so the ids have to be distinct, and each (type, field) stands in a list once.
template <auto kMember>
class Column {
    using Member = FieldMember<decltype(kMember)>;
    using Shape = FieldShape<typename Member::Type>;
    using Values = std::variant_alternative_t<static_cast<std::size_t>(Shape::kKind), FieldColumn::Values>;

public:
    explicit Column(std::size_t rows)
        : column_(FieldColumn::ofShape(typeOf<typename Member::Core>(), fieldId<kMember>, Shape::kKind, Shape::kWidth)),
          values_(std::get<Values>(column_.values)) {
        column_.ids.reserve(rows);
        values_.reserve(rows * Shape::kWidth);
    }
    Column(const Column&) = delete;
    Column& operator=(const Column&) = delete;

    void add(ObjectId id, const typename Member::Type& value) {
        column_.ids.push_back(id);
        if constexpr (requires { Shape::numbers(value); })
            for (const auto number : Shape::numbers(value)) values_.push_back(number);
        else
            values_.push_back(value);
    }
    [[nodiscard]] FieldColumn take() { return std::move(column_); }

private:
    FieldColumn column_;
    Values& values_;
};

}  // namespace tessera

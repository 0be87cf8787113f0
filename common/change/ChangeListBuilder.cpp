#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <unordered_map>
#include <utility>

#include "common/change/ChangeList.h"

namespace tessera {

/// A column that finds its rows by id. Ids mostly arrive in ascending order; as long as they do, the column itself is
/// the index and no other is built.
class GrowingColumn {
public:
    explicit GrowingColumn(FieldColumn column) : column_(std::move(column)) {}

    void set(ObjectId id, const FieldValue& value) {
        if (const auto row = rowOf(id))
            column_.assign(*row, value);
        else
            column_.append(id, value);
    }
    template <typename Scalar>
    void set(ObjectId id, std::span<const Scalar> numbers) {
        auto* all = std::get_if<std::vector<Scalar>>(&column_.values);
        TESSERA_CHECK(all && numbers.size() == column_.width, "numbers of another kind or width than their column");
        if (const auto row = rowOf(id)) {
            std::ranges::copy(numbers, all->begin() + static_cast<std::ptrdiff_t>(*row * column_.width));
        } else {
            column_.ids.push_back(id);
            for (const Scalar number : numbers) all->push_back(number);
        }
    }

    [[nodiscard]] FieldColumn take() { return std::move(column_); }

private:
    /// The row of an id; nothing where it is new and about to be appended.
    [[nodiscard]] std::optional<std::size_t> rowOf(ObjectId id) {
        if (ascending_ && (column_.ids.empty() || column_.ids.back() < id)) return std::nullopt;
        if (const auto row = find(id)) return row;
        if (ascending_) leaveAscendingOrder();
        rows_.emplace(id, column_.ids.size());
        return std::nullopt;
    }
    [[nodiscard]] std::optional<std::size_t> find(ObjectId id) const {
        if (!ascending_) {
            const auto it = rows_.find(id);
            return it == rows_.end() ? std::nullopt : std::optional(it->second);
        }
        const auto it = std::lower_bound(column_.ids.begin(), column_.ids.end(), id);
        if (it == column_.ids.end() || *it != id) return std::nullopt;
        return static_cast<std::size_t>(it - column_.ids.begin());
    }
    void leaveAscendingOrder() {
        ascending_ = false;
        rows_.reserve(column_.ids.size() + 1);
        for (std::size_t row = 0; row < column_.ids.size(); ++row) rows_.emplace(column_.ids[row], row);
    }

    FieldColumn column_;
    bool ascending_ = true;
    std::unordered_map<ObjectId, std::size_t> rows_;
};

struct ChangeListBuilder::Impl {
    using Key = std::pair<ObjectType, FieldId>;
    struct AtHand {
        Key key;
        GrowingColumn* column = nullptr;
    };

    GrowingColumn& column(ObjectType type, FieldId field, FieldKind kind, std::size_t width) {
        AtHand& hand = atHand[(type.value * 4u + field.value) % atHand.size()];
        const Key key(type, field);
        if (!hand.column || hand.key != key) {
            auto it = columns.find(key);
            if (it == columns.end())
                it = columns.emplace(key, FieldColumn::ofShape(type, field, kind, static_cast<std::uint8_t>(width)))
                         .first;
            hand = {key, &it->second};
        }
        return *hand.column;
    }

    ChangeList list;
    std::map<Key, GrowingColumn> columns;
    std::array<AtHand, 64> atHand;  ///< many edits set the same few fields in turn
};

ChangeListBuilder::ChangeListBuilder() : impl_(std::make_unique<Impl>()) {}
ChangeListBuilder::~ChangeListBuilder() = default;
ChangeListBuilder::ChangeListBuilder(ChangeListBuilder&&) noexcept = default;
ChangeListBuilder& ChangeListBuilder::operator=(ChangeListBuilder&&) noexcept = default;

void ChangeListBuilder::create(ObjectId id, ObjectType type) {
    impl_->list.creations.push_back({id, type});
}

void ChangeListBuilder::place(ObjectId node, ObjectId parent, std::uint32_t index) {
    impl_->list.placements.push_back({node, parent, index});
}

void ChangeListBuilder::set(ObjectId id, ObjectType type, FieldId field, const FieldValue& value) {
    impl_->column(type, field, kindOf(value), widthOf(value)).set(id, value);
}

void ChangeListBuilder::set(ObjectId id, ObjectType type, FieldId field, std::span<const double> numbers) {
    impl_->column(type, field, FieldKind::kDouble, numbers.size()).set(id, numbers);
}

void ChangeListBuilder::set(ObjectId id, ObjectType type, FieldId field, std::span<const float> numbers) {
    impl_->column(type, field, FieldKind::kFloat, numbers.size()).set(id, numbers);
}

void ChangeListBuilder::setRange(ObjectId id, ObjectType type, FieldId field, std::uint64_t offset, Blob bytes) {
    impl_->list.ranges.push_back({id, type, field, offset, std::move(bytes), {}});
}

void ChangeListBuilder::destroy(ObjectId id) {
    impl_->list.destructions.push_back(id);
}

bool ChangeListBuilder::empty() const {
    return impl_->list.empty() && impl_->columns.empty();
}

ChangeList ChangeListBuilder::take() {
    ChangeList list = std::exchange(impl_->list, {});
    list.columns.reserve(impl_->columns.size());
    for (auto& [key, column] : impl_->columns) list.columns.push_back(column.take());
    impl_->columns.clear();
    impl_->atHand = {};
    return list;
}

}  // namespace tessera

#include <algorithm>
#include <map>
#include <optional>
#include <unordered_map>
#include <utility>

#include "common/change/ChangeList.h"

namespace tessera {

namespace {

/// A column that finds its rows by id. Ids mostly arrive in ascending order; as long as they do, the column itself is
/// the index and no other is built.
class GrowingColumn {
public:
    explicit GrowingColumn(FieldColumn column) : column_(std::move(column)) {}

    void set(ObjectId id, const FieldValue& value) {
        if (const auto row = find(id)) {
            column_.assign(*row, value);
            return;
        }
        if (ascending_ && !column_.ids.empty() && id < column_.ids.back()) leaveAscendingOrder();
        if (!ascending_) rows_.emplace(id, column_.ids.size());
        column_.append(id, value);
    }

    [[nodiscard]] FieldColumn take() { return std::move(column_); }

private:
    [[nodiscard]] std::optional<std::size_t> find(ObjectId id) const {
        if (!ascending_) {
            const auto it = rows_.find(id);
            return it == rows_.end() ? std::nullopt : std::optional(it->second);
        }
        if (column_.ids.empty() || column_.ids.back() < id) return std::nullopt;
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

}  // namespace

struct ChangeListBuilder::Impl {
    ChangeList list;
    std::map<std::pair<ObjectType, FieldId>, GrowingColumn> columns;
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
    const auto key = std::pair(type, field);
    auto it = impl_->columns.find(key);
    if (it == impl_->columns.end())
        it =
            impl_->columns.emplace(key, GrowingColumn(FieldColumn::ofShape(type, field, kindOf(value), widthOf(value))))
                .first;
    it->second.set(id, value);
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
    return list;
}

}  // namespace tessera

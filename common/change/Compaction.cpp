#include <algorithm>
#include <unordered_set>

#include "common/change/ChangeList.h"

namespace tessera {

namespace {

/// Several lists on their way to becoming one.
///
/// Grouping moves the destructions of an early list behind the placements and columns of a later one. That is sound
/// because nothing later mentions a destroyed object, unless the id is created anew: there a new list has to start.
class MergedList {
public:
    [[nodiscard]] bool canTake(const ChangeList& next) const {
        return std::none_of(next.creations.begin(), next.creations.end(),
                            [&](const Creation& c) { return destroyed_.contains(c.id); });
    }

    void add(const ChangeList& next) {
        empty_ = false;
        for (const Creation& c : next.creations) created_.insert(c.id);
        for (const Placement& p : next.placements) {
            placed_.insert(p.node);
            placed_.insert(p.parent);
        }
        for (const ObjectId id : next.destructions) destroyed_.insert(id);
        append(creations_, next.creations);
        append(placements_, next.placements);
        append(destructions_, next.destructions);
        for (const FieldColumn& column : next.columns) {
            if (!ranges_.empty() && column.kind() == FieldKind::kBlob) dropOverwritten(column);
            for (std::size_t row = 0; row < column.ids.size(); ++row)
                values_.set(column.ids[row], column.type, column.field, column.value(row));
        }
        append(ranges_, next.ranges);
        nextFreeId_ = std::max(nextFreeId_, next.nextFreeId);
    }

    [[nodiscard]] bool empty() const { return empty_; }

    [[nodiscard]] ChangeList take() {
        ChangeList list = values_.take();
        list.nextFreeId = nextFreeId_;
        list.placements = std::move(placements_);
        for (const Creation& c : creations_) {
            if (!cameAndWent(c.id))
                list.creations.push_back(c);
            else
                list.nextFreeId = std::max(list.nextFreeId, c.id.value + 1);
        }
        for (const ObjectId id : destructions_)
            if (!cameAndWent(id)) list.destructions.push_back(id);
        for (FieldColumn& column : list.columns) dropRowsOfDestroyed(column);
        std::erase_if(list.columns, [](const FieldColumn& column) { return column.ids.empty(); });
        std::erase_if(ranges_, [&](const RangeEdit& range) { return destroyed_.contains(range.object); });
        list.ranges = std::move(ranges_);
        return list;
    }

private:
    template <typename T>
    static void append(std::vector<T>& all, const std::vector<T>& more) {
        all.insert(all.end(), more.begin(), more.end());
    }
    /// An object that is neither there before nor after. One with placements stays: it shifts its siblings' indices.
    [[nodiscard]] bool cameAndWent(ObjectId id) const {
        return created_.contains(id) && destroyed_.contains(id) && !placed_.contains(id);
    }
    /// Ranges stand behind all columns: those of an array that is replaced later must not come back.
    void dropOverwritten(const FieldColumn& column) {
        const std::unordered_set<ObjectId> replaced(column.ids.begin(), column.ids.end());
        std::erase_if(ranges_, [&](const RangeEdit& range) {
            return range.type == column.type && range.field == column.field && replaced.contains(range.object);
        });
    }
    void dropRowsOfDestroyed(FieldColumn& column) const {
        if (std::none_of(column.ids.begin(), column.ids.end(), [&](ObjectId id) { return destroyed_.contains(id); }))
            return;
        FieldColumn kept = FieldColumn::ofShape(column.type, column.field, column.kind(), column.width);
        for (std::size_t row = 0; row < column.ids.size(); ++row)
            if (!destroyed_.contains(column.ids[row])) kept.append(column.ids[row], column.value(row));
        column = std::move(kept);
    }

    std::vector<Creation> creations_;
    std::vector<Placement> placements_;
    std::vector<RangeEdit> ranges_;
    std::vector<ObjectId> destructions_;
    ChangeListBuilder values_;
    std::unordered_set<ObjectId> created_, placed_, destroyed_;
    std::uint64_t nextFreeId_ = 0;
    bool empty_ = true;
};

}  // namespace

std::vector<ChangeList> compact(std::span<const ChangeListPtr> lists) {
    std::vector<ChangeList> compacted;
    MergedList merged;
    for (const ChangeListPtr& list : lists) {
        if (!merged.canTake(*list)) {
            compacted.push_back(merged.take());
            merged = MergedList();
        }
        merged.add(*list);
    }
    if (!merged.empty()) compacted.push_back(merged.take());
    return compacted;
}

}  // namespace tessera

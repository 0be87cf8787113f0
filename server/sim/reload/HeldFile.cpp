#include "server/sim/reload/HeldFile.h"

#include <algorithm>
#include <numeric>
#include <unordered_set>
#include <utility>

#include "common/base/Hash.h"
#include "common/cores/Node.h"

namespace tessera {
namespace {

constexpr std::uint64_t placeAmongAll(ObjectId id) {
    return id.value - kFirstPlaceholder;
}

std::uint64_t mixed(std::uint64_t hash, std::uint64_t more) {
    const std::uint64_t both[] = {hash, more};
    return hash64(std::as_bytes(std::span(both)));
}

std::uint64_t hashOf(const FieldValue& value) {
    return std::visit(
        [](const auto& one) -> std::uint64_t {
            using One = std::decay_t<decltype(one)>;
            if constexpr (std::is_same_v<One, Floats> || std::is_same_v<One, Doubles>)
                return hash64(std::as_bytes(std::span(one.values).first(one.width)));
            else if constexpr (std::is_same_v<One, Matrix>)
                return hash64(std::as_bytes(std::span(one.values)));
            else if constexpr (std::is_same_v<One, std::string>)
                return hash64(asBytes(one));
            else if constexpr (std::is_same_v<One, Blob>)
                return hash64(std::as_bytes(std::span(&one.id(), 1)));
            else if constexpr (std::is_same_v<One, std::int64_t> || std::is_same_v<One, bool>)
                return static_cast<std::uint64_t>(one);
            else
                return 0;  // references
        },
        value);
}

/// Counted into rows of one array: `starts[i]` of what belongs to i.
void sumUp(std::vector<std::uint32_t>& starts) {
    std::inclusive_scan(starts.begin(), starts.end(), starts.begin());
}

}  // namespace

std::optional<HeldFile> HeldFile::of(const ChangeList& list) {
    for (std::size_t i = 0; i < list.creations.size(); ++i)
        if (placeAmongAll(list.creations[i].id) != i || !findType(list.creations[i].type)) return std::nullopt;
    HeldFile held{.list = list, .ids = std::vector<ObjectId>(list.creations.size())};
    for (const Placement& placement : list.placements)
        if (placement.parent && !isPlaceholder(placement.parent) && held.tops.size() < kMostTops)
            held.tops.push_back(static_cast<std::uint32_t>(placeAmongAll(placement.node)));
    for (FieldColumn& column : held.list.columns)
        if (auto* arrays = std::get_if<std::vector<Blob>>(&column.values))
            for (Blob& array : *arrays)
                if (!array.empty()) array = Blob::absent(array.id(), array.sizeBytes());
    held.bytes = held.count();
    return held;
}

void HeldFile::standsFrom(ObjectId first) {
    for (std::size_t i = 0; i < ids.size(); ++i) ids[i] = ObjectId(first.value + i);
}

void HeldFile::write(const ChangeList& others, std::span<const ObjectId> idsOfMore) {
    list.creations.insert(list.creations.end(), others.creations.begin(), others.creations.end());
    ids.insert(ids.end(), idsOfMore.begin(), idsOfMore.end());
    const auto order = [](const FieldColumn& column) { return std::pair(column.type, column.field); };
    for (const FieldColumn& column : others.columns) {
        const auto same = std::ranges::find(list.columns, order(column), order);
        if (same == list.columns.end()) {
            list.columns.insert(std::ranges::upper_bound(list.columns, order(column), {}, order), column);
            continue;
        }
        const std::unordered_set<ObjectId> written(column.ids.begin(), column.ids.end());
        FieldColumn all = FieldColumn::ofShape(same->type, same->field, same->kind(), same->width);
        for (std::size_t row = 0; row < same->ids.size(); ++row)
            if (!written.contains(same->ids[row])) all.append(same->ids[row], same->value(row));
        for (std::size_t row = 0; row < column.ids.size(); ++row) all.append(column.ids[row], column.value(row));
        *same = std::move(all);
    }
    bytes = count();
}

std::size_t HeldFile::count() const {
    std::size_t sum = list.creations.size() * sizeof(Creation) + list.placements.size() * sizeof(Placement) +
                      ids.size() * sizeof(ObjectId) + leftOut.size() * sizeof(std::uint32_t);
    for (const FieldColumn& column : list.columns) {
        sum += column.ids.size() * sizeof(ObjectId);
        std::visit(
            [&](const auto& values) {
                using Scalar = typename std::decay_t<decltype(values)>::value_type;
                sum += values.size() * sizeof(Scalar);
                if constexpr (std::is_same_v<Scalar, std::string> || std::is_same_v<Scalar, RefList>) {
                    for (const auto& one : values)
                        if (!std::is_same_v<Scalar, std::string> || one.capacity() > 15)
                            sum += one.capacity() * sizeof(one[0]);
                }
                if constexpr (std::is_same_v<Scalar, Blob>) sum += values.size() * 128;  // a name each
            },
            column.values);
    }
    return sum;
}

FileObjects::FileObjects(const ChangeList& list) : list_(list) {
    const std::size_t count = list.creations.size();
    for (const Creation& creation : list.creations) types_.push_back(findType(creation.type));
    parents_.assign(count, kNone);
    childStarts_.assign(count + 2, 0);
    std::vector<std::uint32_t> hangsBelow(count, kNone);  // `count`: what is not of the file
    for (const Placement& placement : list.placements) {
        const std::uint32_t node = placeOf(placement.node);
        if (node == kNone) continue;
        parents_[node] = placeOf(placement.parent);
        hangsBelow[node] = !placement.parent ? kNone : std::min(parents_[node], static_cast<std::uint32_t>(count));
    }
    for (const std::uint32_t below : hangsBelow)
        if (below != kNone) ++childStarts_[below + 1];
    sumUp(childStarts_);
    children_.resize(childStarts_.back());
    std::vector<std::uint32_t> next = childStarts_;
    for (const Placement& placement : list.placements) {
        const std::uint32_t node = placeOf(placement.node);
        if (node != kNone && hangsBelow[node] != kNone)
            children_[next[std::exchange(hangsBelow[node], kNone)]++] = node;
    }

    rowStarts_.assign(count + 1, 0);
    for (const FieldColumn& column : list.columns)
        for (const ObjectId id : column.ids)
            if (const std::uint32_t place = placeOf(id); place != kNone) ++rowStarts_[place + 1];
    sumUp(rowStarts_);
    rows_.resize(rowStarts_.back());
    next = rowStarts_;
    for (std::uint32_t number = 0; number < list.columns.size(); ++number)
        for (std::uint32_t row = 0; row < list.columns[number].ids.size(); ++row)
            if (const std::uint32_t place = placeOf(list.columns[number].ids[row]); place != kNone)
                rows_[next[place]++] = {number, row};
}

std::uint32_t FileObjects::placeOf(ObjectId id) const {
    const std::uint64_t place = placeAmongAll(id);
    return isPlaceholder(id) && place < types_.size() ? static_cast<std::uint32_t>(place) : kNone;
}

std::span<const std::uint32_t> FileObjects::children(std::uint32_t node) const {
    return std::span(children_).subspan(childStarts_[node], childStarts_[node + 1] - childStarts_[node]);
}

std::span<const FileObjects::Row> FileObjects::rowsOf(std::uint32_t place) const {
    return std::span(rows_).subspan(rowStarts_[place], rowStarts_[place + 1] - rowStarts_[place]);
}

FieldValue FileObjects::value(std::uint32_t place, const FieldEntry& field) const {
    const TypeInfo& type = *types_[place];
    for (const Row& row : rowsOf(place)) {
        const FieldColumn& column = list_.columns[row.column];
        if (column.field != field.id || column.type != type.type) continue;
        return column.value(row.row);
    }
    return field.load(type.freshObject());
}

std::uint64_t FileObjects::contentHash(std::uint32_t place) const {
    std::uint64_t hash = types_[place]->type.value;
    // Rows are in the order of the columns, which is that of types and fields.
    for (const Row& row : rowsOf(place)) {
        const FieldColumn& column = list_.columns[row.column];
        hash = mixed(mixed(hash, column.field.value), hashOf(column.value(row.row)));
    }
    return hash;
}

}  // namespace tessera

#include "server/sim/frame/LoadParts.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

#include "common/cores/Animation.h"
#include "common/cores/Motion.h"
#include "common/scene/FieldTable.h"

namespace tessera {
namespace {

/// What is created, by its place among the placeholders.
constexpr std::uint64_t placeOf(ObjectId id) {
    return id.value - kFirstPlaceholder;
}

bool mayBeCut(const ChangeList& list) {
    const std::uint64_t count = list.creations.size();
    if (!list.ranges.empty() || !list.destructions.empty() || count > 0xffffffffu) return false;
    std::vector<bool> created(count), placed(count);
    for (const Creation& creation : list.creations) {
        const std::uint64_t place = placeOf(creation.id);
        if (place >= count || created[place]) return false;
        created[place] = true;
    }
    for (const Placement& placement : list.placements) {
        const std::uint64_t node = placeOf(placement.node);
        if (node >= count || placed[node] || placement.index != Placement::kLast) return false;
        placed[node] = true;
    }
    return list.columns.size() < 0xffff;
}

FieldColumn shapeOf(const FieldColumn& column) {
    return FieldColumn::ofShape(column.type, column.field, column.kind(), column.width);
}

/// Takes a row out of a column that nobody reads again.
void moveRow(FieldColumn& from, std::size_t row, FieldColumn& to) {
    to.ids.push_back(from.ids[row]);
    std::visit(
        [&](auto& values) {
            using Values = std::decay_t<decltype(values)>;
            using Scalar = typename Values::value_type;
            auto& target = std::get<Values>(to.values);
            if constexpr (std::is_same_v<Scalar, float> || std::is_same_v<Scalar, double>) {
                const auto first = values.begin() + static_cast<std::ptrdiff_t>(row * from.width);
                target.insert(target.end(), first, first + from.width);
            } else {
                target.push_back(std::move(values[row]));
            }
        },
        from.values);
}

std::size_t bytesOf(const FieldColumn& column, std::size_t row) {
    if (const auto* texts = std::get_if<std::vector<std::string>>(&column.values)) return 8 + (*texts)[row].size();
    if (const auto* refs = std::get_if<std::vector<RefList>>(&column.values)) return 8 + 8 * (*refs)[row].size();
    return 8 + (column.kind() == FieldKind::kMatrix ? sizeof(Matrix) : std::size_t{8} * column.width);
}

/// The greatest place among the objects that a row refers to, as far as the list creates them.
std::uint64_t lastReferred(const FieldColumn& column, std::size_t row, std::uint64_t count) {
    std::uint64_t last = 0;
    const auto look = [&](ObjectId id) {
        if (placeOf(id) < count) last = std::max(last, placeOf(id));
    };
    if (const auto* refs = std::get_if<std::vector<ObjectId>>(&column.values)) look((*refs)[row]);
    if (const auto* lists = std::get_if<std::vector<RefList>>(&column.values))
        for (const ObjectId id : (*lists)[row]) look(id);
    return last;
}

/// What plays from the beginning stands still; what sets those going that are to play is returned.
FieldColumn holdPlaying(ChangeList& list, ObjectType type, FieldId field) {
    const auto order = [](const FieldColumn& column) { return std::pair(column.type, column.field); };
    FieldColumn go = FieldColumn::ofShape(type, field, FieldKind::kBool, 1);
    std::vector<ObjectId> players;
    for (const Creation& creation : list.creations)
        if (creation.type == type) players.push_back(creation.id);
    if (players.empty()) return go;
    auto at = std::ranges::lower_bound(list.columns, std::pair(type, field), {}, order);
    if (at == list.columns.end() || order(*at) != std::pair(type, field)) at = list.columns.insert(at, go);
    auto* playing = std::get_if<std::vector<std::uint8_t>>(&at->values);
    if (!playing) return go;  // the scene refuses it in words
    std::vector<ObjectId> spokenOf = at->ids;
    std::ranges::sort(spokenOf);
    for (std::size_t row = 0; row < at->ids.size() && row < playing->size(); ++row)
        if (placeOf(at->ids[row]) < list.creations.size() && std::exchange((*playing)[row], std::uint8_t{0}) != 0)
            go.append(at->ids[row], true);
    for (const ObjectId id : players) {
        if (std::ranges::binary_search(spokenOf, id)) continue;
        at->append(id, false);
        go.append(id, true);
    }
    return go;
}

/// The list as a stream of single changes, each as early as all that it speaks of is there; cut wherever it is full.
class Cutter {
public:
    Cutter(ChangeList list, const LoadPartLimits& limits)
        : list_(std::move(list)), limits_(limits), count_(list_.creations.size()),
          go_{holdPlaying(list_, typeOf<Motion>(), fieldId<&Motion::playing>), holdPlaying(list_, typeOf<Animation>(), fieldId<&Animation::playing>)} {
        std::ranges::sort(list_.creations, {}, &Creation::id);
    }

    LoadParts run() {
        order();
        open_.assign(list_.columns.size(), {});
        for (const Change& change : stream_) take(change);
        close();
        parts_.lists.push_back(lastOne());
        parts_.objects = count_;
        return std::move(parts_);
    }

private:
    static constexpr std::uint16_t kCreation = 0xffff, kPlacement = 0xfffe;
    struct Change {
        std::uint32_t row = 0;
        std::uint16_t what = 0;  ///< a column, or one of the above
    };

    /// Counted, then put in order: the stream is as long as the list, and nothing is compared.
    void order() {
        std::vector<std::uint32_t> placedBelow(count_);
        std::vector<std::uint32_t> starts(count_ + 1);
        visit(placedBelow, [&](std::uint64_t when, Change) { ++starts[when + 1]; });
        std::inclusive_scan(starts.begin(), starts.end(), starts.begin());
        stream_.resize(starts.back());
        std::ranges::fill(placedBelow, 0u);
        visit(placedBelow, [&](std::uint64_t when, Change change) { stream_[starts[when]++] = change; });
    }

    /// `found` is given each change that can be made before the end, with the place of the last object that it speaks of.
    /// `placedBelow`: of each node, when its newest child was placed; children keep their order.
    template <typename Found>
    void visit(std::vector<std::uint32_t>& placedBelow, Found&& found) {
        for (std::uint32_t row = 0; row < count_; ++row) found(row, Change{row, kCreation});
        for (std::size_t row = 0; row < list_.placements.size(); ++row) {
            const Placement& placement = list_.placements[row];
            const std::uint64_t parent = placeOf(placement.parent);
            if (parent >= count_) continue;
            const std::uint64_t when = std::max({placeOf(placement.node), parent, std::uint64_t{placedBelow[parent]}});
            placedBelow[parent] = static_cast<std::uint32_t>(when);
            found(when, Change{static_cast<std::uint32_t>(row), kPlacement});
        }
        for (std::size_t number = 0; number < list_.columns.size(); ++number) {
            const FieldColumn& column = list_.columns[number];
            for (std::size_t row = 0; row < column.ids.size(); ++row) {
                const std::uint64_t object = placeOf(column.ids[row]);
                if (object >= count_) continue;
                found(std::max(object, lastReferred(column, row, count_)),
                      Change{static_cast<std::uint32_t>(row), static_cast<std::uint16_t>(number)});
            }
        }
    }

    void take(const Change& change) {
        std::size_t bytes = 24;
        if (change.what < kPlacement) bytes = bytesOf(list_.columns[change.what], change.row);
        if (changes_ > 0 && (changes_ >= limits_.changes || bytes_ + bytes > limits_.bytes)) close();
        ++changes_;
        bytes_ += bytes;
        if (change.what == kCreation) {
            part_.creations.push_back(list_.creations[change.row]);
        } else if (change.what == kPlacement) {
            part_.placements.push_back(list_.placements[change.row]);
        } else {
            FieldColumn& column = open_[change.what];
            if (column.ids.empty()) column = shapeOf(list_.columns[change.what]);
            moveRow(list_.columns[change.what], change.row, column);
        }
    }

    void close() {
        if (changes_ == 0) return;
        for (FieldColumn& column : open_)
            if (!column.ids.empty()) part_.columns.push_back(std::exchange(column, {}));
        parts_.lists.push_back(std::exchange(part_, {}));
        changes_ = bytes_ = 0;
    }

    /// What has to do with objects that were there before, and what plays.
    ChangeList lastOne() {
        ChangeList last;
        for (const Placement& placement : list_.placements)
            if (placeOf(placement.parent) >= count_) last.placements.push_back(placement);
        for (FieldColumn& column : list_.columns) {
            FieldColumn rows = shapeOf(column);
            for (std::size_t row = 0; row < column.ids.size(); ++row)
                if (placeOf(column.ids[row]) >= count_) moveRow(column, row, rows);
            for (FieldColumn& go : go_)
                if (column.type == go.type && column.field == go.field)
                    for (std::size_t row = 0; row < go.ids.size(); ++row) moveRow(go, row, rows);
            if (!rows.ids.empty()) last.columns.push_back(std::move(rows));
        }
        return last;
    }

    ChangeList list_;
    const LoadPartLimits& limits_;
    const std::uint64_t count_;
    std::array<FieldColumn, 2> go_;
    std::vector<Change> stream_;
    LoadParts parts_;
    ChangeList part_;
    std::vector<FieldColumn> open_;  ///< of the part, by the list's columns
    std::size_t changes_ = 0, bytes_ = 0;
};

bool isSmall(const ChangeList& list, const LoadPartLimits& limits) {
    if (list.changeCount() > limits.changes) return false;
    std::size_t bytes = 0;
    for (const FieldColumn& column : list.columns)
        for (std::size_t row = 0; row < column.ids.size(); ++row) bytes += bytesOf(column, row);
    return bytes <= limits.bytes;
}

}  // namespace

LoadParts cutForFrames(ChangeList list, const LoadPartLimits& limits) {
    if (!isSmall(list, limits) && mayBeCut(list)) return Cutter(std::move(list), limits).run();
    LoadParts whole{.lists = {}, .objects = list.creations.size()};
    whole.lists.push_back(std::move(list));
    return whole;
}

std::optional<ObjectId> namedIn(const ChangeList& list, const IdRange& range) {
    std::optional<ObjectId> named;
    const auto look = [&](ObjectId id) {
        if (range.contains(id)) named = id;
    };
    for (const Placement& placement : list.placements) look(placement.node), look(placement.parent);
    for (const FieldColumn& column : list.columns) {
        std::ranges::for_each(column.ids, look);
        if (const auto* refs = std::get_if<std::vector<ObjectId>>(&column.values)) std::ranges::for_each(*refs, look);
        if (const auto* lists = std::get_if<std::vector<RefList>>(&column.values))
            for (const RefList& refs : *lists) std::ranges::for_each(refs, look);
    }
    for (const RangeEdit& edit : list.ranges) look(edit.object);
    std::ranges::for_each(list.destructions, look);
    return named;
}

}  // namespace tessera

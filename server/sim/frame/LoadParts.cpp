#include "server/sim/frame/LoadParts.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

#include "common/cores/Animation.h"
#include "common/cores/CollisionObject.h"
#include "common/cores/Motion.h"
#include "common/scene/FieldTable.h"
#include "server/sim/frame/AppearingOrder.h"
#include "server/sim/frame/Emitters.h"

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

/// Objects of a type that move by themselves unless a field says otherwise.
struct Held {
    ObjectType type;
    std::optional<std::uint16_t>
        column;  ///< where the list says so, now of none that it creates: they are told to stand with their creation
    FieldColumn go;  ///< what sets those going that are to play
};

Held holdPlaying(ChangeList& list, ObjectType type, FieldId field) {
    const auto order = [](const FieldColumn& column) { return std::pair(column.type, column.field); };
    Held held{.type = type, .column = {}, .go = FieldColumn::ofShape(type, field, FieldKind::kBool, 1)};
    std::vector<ObjectId> players;
    for (const Creation& creation : list.creations)
        if (creation.type == type) players.push_back(creation.id);
    if (players.empty()) return held;
    auto at = std::ranges::lower_bound(list.columns, std::pair(type, field), {}, order);
    if (at == list.columns.end() || order(*at) != std::pair(type, field)) at = list.columns.insert(at, held.go);
    const auto* playing = std::get_if<std::vector<std::uint8_t>>(&at->values);
    if (!playing || playing->size() != at->ids.size()) return held;  // the scene refuses it in words
    std::vector<ObjectId> spokenOf = at->ids;
    std::ranges::sort(spokenOf);
    FieldColumn others = shapeOf(*at);
    for (std::size_t row = 0; row < at->ids.size(); ++row) {
        if (placeOf(at->ids[row]) >= list.creations.size())
            others.append(at->ids[row], at->value(row));
        else if ((*playing)[row] != 0)
            held.go.append(at->ids[row], true);
    }
    for (const ObjectId id : players)
        if (!std::ranges::binary_search(spokenOf, id)) held.go.append(id, true);
    *at = std::move(others);
    return held;
}

/// Bodies that would fall before they stand on anything have no mass; what gives it to them is returned.
FieldColumn holdMasses(ChangeList& list) {
    FieldColumn go =
        FieldColumn::ofShape(typeOf<CollisionObject>(), fieldId<&CollisionObject::mass>, FieldKind::kDouble, 1);
    for (FieldColumn& column : list.columns) {
        auto* masses = std::get_if<std::vector<double>>(&column.values);
        if (column.type != go.type || column.field != go.field || !masses || column.width != 1) continue;
        for (std::size_t row = 0; row < std::min(column.ids.size(), masses->size()); ++row)
            if (placeOf(column.ids[row]) < list.creations.size() && (*masses)[row] != 0)
                go.append(column.ids[row], toValue(std::exchange((*masses)[row], 0.0)));
    }
    return go;
}

/// The list as a stream of single changes, each as early as all that it speaks of is there; cut wherever it is full.
class Cutter {
public:
    Cutter(ChangeList list, const LoadPartLimits& limits)
        : list_(std::move(list)),
          limits_(limits),
          count_(list_.creations.size()),
          held_{holdPlaying(list_, typeOf<Motion>(), fieldId<&Motion::playing>),
                holdPlaying(list_, typeOf<Animation>(), fieldId<&Animation::playing>),
                holdPlaying(list_, typeOf<Emitters::Core>(), fieldId<&Emitters::Core::playing>)},
          appearing_(appearingOrder(list_.placements, count_, limits.seen)),
          appears_(list_.placements.size()) {
        std::ranges::sort(list_.creations, {}, &Creation::id);
        for (const std::vector<std::uint32_t>& rows : appearing_)
            for (const std::uint32_t row : rows) appears_[row] = true;
        for (Held& held : held_) {
            const auto said = [&](const FieldColumn& column) {
                return column.type == held.go.type && column.field == held.go.field;
            };
            const auto at = std::ranges::find_if(list_.columns, said);
            if (at != list_.columns.end() && at->kind() == FieldKind::kBool)
                held.column = static_cast<std::uint16_t>(at - list_.columns.begin());
            go_.push_back(std::move(held.go));
        }
        if (appearing_.size() > 1) go_.push_back(holdMasses(list_));
    }

    std::vector<ChangeList> run() {
        order();
        open_.assign(list_.columns.size(), {});
        for (const Change& change : stream_) take(change);
        close();
        for (std::size_t i = 0; i + 1 < appearing_.size(); ++i) place(appearing_[i], parts_.emplace_back());
        parts_.push_back(lastOne());
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

    /// `found` is given each change that can be made before the end, with the place of the last object that it speaks
    /// of. `placedBelow`: of each node, when its newest child was placed; children keep their order.
    template <typename Found>
    void visit(std::vector<std::uint32_t>& placedBelow, Found&& found) {
        for (std::uint32_t row = 0; row < count_; ++row) found(row, Change{row, kCreation});
        for (std::size_t row = 0; row < list_.placements.size(); ++row) {
            const Placement& placement = list_.placements[row];
            if (appears_[row]) continue;
            const std::uint64_t parent = placeOf(placement.parent);
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
        std::size_t changes = 1, bytes = 24;
        if (change.what < kPlacement) bytes = bytesOf(list_.columns[change.what], change.row);
        const std::optional<std::uint16_t> still =
            change.what == kCreation ? heldIn(list_.creations[change.row].type) : std::nullopt;
        if (still) ++changes, bytes += 16;
        if (changes_ > 0 && (changes_ + changes > limits_.changes || bytes_ + bytes > limits_.bytes)) close();
        changes_ += changes;
        bytes_ += bytes;
        if (change.what == kCreation) {
            part_.creations.push_back(list_.creations[change.row]);
            if (still) columnOf(*still).append(list_.creations[change.row].id, false);
        } else if (change.what == kPlacement) {
            part_.placements.push_back(list_.placements[change.row]);
        } else {
            moveRow(list_.columns[change.what], change.row, columnOf(change.what));
        }
    }

    [[nodiscard]] std::optional<std::uint16_t> heldIn(ObjectType type) const {
        const auto held = std::ranges::find(held_, type, &Held::type);
        return held == held_.end() ? std::nullopt : held->column;
    }
    /// Of the part that is being filled.
    [[nodiscard]] FieldColumn& columnOf(std::uint16_t what) {
        FieldColumn& column = open_[what];
        if (column.ids.empty()) column = shapeOf(list_.columns[what]);
        return column;
    }

    void close() {
        if (changes_ == 0) return;
        for (FieldColumn& column : open_)
            if (!column.ids.empty()) part_.columns.push_back(std::exchange(column, {}));
        parts_.push_back(std::exchange(part_, {}));
        changes_ = bytes_ = 0;
    }

    void place(const std::vector<std::uint32_t>& rows, ChangeList& list) const {
        for (const std::uint32_t row : rows) list.placements.push_back(list_.placements[row]);
    }

    /// The rest of what appears, what has to do with objects that were there before, and what moves by itself.
    ChangeList lastOne() {
        ChangeList last;
        place(appearing_.back(), last);
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
    std::array<Held, 3> held_;
    std::vector<FieldColumn> go_;
    const std::vector<std::vector<std::uint32_t>> appearing_;
    std::vector<bool> appears_;  ///< by placement
    std::vector<Change> stream_;
    std::vector<ChangeList> parts_;
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

std::vector<ChangeList> cutForFrames(ChangeList list, const LoadPartLimits& limits) {
    if (!isSmall(list, limits) && mayBeCut(list)) return Cutter(std::move(list), limits).run();
    std::vector<ChangeList> whole;
    whole.push_back(std::move(list));
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

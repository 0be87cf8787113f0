#include "server/sim/desk/StepPlans.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <set>
#include <unordered_set>

#include "common/cores/Node.h"
#include "common/scene/FieldTable.h"
#include "server/sim/desk/AuditNames.h"
#include "server/sim/frame/Simulation.h"

namespace tessera {
namespace {

constexpr std::size_t kMostLists = 8;   ///< of a step that are looked at
constexpr std::size_t kMostRows = 256;  ///< of each kind of change, of one list
constexpr std::size_t kNamed = 2;       ///< in words
constexpr std::size_t kTold = 16;       ///< as numbers
constexpr std::size_t kMostNameBytes = 256;

/// Of a long one its end.
std::string shortened(const std::string& name) {
    if (name.size() <= kMostNameBytes) return name;
    std::size_t from = name.size() - kMostNameBytes;
    while (from < name.size() && (static_cast<unsigned char>(name[from]) & 0xc0) == 0x80) ++from;
    return "…" + name.substr(from);
}

/// Objects of a kind, each once, in the order in which they are met.
struct Met {
    std::vector<ObjectId> objects = {};
    std::unordered_set<ObjectId> seen = {};
    bool more = false;

    void add(ObjectId id) {
        if (seen.insert(id).second) objects.push_back(id);
    }
    template <typename Rows, typename IdOf>
    void addAll(const Rows& rows, IdOf idOf) {
        for (const auto& row : firstOf(rows)) add(std::invoke(idOf, row));
        more = more || rows.size() > kMostRows;
    }
    template <typename Row>
    static std::span<const Row> firstOf(const std::vector<Row>& rows) {
        return std::span(rows).first(std::min(rows.size(), kMostRows));
    }
};

class Plan {
public:
    Plan(const Simulation& simulation, std::span<const ChangeListPtr> lists) : simulation_(simulation) {
        for (const ChangeListPtr& list : lists) add(*list);
        // What comes or goes has its fields with it.
        std::erase_if(set_.objects, [&](ObjectId id) { return made_.seen.contains(id) || removed_.seen.contains(id); });
        if (made_.more) set_.objects.clear();
    }

    [[nodiscard]] answer::StepPlan told() const {
        answer::StepPlan plan{.what = words(), .objects = {}, .changes = changes_};
        for (const Met* met : {&removed_, &made_, &placed_, &set_})
            for (const ObjectId id : met->objects)
                if (plan.objects.size() < kTold) plan.objects.push_back(id);
        return plan;
    }

private:
    void add(const ChangeList& list) {
        changes_ += list.changeCount();
        removed_.addAll(list.destructions, std::identity());
        made_.addAll(list.creations, &Creation::id);
        for (const Creation& creation : Met::firstOf(list.creations)) madeNodes_ += creation.type == typeOf<Node>();
        for (const Placement& placed : Met::firstOf(list.placements)) {
            if (!made_.seen.contains(placed.node)) {
                if (placed.parent && !removed_.seen.contains(placed.node)) placed_.add(placed.node);
            } else if (!made_.seen.contains(placed.parent) && tops_.size() < kNamed) {
                tops_.push_back(shortened(nameIn(list, placed.node)));
            }
        }
        for (const FieldColumn& column : list.columns) {
            set_.addAll(column.ids, std::identity());
            fields_.insert(nameOf(column.type, column.field));
        }
        for (const RangeEdit& range : Met::firstOf(list.ranges)) {
            set_.add(range.object);
            fields_.insert(nameOf(range.type, range.field));
        }
    }
    static std::string nameOf(ObjectType type, FieldId field) {
        const TypeInfo* const info = findType(type);
        const FieldEntry* const entry = info ? findField(*info, field) : nullptr;
        return entry ? fmt::format("{}.{}", info->name, entry->name) : "a field";
    }

    /// "/hall/crane, /hall/door and 3 more"; a node and its core have one name.
    [[nodiscard]] std::string named(const Met& met) const {
        std::vector<std::string> names = auditNames(simulation_, met.objects, kTold);
        const std::size_t others = names.size() > kNamed ? names.size() - kNamed : 0;
        names.resize(names.size() - others);
        std::ranges::transform(names, names.begin(), shortened);
        const std::string text = fmt::format("{}", fmt::join(names, ", "));
        if (met.more || met.objects.size() > kTold) return text + " and more";
        return others > 0 ? fmt::format("{} and {} more", text, others) : text;
    }
    [[nodiscard]] std::string words() const {
        std::vector<std::string> parts;
        if (!removed_.objects.empty()) parts.push_back("removes " + named(removed_));
        if (!made_.objects.empty()) {
            const std::size_t count = madeNodes_ > 0 ? madeNodes_ : made_.objects.size();
            parts.push_back(fmt::format("brings {}{} {}{}{}", made_.more ? "more than " : "", count,
                                        madeNodes_ > 0 ? "node" : "object", count == 1 ? "" : "s",
                                        tops_.empty() ? "" : fmt::format(": {}", fmt::join(tops_, ", "))));
        }
        if (!placed_.objects.empty()) parts.push_back(fmt::format("puts {} elsewhere in the tree", named(placed_)));
        if (!set_.objects.empty())
            parts.push_back(
                fmt::format("sets {} of {}", fields_.size() == 1 ? *fields_.begin() : "fields", named(set_)));
        return fmt::format("{}", fmt::join(parts, "; "));
    }

    const Simulation& simulation_;
    Met removed_, made_, placed_, set_;
    std::size_t madeNodes_ = 0;
    std::vector<std::string> tops_;  ///< names of what is made, of nodes below others that stay
    std::set<std::string> fields_;
    std::uint64_t changes_ = 0;
};

// ---- steps in parts: their first lists only hide what they make, or make what is not to be seen yet

constexpr std::size_t kMostDepth = 4096;

std::uint64_t changesOf(std::span<const ChangeListPtr> lists) {
    std::uint64_t changes = 0;
    for (const ChangeListPtr& list : lists) changes += list->changeCount();
    return changes;
}

/// Takes nodes of the range away. One of each list is looked at, and all that is above it.
answer::StepPlan planOfRemoval(const Simulation& simulation, std::span<const ChangeListPtr> lists,
                               const IdRange& range) {
    Met tops;
    const auto look = [&](ObjectId id) {
        for (std::size_t depth = 0; depth < kMostDepth; ++depth) {
            const Node* const node = range.contains(id) ? simulation.scene().get<Node>(id) : nullptr;
            if (node == nullptr || !node->parent) return;
            if (!range.contains(node->parent)) return tops.add(id);
            id = node->parent;
        }
    };
    for (const ChangeListPtr& list : lists)
        if (!list->placements.empty()) look(list->placements.front().node);
    answer::StepPlan plan{.what = "", .objects = {}, .changes = changesOf(lists)};
    std::vector<std::string> names = auditNames(simulation, tops.objects, kNamed);
    std::ranges::transform(names, names.begin(), shortened);
    if (names.empty()) names.emplace_back("what a load has brought");
    plan.what = fmt::format("removes {} and more", fmt::join(names, ", "));
    for (const ObjectId id : tops.objects)
        if (plan.objects.size() < kTold) plan.objects.push_back(id);
    return plan;
}

/// Brings nodes of the range. Those on top come in the order of the document, so that the first rows of a list do,
/// or the last one.
answer::StepPlan planOfReturn(const Simulation& simulation, std::span<const ChangeListPtr> lists,
                              const IdRange& range) {
    Met tops;
    const auto look = [&](const Placement& placed) {
        if (range.contains(placed.node) && placed.parent && !range.contains(placed.parent)) tops.add(placed.node);
    };
    for (const ChangeListPtr& list : lists) {
        for (const Placement& placed : Met::firstOf(list->placements)) look(placed);
        if (!list->placements.empty()) look(list->placements.back());
    }
    answer::StepPlan plan{.what = "", .objects = {}, .changes = changesOf(lists)};
    std::vector<std::string> names(std::min(tops.objects.size(), kNamed));
    for (const ChangeListPtr& list : lists)
        for (const FieldColumn& column : list->columns) {
            if (column.type != typeOf<Node>() || column.field != fieldId<&Node::name>) continue;
            const auto& texts = std::get<std::vector<std::string>>(column.values);
            for (std::size_t i = 0; i < names.size(); ++i)
                if (const auto row = std::ranges::find(column.ids, tops.objects[i]); row != column.ids.end())
                    names[i] = shortened(texts[static_cast<std::size_t>(row - column.ids.begin())]);
        }
    for (std::size_t i = 0; i < names.size(); ++i) {
        // Of one that is still being taken back.
        const Node* const node = simulation.scene().get<Node>(tops.objects[i]);
        if (node && names[i].empty()) names[i] = shortened(node->name);
        if (names[i].empty()) names[i] = fmt::format("#{}", tops.objects[i].value);
    }
    plan.what = fmt::format("brings {} objects{}{}{}", range.count, names.empty() ? "" : ": ", fmt::join(names, ", "),
                            tops.objects.size() > kNamed ? " and more" : "");
    for (const ObjectId id : tops.objects)
        if (plan.objects.size() < kTold) plan.objects.push_back(id);
    return plan;
}

}  // namespace

answer::StepPlan undoPlan(const Simulation& simulation) {
    const EditHistory& history = simulation.history();
    if (!history.undoesInParts()) return Plan(simulation, history.firstToUndo(kMostLists)).told();
    return planOfRemoval(simulation, history.firstToUndo(SIZE_MAX), history.idsToUndo());
}

answer::StepPlan redoPlan(const Simulation& simulation) {
    const EditHistory& history = simulation.history();
    if (const std::vector<ChangeListPtr> taken = history.takenBack(); !taken.empty())
        return planOfReturn(simulation, taken, history.idsUnderWay());
    if (!history.redoesInParts()) return Plan(simulation, history.firstToRedo(kMostLists)).told();
    return planOfReturn(simulation, history.firstToRedo(SIZE_MAX), history.idsToRedo());
}

}  // namespace tessera

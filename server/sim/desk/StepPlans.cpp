#include "server/sim/desk/StepPlans.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <set>
#include <unordered_set>

#include "common/cores/Node.h"
#include "common/scene/FieldTable.h"
#include "server/sim/desk/AuditNames.h"
#include "server/sim/frame/Simulation.h"

namespace tessera {
namespace {

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

}  // namespace

answer::StepPlan stepPlan(const Simulation& simulation, std::span<const ChangeListPtr> lists) {
    return Plan(simulation, lists).told();
}

}  // namespace tessera

#include "server/sim/desk/AuditNames.h"

#include <fmt/format.h>

#include <algorithm>
#include <variant>

#include "common/cores/Node.h"
#include "common/scene/FieldTable.h"

namespace tessera {
namespace {

constexpr std::size_t kLooks = 4'096;      ///< at nodes, of one edit
constexpr std::size_t kRowsForNames = 64;  ///< of a list's column, for what it makes

class Namer {
public:
    Namer(const Simulation& simulation, std::size_t most) : simulation_(simulation), most_(most) {}

    [[nodiscard]] bool full() const { return names_.size() >= most_; }
    void add(std::string name) {
        if (!full() && std::ranges::find(names_, name) == names_.end()) names_.push_back(std::move(name));
    }
    void add(ObjectId id) {
        if (!full()) add(nameOf(id));
    }
    [[nodiscard]] std::string nameOf(ObjectId id) {
        const Object object = simulation_.scene().find(id);
        if (!object) return fmt::format("#{}", id.value);
        if (object.is<Node>()) return pathOfNode(id);
        if (const ObjectId bearer = simulation_.bearerOf(id)) return pathOfNode(bearer);
        return fmt::format("#{} {}", id.value, object.info().name);
    }
    [[nodiscard]] std::vector<std::string> take() { return std::move(names_); }

private:
    [[nodiscard]] std::string pathOfNode(ObjectId node) {
        NodeFinder finder(simulation_.scene(), kLooks - std::min(kLooks, looked_));
        if (!finder.lookAbove(node, true)) {
            looked_ = kLooks;
            return fmt::format("#{}", node.value);
        }
        for (const Node* at = simulation_.scene().get<Node>(node); at && at->parent;) {
            at = simulation_.scene().get<Node>(at->parent);
            looked_ += 1 + at->children.size();
        }
        return pathOf(simulation_.scene(), node);
    }

    const Simulation& simulation_;
    std::size_t most_;
    std::size_t looked_ = 0;
    std::vector<std::string> names_;
};

/// The name that a list gives to a node that it makes; empty: it gives none, or far behind.
std::string nameIn(const ChangeList& list, ObjectId made) {
    for (const FieldColumn& column : list.columns) {
        const auto* texts = std::get_if<std::vector<std::string>>(&column.values);
        if (texts == nullptr || column.type != typeOf<Node>() || column.field != fieldId<&Node::name>) continue;
        for (std::size_t row = 0; row < std::min(column.ids.size(), kRowsForNames); ++row)
            if (column.ids[row] == made) return (*texts)[row];
    }
    return {};
}

}  // namespace

std::vector<std::string> auditNames(const Simulation& simulation, const ChangeList& list, std::size_t most) {
    Namer names(simulation, most);
    const std::size_t far = 4 * most;  // rows of one object follow each other: what is behind is another list's affair
    for (std::size_t i = 0; i < std::min(list.placements.size(), far) && !names.full(); ++i) {
        const Placement& placed = list.placements[i];
        if (!isPlaceholder(placed.node))
            names.add(placed.node);
        else if (!isPlaceholder(placed.parent))
            names.add(fmt::format("{}/{}", placed.parent == kRootNode ? "" : names.nameOf(placed.parent),
                                  nameIn(list, placed.node)));
    }
    for (const FieldColumn& column : list.columns)
        for (std::size_t i = 0; i < std::min(column.ids.size(), far) && !names.full(); ++i)
            if (!isPlaceholder(column.ids[i])) names.add(column.ids[i]);
    for (std::size_t i = 0; i < std::min(list.ranges.size(), far) && !names.full(); ++i)
        if (!isPlaceholder(list.ranges[i].object)) names.add(list.ranges[i].object);
    for (std::size_t i = 0; i < std::min(list.destructions.size(), far) && !names.full(); ++i)
        names.add(list.destructions[i]);
    return names.take();
}

std::vector<std::string> auditNames(const Simulation& simulation, const ApplicationRequest& request) {
    Namer names(simulation, 4);
    std::visit(
        [&]<typename Request>(const Request& wish) {
            if constexpr (requires { wish.node; }) names.add(wish.node);
            if constexpr (requires { wish.wish.node; }) names.add(wish.wish.node);
            if constexpr (requires { std::string(wish.path); }) names.add(std::string(wish.path));
            if constexpr (requires { wish.kPrefix; }) names.add(std::string(wish.kPrefix) + wish.name);
        },
        request);
    return names.take();
}

}  // namespace tessera

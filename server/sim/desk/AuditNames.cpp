#include "server/sim/desk/AuditNames.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <variant>

#include "common/cores/Node.h"
#include "common/scene/FieldTable.h"

namespace tessera {
namespace {

constexpr std::size_t kLooks = 4'096;      ///< at nodes, of one edit
constexpr std::size_t kRowsForNames = 64;  ///< of a list's column, for what it makes
constexpr std::size_t kMostPathBytes = 4'096;

class Namer {
public:
    Namer(const Simulation& simulation, std::size_t most) : simulation_(simulation), most_(most) {}

    [[nodiscard]] bool full() const { return names_.size() >= most_; }
    void add(std::string name) {
        if (!full() && std::ranges::find(names_, name) == names_.end()) names_.push_back(std::move(name));
    }
    /// Of a node, or of what one node has as its core; of others at once.
    void add(ObjectId id) {
        if (full() || !seen_.insert(id).second) return;
        const Object object = simulation_.scene().find(id);
        const ObjectId node = object && object.is<Node>() ? id : simulation_.bearerOf(id);
        if (!node)
            return add(object ? fmt::format("#{} {}", id.value, object.info().name) : fmt::format("#{}", id.value));
        if (std::ranges::find(nodes_, node) != nodes_.end()) return;
        if (!mayLookAbove(node)) return add(fmt::format("#{}", node.value));
        nodes_.push_back(node);
        places_.push_back(names_.size());
        names_.emplace_back();
    }
    [[nodiscard]] std::string pathOfParent(ObjectId node) {
        return mayLookAbove(node) ? pathOf(simulation_.scene(), node) : fmt::format("#{}", node.value);
    }
    [[nodiscard]] std::vector<std::string> take() {
        // What lies above several of them is looked at once.
        std::vector<std::string> paths = pathsOf(simulation_.scene(), nodes_);
        for (std::size_t i = 0; i < nodes_.size(); ++i) names_[places_[i]] = std::move(paths[i]);
        return std::move(names_);
    }

private:
    /// Not where names are long all the way down: a path takes as long to be written as it is long.
    [[nodiscard]] bool isShort(ObjectId node) const {
        std::size_t bytes = 0;
        for (const Node* at = simulation_.scene().get<Node>(node); at && bytes <= kMostPathBytes;
             at = simulation_.scene().get<Node>(at->parent))
            bytes += at->name.size() + 1;
        return bytes <= kMostPathBytes;
    }
    /// All on the way to the root, and their siblings, as far as they have not been looked at.
    bool mayLookAbove(ObjectId node) {
        if (!isShort(node)) return false;
        for (const Node* at = simulation_.scene().get<Node>(node); at && at->parent;) {
            const ObjectId parent = at->parent;
            at = simulation_.scene().get<Node>(parent);
            if (above_.contains(parent)) return true;
            if (at->children.size() > kLooks - looked_) return false;
            looked_ += at->children.size();
            above_.insert(parent);
        }
        return true;
    }

    const Simulation& simulation_;
    std::size_t most_;
    std::size_t looked_ = 0;
    std::set<ObjectId> seen_, above_;
    std::vector<ObjectId> nodes_;
    std::vector<std::size_t> places_;  ///< of each, among the names
    std::vector<std::string> names_;
};

}  // namespace

std::string nameIn(const ChangeList& list, ObjectId made) {
    for (const FieldColumn& column : list.columns) {
        const auto* texts = std::get_if<std::vector<std::string>>(&column.values);
        if (texts == nullptr || column.type != typeOf<Node>() || column.field != fieldId<&Node::name>) continue;
        for (std::size_t row = 0; row < std::min(column.ids.size(), kRowsForNames); ++row)
            if (column.ids[row] == made) return (*texts)[row];
    }
    return {};
}

std::vector<std::string> auditNames(const Simulation& simulation, std::span<const ObjectId> objects, std::size_t most) {
    Namer names(simulation, most);
    for (const ObjectId object : objects) names.add(object);
    return names.take();
}

std::vector<std::string> auditNames(const Simulation& simulation, const ChangeList& list, std::size_t most) {
    Namer names(simulation, most);
    const std::size_t far = 4 * most;  // rows of one object follow each other: what is behind is another list's affair
    for (std::size_t i = 0; i < std::min(list.placements.size(), far) && !names.full(); ++i) {
        const Placement& placed = list.placements[i];
        if (!isPlaceholder(placed.node))
            names.add(placed.node);
        else if (!isPlaceholder(placed.parent))
            names.add(fmt::format("{}/{}", placed.parent == kRootNode ? "" : names.pathOfParent(placed.parent),
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

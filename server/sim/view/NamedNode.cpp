#include "server/sim/view/NamedNode.h"

#include <algorithm>

#include "common/scene/FieldTable.h"

namespace tessera {

void NamedNode::update(const Aspect& scene, const ChangeList* list) {
    if (!list || concerns(scene, *list)) find(scene);
}

void NamedNode::find(const Aspect& scene) {
    ++searches_;
    namesakes_.clear();
    node_ = findNode(scene, path_);
    if (!node_ || path_.starts_with('#')) return;
    for (ObjectId id = scene.get<Node>(*node_)->parent; id;) {
        const Node& parent = *scene.get<Node>(id);
        for (const ObjectId child : parent.children)
            if (mayMean(scene.get<Node>(child)->name)) namesakes_.insert(child);
        id = parent.parent;
    }
}

bool NamedNode::concerns(const Aspect& scene, const ChangeList& list) const {
    if (path_.starts_with('#')) return true;  // one look-up
    const auto mayCount = [&](ObjectId id) {
        // What was lost may come back anywhere.
        if (!node_ || namesakes_.contains(id)) return true;
        const Node* node = scene.get<Node>(id);
        return node && mayMean(node->name);
    };
    if (std::ranges::any_of(list.placements, mayCount, &Placement::node)) return true;
    return std::ranges::any_of(list.columns, [&](const FieldColumn& column) {
        return column.type == typeOf<Node>() && column.field == fieldId<&Node::name> &&
               std::ranges::any_of(column.ids, mayCount);
    });
}

bool NamedNode::mayMean(const std::string& name) const {
    // "name" and "name[2]" hold the name as it is.
    if (!name.empty()) return path_.find(name) != std::string::npos;
    return path_.starts_with('[') || path_.find("//") != std::string::npos || path_.find("/[") != std::string::npos;
}

}  // namespace tessera

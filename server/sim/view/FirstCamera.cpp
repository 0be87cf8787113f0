#include "server/sim/view/FirstCamera.h"

#include <algorithm>

#include "common/cores/Camera.h"
#include "common/cores/DistanceLOD.h"
#include "common/cores/Switch.h"
#include "common/scene/ChildChoice.h"
#include "common/scene/FieldTable.h"

namespace tessera {
namespace {

std::size_t indexOf(const Node& parent, ObjectId child) {
    return parent.children.indexOf(child);
}

}  // namespace

void FirstCamera::update(const Aspect& scene, const ChangeList* list) {
    if (!list)
        findBearers(scene);
    else if (const bool others = noteBearers(scene, *list); !others && !concerns(scene, *list))
        return;
    watch(scene);
    first_ = watched_.contains(kRootNode)
                 ? findBelow(scene, kRootNode, [&](const Node& node) { return scene.coreOf<Camera>(node)->enabled; })
                 : ObjectId();
}

ObjectId FirstCamera::numbered(const Aspect& scene, std::size_t number) const {
    if (!watched_.contains(kRootNode)) return {};
    return findBelow(scene, kRootNode, [&](const Node&) { return number-- == 0; });
}

void FirstCamera::findBearers(const Aspect& scene) {
    bearers_.clear();
    for (const ObjectId id : scene.ids()) {
        ++visited_;
        const Node* node = scene.get<Node>(id);
        if (node && scene.coreOf<Camera>(*node)) bearers_.insert(id);
    }
}

bool FirstCamera::noteBearers(const Aspect& scene, const ChangeList& list) {
    bool changed = false;
    for (const FieldColumn& column : list.columns) {
        if (column.type != typeOf<Node>() || column.field != fieldId<&Node::core>) continue;
        for (const ObjectId id : column.ids) {
            const Node* node = scene.get<Node>(id);
            const bool bears = node && scene.coreOf<Camera>(*node);
            // From one Camera to another is a change too.
            if (bears ? (bearers_.insert(id), true) : bearers_.erase(id) > 0) changed = true;
        }
    }
    if (!bearers_.empty())
        for (const ObjectId id : list.destructions)
            if (bearers_.erase(id) > 0) changed = true;
    return changed;
}

bool FirstCamera::concerns(const Aspect& scene, const ChangeList& list) const {
    if (watched_.empty()) return false;
    // A node that is not watched is in nobody's way but a Switch's: it counts among the children.
    for (const Placement& placement : list.placements)
        if (watched_.contains(placement.node) || switchNodes_.contains(placement.parent)) return true;
    if (!list.placements.empty())
        for (const auto& [id, children] : switchNodes_)
            if (const Node* node = scene.get<Node>(id); !node || node->children.size() != children) return true;
    for (const FieldColumn& column : list.columns) {
        if (column.type == typeOf<Camera>() && column.field == fieldId<&Camera::enabled>) return true;
        const bool cores = column.type == typeOf<Node>() && column.field == fieldId<&Node::core>;
        const bool choices = column.type == typeOf<Switch>();  // levels: always the first
        if (!cores && !choices) continue;
        for (const ObjectId id : column.ids)
            if (cores ? watched_.contains(id) : switchCores_.contains(id)) return true;
    }
    return false;
}

void FirstCamera::watch(const Aspect& scene) {
    watched_.clear();
    switchNodes_.clear();
    switchCores_.clear();
    for (const ObjectId bearer : bearers_) {
        ObjectId below;
        for (ObjectId id = bearer; id;) {
            const auto [at, isNew] = watched_.try_emplace(id);
            if (below) at->second.push_back(below);
            if (!isNew) break;  // the way up from here is watched already
            ++visited_;
            const Node& node = *scene.get<Node>(id);
            if (scene.coreOf<Switch>(node) || scene.coreOf<DistanceLOD>(node)) {
                switchNodes_.emplace(id, node.children.size());
                switchCores_.insert(node.core);
            }
            below = id;
            id = node.parent;
        }
    }
}

// The tree's depth bounds the recursion.
ObjectId FirstCamera::findBelow(const Aspect& scene, ObjectId id, const std::function<bool(const Node&)>& isIt) const {
    ++visited_;
    const Node& node = *scene.get<Node>(id);
    if (scene.coreOf<Camera>(node) && isIt(node)) return id;
    std::vector<std::pair<std::size_t, ObjectId>> children;
    for (const ObjectId child : watched_.at(id)) children.emplace_back(0, child);
    const auto some = seenChildren(node.core ? scene.find(node.core) : Object(), node.children.size());
    if (some || children.size() > 1)
        for (auto& [index, child] : children) index = indexOf(node, child);
    if (some)
        std::erase_if(children, [&](const auto& child) { return !std::ranges::binary_search(*some, child.first); });
    std::ranges::sort(children);
    for (const auto& [index, child] : children)
        if (const ObjectId found = findBelow(scene, child, isIt)) return found;
    return {};
}

}  // namespace tessera

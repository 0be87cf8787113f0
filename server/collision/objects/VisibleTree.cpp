#include "server/collision/objects/VisibleTree.h"

#include <algorithm>

#include "common/scene/Action.h"

namespace tessera {

void VisibleTree::flatten(const Aspect& aspect) {
    const std::size_t before = places.size();
    places.clear();
    nodes.clear();
    geometries.clear();
    interests.clear();
    objects.clear();
    environment = {};
    switches.reset(0);
    transforms.clear();
    transformNumbers.reset(before);
    std::vector<std::uint32_t> transformOf;  // per place with a Transform, in order: its number

    IdTable interestsSeen;
    std::vector<std::uint32_t> path;  // places above, by depth
    Action action;
    action.onNode([&](const Visit& visit) {
        const auto index = static_cast<std::uint32_t>(places.size());
        while (path.size() > visit.depth) {
            places[path.back()].end = index;
            path.pop_back();
        }
        Place place;
        place.parent = path.empty() ? Place::kNone : path.back();
        place.world = visit.world_T_node;
        if (const Object core = visit.node.core ? aspect.find(visit.node.core) : Object()) {
            if (core.info().pose) {
                const NodePose pose = core.info().pose(core.data());
                place.transform = visit.node.core;
                place.local = pose.matrix;
                place.absolute = pose.absolute;
                const auto next = static_cast<std::uint32_t>(transforms.size());
                const std::uint32_t number = transformNumbers.insert(visit.node.core, next);
                if (number == next) transforms.push_back(visit.node.core);
                transformOf.push_back(number);
            } else if (core.is<Geometry>()) {
                geometries.push_back({index, visit.node.core});
            } else if (core.is<Switch>()) {
                switches.insert(visit.node.core, index);
            } else if (core.is<Interest>()) {
                if (interestsSeen.insert(visit.node.core, index) == index) interests.push_back(visit.node.core);
            } else if (core.is<CollisionObject>()) {
                objects.push_back(visit.node.core);
            } else if (core.is<Environment>() && !environment) {
                environment = visit.node.core;
            }
        }
        path.push_back(index);
        places.push_back(place);
        nodes.push_back(visit.nodeId);
        return Descend::kInto;
    });
    action.run(aspect);
    for (const std::uint32_t open : path) places[open].end = static_cast<std::uint32_t>(places.size());
    std::sort(objects.begin(), objects.end());
    objects.erase(std::unique(objects.begin(), objects.end()), objects.end());

    transformFirst_.assign(transforms.size() + 1, 0);
    for (const std::uint32_t number : transformOf) ++transformFirst_[number + 1];
    for (std::size_t i = 0; i < transforms.size(); ++i) transformFirst_[i + 1] += transformFirst_[i];
    transformPlaces_.resize(transformOf.size());
    std::vector<std::uint32_t> next(transformFirst_.begin(), transformFirst_.end() - 1);
    auto number = transformOf.begin();
    for (std::uint32_t i = 0; i < places.size(); ++i)
        if (places[i].transform) transformPlaces_[next[*number++]++] = i;
}

std::vector<std::uint32_t> VisibleTree::find(std::span<const ObjectId> nodeIds) const {
    IdTable wanted;
    wanted.reset(nodeIds.size());
    for (const ObjectId id : nodeIds)
        if (id) wanted.insert(id, Place::kNone);
    for (std::uint32_t i = 0; i < nodes.size(); ++i) wanted.replace(nodes[i], i);
    std::vector<std::uint32_t> found;
    found.reserve(nodeIds.size());
    for (const ObjectId id : nodeIds) found.push_back(wanted.find(id));
    return found;
}

}  // namespace tessera

// Motions and interests find the nodes that they name.

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "common/cores/CollisionObject.h"
#include "common/cores/Interest.h"
#include "common/cores/Manipulator.h"
#include "common/cores/Motion.h"
#include "common/math/Decompositions.h"
#include "common/scene/FieldTable.h"
#include "common/wall/View.h"
#include "server/import/SceneAssembly.h"

namespace tessera {
namespace {

struct Step {
    std::string_view name;
    std::size_t which = 0;  ///< among equal names
};

/// "pillar[2]" → {"pillar", 2}
Step readStep(std::string_view text) {
    if (text.size() > 2 && text.back() == ']') {
        if (const std::size_t open = text.rfind('['); open != std::string_view::npos) {
            std::size_t which = 0;
            const char* last = text.data() + text.size() - 1;
            const auto [end, error] = std::from_chars(text.data() + open + 1, last, which);
            if (error == std::errc() && end == last) return {text.substr(0, open), which};
        }
    }
    return {text, 0};
}

template <typename PlacedNode>
PlacedNode* descend(PlacedNode* node, std::string_view path) {
    while (node != nullptr && !path.empty()) {
        const std::size_t slash = path.find('/');
        const Step step = readStep(path.substr(0, slash));
        node = node->child(step.name, step.which);
        path = slash == std::string_view::npos ? std::string_view() : path.substr(slash + 1);
    }
    return node;
}

/// Where the path begins with the node's own name. So in each copy of a repeated node its name means that copy.
template <typename PlacedNode>
PlacedNode* descendFrom(PlacedNode* node, std::string_view path) {
    const std::size_t slash = path.find('/');
    if (node->name != path.substr(0, slash)) return nullptr;
    return descend(node, slash == std::string_view::npos ? std::string_view() : path.substr(slash + 1));
}

}  // namespace

SceneAssembly::Placed* SceneAssembly::Placed::child(std::string_view wanted, std::size_t which) {
    for (; entered_ < children.size(); ++entered_) byName_[children[entered_]->name].push_back(children[entered_]);
    const auto same = byName_.find(wanted);
    return same == byName_.end() || which >= same->second.size() ? nullptr : same->second[which];
}

Expected<void> SceneAssembly::resolvePending(std::size_t from) {
    for (std::size_t i = from; i < pending_.size(); ++i)
        if (Expected<void> done = resolve(pending_[i]); !done) return done;
    pending_.erase(pending_.begin() + static_cast<std::ptrdiff_t>(from), pending_.end());
    return {};
}

SceneAssembly::Placed* SceneAssembly::find(Placed* from, Placed* top, const std::string& name) const {
    if (name.starts_with('/')) return descend(top, std::string_view(name).substr(1));
    Placed* found = nullptr;
    for (Placed* outer = from; found == nullptr && outer != nullptr && outer != top; outer = outer->parent) {
        if (outer != from) found = descendFrom(outer, name);
        if (found == nullptr && outer->parent != nullptr) found = descend(outer->parent, name);
    }
    return found;
}

Expected<void> SceneAssembly::resolve(const PendingRef& ref) {
    Placed* found = nullptr;
    if (ref.name.empty()) {
        found = ref.from;
        while (found != ref.top && !found->transform) found = found->parent;
        if (found == ref.top) found = nullptr;
    } else {
        found = find(ref.from, ref.top, ref.name);
    }
    const std::string shown = readName(ref.name, "");
    const auto wrong = [&](std::string_view what) {
        return fail(ErrorCode::kBadInput, fmt::format("{}: {}", ref.where, what));
    };
    switch (ref.kind) {
        case PendingRef::Kind::kMotionTarget:
            if (found == nullptr || !found->transform)
                return wrong(ref.name.empty()   ? "this motion has no transform at or above it to move"
                             : found != nullptr ? fmt::format("the motion's target '{}' has no transform", shown)
                                                : fmt::format("there is no node '{}' for this motion to move", shown));
            builder_.set(ref.core, typeOf<Motion>(), fieldId<&Motion::target>, toValue(found->transform));
            driven_.emplace(found->transform, "a motion");
            return {};
        case PendingRef::Kind::kCollisionNode:
            if (found == nullptr)
                return wrong(ref.name.empty() ? "this collision object has no transform at or above it; name its node"
                                              : fmt::format("there is no node '{}' for this collision object", shown));
            builder_.set(ref.core, typeOf<CollisionObject>(), fieldId<&CollisionObject::node>, toValue(found->id));
            if (ref.free) noteUnfree(ref, *found);
            return {};
        case PendingRef::Kind::kBeacon:
        case PendingRef::Kind::kScope: {
            const bool scope = ref.kind == PendingRef::Kind::kScope;
            if (found == nullptr) return wrong(fmt::format("there is no node '{}' for this light to {}", shown, scope ? "light" : "stand at"));
            builder_.set(ref.core, ref.type, findField(*findType(ref.type), scope ? "scope" : "beacon")->id, toValue(found->id));
            return {};
        }
        case PendingRef::Kind::kManipulatorTarget: {
            if (found == nullptr)
                return wrong(ref.name.empty() ? "this manipulator has no transform at or above it to move"
                                              : fmt::format("there is no node '{}' for this manipulator to move", shown));
            // A light that has a transform of its own in the text is a node below that.
            if (Placed* light = ref.free && found->transform && found->content ? found->child("light", 0) : nullptr) found = light;
            builder_.set(ref.core, typeOf<Manipulator>(), fieldId<&Manipulator::target>, toValue(found->id));
            handles_.push_back({found->transform ? found->transform : found->content, ref.where});
            return {};
        }
        case PendingRef::Kind::kInterestObject:
        case PendingRef::Kind::kInterestAgainst:
            break;
    }
    if (found == nullptr || ref.name.empty())
        return wrong(ref.name.empty() ? "this interest names no object"
                                      : fmt::format("there is no node '{}' for this interest", shown));
    const bool object = ref.kind == PendingRef::Kind::kInterestObject;
    builder_.set(ref.core, typeOf<Interest>(), object ? fieldId<&Interest::object> : fieldId<&Interest::against>,
                 toValue(found->id));
    return {};
}

void SceneAssembly::noteDriven() {
    for (const Handle& handle : handles_)
        if (const auto driver = driven_.find(handle.moved); driver != driven_.end())
            note(fmt::format("{}: what this manipulator moves is driven by {}: its handles can be dragged only while that is paused", handle.where,
                             driver->second));
}

Expected<void> SceneAssembly::checkCamera(const Placed& node, const proto::scene::Camera& camera) {
    Affine3d world_T_node = Affine3d::Identity();
    for (const Placed* above = &node; above != nullptr; above = above->parent) {
        if (above->movesOtherwise) return {};  // then the server sees where it stands, in the first frame
        world_T_node = above->parent_T_node * world_T_node;
    }
    if (!world_T_node.matrix().allFinite()) return fail(ErrorCode::kBadInput, "the camera's place in the world is not finite");
    View view;
    view.position = world_T_node.translation();
    view.orientation = Quatd(rotationOf(world_T_node)).normalized();
    if (camera.has_world_units_per_metre()) view.worldUnitsPerMetre = camera.world_units_per_metre();
    return checkStand(view);
}

void SceneAssembly::noteUnfree(const PendingRef& ref, const Placed& body) {
    if (!body.transform)
        return note(
            fmt::format("{}: the node '{}' has no transform of its own that could move, so its mass means nothing",
                        ref.where, body.name));
    for (const Placed* above = body.parent; above != nullptr; above = above->parent)
        if (!above->evenScale)
            return note(fmt::format("{}: the node '{}' above it scales its axes differently, so its mass means nothing",
                                    ref.where, above->name));
}

}  // namespace tessera

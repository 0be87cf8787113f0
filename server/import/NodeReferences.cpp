#include "server/import/NodeReferences.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/cores/CollisionObject.h"
#include "common/cores/Interest.h"
#include "common/cores/Manipulator.h"
#include "common/cores/Motion.h"
#include "common/scene/FieldTable.h"
#include "server/import/TableCores.h"

namespace tessera {
namespace {

/// The names of the nodes that a light stands at, and that it lights; empty: its own, and everything.
struct LightNames {
    std::string_view beacon, scope;
};
LightNames lightNamesOf(const proto::scene::Node& node) {
    if (node.has_directional_light()) return {node.directional_light().beacon(), node.directional_light().scope()};
    if (node.has_point_light()) return {node.point_light().beacon(), node.point_light().scope()};
    return node.has_spot_light() ? LightNames{node.spot_light().beacon(), node.spot_light().scope()} : LightNames();
}

}  // namespace

void NodeReferences::take(const LoadedFile& file, const proto::scene::Node& node, ObjectId core, PlacedNode* from,
                          PlacedNode* top) {
    const auto add = [&](Kind kind, const std::string& name, const std::string& where) -> Pending& {
        return pending_.emplace_back(
            Pending{.kind = kind, .core = core, .from = from, .top = top, .name = name, .where = where});
    };
    if (node.has_motion()) add(Kind::kMotionTarget, node.motion().target(), placeText(file.label, node.motion().at()));
    if (node.has_interest()) {
        const proto::scene::Interest& interest = node.interest();
        const std::string where = placeText(file.label, interest.at());
        add(Kind::kInterestObject, interest.object(), where);
        if (!interest.against().empty()) add(Kind::kInterestAgainst, interest.against(), where);
    }
    if (node.has_collision_object()) {
        const proto::scene::CollisionObject& object = node.collision_object();
        const std::string where = placeText(file.label, object.at());
        add(Kind::kCollisionNode, object.node(), where).free = object.mass() > 0;
        if (object.mass() > 0 && object.has_kind() && object.kind() != proto::scene::CollisionObject::RIGID)
            draft_.note(where + ": it is not RIGID, so its mass means nothing");
        else if (object.mass() > 0 && object.division() != proto::scene::CollisionObject::WHOLE)
            draft_.note(where + ": it is divided into several objects, so its mass means nothing");
    }
    const std::string where = placeText(file.label, placeOf(node));
    if (node.has_manipulator()) {
        draft_.isWritten(core, where);
        add(Kind::kManipulatorTarget, node.manipulator().target(), where).free =
            Manipulator::isLightKind(node.manipulator().kind());
    }
    const LightNames lights = lightNamesOf(node);
    for (const auto& [kind, name] : {std::pair(Kind::kBeacon, lights.beacon), {Kind::kScope, lights.scope}})
        if (!name.empty()) add(kind, std::string(name), where).type = tableTypeOf(node)->type;
}

Expected<void> NodeReferences::resolve(std::size_t after) {
    for (std::size_t i = after; i < pending_.size(); ++i)
        if (Expected<void> done = resolve(pending_[i]); !done) return done;
    pending_.erase(pending_.begin() + static_cast<std::ptrdiff_t>(after), pending_.end());
    return {};
}

Expected<void> NodeReferences::resolve(const Pending& ref) {
    PlacedNode* found = nullptr;
    if (ref.name.empty()) {
        found = ref.from;
        while (found != ref.top && !found->transform) found = found->parent;
        if (found == ref.top) found = nullptr;
    } else {
        found = PlacedNodes::find(ref.from, ref.top, ref.name);
    }
    if (found != nullptr && !ref.name.empty()) noteTwins(ref, *found);
    const std::string shown = readName(ref.name, "");
    const auto wrong = [&](std::string_view what) {
        return fail(ErrorCode::kBadInput, fmt::format("{}: {}", ref.where, what));
    };
    // The top of a file is where its nodes stand, and no node; none means everything to these two.
    if (found != nullptr && !found->id && ref.kind != Kind::kScope && ref.kind != Kind::kInterestAgainst)
        return wrong(fmt::format("'{}' is the top of the file, and no node; name one below it", shown));
    ChangeListBuilder& list = draft_.list();
    switch (ref.kind) {
        case Kind::kMotionTarget:
            if (found == nullptr || !found->transform)
                return wrong(ref.name.empty()   ? "this motion has no transform at or above it to move"
                             : found != nullptr ? fmt::format("the motion's target '{}' has no transform", shown)
                                                : fmt::format("there is no node '{}' for this motion to move", shown));
            setField<&Motion::target>(list, ref.core, found->transform);
            isDriven(found->transform, "a motion");
            return {};
        case Kind::kCollisionNode:
            if (found == nullptr)
                return wrong(ref.name.empty() ? "this collision object has no transform at or above it; name its node"
                                              : fmt::format("there is no node '{}' for this collision object", shown));
            setField<&CollisionObject::node>(list, ref.core, found->id);
            if (ref.free) noteUnfree(ref, *found);
            return {};
        case Kind::kBeacon:
        case Kind::kScope: {
            const bool scope = ref.kind == Kind::kScope;
            if (found == nullptr)
                return wrong(
                    fmt::format("there is no node '{}' for this light to {}", shown, scope ? "light" : "stand at"));
            const FieldEntry& field = *findField(*findType(ref.type), scope ? "scope" : "beacon");
            list.set(ref.core, ref.type, field.id, toValue(found->id));
            return {};
        }
        case Kind::kManipulatorTarget: {
            if (found == nullptr)
                return wrong(ref.name.empty()
                                 ? "this manipulator has no transform at or above it to move"
                                 : fmt::format("there is no node '{}' for this manipulator to move", shown));
            // A light that has a transform of its own in the text is a node below that.
            if (ref.free && found->transform && found->content)
                if (PlacedNode* light = found->child("light", 0)) found = light;
            setField<&Manipulator::target>(list, ref.core, found->id);
            handles_.push_back({found->transform ? found->transform : found->content, ref.where});
            return {};
        }
        case Kind::kInterestObject:
        case Kind::kInterestAgainst:
            break;
    }
    if (found == nullptr || ref.name.empty())
        return wrong(ref.name.empty() ? "this interest names no object"
                                      : fmt::format("there is no node '{}' for this interest", shown));
    if (ref.kind == Kind::kInterestObject)
        setField<&Interest::object>(list, ref.core, found->id);
    else
        setField<&Interest::against>(list, ref.core, found->id);
    return {};
}

void NodeReferences::noteTwins(const Pending& ref, PlacedNode& found) {
    if (ref.name.find('[') != std::string::npos) return;
    const std::size_t first = ref.name.find_first_not_of('/'), last = ref.name.find_last_not_of('/');
    if (first == std::string::npos) return;
    const std::string_view path = std::string_view(ref.name).substr(first, last - first + 1);
    auto steps = 1 + std::ranges::count(path, '/');
    for (PlacedNode* node = &found; node->parent != nullptr && steps > 0; node = node->parent, --steps) {
        if (node->parent->child(node->name, 1) == nullptr) continue;
        // Of copies each finds itself: that is what it means.
        for (const PlacedNode* above = ref.from; above != nullptr; above = above->parent)
            if (above == node) return;
        const std::string twin = readName(node->name, "");
        std::string text = fmt::format("{}: '{}' names the first of several nodes called '{}'; '{}[1]' is the second",
                                       ref.where, readName(ref.name, ""), twin, twin);
        if (saidOfTwins_.insert(text).second) draft_.note(std::move(text));
        return;
    }
}

void NodeReferences::noteUnfree(const Pending& ref, const PlacedNode& body) {
    if (!body.transform)
        return draft_.note(
            fmt::format("{}: the node '{}' has no transform of its own that could move, so its mass means nothing",
                        ref.where, body.name));
    for (const PlacedNode* above = body.parent; above != nullptr; above = above->parent)
        if (!above->evenScale)
            return draft_.note(
                fmt::format("{}: the node '{}' above it scales its axes differently, so its mass means nothing",
                            ref.where, above->name));
}

void NodeReferences::noteDriven() {
    for (const Handle& handle : handles_)
        if (const auto driver = driven_.find(handle.moved); driver != driven_.end())
            draft_.note(
                fmt::format("{}: what this manipulator moves is driven by {}: its handles can be dragged only "
                            "while that is paused",
                            handle.where, driver->second));
}

}  // namespace tessera

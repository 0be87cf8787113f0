#include "server/sim/frame/SkinPoses.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include <fmt/format.h>

#include "common/drawable/SkinArrays.h"
#include "common/scene/Action.h"
#include "common/scene/FieldTable.h"

namespace tessera {
namespace {

using JointPose = std::array<float, 12>;

/// From a node up to the root, itself first.
std::vector<ObjectId> wayUp(const Aspect& scene, ObjectId node) {
    std::vector<ObjectId> way;
    for (ObjectId id = node; id; id = scene.get<Node>(id)->parent) {
        if (!scene.get<Node>(id)) break;
        way.push_back(id);
    }
    return way;
}

bool standsInWorld(const Aspect& scene, ObjectId node) {
    const Node& at = *scene.get<Node>(node);
    const Object core = at.core ? scene.find(at.core) : Object();
    return core && core.info().pose && core.info().pose(core.data()).absolute;
}

/// holder_T_node, or world_T_node where there is no holder.
Affine3d placeBelow(const Aspect& scene, ObjectId holder, ObjectId node,
                    std::unordered_map<ObjectId, Affine3d>& known) {
    std::vector<ObjectId> way;
    Affine3d place = Affine3d::Identity();
    for (ObjectId id = node; id && id != holder; id = scene.get<Node>(id)->parent) {
        if (const auto found = known.find(id); found != known.end()) {
            place = found->second;
            break;
        }
        way.push_back(id);
    }
    for (std::size_t i = way.size(); i-- > 0;) {
        place = placeNode(scene, *scene.get<Node>(way[i]), Affine3d(place));
        known.emplace(way[i], place);
    }
    return place;
}

Affine3d bindOf(std::span<const float> rows) {
    Affine3d bind = Affine3d::Identity();
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 4; ++c) bind(r, c) = static_cast<double>(rows[static_cast<std::size_t>(4 * r + c)]);
    return bind;
}

/// Nothing where a number is none that a skin takes.
std::optional<JointPose> rowsOf(const Affine3d& matrix) {
    JointPose rows{};
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 4; ++c) {
            if (!(std::abs(matrix(r, c)) <= kGreatestSkinNumber)) return std::nullopt;
            rows[static_cast<std::size_t>(4 * r + c)] = static_cast<float>(matrix(r, c));
        }
    return rows;
}

}  // namespace

void SkinPoses::update(const Aspect& scene, const ChangeList* list) {
    if (!list) {
        known_.clear();
        watchers_.clear();
        stale_.clear();
        const std::vector<ObjectId> ids = scene.ids();
        for (const ObjectId id : ids)
            if (scene.get<Skin>(id)) known_[id];
        if (known_.empty()) return;
        for (const ObjectId id : ids)
            if (const Node* node = scene.get<Node>(id))
                if (const auto known = known_.find(node->core); known != known_.end()) known->second.bearers.insert(id);
        for (const auto& [id, known] : known_) stale_.insert(id);
        for (const ObjectId id : std::set<ObjectId>(stale_)) look(scene, id);
        return;
    }
    std::set<ObjectId> changed;
    for (const Creation& creation : list->creations)
        if (creation.type == typeOf<Skin>()) known_[creation.id], changed.insert(creation.id);
    if (known_.empty()) return;
    const auto changesWatchers = [&](ObjectId id) {
        if (const auto found = watchers_.find(id); found != watchers_.end())
            changed.insert(found->second.begin(), found->second.end());
    };
    for (const Placement& placement : list->placements) changesWatchers(placement.node);
    for (const FieldColumn& column : list->columns) {
        if (column.type == typeOf<Skin>() &&
            (column.field == fieldId<&Skin::joints> || column.field == fieldId<&Skin::inverseBinds>))
            changed.insert(column.ids.begin(), column.ids.end());
        if (column.type == typeOf<Node>() && column.field == fieldId<&Node::core>) {
            for (const ObjectId id : column.ids) {
                changesWatchers(id);
                const Node* node = scene.get<Node>(id);
                const auto skin = node ? known_.find(node->core) : known_.end();
                if (skin == known_.end()) continue;
                skin->second.bearers.insert(id);
                changed.insert(node->core);
            }
        } else if (effectsOf(column) & Effect::kPose) {
            for (const ObjectId id : column.ids)
                if (const auto found = watchers_.find(id); found != watchers_.end())
                    stale_.insert(found->second.begin(), found->second.end());
        }
    }
    for (const RangeEdit& range : list->ranges)
        if (range.type == typeOf<Skin>() && range.field == fieldId<&Skin::inverseBinds>) changed.insert(range.object);
    for (const ObjectId id : list->destructions) {
        changesWatchers(id);
        forget(id);
    }
    for (const ObjectId id : changed)
        if (known_.contains(id)) look(scene, id);
}

void SkinPoses::look(const Aspect& scene, ObjectId id) {
    Known& known = known_.at(id);
    unwatch(id, known);
    const Skin* skin = scene.get<Skin>(id);
    std::erase_if(known.bearers,
                  [&](ObjectId node) { return !scene.get<Node>(node) || scene.get<Node>(node)->core != id; });
    if (!skin || skin->joints.empty() || known.bearers.empty()) {
        stale_.erase(id);
        return;
    }
    stale_.insert(id);
    // Nodes on the way from bearer or joints up, and from how many of them.
    std::vector<ObjectId> nodes = skin->joints;
    nodes.push_back(*known.bearers.begin());
    std::unordered_map<ObjectId, std::size_t> passed;
    bool inWorld = false;
    for (const ObjectId node : nodes)
        for (const ObjectId above : wayUp(scene, node)) ++passed[above];
    known.holder = {};
    // A joint or the bearer may itself be what holds the others; then its parent is, as it moves them by itself.
    for (const ObjectId above : wayUp(scene, nodes.back()))
        if (passed[above] == nodes.size() && std::ranges::find(nodes, above) == nodes.end()) {
            known.holder = above;
            break;
        }
    for (const auto& [node, count] : passed)
        if ((count < nodes.size() || std::ranges::find(nodes, node) != nodes.end()) && standsInWorld(scene, node))
            inWorld = true;
    if (inWorld) known.holder = {};
    for (const auto& [node, count] : passed) {
        const bool above = count == nodes.size() && known.holder && std::ranges::find(nodes, node) == nodes.end();
        if (above && !inWorld) continue;
        known.watched.push_back(node);
        if (const ObjectId core = scene.get<Node>(node)->core) known.watched.push_back(core);
    }
    for (const ObjectId watched : known.watched) watchers_[watched].insert(id);
}

void SkinPoses::unwatch(ObjectId id, Known& known) {
    for (const ObjectId watched : known.watched) {
        const auto found = watchers_.find(watched);
        if (found == watchers_.end()) continue;
        found->second.erase(id);
        if (found->second.empty()) watchers_.erase(found);
    }
    known.watched.clear();
}

void SkinPoses::forget(ObjectId id) {
    const auto found = known_.find(id);
    if (found == known_.end()) return;
    unwatch(id, found->second);
    known_.erase(found);
    stale_.erase(id);
}

void SkinPoses::write(const Aspect& scene, ChangeListBuilder& builder, std::vector<std::string>& remarks) {
    for (const ObjectId id : std::exchange(stale_, {})) {
        Known& known = known_.at(id);
        const Skin& skin = *scene.get<Skin>(id);
        ++calculated_;
        std::unordered_map<ObjectId, Affine3d> places;
        const Affine3d holder_T_bearer = placeBelow(scene, known.holder, *known.bearers.begin(), places);
        const Affine3d bearer_T_holder = holder_T_bearer.inverse(Eigen::Affine);
        const std::span<const float> binds = skin.inverseBinds.as<float>();
        std::vector<float> pose;
        bool sound = true;
        for (std::size_t j = 0; j < skin.joints.size() && sound; ++j) {
            Affine3d matrix = bearer_T_holder * placeBelow(scene, known.holder, skin.joints[j], places);
            if (binds.size() >= 12 * (j + 1)) matrix = matrix * bindOf(binds.subspan(12 * j, 12));
            const std::optional<JointPose> rows = rowsOf(matrix);
            sound = rows.has_value();
            if (sound) pose.insert(pose.end(), rows->begin(), rows->end());
        }
        if (!sound) {
            if (!std::exchange(known.complained, true))
                remarks.push_back(fmt::format(
                    "skin #{} stays as it was: its node or a joint is scaled to nothing or out of this world",
                    id.value));
            continue;
        }
        known.complained = false;
        const std::span<const float> now = skin.pose.as<float>();
        if (now.size() != pose.size()) {
            builder.set(id, typeOf<Skin>(), fieldId<&Skin::pose>, Blob::of(std::span<const float>(pose)));
            continue;
        }
        const auto differs = [&](std::size_t joint) {
            return !std::equal(pose.begin() + static_cast<std::ptrdiff_t>(12 * joint),
                               pose.begin() + static_cast<std::ptrdiff_t>(12 * joint + 12),
                               now.begin() + static_cast<std::ptrdiff_t>(12 * joint));
        };
        for (std::size_t first = 0; first < skin.joints.size();) {
            if (!differs(first)) {
                ++first;
                continue;
            }
            // A range of its own is dearer than two joints that stand still.
            std::size_t end = first + 1;
            for (std::size_t next = end; next < skin.joints.size() && next < end + 3; ++next)
                if (differs(next)) end = next + 1;
            builder.setRange(id, typeOf<Skin>(), fieldId<&Skin::pose>, first * sizeof(JointPose),
                             Blob::of(std::span<const float>(pose).subspan(12 * first, 12 * (end - first))));
            first = end;
        }
    }
}

}  // namespace tessera

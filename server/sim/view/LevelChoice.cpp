#include "server/sim/view/LevelChoice.h"

#include <algorithm>
#include <array>
#include <limits>

#include "common/cores/DistanceLOD.h"
#include "common/scene/Action.h"
#include "common/scene/FieldTable.h"
#include "common/scene/ServerNodes.h"

namespace tessera {
namespace {

bool bearsLevels(const Aspect& scene, ObjectId id) {
    const Node* node = scene.get<Node>(id);
    return node && scene.coreOf<DistanceLOD>(*node) && !standsInServersOwn(scene, id);
}

}  // namespace

std::size_t nextLevel(const DistanceLOD& lod, std::size_t level, double measure) {
    const std::span<const double> ranges = lod.ranges.as<double>();
    const bool size = lod.measure == DistanceLOD::kSize;
    const double more = 1 + lod.hysteresis, less = 1 - lod.hysteresis;
    level = std::min(level, ranges.size());
    while (level < ranges.size() && (size ? measure < less * ranges[level] : measure > more * ranges[level])) ++level;
    while (level > 0 && (size ? measure > more * ranges[level - 1] : measure < less * ranges[level - 1])) --level;
    return level;
}

LevelChoice::LevelChoice(const Wall& wall) : lookers_(wall) {}

void LevelChoice::update(const Aspect& scene, const ChangeList* list) {
    if (!list) {
        bearers_.clear();
        for (const ObjectId id : scene.ids())
            if (bearsLevels(scene, id)) bearers_.try_emplace(id);
        return watch(scene);
    }
    const bool others = noteBearers(scene, *list);
    if (bearers_.empty() && !others) return;
    if (others || concernsTree(*list)) return watch(scene);
    const auto touched = [&](ObjectType type, FieldId field, std::span<const ObjectId> ids) {
        if (type == typeOf<Node>() && field == fieldId<&Node::levels>) {
            for (const ObjectId id : ids)
                if (bearers_.contains(id)) due_.insert(id);
        } else if (type == typeOf<DistanceLOD>() || (effectsOf(type, field) & Effect::kPose)) {
            for (const ObjectId id : ids)
                if (const auto nodes = nodesOfCore_.find(id); nodes != nodesOfCore_.end())
                    for (const ObjectId node : nodes->second) placeBelow(node);
        }
    };
    for (const FieldColumn& column : list->columns) touched(column.type, column.field, column.ids);
    for (const RangeEdit& range : list->ranges) touched(range.type, range.field, std::span(&range.object, 1));
}

bool LevelChoice::noteBearers(const Aspect& scene, const ChangeList& list) {
    bool changed = false;
    for (const FieldColumn& column : list.columns) {
        if (column.type != typeOf<Node>() || column.field != fieldId<&Node::core>) continue;
        for (const ObjectId id : column.ids) {
            const bool bears = bearsLevels(scene, id);
            if (bears ? bearers_.try_emplace(id).second : bearers_.erase(id) > 0) changed = true;
        }
    }
    if (!bearers_.empty())
        for (const ObjectId id : list.destructions)
            if (bearers_.erase(id) > 0) changed = true;
    return changed;
}

/// Whether what is watched may hang otherwise, or bear other cores.
bool LevelChoice::concernsTree(const ChangeList& list) const {
    for (const Placement& placement : list.placements)
        if (watched_.contains(placement.node)) return true;
    for (const FieldColumn& column : list.columns) {
        if (column.type != typeOf<Node>() || column.field != fieldId<&Node::core>) continue;
        if (std::ranges::any_of(column.ids, [&](ObjectId id) { return watched_.contains(id); })) return true;
    }
    return false;
}

void LevelChoice::watch(const Aspect& scene) {
    watched_.clear();
    nodesOfCore_.clear();
    due_.clear();
    stale_.clear();
    for (const auto& [bearer, known] : bearers_) {
        stale_.insert(bearer);
        ObjectId below;
        for (ObjectId id = bearer; id;) {
            const auto [at, isNew] = watched_.try_emplace(id);
            if (below) at->second.push_back(below);
            if (!isNew) break;  // the way up from here is watched already
            ++work_;
            const Node& node = *scene.get<Node>(id);
            if (node.core) nodesOfCore_[node.core].push_back(id);
            below = id;
            id = node.parent;
        }
    }
}

void LevelChoice::placeBelow(ObjectId top) {
    std::vector<ObjectId> open{top};
    while (!open.empty()) {
        const ObjectId id = open.back();
        open.pop_back();
        ++work_;
        if (bearers_.contains(id)) stale_.insert(id);
        for (const ObjectId child : watched_.at(id)) open.push_back(child);
    }
}

void LevelChoice::place(const Aspect& scene, ObjectId id, Bearer& bearer) {
    ++work_;
    ObjectId top = id;
    for (const Node* node = scene.get<Node>(id); node && node->parent; node = scene.get<Node>(top)) top = node->parent;
    bearer.attached = top == kRootNode;
    if (!bearer.attached) return;
    const DistanceLOD& lod = *scene.coreOf<DistanceLOD>(*scene.get<Node>(id));
    const Affine3d world_T_node = worldTransform(scene, id);
    bearer.center = world_T_node * lod.center;
    bearer.radius = lod.radius * world_T_node.linear().colwise().norm().maxCoeff();
}

ChangeList LevelChoice::choose(const Aspect& scene, const View& view) {
    if (bearers_.empty() || lookers_.bytes().empty()) return {};
    for (const ObjectId id : stale_) {
        place(scene, id, bearers_.at(id));
        due_.insert(id);
    }
    stale_.clear();
    if (lookers_.lookFrom(view))
        for (const auto& [id, bearer] : bearers_) due_.insert(id);
    ChangeListBuilder builder;
    std::set<ObjectId> said;
    for (const ObjectId id : due_) {
        const Bearer& bearer = bearers_.at(id);
        if (!bearer.attached) continue;
        ++work_;
        const Node& node = *scene.get<Node>(id);
        const std::int64_t levels = levelsOf(*scene.coreOf<DistanceLOD>(node), node, bearer);
        if (levels == node.levels) continue;
        builder.set(id, typeOf<Node>(), fieldId<&Node::levels>, levels);
        said.insert(id);
    }
    due_ = std::move(said);  // looked at once more: it may be refused
    return builder.take();
}

std::int64_t LevelChoice::levelsOf(const DistanceLOD& lod, const Node& node, const Bearer& bearer) const {
    const bool size = lod.measure == DistanceLOD::kSize;
    std::array<std::uint64_t, kLevelUsers> chosen{};
    for (const std::size_t byte : lookers_.bytes()) {
        double measure = size ? 0.0 : std::numeric_limits<double>::infinity();
        for (const std::size_t user : lookers_.usersOf(byte)) {
            const Lookers::Looker& looker = lookers_[user];
            const double away = (bearer.center - looker.head).norm(), distance = looker.coarser * away;
            const double across = away > bearer.radius ? 2 * bearer.radius * looker.pixels / distance
                                                       : std::numeric_limits<double>::infinity();
            measure = size ? std::max(measure, across) : std::min(measure, distance);
            // What stands nowhere leaves everything as it is.
            if (!(distance < std::numeric_limits<double>::infinity()))
                measure = std::numeric_limits<double>::quiet_NaN();
        }
        const std::uint64_t now = static_cast<std::uint64_t>(node.levels) >> (8 * byte) & 0xff;
        chosen[byte] = nextLevel(lod, now, measure);
    }
    std::uint64_t levels = 0;
    for (std::size_t byte = 0; byte < kLevelUsers; ++byte) levels |= chosen[lookers_.byteFor(byte)] << (8 * byte);
    return static_cast<std::int64_t>(levels);
}

}  // namespace tessera

#include "server/collision/pipeline/ObjectHandler.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <unordered_set>

#include "common/scene/Action.h"
#include "common/scene/FieldTable.h"
#include "server/collision/mesh/TreeQueries.h"

namespace tessera {

namespace {

/// Fields that decide who takes part. Everything else moves parts or does not concern them.
bool changesStructure(const FieldColumn& column) {
    if (column.type == typeOf<Node>()) return column.field == field::kNodeCore;
    if (column.type == typeOf<Geometry>()) return column.field == field::kPositions || column.field == field::kIndices;
    return column.type == typeOf<Switch>() || column.type == typeOf<Interest>();
}

Affine3d localOf(const Transform& t) {
    return composeTransform(t.translation, t.rotation, t.scale);
}

}  // namespace

bool invertible(const Affine3d& m) {
    if (!m.matrix().allFinite()) return false;
    const Affine3d inverse = m.inverse();
    return inverse.matrix().allFinite() && std::abs(m.linear().determinant()) > 1e-120 &&
           m.matrix().cwiseAbs().maxCoeff() < 1e50 && inverse.matrix().cwiseAbs().maxCoeff() < 1e50;
}

void ObjectHandler::update(const Aspect& aspect, const ChangeList* list) {
    const bool structure = !list || !list->creations.empty() || !list->placements.empty() ||
                           !list->destructions.empty() ||
                           std::any_of(list->columns.begin(), list->columns.end(), changesStructure);
    if (structure) {
        rebuild(aspect);
        return;
    }
    // What was laid over the scene is now committed, or was refused.
    std::vector<ObjectId> touched = std::move(overlaid_);
    overlaid_.clear();
    for (const FieldColumn& column : list->columns)
        if (column.type == typeOf<Transform>()) touched.insert(touched.end(), column.ids.begin(), column.ids.end());
    std::sort(touched.begin(), touched.end());
    touched.erase(std::unique(touched.begin(), touched.end()), touched.end());
    for (const ObjectId id : touched) reload(aspect, id);
}

void ObjectHandler::rebuild(const Aspect& aspect) {
    ++generation_;
    overlaid_.clear();
    flatten(aspect);
    chooseParts(aspect);
    relate();
    shapes_->forgetIdle();
    moved_.clear();
    for (std::uint32_t i = 0; i < parts_.size(); ++i) moved_.push_back(i);
}

void ObjectHandler::flatten(const Aspect& aspect) {
    places_.clear();
    nodes_.clear();
    placesOfTransform_.clear();
    interests_.clear();
    interestsLeftOut_ = 0;

    std::vector<std::uint32_t> path;  // places above, by depth
    std::vector<ObjectId> interestCores;
    std::unordered_map<ObjectId, std::uint32_t> placeOfNode;
    Action action;
    action.onNode([&](const Visit& visit) {
        const auto index = static_cast<std::uint32_t>(places_.size());
        while (path.size() > visit.depth) {
            places_[path.back()].end = index;
            path.pop_back();
        }
        Place place;
        place.parent = path.empty() ? Place::kNone : path.back();
        place.world = visit.world_T_node;
        if (const Transform* t = aspect.coreOf<Transform>(visit.node)) {
            place.transform = visit.node.core;
            place.local = localOf(*t);
            placesOfTransform_[visit.node.core].push_back(index);
        }
        if (aspect.coreOf<Interest>(visit.node)) interestCores.push_back(visit.node.core);
        placeOfNode.emplace(visit.nodeId, index);
        path.push_back(index);
        places_.push_back(place);
        nodes_.push_back(visit.nodeId);
        return Descend::kInto;
    });
    action.run(aspect);
    for (const std::uint32_t open : path) places_[open].end = static_cast<std::uint32_t>(places_.size());

    std::unordered_set<ObjectId> seen;
    for (const ObjectId core : interestCores) {
        const Interest& interest = *aspect.get<Interest>(core);
        if (interest.enabled == 0 || !seen.insert(core).second) continue;
        // A node that is hidden, detached or gone: the interest sleeps.
        const auto object = placeOfNode.find(interest.object);
        const auto against = placeOfNode.find(interest.against ? interest.against : kRootNode);
        if (object == placeOfNode.end() || against == placeOfNode.end()) continue;
        if (interests_.size() == maxInterests_) {
            ++interestsLeftOut_;
            continue;
        }
        interests_.push_back({object->second, places_[object->second].end, against->second,
                              places_[against->second].end, interest.response == Interest::kStop});
    }
}

void ObjectHandler::chooseParts(const Aspect& aspect) {
    parts_.clear();
    std::vector<int> coverage(places_.size() + 1, 0);
    for (const InterestTerms& terms : interests_) {
        ++coverage[terms.objectBegin];
        --coverage[terms.objectEnd];
        ++coverage[terms.againstBegin];
        --coverage[terms.againstEnd];
    }
    partOfPlace_.assign(places_.size(), Place::kNone);
    int covered = 0;
    for (std::uint32_t i = 0; i < places_.size(); ++i) {
        covered += coverage[i];
        if (covered == 0) continue;
        const Geometry* geometry = aspect.coreOf<Geometry>(*aspect.get<Node>(nodes_[i]));
        if (!geometry) continue;
        Part part;
        part.node = nodes_[i];
        part.place = i;
        part.shape = shapes_->shape(*geometry);
        partOfPlace_[i] = static_cast<std::uint32_t>(parts_.size());
        parts_.push_back(std::move(part));
        // The pose is new even where it equals an old one: part numbers have changed their meaning.
        parts_.back().world.matrix().setConstant(std::nan(""));
        place(i);
    }
}

void ObjectHandler::relate() {
    // The interests that a part is in, and on which side, are its signature; parts of one signature form a group.
    struct Membership {
        std::size_t interest;
        bool object;
        auto operator<=>(const Membership&) const = default;
    };
    std::vector<std::vector<Membership>> signatures(parts_.size());
    for (std::size_t k = 0; k < interests_.size(); ++k) {
        const InterestTerms& terms = interests_[k];
        const auto within = [](std::uint32_t place, std::uint32_t begin, std::uint32_t end) {
            return begin <= place && place < end;
        };
        const std::uint32_t from = std::min(terms.objectBegin, terms.againstBegin);
        const std::uint32_t to = std::max(terms.objectEnd, terms.againstEnd);
        const std::uint32_t last =
            to < places_.size() ? partsBelow(to).first : static_cast<std::uint32_t>(parts_.size());
        for (std::uint32_t i = partsBelow(from).first; i < last; ++i) {
            const std::uint32_t at = parts_[i].place;
            if (within(at, terms.objectBegin, terms.objectEnd))
                signatures[i].push_back({k, true});
            else if (within(at, terms.againstBegin, terms.againstEnd))
                signatures[i].push_back({k, false});
        }
    }
    std::map<std::vector<Membership>, std::uint32_t> groups;
    interactions_ = {};
    interactions_.groupOf.reserve(parts_.size());
    for (const auto& signature : signatures)
        interactions_.groupOf.push_back(
            groups.emplace(signature, static_cast<std::uint32_t>(groups.size())).first->second);

    const std::size_t n = groups.size();
    interactions_.active.assign(n, false);
    interactions_.interacts.assign(n * n, false);
    relations_.assign(n * n, {});
    std::vector<std::vector<std::uint32_t>> objects(interests_.size()), others(interests_.size());
    for (const auto& [signature, group] : groups)
        for (const Membership& m : signature) {
            (m.object ? objects : others)[m.interest].push_back(group);
            if (m.object) interactions_.active[group] = true;
        }
    // Of several interests in one pair the first, in document order, says which side is A; any of them can stop it.
    for (std::size_t k = 0; k < interests_.size(); ++k)
        for (const std::uint32_t a : objects[k])
            for (const std::uint32_t b : others[k]) {
                Relation& ab = relations_[a * n + b];
                Relation& ba = relations_[b * n + a];
                if (!ab.relevant) {
                    ab = {true, false, true};
                    ba = {true, false, false};
                }
                ab.stop = ab.stop || interests_[k].stop;
                ba.stop = ab.stop;
                interactions_.interacts[a * n + b] = interactions_.interacts[b * n + a] = true;
            }
}

Relation ObjectHandler::relation(std::uint32_t a, std::uint32_t b) const {
    return relations_[interactions_.groupOf[a] * interactions_.active.size() + interactions_.groupOf[b]];
}

std::pair<std::uint32_t, std::uint32_t> ObjectHandler::partsBelow(std::uint32_t place) const {
    const auto at = [&](std::uint32_t p) {
        const auto it = std::lower_bound(parts_.begin(), parts_.end(), p,
                                         [](const Part& part, std::uint32_t value) { return part.place < value; });
        return static_cast<std::uint32_t>(it - parts_.begin());
    };
    return {at(place), at(places_[place].end)};
}

std::span<const std::uint32_t> ObjectHandler::placesOf(ObjectId transform) const {
    const auto found = placesOfTransform_.find(transform);
    if (found == placesOfTransform_.end()) return {};
    return found->second;
}

std::size_t ObjectHandler::partsSkipped() const {
    return static_cast<std::size_t>(
        std::count_if(parts_.begin(), parts_.end(), [](const Part& p) { return !p.solid(); }));
}

/// Makes the part at a place follow the place's world pose.
void ObjectHandler::place(std::uint32_t index) {
    const std::uint32_t number = partOfPlace_[index];
    if (number == Place::kNone) return;
    Part& part = parts_[number];
    const Affine3d& world = places_[index].world;
    if (part.world.matrix() == world.matrix()) return;
    part.world = world;
    part.worldBox = part.shape && invertible(world) ? conservativeBox(world, part.shape->mesh().bounds()) : Box{};
    part.poseVersion = nextVersion_++;
    moved_.push_back(number);
}

void ObjectHandler::setLocal(ObjectId transform, const Affine3d& local) {
    std::uint32_t done = 0;  // a place below one that was just recomputed is right already
    const std::span<const std::uint32_t> mine = placesOf(transform);
    for (const std::uint32_t index : mine) places_[index].local = local;
    for (const std::uint32_t index : mine) {
        if (index < done) continue;
        done = places_[index].end;
        for (std::uint32_t i = index; i < done; ++i) {
            Place& p = places_[i];
            const Affine3d above = p.parent == Place::kNone ? Affine3d(Affine3d::Identity()) : places_[p.parent].world;
            p.world = p.transform ? Affine3d(above * p.local) : above;
            place(i);
        }
    }
}

void ObjectHandler::reload(const Aspect& aspect, ObjectId transform) {
    if (const Transform* t = aspect.get<Transform>(transform)) setLocal(transform, localOf(*t));
}

void ObjectHandler::overlay(ObjectId transform, const Affine3d& local) {
    overlaid_.push_back(transform);
    setLocal(transform, local);
}

void ObjectHandler::dropOverlay(const Aspect& aspect) {
    std::vector<ObjectId> touched = std::move(overlaid_);
    overlaid_.clear();
    for (const ObjectId id : touched) reload(aspect, id);
}

std::vector<std::uint32_t> ObjectHandler::takeMoved() {
    std::vector<std::uint32_t> moved = std::move(moved_);
    moved_.clear();
    std::sort(moved.begin(), moved.end());
    moved.erase(std::unique(moved.begin(), moved.end()), moved.end());
    return moved;
}

}  // namespace tessera

#include "server/collision/objects/CollisionObjectTable.h"

#include <algorithm>

#include "common/cores/CollisionObject.h"

namespace tessera {
namespace {

ShapeChoice choiceOf(const CollisionObject& object) {
    ShapeChoice choice;
    constexpr double kUsualError = 0.01, kPercent = 0.01;
    switch (object.shape) {
        case CollisionWords::kHull:
            choice.representation = Representation::kHull;
            break;
        case CollisionWords::kHeightField:
            choice.representation = Representation::kHeightField;
            break;
        case CollisionWords::kPoints:
            choice.representation = Representation::kPoints;
            break;
        case CollisionWords::kAutoShape:
            choice.representation = std::nullopt;
            choice.error = kPercent * object.error;
            break;
        case CollisionWords::kSphericalBezier:
            choice.representation = Representation::kSphericalBezier;
            break;
        case CollisionWords::kSpherical:
            choice.representation = Representation::kSpherical;
            break;
        case CollisionWords::kDistanceField:
            choice.representation = Representation::kDistanceField;
            choice.error = object.error > 0 ? kPercent * object.error : kUsualError;
            break;
        case CollisionWords::kFreeform:
            choice.representation = Representation::kFreeform;
            choice.error = kPercent * object.error;
            break;
        default:
            break;
    }
    switch (object.volume) {
        case CollisionWords::kSphere:
            choice.volume = VolumeKind::kSphere;
            break;
        case CollisionWords::kAabb:
            choice.volume = VolumeKind::kAabb;
            break;
        case CollisionWords::kObb:
            choice.volume = VolumeKind::kObb;
            break;
        case CollisionWords::kDop6:
            choice.volume = VolumeKind::kDop6;
            break;
        case CollisionWords::kDop14:
            choice.volume = VolumeKind::kDop14;
            break;
        case CollisionWords::kDop18:
            choice.volume = VolumeKind::kDop18;
            break;
        case CollisionWords::kDop26:
            choice.volume = VolumeKind::kDop26;
            break;
        default:
            break;
    }
    static_assert(kFinestLevel == CollisionObject::kFinestLevel);
    choice.level = static_cast<unsigned>(object.level);
    return choice;
}

}  // namespace

void CollisionObjectTable::clear() {
    *this = {};
}

void CollisionObjectTable::follow(const Aspect& aspect, ObjectId core, bool visible, std::uint64_t update,
                                  std::vector<ObjectId>& nodes) {
    std::uint32_t number = numbers_.find(core);
    if (number != IdTable::kNone) {
        const ObjectId before = entries_[number].node;
        if (const auto named = naming_.find(before); named != naming_.end()) {
            std::erase(named->second, core);
            if (named->second.empty()) naming_.erase(named);
            nodes.push_back(before);
        }
        if (!visible) {
            gone_.push_back(number);
            numbers_.erase(core);
        }
    }
    if (!visible) return;
    if (number == IdTable::kNone) {
        if (free_.empty()) {
            number = static_cast<std::uint32_t>(entries_.size());
            entries_.emplace_back();
        } else {
            number = free_.back();
            free_.pop_back();
        }
        numbers_.insert(core, number);
    }
    const CollisionObject& it = *aspect.get<CollisionObject>(core);
    const ShapeChoice choice = choiceOf(it);
    Entry& entry = entries_[number];
    const bool same = entry.core == core && entry.kind == it.kind && entry.division == it.division &&
                      entry.choice == choice && entry.layers == it.layers;
    entry.core = core;
    entry.node = it.node;
    entry.kind = it.kind;
    entry.division = it.division;
    entry.choice = choice;
    entry.layers = it.layers;
    if (!same) entry.changed = update;
    if (!it.node) return;
    std::vector<ObjectId>& named = naming_[it.node];
    named.insert(std::ranges::lower_bound(named, core), core);
    nodes.push_back(it.node);
}

void CollisionObjectTable::recycle() {
    for (const std::uint32_t number : gone_) {
        entries_[number] = {};
        free_.push_back(number);
    }
    gone_.clear();
}

}  // namespace tessera

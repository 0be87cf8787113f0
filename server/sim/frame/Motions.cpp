#include "server/sim/frame/Motions.h"

#include <algorithm>

#include "common/animation/MotionKeys.h"
#include "common/cores/Motion.h"
#include "common/cores/Transform.h"
#include "common/scene/FieldTable.h"
#include "server/sim/frame/PoseFields.h"

namespace tessera {

void Motions::update(const Aspect& scene, const ChangeList* list) {
    if (!list) {
        known_.clear();
        playing_.clear();
        byTarget_.clear();
        for (const ObjectId id : scene.ids()) look(scene, id, true);
        return;
    }
    for (const Creation& creation : list->creations)
        if (creation.type == typeOf<Motion>()) look(scene, creation.id, false);  // fresh ones have no keys
    for (const FieldColumn& column : list->columns) {
        if (column.type != typeOf<Motion>() || column.field == fieldId<&Motion::time> ||
            column.field == fieldId<&Motion::mode>)
            continue;
        for (const ObjectId id : column.ids) look(scene, id, column.field == fieldId<&Motion::keys>);
    }
    if (!known_.empty())
        for (const ObjectId id : list->destructions) forget(id);
}

void Motions::look(const Aspect& scene, ObjectId id, bool keys) {
    const Motion* motion = scene.get<Motion>(id);
    if (!motion) return;  // destroyed by the same list, or no Motion at all
    Known& known = known_[id];
    if (keys) {
        ++keysChecked_;
        known.sound = checkKeys(motion->keys.as<double>()).has_value();
    }
    setPlaying(id, known, motion->playing != 0, motion->target);
}

void Motions::forget(ObjectId id) {
    const auto found = known_.find(id);
    if (found == known_.end()) return;
    setPlaying(id, found->second, false, {});
    known_.erase(found);
}

void Motions::setPlaying(ObjectId id, Known& known, bool playing, ObjectId target) {
    if (known.playing) byTarget_.erase({known.target, id});
    known.playing = playing;
    known.target = target;
    if (playing) {
        playing_[id] = known.sound;
        byTarget_.insert({target, id});
    } else {
        playing_.erase(id);
    }
}

std::vector<MotionStep> Motions::advance(const Aspect& scene, double seconds) const {
    ById<MotionStep> byTarget;
    for (const auto& [id, sound] : playing_) {
        if (!sound) continue;
        const Motion& motion = *scene.get<Motion>(id);
        if (!scene.get<Transform>(motion.target)) continue;
        const std::span<const double> keys = motion.keys.as<double>();
        double time = motion.time + seconds;
        if (motion.mode == Motion::kOnce) time = std::min(time, keyTime(keys, keys.size() / kScalarsPerKey - 1));
        byTarget.add(motion.target).value = {.motion = id,
                                             .target = motion.target,
                                             .from = motion.time,
                                             .time = time,
                                             .pose = poseAt(keys, motion.mode, time)};
    }
    std::vector<MotionStep> steps;
    for (const auto& [target, step] : byTarget.ascending()) steps.push_back(step);
    std::ranges::sort(steps, {}, &MotionStep::motion);
    return steps;
}

void Motions::appendPlaying(ObjectId target, std::vector<ObjectId>& motions) const {
    for (auto it = byTarget_.lower_bound({target, ObjectId()}); it != byTarget_.end() && it->first == target; ++it)
        motions.push_back(it->second);
}

void Motions::want(ActorStage& stage) {
    wanted_ = advance(stage.scene(), stage.seconds);
    std::ranges::sort(wanted_, {}, &MotionStep::target);
    for (const MotionStep& step : wanted_)
        stage.wishes.add(step.target).value = {.pose = step.pose, .actors = {step.motion}, .whole = true};
}

void Motions::hear(const Aspect& scene, const WishOutcome& outcome, ChangeListBuilder& list) const {
    for (const MotionStep& step : wanted_) {
        if (!outcome.granted.contains(step.motion)) continue;
        const Motion* motion = scene.get<Motion>(step.motion);
        // A hand may have set its time: that is a seek.
        if (motion && motion->time == step.from && motion->time != step.time)
            list.set(step.motion, typeOf<Motion>(), fieldId<&Motion::time>, toValue(step.time));
    }
}

void Motions::appendDrivers(const ChangeList& list, std::vector<Actor::Driver>& drivers) const {
    if (byTarget_.empty()) return;
    std::set<ObjectId> targets;
    for (const FieldColumn& column : list.columns)
        if (isPoseField(column)) targets.insert(column.ids.begin(), column.ids.end());
    std::vector<ObjectId> motions;
    for (const ObjectId target : targets) appendPlaying(target, motions);
    std::ranges::sort(motions);
    for (const ObjectId id : motions) drivers.push_back({id, typeOf<Motion>(), fieldId<&Motion::playing>});
}

}  // namespace tessera

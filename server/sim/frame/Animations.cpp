#include "server/sim/frame/Animations.h"

#include <algorithm>
#include <cstring>
#include <map>

#include <fmt/format.h>

#include "common/cores/Transform.h"
#include "server/sim/frame/PoseFields.h"

namespace tessera {
namespace {

/// The bytes in which an array of the same size differs, as an offset and a blob. Nothing: none.
std::optional<std::pair<std::uint64_t, Blob>> differingBytes(ByteSpan now, ByteSpan wanted) {
    const auto [nowFirst, wantedFirst] = std::mismatch(now.begin(), now.end(), wanted.begin());
    if (nowFirst == now.end()) return std::nullopt;
    std::size_t begin = static_cast<std::size_t>(nowFirst - now.begin()), end = now.size();
    while (end > begin && now[end - 1] == wanted[end - 1]) --end;
    // Whole numbers, so that who follows ranges sees elements.
    begin = begin / 4 * 4;
    end = std::min(now.size(), (end + 3) / 4 * 4);
    return std::pair(std::uint64_t{begin}, Blob::of(wanted.subspan(begin, end - begin)));
}

std::optional<AnimatedValue> newValue(const Object& target, const FieldEntry& field, FieldValue wanted) {
    AnimatedValue value{.animation = {}, .object = {}, .type = typeOf(target), .field = field.id, .value = {}};
    const FieldValue now = field.load(target);
    if (const Blob* array = std::get_if<Blob>(&now)) {
        const Blob& other = std::get<Blob>(wanted);
        if (array->resident() && array->sizeBytes() == other.sizeBytes()) {
            auto part = differingBytes(array->bytes(), other.bytes());
            if (!part) return std::nullopt;
            value.offset = part->first;
            value.value = std::move(part->second);
            return value;
        }
    }
    if (now == wanted) return std::nullopt;
    value.value = std::move(wanted);
    return value;
}

bool isPoseOf(const KeyTrack& track) {
    return track.type().type == typeOf<Transform>();
}

void wish(AnimatedTransform& transform, const KeyTrack& track, std::span<const double> v) {
    const FieldId field = track.field().id;
    if (field == fieldId<&Transform::translation>) transform.translation = Vec3d(v[0], v[1], v[2]);
    if (field == fieldId<&Transform::rotation>) transform.rotation = Quatd(v[0], v[1], v[2], v[3]);
    if (field == fieldId<&Transform::scale>) transform.scale = Vec3d(v[0], v[1], v[2]);
}

}  // namespace

void addTo(ChangeListBuilder& builder, const AnimatedValue& value) {
    if (value.offset)
        builder.setRange(value.object, value.type, value.field, *value.offset, std::get<Blob>(value.value));
    else
        builder.set(value.object, value.type, value.field, value.value);
}

void Animations::update(const Aspect& scene, const ChangeList* list) {
    if (!list) {
        frames_.clear();
        known_.clear();
        playing_.clear();
        shownOnce_.clear();
        carriedOn_.clear();
        held_.clear();
        byTarget_.clear();
        std::vector<ObjectId> animations;
        for (const ObjectId id : scene.ids()) {
            const Object object = scene.find(id);
            if (object.is<KeyFrames>()) lookAtFrames(scene, id);
            if (object.is<Animation>()) animations.push_back(id);
        }
        for (const ObjectId id : animations) lookAt(scene, id);
        return;
    }
    std::set<ObjectId> frames, animations, fresh, sought;
    for (const Creation& creation : list->creations) {
        if (creation.type == typeOf<KeyFrames>()) frames.insert(creation.id);
        if (creation.type == typeOf<Animation>()) animations.insert(creation.id), fresh.insert(creation.id);
    }
    for (const FieldColumn& column : list->columns) {
        if (column.type == typeOf<KeyFrames>()) frames.insert(column.ids.begin(), column.ids.end());
        if (column.type != typeOf<Animation>()) continue;
        (column.field == fieldId<&Animation::time> ? sought : animations).insert(column.ids.begin(), column.ids.end());
    }
    for (const RangeEdit& range : list->ranges)
        if (range.type == typeOf<KeyFrames>()) frames.insert(range.object);
    for (const ObjectId id : frames) {
        lookAtFrames(scene, id);
        if (const auto known = frames_.find(id); known != frames_.end())
            animations.insert(known->second.users.begin(), known->second.users.end());
    }
    for (const ObjectId id : animations) lookAt(scene, id);
    for (const ObjectId id : sought) {
        held_.erase(id);
        if (carriedOn_.erase(id) != 0) continue;
        if (const Animation* animation = scene.get<Animation>(id);
            animation && !animation->playing && !fresh.contains(id))
            shownOnce_.insert(id);
    }
    if (known_.empty() && frames_.empty()) return;
    for (const ObjectId id : list->destructions) forget(id);
}

void Animations::lookAtFrames(const Aspect& scene, ObjectId id) {
    const KeyFrames* frames = scene.get<KeyFrames>(id);
    if (!frames) return;  // destroyed by the same list
    Frames& known = frames_[id];
    ++keysChecked_;
    const Object target = frames->target ? scene.find(frames->target) : Object();
    const Expected<KeyTrack> track = KeyTrack::of(*frames, target ? &target.info() : nullptr);
    known.sound = track.has_value();
    known.last = track ? track->lastTime() : 0;
}

void Animations::lookAt(const Aspect& scene, ObjectId id) {
    const Animation* animation = scene.get<Animation>(id);
    if (!animation) return;
    Known& known = known_[id];
    standStill(id, known);
    for (const ObjectId channel : known.channels)
        if (const auto frames = frames_.find(channel); frames != frames_.end()) frames->second.users.erase(id);
    known.channels = animation->channels;
    known.playing = animation->playing;
    known.last = 0;
    for (const ObjectId channel : known.channels) {
        Frames& frames = frames_[channel];
        frames.users.insert(id);
        if (frames.sound) known.last = std::max(known.last, frames.last);
    }
    if (!known.playing) return;
    playing_.insert(id);
    shownOnce_.erase(id);
    for (const ObjectId channel : known.channels) {
        if (!frames_[channel].sound) continue;
        const KeyFrames& frames = *scene.get<KeyFrames>(channel);
        known.driven.emplace_back(frames.target,
                                  KeyTrack::ofSound(frames, scene.find(frames.target).info()).field().id);
        byTarget_.insert({known.driven.back().first, known.driven.back().second, id});
    }
}

void Animations::standStill(ObjectId id, Known& known) {
    for (const auto& [object, field] : known.driven) byTarget_.erase({object, field, id});
    known.driven.clear();
    playing_.erase(id);
}

void Animations::forget(ObjectId id) {
    frames_.erase(id);
    shownOnce_.erase(id);
    held_.erase(id);
    const auto found = known_.find(id);
    if (found == known_.end()) return;
    standStill(id, found->second);
    for (const ObjectId channel : found->second.channels)
        if (const auto frames = frames_.find(channel); frames != frames_.end()) frames->second.users.erase(id);
    known_.erase(found);
}

AnimationWishes Animations::advance(const Aspect& scene, double seconds) {
    AnimationWishes wishes;
    if (playing_.empty() && shownOnce_.empty()) return wishes;
    std::set<ObjectId> all = std::exchange(shownOnce_, {});
    all.insert(playing_.begin(), playing_.end());
    std::map<std::pair<ObjectId, FieldId>, AnimatedValue> values;
    for (const ObjectId id : all) {
        const Animation& animation = *scene.get<Animation>(id);
        const Known& known = known_.at(id);
        const double time = foldedTime(animation.time + (animation.playing ? animation.speed * seconds : 0), known.last,
                                       animation.mode);
        if (animation.playing) wishes.steps.push_back({.animation = id, .from = animation.time, .time = time});
        const double shown = shownTime(time, known.last, animation.mode);
        for (const ObjectId channel : known.channels) {
            if (!frames_.at(channel).sound) continue;
            ++framesPlayed_;
            const KeyFrames& frames = *scene.get<KeyFrames>(channel);
            const Object target = scene.find(frames.target);
            const KeyTrack track = KeyTrack::ofSound(frames, target.info());
            const std::vector<double> numbers = track.at(shown);
            if (isPoseOf(track)) {
                AnimatedTransform& transform = wishes.transforms.add(frames.target).value;
                wish(transform, track, numbers);
                if (transform.animations.empty() || transform.animations.back() != id)
                    transform.animations.push_back(id);
                continue;
            }
            if (held_.contains(id)) continue;  // `hear` sets it once nothing is stopped
            // Of an animation that stands and one that plays the later one decides too.
            values.erase({frames.target, track.field().id});
            std::optional<AnimatedValue> value = newValue(target, track.field(), track.valueOf(numbers));
            if (!value) continue;
            value->animation = id;
            value->object = frames.target;
            values.emplace(std::pair(frames.target, track.field().id), std::move(*value));
        }
    }
    for (auto& [where, value] : values) wishes.values.push_back(std::move(value));
    return wishes;
}

template <typename Found>
void Animations::visitDriving(const ChangeList& list, Found&& found) const {
    if (byTarget_.empty()) return;
    const auto look = [&](ObjectId object, FieldId field) {
        for (auto it = byTarget_.lower_bound({object, field, ObjectId()});
             it != byTarget_.end() && std::get<0>(*it) == object && std::get<1>(*it) == field; ++it)
            found(std::get<2>(*it));
    };
    for (const FieldColumn& column : list.columns)
        for (const ObjectId id : column.ids) look(id, column.field);
    for (const RangeEdit& range : list.ranges) look(range.object, range.field);
}

void Animations::appendDriving(const ChangeList& list, std::vector<ObjectId>& animations) const {
    std::set<ObjectId> all;
    visitDriving(list, [&](ObjectId id) { all.insert(id); });
    animations.insert(animations.end(), all.begin(), all.end());
}

void Animations::want(ActorStage& stage) {
    AnimationWishes wanted = advance(stage.scene(), stage.seconds);
    steps_ = std::move(wanted.steps);
    for (const auto& [id, transform] : wanted.transforms.ascending()) {
        const auto [wish, isNew] = stage.wishes.add(id);
        if (isNew) wish.pose = poseOf(*stage.scene().get<Transform>(id));
        transform.overlay(wish.pose);
        wish.actors.insert(wish.actors.end(), transform.animations.begin(), transform.animations.end());
    }
    applyValues(stage, wanted.values);
}

void Animations::settle(ActorStage& stage) {
    applyValues(stage, std::exchange(late_, {}));
}

void Animations::applyValues(ActorStage& stage, const std::vector<AnimatedValue>& values) {
    if (values.empty()) return;
    ChangeListBuilder all;
    for (const AnimatedValue& value : values) addTo(all, value);
    if (stage.hand.apply(all.take())) return;
    // One of them is not to be: each by itself, and who wants it is paused.
    for (const AnimatedValue& value : values) {
        ChangeListBuilder one;
        addTo(one, value);
        const Expected<void> applied = stage.hand.apply(one.take());
        const Animation* const animation = stage.scene().get<Animation>(value.animation);
        if (applied || !animation || !animation->playing) continue;  // or its earlier value has paused it
        stage.remarks.push_back(
            fmt::format("animation #{} is paused: {}", value.animation.value, applied.error().message));
        one.set(value.animation, typeOf<Animation>(), fieldId<&Animation::playing>, false);
        stage.hand.commit(one.take());
    }
}

void Animations::hear(const Aspect& scene, const WishOutcome& outcome, ChangeListBuilder& list) {
    late_.clear();
    for (const AnimationStep& went : steps_) {
        const Animation* now = scene.get<Animation>(went.animation);
        // A hand may have set its time, even to the one that it had.
        if (!now || now->time != went.from || now->time == went.time || shownOnce_.contains(went.animation)) {
            held_.erase(went.animation);
            continue;
        }
        if (outcome.stopped.contains(went.animation)) {
            if (held_.insert(went.animation).second) wantValues(scene, went.animation, went.from, went.time);
        } else {
            if (held_.contains(went.animation)) wantValues(scene, went.animation, went.time, went.from);
            list.set(went.animation, typeOf<Animation>(), fieldId<&Animation::time>, toValue(went.time));
            if (!now->playing) carriedOn_.insert(went.animation);
        }
        if (!now->playing || !outcome.stopped.contains(went.animation)) held_.erase(went.animation);
    }
}

void Animations::wantValues(const Aspect& scene, ObjectId id, double time, double now) {
    const Known& known = known_.at(id);
    const std::int64_t mode = scene.get<Animation>(id)->mode;
    for (const ObjectId channel : known.channels) {
        if (!frames_.at(channel).sound) continue;
        const KeyFrames& frames = *scene.get<KeyFrames>(channel);
        const Object target = scene.find(frames.target);
        const KeyTrack track = KeyTrack::ofSound(frames, target.info());
        if (isPoseOf(track)) continue;
        const auto valueAt = [&](double at) {
            return newValue(target, track.field(), track.valueOf(track.at(shownTime(at, known.last, mode))));
        };
        if (valueAt(now)) continue;  // somebody else has written it
        std::optional<AnimatedValue> value = valueAt(time);
        if (!value) continue;
        value->animation = id;
        value->object = frames.target;
        late_.push_back(std::move(*value));
    }
}

void Animations::appendDrivers(const ChangeList& list, std::vector<Actor::Driver>& drivers) const {
    std::vector<ObjectId> animations;
    appendDriving(list, animations);
    for (const ObjectId id : animations) drivers.push_back({id, typeOf<Animation>(), fieldId<&Animation::playing>});
}

}  // namespace tessera

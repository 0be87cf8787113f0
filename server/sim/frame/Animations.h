/// Key frames of any fields: what each playing animation wants to be in the next frame.
#pragma once

#include <optional>
#include <set>
#include <tuple>
#include <unordered_map>
#include <vector>

#include "common/animation/KeyTrack.h"
#include "common/math/Pose.h"
#include "common/scene/Aspect.h"
#include "server/sim/frame/Actor.h"

namespace tessera {

/// How far an animation gets, if nothing that it moves is stopped.
struct AnimationStep {
    ObjectId animation;
    double from = 0;  ///< its time, as it was
    double time = 0;  ///< as it is kept
};

/// What animations want of one Transform; what is unset they leave as it is.
struct AnimatedTransform {
    std::optional<Vec3d> translation;
    std::optional<Quatd> rotation;
    std::optional<Vec3d> scale;
    std::vector<ObjectId> animations;  ///< whose wish it is

    void overlay(Pose& pose) const {
        if (translation) pose.translation = *translation;
        if (rotation) pose.rotation = *rotation;
        if (scale) pose.scale = *scale;
    }
};

/// A value that an animation gives to a field which is not as it says.
struct AnimatedValue {
    ObjectId animation;
    ObjectId object;
    ObjectType type;
    FieldId field;
    FieldValue value;                          ///< of an array that keeps its size: the bytes that differ
    std::optional<std::uint64_t> offset = {};  ///< in bytes; of such
};
void addTo(ChangeListBuilder& builder, const AnimatedValue& value);

/// What a frame of all that play wants.
struct AnimationWishes {
    std::vector<AnimationStep> steps;    ///< by ascending id
    ById<AnimatedTransform> transforms;  ///< they go through the collision pipeline
    std::vector<AnimatedValue> values;   ///< of everything else, in the order of objects and fields
};

/// The animations of a scene, followed through its lists. Not thread-safe.
///
/// A frame costs what plays; a list what it says of animations and key frames. Key frames are checked once, when they
/// change. Of several that play and drive one field the one with the highest id decides, within one the last channel;
/// key frames that several animations have are played by each at its own time. An animation that stands is shown once
/// when its time is set. Key frames that say nothing sound are passed over, the others of their animation play.
class Animations {
public:
    /// After each list applied to the scene, with that list; null: anything may have changed.
    void update(const Aspect& scene, const ChangeList* list);

    /// `scene`: as of the last update. What was shown once is no longer wanted afterwards.
    [[nodiscard]] AnimationWishes advance(const Aspect& scene, double seconds);
    /// Appends those that play and drive a field that the list writes, ascending, each once.
    void appendDriving(const ChangeList& list, std::vector<ObjectId>& animations) const;

    // As an actor:
    /// Adds to the wishes what they want of Transforms, and applies what they want of everything else. One whose value
    /// the scene refuses is paused.
    void want(ActorStage& stage);
    /// Lets the time of all that was not stopped go on. An animation that was stopped has the values of its time, from
    /// `settle` on. One that is paused in this frame keeps the time of the picture that it has just made.
    void hear(const Aspect& scene, const WishOutcome& outcome, ChangeListBuilder& list);
    /// Applies what `hear` has found. One whose value the scene refuses is paused.
    void settle(ActorStage& stage);
    void appendDrivers(const ChangeList& list, std::vector<Actor::Driver>& drivers) const;

    [[nodiscard]] std::size_t playingCount() const { return playing_.size(); }
    [[nodiscard]] std::uint64_t keysChecked() const { return keysChecked_; }
    /// How many were looked at since the start, by whatever frame.
    [[nodiscard]] std::uint64_t framesPlayed() const { return framesPlayed_; }

private:
    struct Frames {
        bool sound = false;
        double last = 0;  ///< of a sound one: its last key
        std::set<ObjectId> users;
    };
    struct Known {
        std::vector<ObjectId> channels;
        bool playing = false;
        double last = 0;
        std::vector<std::pair<ObjectId, FieldId>> driven;  ///< while it plays: where it stands in byTarget_
    };
    /// Wants everything but Transforms as it is shown at `time`, where it is as it was shown at `now`.
    void wantValues(const Aspect& scene, ObjectId id, double time, double now);
    static void applyValues(ActorStage& stage, const std::vector<AnimatedValue>& values);
    void lookAtFrames(const Aspect& scene, ObjectId id);
    void lookAt(const Aspect& scene, ObjectId id);
    void forget(ObjectId id);
    void standStill(ObjectId id, Known& known);
    template <typename Found>
    void visitDriving(const ChangeList& list, Found&& found) const;

    std::unordered_map<ObjectId, Frames> frames_;  ///< all KeyFrames
    std::unordered_map<ObjectId, Known> known_;    ///< all Animations
    std::set<ObjectId> playing_;
    std::set<ObjectId> shownOnce_;                                ///< that stand, and whose time was set
    std::set<ObjectId> carriedOn_;                                ///< that stand where `hear` has just set their time
    std::set<ObjectId> held_;                                     ///< that play, and were stopped in the last frame
    std::set<std::tuple<ObjectId, FieldId, ObjectId>> byTarget_;  ///< of those that play: object, field, animation
    std::vector<AnimationStep> steps_;                            ///< of this frame
    std::vector<AnimatedValue> late_;                             ///< of those that were stopped, or go on again
    std::uint64_t keysChecked_ = 0, framesPlayed_ = 0;
};

}  // namespace tessera

/// Key-framed motion: where each animated Transform wants to be in the next frame.
#pragma once

#include <map>
#include <set>
#include <unordered_map>
#include <utility>
#include <vector>

#include "common/math/Pose.h"
#include "common/scene/Aspect.h"
#include "server/sim/frame/Actor.h"

namespace tessera {

/// One playing motion's wish.
struct MotionStep {
    ObjectId motion;
    ObjectId target;  ///< a Transform
    double from = 0;  ///< the motion's local time, as it is
    double time = 0;  ///< if the wish is granted
    Pose pose;
};

/// The motions of a scene, followed through its lists: which play, and whether their keys are sound. Not thread-safe.
///
/// A frame costs what plays; a list what it says of motions. Keys are checked once, when they change.
class Motions {
public:
    /// After each list applied to the scene, with that list; null: anything may have changed.
    void update(const Aspect& scene, const ChangeList* list);

    /// All playing motions with sound keys, by ascending id, `seconds` further than they are. Of several motions with
    /// one target the last (highest id) decides. `scene`: as of the last update.
    [[nodiscard]] std::vector<MotionStep> advance(const Aspect& scene, double seconds) const;
    /// Appends those that play and have this target, with sound keys or without, ascending.
    void appendPlaying(ObjectId target, std::vector<ObjectId>& motions) const;

    // As an actor:
    void want(ActorStage& stage);
    /// The time of what was granted goes on.
    void hear(const Aspect& scene, const WishOutcome& outcome, ChangeListBuilder& list) const;
    /// Those that play and drive a Transform that the list writes, ascending.
    void appendDrivers(const ChangeList& list, std::vector<Actor::Driver>& drivers) const;

    [[nodiscard]] std::size_t playingCount() const { return playing_.size(); }
    [[nodiscard]] std::uint64_t keysChecked() const { return keysChecked_; }

private:
    struct Known {
        bool sound = false;  ///< its keys
        bool playing = false;
        ObjectId target;  ///< while it plays: where it stands in byTarget_
    };
    void look(const Aspect& scene, ObjectId id, bool keys);
    void forget(ObjectId id);
    void setPlaying(ObjectId id, Known& known, bool playing, ObjectId target);

    std::unordered_map<ObjectId, Known> known_;         ///< all Motion cores
    std::map<ObjectId, bool> playing_;                  ///< those that play → whether their keys are sound
    std::set<std::pair<ObjectId, ObjectId>> byTarget_;  ///< of those that play: target, motion
    std::vector<MotionStep> wanted_;                    ///< in this frame, by ascending target
    std::uint64_t keysChecked_ = 0;
};

}  // namespace tessera

/// The clocks of particle emitters.
#pragma once

#include <algorithm>
#include <set>

#include <fmt/format.h>

#include "common/cores/ParticleEmitter.h"
#include "server/sim/frame/Actor.h"

namespace tessera {

/// Lets the time of each ParticleEmitter that plays go on: all that a host needs to know of its particles. Follows the
/// scene's lists; a frame costs what plays. An edit of the time in the same frame has the last word. Not thread-safe.
class Emitters {
public:
    using Core = ParticleEmitter;

    /// After each list applied to the scene, with that list; null: anything may have changed.
    void update(const Aspect& scene, const ChangeList* list) {
        if (!list) {
            playing_.clear();
            for (const ObjectId id : scene.ids()) look(scene, id);
            return;
        }
        for (const Creation& creation : list->creations)
            if (creation.type == typeOf<ParticleEmitter>()) look(scene, creation.id);
        for (const FieldColumn& column : list->columns)
            if (column.type == typeOf<ParticleEmitter>() && column.field == fieldId<&ParticleEmitter::playing>)
                for (const ObjectId id : column.ids) look(scene, id);
        if (playing_.empty()) return;
        for (const ObjectId id : list->destructions) playing_.erase(id);
    }

    /// An emitter that the rules of this version refuse, as a journal of another one may have it, stands still.
    void want(ActorStage& stage) {
        ChangeListBuilder all;
        for (const ObjectId id : playing_) goOn(stage, id, all);
        if (all.empty() || stage.hand.apply(all.take())) return;
        for (const ObjectId id : std::set<ObjectId>(playing_)) {
            ChangeListBuilder one;
            goOn(stage, id, one);
            if (one.empty()) continue;
            if (const Expected<void> applied = stage.hand.apply(one.take()); !applied) {
                playing_.erase(id);
                stage.remarks.push_back(
                    fmt::format("particle emitter #{} stands still: {}", id.value, applied.error().message));
            }
        }
    }

private:
    static constexpr double kLatest = 1e9;  ///< s: what the field may be; there it stands
    static void goOn(const ActorStage& stage, ObjectId id, ChangeListBuilder& list) {
        const ParticleEmitter& emitter = *stage.scene().get<ParticleEmitter>(id);
        const double time = std::clamp(emitter.time + emitter.speed * stage.seconds, 0.0, kLatest);
        if (time != emitter.time)
            list.set(id, typeOf<ParticleEmitter>(), fieldId<&ParticleEmitter::time>, toValue(time));
    }
    void look(const Aspect& scene, ObjectId id) {
        const ParticleEmitter* emitter = scene.get<ParticleEmitter>(id);
        if (emitter && emitter->playing)
            playing_.insert(id);
        else
            playing_.erase(id);
    }

    std::set<ObjectId> playing_;
};

}  // namespace tessera

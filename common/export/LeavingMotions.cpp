#include "common/export/LeavingMotions.h"

#include <algorithm>
#include <cmath>

#include "common/animation/MotionKeys.h"
#include "common/export/Selection.h"

namespace tessera {

Playing Playing::of(const Aspect& scene, const Animation& animation) {
    Playing playing{.speed = animation.speed, .mode = animation.mode, .paused = !animation.playing};
    for (const ObjectId id : animation.channels)
        if (const auto* keys = scene.get<KeyFrames>(id); keys && !keys->times.empty())
            playing.length = std::max(playing.length, keys->times.as<double>().back());
    return playing;
}

Playing Playing::of(const Motion& motion) {
    static_assert(Motion::kOnce == Animation::kOnce && Motion::kLoop == Animation::kLoop &&
                  Motion::kPingPong == Animation::kPingPong);
    const std::span<const double> keys = motion.keys.as<double>();
    const double last = keyTime(keys, keys.size() / kScalarsPerKey - 1);
    return {.length = last - keyTime(keys, 0), .mode = motion.mode, .paused = !motion.playing};
}

void noteLostPlaying(const Playing& playing, ExportNotes& notes, ObjectId node) {
    if (playing.mode != Animation::kLoop || playing.speed != 1)
        notes.add("how often and how fast animations play is left out", node);
    if (playing.paused) notes.add("animations that are paused play in the file", node);
}

bool canLead(std::span<const double> values, ObjectId node, ExportNotes& notes) {
    const auto isWithin = [](double value) { return std::abs(value) <= kUtmostPlace; };
    if (std::ranges::all_of(values, isWithin)) return true;
    notes.add("animations that lead beyond 1e15 m are left out (keep their keys within 1e15 m)", node);
    return false;
}

}  // namespace tessera

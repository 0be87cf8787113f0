#include "common/export/LeavingMotions.h"

#include <fmt/format.h>

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

bool canLead(std::span<const double> values, std::string_view field, ObjectId node, ExportNotes& notes) {
    const auto isWithin = [](double value) { return std::abs(value) <= kUtmostPlace; };
    if (std::ranges::all_of(values, isWithin)) return true;
    if (field == "translation")
        notes.add("animations that lead beyond 1e15 m are left out (keep their keys within 1e15 m)", node);
    else
        notes.add(
            fmt::format("animations of a {} with numbers beyond 1e15 are left out (keep these within 1e15)", field),
            node);
    return false;
}

bool canLead(const Motion& motion, ObjectId node, ExportNotes& notes) {
    struct Part {
        std::string_view field;
        std::size_t first, count;
    };
    const std::span<const double> keys = motion.keys.as<double>();
    const double first = keyTime(keys, 0), last = keyTime(keys, keys.size() / kScalarsPerKey - 1);
    if (!(last - first <= kUtmostPlace)) {
        notes.add("animations that take more than 1e15 s are left out (move their keys closer together)", node);
        return false;
    }
    for (const Part& part : {Part{"translation", 1, 3}, Part{"rotation", 4, 4}, Part{"scale", 8, 3}})
        for (std::size_t key = 0; key < keys.size(); key += kScalarsPerKey)
            if (!canLead(keys.subspan(key + part.first, part.count), part.field, node, notes)) return false;
    return true;
}

void noteUnsound(const Blob& numbers, ObjectId node, ExportNotes& notes) {
    const bool areNumbers = !numbers.empty() && numbers.resident() && numbers.sizeBytes() % sizeof(double) == 0;
    const bool areFinite =
        !areNumbers || std::ranges::all_of(numbers.as<double>(), [](double value) { return std::isfinite(value); });
    notes.add(areFinite ? "animations that cannot play are left out"
                        : "animations with keys that are not finite are left out",
              node);
}

}  // namespace tessera

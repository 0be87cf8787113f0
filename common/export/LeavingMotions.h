/// How animations play, and what formats for other programs lose of it.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "common/cores/Animation.h"
#include "common/cores/Motion.h"
#include "common/export/ExportNotes.h"

namespace tessera {

/// Of an Animation or a Motion.
struct Playing {
    double length = 0;  ///< s, of its keys: once through, one way
    double speed = 1;
    std::int64_t mode = Animation::kLoop;  ///< as Animation::mode
    bool paused = false;

    [[nodiscard]] static Playing of(const Aspect& scene, const Animation& animation);
    /// Its keys have passed checkKeys. The first one, whatever its time, is its beginning: files have it at 0 s.
    [[nodiscard]] static Playing of(const Motion& motion);
};

/// Of formats that play all from their beginnings, as fast as the keys say, for ever.
void noteLostPlaying(const Playing& playing, ExportNotes& notes, ObjectId node);

/// Whether files can have these values of a "translation", "rotation" or "scale": one beyond kUtmostPlace is noted.
[[nodiscard]] bool canLead(std::span<const double> values, std::string_view field, ObjectId node, ExportNotes& notes);
/// The same of all its keys, which have passed checkKeys.
[[nodiscard]] bool canLead(const Motion& motion, ObjectId node, ExportNotes& notes);
/// Says why keys with these numbers are left out, which have not passed their check.
void noteUnsound(const Blob& numbers, ObjectId node, ExportNotes& notes);

}  // namespace tessera

#include "server/movies/Reel.h"

#include <algorithm>
#include <cmath>

#include "common/cores/Movie.h"

namespace tessera {

void Movies::Reel::beginRun(double time) {
    clock = length > 0 ? time : std::max(time, 0.0);  // folded once it is known how long the film is
    base = 0;
    held.clear();
    for (Asked& one : asked) one.ofThisRun = false;
    told = false;
    exactlyAsked.reset();
}

void Movies::Reel::fold(std::int64_t mode) {
    const double time = filmTime();
    if (!(length > 0)) {
        if (time < 0) clock = base;
        return;
    }
    if (mode == Movie::kOnce) {
        clock = base + std::clamp(time, 0.0, length);
        return;
    }
    if (time >= 0 && time <= length) return;  // a seek to the end shows the end
    base += std::floor(time / length) * length;
    // Rounding may leave it just beyond.
    clock = std::clamp(clock, base, base + length);
}

bool Movies::Reel::covered() const {
    const double time = filmTime();
    return shown && ((time >= shownBegin && time < shownEnd) || time == shownBegin);
}

bool Movies::Reel::wants(const Movie& movie) const {
    if (!shown) return true;
    if (!covered() && exactlyAsked != filmTime()) return true;
    if (!movie.playing || movie.speed == 0) return false;
    if (length > 0 && shownBegin <= 0 && shownEnd >= length - 1e-9) return false;  // one picture
    if (movie.mode != Movie::kOnce || !(length > 0)) return true;
    return movie.speed > 0 ? filmTime() < length : filmTime() > 0;
}

void Movies::Reel::stop() {
    process.reset();
    asked.clear();
    if (state != State::kFailed) state = State::kStill;
    beginRun(filmTime());
    idle = 0;
}

}  // namespace tessera

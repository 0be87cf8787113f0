/// Where one film stands: its clock, what has been asked of who decodes it, and what has come.
#pragma once

#include <deque>
#include <future>
#include <optional>
#include <string>

#include "common/cores/ShippedTypes.h"
#include "server/movies/FilmProcess.h"
#include "server/movies/Movies.h"

namespace tessera {

/// Two time lines: the film's own, from 0 to its length, which Movie::time is on, and an endless one (`clock`) that
/// does not go back where the film begins again: film time = clock - base. A seek, or a change of direction, begins a
/// new *run*: what was asked before it is thrown away when it comes.
struct Movies::Reel {
    enum class State : std::uint8_t { kStill, kOpening, kRunning, kFailed };
    struct Asked {
        std::uint64_t serial = 0;
        bool exact = false;
        bool ofThisRun = true;
        double base = 0;
    };
    struct Held {
        FilmFrame frame;
        bool exact = false;  ///< asked for by its time, and shown when it comes; the others when they are due
        double begin = 0;    ///< on the endless line
    };

    std::string file;
    ObjectId image;
    bool playable = false;  ///< it names an Image and a file
    State state = State::kStill;
    std::future<Expected<FileHandle>> opening;
    std::optional<FilmProcess> process;
    std::string problem;  ///< that Movie::problem shall say

    double length = 0;  ///< s; 0: not known
    double clock = 0, base = 0;
    double written = 0, before = 0;  ///< Movie::time as it was said last, and as it was then: another one is a seek
    int direction = 0;               ///< -1, 0 (it stands), 1
    bool shown = false;              ///< there has been a picture
    double shownBegin = 0, shownEnd = 0;  ///< of the film, of the picture that is shown

    std::deque<Asked> asked;
    std::deque<Held> held;
    bool told = false;  ///< in this run a picture has come: the last one is
    double lastBase = 0, lastBegin = 0, lastEnd = 0;
    std::optional<double> exactlyAsked;  ///< in this run
    int idle = 0;

    [[nodiscard]] double filmTime() const { return clock - base; }
    void beginRun(double time);
    /// Into the film, as its mode says; once its length is known.
    void fold(std::int64_t mode);
    [[nodiscard]] bool covered() const;
    /// Whether anything is to be decoded.
    [[nodiscard]] bool wants(const Movie& movie) const;
    [[nodiscard]] bool lastIsTheEnd() const { return length > 0 && lastEnd >= length - 1e-9; }
    void stop();
};

}  // namespace tessera

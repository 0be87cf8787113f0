/// What a person sees while the wall runs: lines, and on a terminal a progress bar below them.
#pragma once

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <string>
#include <string_view>

namespace tessera {

/// Not thread-safe. Lines of ours begin with "tessera-wall: ".
class Console {
public:
    struct Manner {
        bool bar = false;      ///< a progress bar on the error stream; else a line now and then
        bool verbose = false;  ///< facts too, and a line for every tenth of the way
    };
    Console(std::FILE* out, std::FILE* err, Manner manner) : out_(out), err_(err), manner_(manner) {}
    /// On the process's own streams, with a bar when stderr is a terminal that can draw one.
    [[nodiscard]] static Console standard(bool verbose);
    ~Console() { finishProgress(); }

    /// A line for scripts, on stdout, as it is. Only where the console is verbose.
    void fact(std::string_view line);
    /// For the person, on stderr.
    void note(std::string_view text);
    void warning(std::string_view text);
    void error(std::string_view text);
    /// A line of a process that we started, as it is.
    void passOn(bool error, std::string_view line);

    /// Before there is any progress: that is what takes so long. May be called as often as one likes.
    void preparing(std::string_view what);
    /// `what` e.g. "frames".
    void progress(std::uint64_t done, std::uint64_t total, std::string_view what);
    /// Takes the bar away.
    void finishProgress();

private:
    using Time = std::chrono::steady_clock::time_point;

    void line(std::FILE* to, std::string_view prefix, std::string_view text);
    void hideBar();
    void drawBar();
    /// Whether nothing has been drawn for a moment; if so, it is now.
    bool mayDraw(Time now);
    [[nodiscard]] std::string timeLeft() const;

    std::FILE* out_;
    std::FILE* err_;
    Manner manner_;
    bool barShown_ = false;
    std::uint64_t firstDone_ = 0, done_ = 0, total_ = 0;
    int lastPart_ = -1;  ///< of the way, a tenth or a quarter
    std::string what_;
    std::string bar_;
    Time began_{}, preparedSince_{}, lastDrawn_{}, lastLine_{};
};

}  // namespace tessera

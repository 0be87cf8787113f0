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
    /// `bar`: draw a progress bar on `err`; else every tenth of the way becomes a line.
    Console(std::FILE* out, std::FILE* err, bool bar) : out_(out), err_(err), bar_(bar) {}
    /// On the process's own streams, with a bar when stderr is a terminal that can draw one.
    [[nodiscard]] static Console standard();
    ~Console() { finishProgress(); }

    /// Facts a script may read, on stdout.
    void fact(std::string_view text);
    /// For the person, on stderr.
    void note(std::string_view text);
    void warning(std::string_view text);
    void error(std::string_view text);
    /// A line of a process that we started, as it is.
    void passOn(bool error, std::string_view line);

    /// `what` e.g. "frames".
    void progress(std::uint64_t done, std::uint64_t total, std::string_view what);
    /// Takes the bar away.
    void finishProgress();

private:
    void line(std::FILE* to, std::string_view prefix, std::string_view text);
    void hideBar();
    void drawBar();

    std::FILE* out_;
    std::FILE* err_;
    bool bar_;
    bool barShown_ = false;
    std::uint64_t done_ = 0, total_ = 0;
    int lastTenth_ = -1;
    std::string what_;
    std::chrono::steady_clock::time_point lastDrawn_{};
};

}  // namespace tessera

/// Messages of a program for a person, on stderr: "tessera-server: text".
#pragma once

#include <chrono>
#include <cstdio>
#include <memory>
#include <string>
#include <string_view>

namespace tessera {

/// Takes whole lines, thread-safe, and never waits for whoever reads them: a thread of its own writes. What waits is bounded
/// (kMaxWaitingBytes); lines beyond are left out and counted, and the count is said as soon as there is room. Passed to whoever has
/// something to say; there is no global log.
///
/// A text may quote what a peer said: control characters (Controls.h) come out as "\x1b" and "\u202e", as does what is
/// no UTF-8, and what follows a line's end is indented, so that it is neither a command to a terminal nor another line.
class Log {
public:
    static constexpr std::size_t kMaxWaitingBytes = std::size_t{256} << 10;

    /// `program` stands in front of every line, e.g. "tessera-client[left]". `out` stays open for as long as the process runs, or
    /// until a `flush` has said true behind the last line; nothing is left in its buffer.
    explicit Log(std::string program, std::FILE* out = stderr);
    /// Flushes.
    ~Log();
    Log(const Log&) = delete;
    Log& operator=(const Log&) = delete;

    void info(std::string_view text) { line("", text); }
    /// What goes as it should: for a person who follows a program step by step.
    void detail(std::string_view text) {
        if (!quiet_) line("", text);
    }
    /// No details from now on. Before anybody else has the log.
    void quieten() { quiet_ = true; }
    void warning(std::string_view text) { line("warning: ", text); }
    void error(std::string_view text) { line("", text); }

    /// Waits until all that was said is written, at most so long. False: it is not.
    bool flush(std::chrono::milliseconds atMost = std::chrono::seconds(1));

private:
    class Writer;
    void line(std::string_view kind, std::string_view text);

    std::string program_;
    bool quiet_ = false;
    std::shared_ptr<Writer> writer_;
};

/// Flushes all logs of the process: before it ends without a word to them.
void flushLogs(std::chrono::milliseconds atMost);

}  // namespace tessera

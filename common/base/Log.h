/// Messages of a program for a person, on stderr: "tessera-server: text".
#pragma once

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace tessera {

/// What a message is about, beside its text: fields in systemd's journal, TESSERA_FRAME and so on.
struct LogAbout {
    std::optional<std::uint64_t> frame = {};
    std::string_view host = {}, tile = {};  ///< of the wall; empty: none
};

/// Takes whole lines, thread-safe, and never waits for whoever reads them: a thread of its own writes. What waits is
/// bounded (kMaxWaitingBytes); lines beyond are left out and counted, and the count is said as soon as there is room.
/// Passed to whoever has something to say; there is no global log.
///
/// A text may quote what a peer said: control characters (Controls.h) come out as "\x1b" and "\u202e", as does what is
/// no UTF-8, and what follows a line's end is indented, so that it is neither a command to a terminal nor another line.
///
/// Where `out` leads to systemd's journal (JOURNAL_STREAM) a message goes there by itself, with its level and fields;
/// where the journal's socket cannot be reached it stays a line, behind the level as "<4>".
class Log {
public:
    static constexpr std::size_t kMaxWaitingBytes = std::size_t{256} << 10;

    /// `program` stands in front of every line, e.g. "tessera-client[left]". The log writes to `out` by a
    /// number of its own, so `out` may be closed once the log is made. `journal`: the journal's socket.
    explicit Log(std::string program, std::FILE* out = stderr, const std::string& journal = usualJournal());
    /// Flushes.
    ~Log();
    Log(const Log&) = delete;
    Log& operator=(const Log&) = delete;

    void info(std::string_view text, const LogAbout& about = {}) { say(Level::kInfo, text, about); }
    /// What goes as it should: for a person who follows a program step by step.
    void detail(std::string_view text, const LogAbout& about = {}) {
        if (!quiet_) say(Level::kInfo, text, about);
    }
    /// No details from now on. Before anybody else has the log.
    void quieten() { quiet_ = true; }
    void warning(std::string_view text, const LogAbout& about = {}) { say(Level::kWarning, text, about); }
    void error(std::string_view text, const LogAbout& about = {}) { say(Level::kError, text, about); }

    /// Waits until all that was said is written, at most so long. False: it is not.
    bool flush(std::chrono::milliseconds atMost = std::chrono::seconds(1));

private:
    class Writer;
    enum class Level : char { kError = '3', kWarning = '4', kInfo = '6' };  ///< syslog(3)'s numbers
    static std::string usualJournal();
    void say(Level level, std::string_view text, const LogAbout& about);

    std::string program_;
    bool quiet_ = false;
    std::shared_ptr<Writer> writer_;
};

/// Flushes all logs of the process: before it ends without a word to them.
void flushLogs(std::chrono::milliseconds atMost);

}  // namespace tessera

#include "common/base/Log.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <pthread.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "common/base/Controls.h"
#include "common/base/FileHandle.h"
#include "common/base/JournalStream.h"
#include "common/base/StartThread.h"

namespace tessera {

/// Shared with its thread, which outlives the log where nobody reads any more what it writes.
class Log::Writer : public std::enable_shared_from_this<Log::Writer> {
public:
    Writer(std::string program, int file, const std::string& journal)
        : program_(std::move(program)),
          own_(::fcntl(file, F_DUPFD_CLOEXEC, 3)),
          file_(own_.get() < 0 ? file : own_.get()) {
        const bool isJournal = leadsToJournal(file);
        if (isJournal) journal_ = JournalSocket::connectTo(journal);
        saysLevel_ = isJournal && !journal_;
    }

    /// Whether entries of its own go to the journal; else lines, which begin with their level (`<4>`) where that is
    /// asked for.
    [[nodiscard]] bool toJournal() const { return journal_ != nullptr; }
    [[nodiscard]] bool saysLevel() const { return saysLevel_; }

    /// A line, or an entry.
    void put(std::string line) {
        const std::scoped_lock lock(mutex_);
        if (waitingBytes_ + line.size() > kMaxWaitingBytes) {
            ++leftOut_;
            return;
        }
        waitingBytes_ += line.size();
        waiting_.push_back(std::move(line));
        if (!running_) {
            std::thread writer = startThread([self = shared_from_this()] { self->run(); });
            running_ = writer.joinable();  // else the next line may find room for it
            if (running_) writer.detach();
        }
        filled_.notify_one();
    }
    bool flush(std::chrono::milliseconds atMost) {
        std::unique_lock lock(mutex_);
        return written_.wait_for(lock, atMost, [&] { return waiting_.empty() && !writing_; });
    }
    void close() {
        const std::scoped_lock lock(mutex_);
        closed_ = true;
        filled_.notify_one();
    }

private:
    void run() {
        // A pipe whose end is gone is an error of `write`, in programs that do not ask for it too. All others are for
        // the program's own threads: one that blocks SIGTERM after its first message would be ended by it here.
        sigset_t all;
        sigfillset(&all);
        pthread_sigmask(SIG_BLOCK, &all, nullptr);
        std::unique_lock lock(mutex_);
        while (true) {
            filled_.wait(lock, [&] { return closed_ || !waiting_.empty(); });
            if (waiting_.empty()) return;
            std::vector<std::string> lines = std::exchange(waiting_, {});
            waitingBytes_ = 0;
            const std::uint64_t count = std::exchange(leftOut_, 0);
            writing_ = true;
            lock.unlock();
            write(lines);
            if (count != 0)
                write(program_ + ": warning: " + std::to_string(count) +
                      " messages are left out here: nobody read them fast enough\n");
            lock.lock();
            writing_ = false;
            written_.notify_all();
        }
    }
    void write(const std::vector<std::string>& lines) const {
        std::string all;
        for (const std::string& line : lines)
            if (!journal_)
                all += line;
            else if (!journal_->send(line))
                write("a message of " + program_ + " could not be sent to the journal\n");
        write(all);
    }
    /// Not through the stream, whose lock others would wait for.
    void write(std::string_view text) const {
        while (!text.empty()) {
            const ssize_t done = ::write(file_, text.data(), text.size());
            if (done < 0 && errno == EINTR) continue;
            if (done <= 0) return;  // nobody is there to be told
            text.remove_prefix(static_cast<std::size_t>(done));
        }
    }

    const std::string program_;
    const FileHandle own_;  ///< whoever closes theirs while the thread still writes may give its number to another file
    const int file_;
    std::unique_ptr<JournalSocket> journal_;  ///< null: lines are written
    bool saysLevel_ = false;
    std::mutex mutex_;
    std::condition_variable filled_, written_;
    std::vector<std::string> waiting_;
    std::size_t waitingBytes_ = 0;
    std::uint64_t leftOut_ = 0;
    bool running_ = false, writing_ = false, closed_ = false;
};

namespace {

/// For flushLogs alone: nobody says anything through it.
struct LiveLogs {
    std::mutex mutex;
    std::vector<Log*> logs;
};
LiveLogs& liveLogs() {
    static auto* live = new LiveLogs;  // never destroyed: a check may fail at any time
    return *live;
}

}  // namespace

std::string Log::usualJournal() {
    return JournalSocket::kUsual;
}

Log::Log(std::string program, std::FILE* out, const std::string& journal)
    : program_(std::move(program)), writer_(std::make_shared<Writer>(program_, ::fileno(out), journal)) {
    const std::scoped_lock lock(liveLogs().mutex);
    liveLogs().logs.push_back(this);
}

Log::~Log() {
    {
        const std::scoped_lock lock(liveLogs().mutex);
        std::erase(liveLogs().logs, this);
    }
    flush();
    writer_->close();
}

bool Log::flush(std::chrono::milliseconds atMost) {
    return writer_->flush(atMost);
}

namespace {

/// As a terminal may have it: no control characters, and one line for others' eyes.
std::string plainText(std::string_view text) {
    std::string whole;
    while (!text.empty()) {
        const std::size_t length = utf8CharacterLength(text);
        const std::string_view character = text.substr(0, std::max<std::size_t>(length, 1));
        text.remove_prefix(character.size());
        const char32_t number = length == 0 ? static_cast<unsigned char>(character[0]) : numberOfCharacter(character);
        if (number == '\n')
            whole += "\n    ";
        else if (length > 0 && !isControl(number))
            whole += character;
        else
            whole += length > 1 ? fmt::format("\\u{:04x}", static_cast<unsigned>(number))
                                : fmt::format("\\x{:02x}", static_cast<unsigned>(number));
    }
    return whole;
}

/// "tessera-client[left]": the program, and the host of the wall that it is.
std::pair<std::string, std::string> programAndHost(const std::string& said) {
    const std::size_t open = said.find('[');
    if (open == std::string::npos || !said.ends_with(']')) return {said, ""};
    return {said.substr(0, open), said.substr(open + 1, said.size() - open - 2)};
}

}  // namespace

void Log::say(Level level, std::string_view text, const LogAbout& about) {
    if (!writer_->toJournal())
        return writer_->put(fmt::format("{}{}: {}{}\n",
                                        writer_->saysLevel() ? fmt::format("<{}>", static_cast<char>(level)) : "",
                                        program_, level == Level::kWarning ? "warning: " : "", plainText(text)));
    const auto [program, host] = programAndHost(program_);
    JournalFields fields{{"MESSAGE", plainText(text)},
                         {"PRIORITY", std::string(1, static_cast<char>(level))},
                         {"SYSLOG_IDENTIFIER", program}};
    const std::string whose = about.host.empty() ? host : plainText(about.host);
    if (!whose.empty()) fields.emplace_back("TESSERA_HOST", whose);
    if (!about.tile.empty()) fields.emplace_back("TESSERA_TILE", plainText(about.tile));
    if (about.frame) fields.emplace_back("TESSERA_FRAME", std::to_string(*about.frame));
    writer_->put(journalEntry(fields));
}

void flushLogs(std::chrono::milliseconds atMost) {
    // Whoever holds the lock may be the one whose check has failed.
    const std::unique_lock lock(liveLogs().mutex, std::try_to_lock);
    if (!lock) return;
    for (Log* log : liveLogs().logs) log->flush(atMost);
}

}  // namespace tessera

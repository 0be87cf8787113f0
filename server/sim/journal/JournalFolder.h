/// The folder of a journal: which files are there, and whose it is.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "server/sim/journal/JournalDisk.h"
#include "server/sim/journal/JournalFile.h"
#include "server/sim/journal/LastLog.h"

namespace tessera {

/// Snapshot k is what there was when log k began. Of several snapshots the one with the highest number counts, of the
/// logs those from it on; what is older is left over.
struct JournalFiles {
    std::optional<std::uint64_t> snapshot;
    std::vector<std::uint64_t> logs;      ///< ascending, without a gap
    std::vector<std::string> leftOver;    ///< paths: what nobody needs any more
    std::vector<std::string> unfinished;  ///< paths: somebody was killed while he made them; or makes them now
    std::optional<JournalEnd> end;        ///< that the file `last` tells; nothing: there is no such file
    [[nodiscard]] std::uint64_t lastLog() const { return logs.empty() ? 0 : logs.back(); }
    /// Whether `last` names this log: others may build on it.
    [[nodiscard]] bool isNamed(std::uint64_t log) const { return end && end->log == log; }
};

/// Holds the folder for one process: a second one is refused, who holds it is named. A killed holder lets go.
///
/// A file has its name once it is whole and synced, and the name is synced before anything stands on it: whenever a
/// server is killed, or the power is cut, what lies in the folder tells one story.
class JournalFolder {
public:
    /// Kept beside the logs. Further ones are refused, so that crashes one after the other never fill a disk.
    static constexpr std::size_t kMostTornEnds = 64;

    /// Makes the folder (not those above it) where there is none.
    [[nodiscard]] static Expected<JournalFolder> hold(
        const std::string& path, std::shared_ptr<FileSystem> calls = std::make_shared<FileSystem>());
    JournalFolder(JournalFolder&& other) noexcept;
    JournalFolder& operator=(JournalFolder&&) = delete;
    ~JournalFolder();

    [[nodiscard]] const std::string& path() const { return path_; }
    [[nodiscard]] const JournalDisk& disk() const { return *disk_; }
    [[nodiscard]] std::string logPath(std::uint64_t number) const;
    [[nodiscard]] std::string snapshotPath(std::uint64_t number) const;
    [[nodiscard]] LastLog& last() const { return *last_; }
    /// Refused: a log is missing. Only the file `last` tells that the newest ones have been there.
    [[nodiscard]] Expected<JournalFiles> files() const;
    /// Names a file that was taken away, replaced or shortened while it is held: the lock, `last`, or the log of
    /// that number, which is `log`. What is written then is not what a start would find.
    [[nodiscard]] std::optional<std::string> findLoss(const JournalFile& log, std::uint64_t number) const;

    /// A log that begins with this; one of this number is replaced. `last` names it once it is there, and before
    /// anybody builds on it. Fails without a trace, but where a sync has failed.
    [[nodiscard]] Expected<JournalFile> beginLog(const journal::Opening& opening,
                                                 std::span<const RecordContent> then = {}) const;
    /// Copies a log from there on into a file beside it, which is synced; gives its path. No file is replaced. Refused:
    /// there are kMostTornEnds already.
    [[nodiscard]] Expected<std::string> keepTornEnd(std::uint64_t number, std::uint64_t wholeBytes) const;
    /// Makes `last` name that log, all of which is synced.
    [[nodiscard]] Expected<void> nameLast(const LogName& log, std::uint64_t bytes) const;
    /// Cuts a log off where it is whole, and sees to it that the disk has what is left: others are to follow it.
    [[nodiscard]] Expected<void> sealLog(std::uint64_t number, std::uint64_t wholeBytes) const;
    /// To be finished, or dropped with `dropSnapshot`.
    [[nodiscard]] Expected<JournalFile> beginSnapshot(const journal::Opening& opening) const;
    [[nodiscard]] Expected<void> finishSnapshot(const JournalFile& file, std::uint64_t number) const;
    void dropSnapshot(std::uint64_t number) const;
    /// What cannot be removed is left over, and goes with a later start.
    void remove(const std::string& path) const { (void)disk_->calls().remove(path); }

private:
    JournalFolder(std::string path, std::shared_ptr<JournalDisk> disk, int lock)
        : path_(std::move(path)),
          disk_(std::move(disk)),
          last_(std::make_unique<LastLog>(path_ + "/last", disk_)),
          lock_(lock) {}
    [[nodiscard]] std::string lockPath() const { return path_ + "/lock"; }
    /// Where no file is; nothing: kMostTornEnds are there.
    [[nodiscard]] std::optional<std::string> freeTornPath(std::uint64_t number) const;
    /// An errno; 0: it has its name for good.
    [[nodiscard]] int name(const std::string& unfinished, const std::string& path) const;

    std::string path_;
    std::shared_ptr<JournalDisk> disk_;
    std::unique_ptr<LastLog> last_;
    int lock_;
};

}  // namespace tessera

/// The folder of a journal: which files are there, whose it is, what they lead to.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <unordered_set>
#include <vector>

#include "server/sim/journal/FileSystem.h"
#include "server/sim/journal/JournalPlaces.h"
#include "server/sim/journal/JournalState.h"

namespace tessera {

/// Snapshot k is what there was when log k began. Of several snapshots the one with the highest number counts, of the
/// logs those from it on; what is older is left over.
struct JournalFiles {
    std::optional<std::uint64_t> snapshot;
    std::vector<std::uint64_t> logs;      ///< ascending, without a gap
    std::vector<std::string> leftOver;    ///< paths: what nobody needs any more
    std::vector<std::string> unfinished;  ///< paths: somebody was killed while he made them; or makes them now
    std::uint64_t newest = 0;             ///< log that the file `last` names; 0: there is no such file
    [[nodiscard]] std::uint64_t lastLog() const { return logs.empty() ? 0 : logs.back(); }
};

/// The disk below a journal. The kernel tells once that a sync has failed; the next one succeeds, though what was to be
/// synced may be lost. So it is remembered here for all who sync, and nothing is synced again. Thread-safe.
class JournalDisk {
public:
    explicit JournalDisk(std::shared_ptr<FileSystem> calls) : calls_(std::move(calls)) {}

    [[nodiscard]] FileSystem& calls() const { return *calls_; }
    /// Errno values; 0: it is on the disk.
    [[nodiscard]] int sync(int file);
    [[nodiscard]] int syncFolder(const std::string& path);
    /// Of the sync that failed; 0: none has.
    [[nodiscard]] int failedSync() const { return failed_; }
    /// As after a failed sync: what is in the folder is not what was to be there.
    void lose(int error) { failed_ = error; }

private:
    [[nodiscard]] int remembered(int error);

    std::shared_ptr<FileSystem> calls_;
    std::atomic<int> failed_{0};
};

/// One file under way. Errors are errno values; 0: none.
class JournalFile {
public:
    JournalFile() = default;
    JournalFile(JournalFile&& other) noexcept;
    JournalFile& operator=(JournalFile&& other) noexcept;
    ~JournalFile();

    /// Makes or empties it, and writes the mark and the opening.
    [[nodiscard]] static Expected<JournalFile> create(std::shared_ptr<JournalDisk> disk, const std::string& path,
                                                      const journal::Opening& opening);
    /// A record that cannot be written whole leaves no trace.
    [[nodiscard]] int append(const RecordContent& content);
    /// The same of content that is in memory in pieces only: `piece` gives them in order, from a place in the content
    /// on, none of them empty. Its error, or that of the disk, in words.
    [[nodiscard]] Expected<void> append(const RecordHeader& about,
                                        const std::function<Expected<ByteSpan>(std::uint64_t at)>& piece);
    [[nodiscard]] int sync() const { return disk_->sync(file_); }
    /// Whether that name stands for it, with all that is written.
    [[nodiscard]] bool isWhole(const std::string& path) const;
    [[nodiscard]] std::uint64_t bytes() const { return bytes_; }

private:
    void cutOff();

    std::shared_ptr<JournalDisk> disk_;
    int file_ = -1;
    std::uint64_t bytes_ = 0, number_ = 0;
    bool torn_ = false;  ///< behind bytes_ lies what could not be removed yet
};

/// Holds the folder for one process: a second one is refused, who holds it is named. A killed holder lets go.
///
/// A file has its name once it is whole and synced, and the name is synced before anything stands on it: whenever a
/// server is killed, or the power is cut, what lies in the folder tells one story.
class JournalFolder {
public:
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
    [[nodiscard]] std::string lastPath() const { return path_ + "/last"; }
    /// Refused: a log is missing. Of the newest ones nothing but the file `last` tells that they have been.
    [[nodiscard]] Expected<JournalFiles> files() const;
    /// What somebody has taken away, replaced or shortened while it is held, in words: the lock, or the log of that
    /// number, which is `log`. What is written then is not what a start would find.
    [[nodiscard]] std::optional<std::string> findLoss(const JournalFile& log, std::uint64_t number) const;

    /// A log that begins with this; one of this number is replaced. `last` names it once it is there, and before
    /// anybody builds on it. Fails without a trace, but where a sync has failed.
    [[nodiscard]] Expected<JournalFile> beginLog(const journal::Opening& opening,
                                                 std::span<const RecordContent> then = {}) const;
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
        : path_(std::move(path)), disk_(std::move(disk)), lock_(lock) {}
    [[nodiscard]] std::string lockPath() const { return path_ + "/lock"; }
    [[nodiscard]] Expected<std::uint64_t> lastOfAll() const;
    [[nodiscard]] Expected<void> writeLast(std::uint64_t number) const;
    /// An errno; 0: it has its name for good.
    [[nodiscard]] int name(const std::string& unfinished, const std::string& path) const;

    std::string path_;
    std::shared_ptr<JournalDisk> disk_;
    int lock_;
};

/// What lies in the folder, read to its end, or before log `upTo`. A torn end of the very last log is where the story
/// ends; anywhere else it is an error. Nothing in the folder is changed.
struct JournalStory {
    JournalState state;
    std::uint64_t snapshotBytes = 0, logBytes = 0;
    /// Of the last log that was read.
    std::uint64_t wholeBytes = 0, tornBytes = 0;
    bool hollow = false;  ///< not even its opening is whole
};
/// `stop` ends it early, with kFailed. The scene's arrays are in `arrays` for as long as the state holds them.
[[nodiscard]] Expected<JournalStory> readJournal(const JournalFolder& folder, const JournalFiles& files,
                                                 BlobStore& arrays, const JournalLimits& limits,
                                                 std::optional<std::uint64_t> upTo = std::nullopt,
                                                 const std::atomic<bool>* stop = nullptr);
/// The same without arrays: `places` knows where they are, and the state names them.
[[nodiscard]] Expected<JournalStory> readJournal(const JournalFolder& folder, const JournalFiles& files,
                                                 JournalPlaces& places, const JournalLimits& limits, std::uint64_t upTo,
                                                 const std::atomic<bool>& stop);

/// Appends the array once, and remembers that it did.
class JournalArrays {
public:
    /// All that the list names and the file lacks. An errno; -1: one is not here.
    [[nodiscard]] int append(JournalFile& file, const ChangeList& list);
    void clear() { written_.clear(); }

private:
    std::unordered_set<BlobId> written_;
};

}  // namespace tessera

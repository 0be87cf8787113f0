/// The file `last` of a journal.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "common/base/Error.h"
#include "common/base/Guarded.h"
#include "server/sim/journal/JournalDisk.h"

namespace tessera {

/// A log of one journal. No other journal has a log with the same opening.
struct LogName {
    std::uint64_t number = 0;
    std::uint64_t opening = 0;  ///< hash of its opening
};

/// How far a journal goes.
struct JournalEnd {
    /// The part of the log that is there for certain.
    struct Extent {
        std::uint64_t opening = 0;  ///< hash of its opening; 0: there is no log
        std::uint64_t written = 0;  ///< bytes, while the machine runs on
        std::uint64_t synced = 0;   ///< bytes, after a power cut too
        std::string boot;           ///< FileSystem::boot of who wrote it
        /// Whether the machine has run on since then.
        [[nodiscard]] bool isOf(const std::string& bootNow) const { return !boot.empty() && boot == bootNow; }
    };
    std::uint64_t log = 0;  ///< the newest; 0: there is none
    /// Nothing: an older version wrote it; or a person who goes on with what there is.
    std::optional<Extent> extent;
};

/// Names the newest log, and tells how much of it has been granted: a log that has lost its end looks like one that a
/// kill has cut off, and nothing else in the folder could tell.
///
/// The file is one line of always as many bytes. It is written over in place before a record is granted. A sector has
/// room for it, so a power cut leaves the old line or the new one. Thread-safe.
class LastLog {
public:
    LastLog(std::string path, std::shared_ptr<JournalDisk> disk) : path_(std::move(path)), disk_(std::move(disk)) {}
    LastLog(const LastLog&) = delete;
    ~LastLog();

    [[nodiscard]] const std::string& path() const { return path_; }
    /// Nothing where there is no such file. Refused: it is damaged.
    [[nodiscard]] Expected<std::optional<JournalEnd>> read() const;

    /// Writes it beside, for a log of which all bytes are synced. To be renamed, then `taken`; or `drop`ped.
    [[nodiscard]] Expected<void> prepare(const LogName& log, std::uint64_t bytes);
    [[nodiscard]] std::string unfinished() const;
    void taken();
    void drop();

    /// An errno; 0: it is in the file.
    [[nodiscard]] int say(std::uint64_t written, std::uint64_t synced);
    [[nodiscard]] int sync();
    /// Whether the name still stands for the file that is written to.
    [[nodiscard]] bool isThere() const;

    /// "write its number into the file: echo 3 > wall/last": how a person goes on with what there is.
    [[nodiscard]] std::string cure(std::uint64_t log) const;

private:
    /// The file, and the one that is to take its place; -1: none.
    struct OpenFiles {
        int now = -1, next = -1;
        LogName log, nextLog;
    };
    void drop(OpenFiles& files);
    [[nodiscard]] int make(OpenFiles& files, const LogName& log, std::uint64_t bytes);
    [[nodiscard]] std::string line(const LogName& log, std::uint64_t written, std::uint64_t synced) const;

    std::string path_;
    std::shared_ptr<JournalDisk> disk_;
    mutable Guarded<OpenFiles> files_;
};

}  // namespace tessera

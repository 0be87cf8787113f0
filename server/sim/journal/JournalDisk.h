/// The disk below a journal.
#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <utility>

#include "server/sim/journal/FileSystem.h"

namespace tessera {

/// The kernel tells once that a sync has failed; the next one succeeds, though what was to be synced may be lost. So it
/// is remembered here for all who sync, and nothing is synced again. Thread-safe.
class JournalDisk {
public:
    explicit JournalDisk(std::shared_ptr<FileSystem> calls) : calls_(std::move(calls)) {}

    [[nodiscard]] FileSystem& calls() const { return *calls_; }
    /// Errno values; 0: it is on the disk.
    [[nodiscard]] int sync(int file);
    [[nodiscard]] int syncFolder(const std::string& path);
    /// The error of the sync that failed; 0: none has.
    [[nodiscard]] int failedSync() const { return failed_; }
    /// As after a failed sync: what is in the folder is not what was to be there.
    void lose(int error) { failed_ = error; }

private:
    [[nodiscard]] int remembered(int error);

    std::shared_ptr<FileSystem> calls_;
    std::atomic<int> failed_{0};
};

}  // namespace tessera

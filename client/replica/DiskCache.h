/// A host's blobs on its disk, so that a restarted host need not fetch a model again.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <thread>

#include "common/base/Blob.h"
#include "common/base/Channel.h"
#include "common/base/Log.h"

namespace tessera {

/// Files `FOLDER/HOST/HASH.blob`, one per blob: two hosts of one machine never meet. Owns a thread that writes; disk
/// errors cost the cache, never the wall. Bounded: the files that were written or read longest ago go first.
class DiskCache {
public:
    DiskCache(const std::string& folder, const std::string& host, std::uint64_t maxBytes, Log& log);
    ~DiskCache();

    /// Reads what is there, newest first, at most `maxBytes`. A file whose bytes do not have the hash of its name is
    /// deleted.
    void load(const std::function<void(Blob)>& found);
    /// Writes later. When the disk cannot keep up, this blob is not cached.
    void store(const Blob& blob);

private:
    void run();
    void write(const Blob& blob);
    void makeRoom();

    std::string folder_;
    std::uint64_t maxBytes_;
    Log& log_;
    Channel<Blob> waiting_;
    std::uint64_t writtenBytes_ = 0;  ///< the thread's own
    bool complained_ = false;         ///< the thread's own
    std::thread thread_;
};

}  // namespace tessera

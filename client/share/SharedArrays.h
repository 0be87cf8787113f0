/// The scene's arrays in memory that the render hosts of one machine have in common, instead of once in each.
///
/// An array that has come lies in a sealed file in memory (memfd_create): nobody can change it, shorten it or leave it behind, and it lives
/// as long as anybody maps it. Each process lists its own in a directory, which the others find by the process' open files
/// (/proc/PID/fd): processes of the same user that run the same program. Nothing that is found there is believed: seals, size and hash
/// are looked at first, so that a neighbour can at worst be of no help.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/base/Blob.h"
#include "common/base/Log.h"
#include "common/session/Messages.h"

namespace tessera {

/// One thread; the blobs that it makes are let go of on any. Without memory of that kind (an old kernel, a full machine) blobs stay
/// where they are.
class SharedArrays {
public:
    /// Below this a blob is not worth an open file.
    static constexpr std::size_t kLeastBytes = 65536;
    /// At most so many of ours are open at once; fewer where the process may not open as many files.
    static constexpr std::size_t kMostArrays = 4096;

    /// Whose arrays may be looked at, asked for at most ten times a second; by default the same user's processes of the same program.
    using Neighbours = std::function<std::vector<pid_t>()>;
    explicit SharedArrays(Log& log, Neighbours neighbours = nullptr);
    ~SharedArrays();

    /// The blob in memory in common: a neighbour's where one has it, else a copy that neighbours may find. Small, absent and
    /// shared ones come back as they are, and so does one for which there is no room.
    [[nodiscard]] Blob share(Blob blob);
    /// A piece of a large blob, as it comes: `share` then has its bytes in their place already. Written at once, hundreds of
    /// megabytes of fresh memory would take longer than a host may be silent. Pieces come in order, from the beginning on.
    void arrives(const BlobInfo& info, std::uint64_t offset, ByteSpan piece);
    /// Pieces may have come that nobody asked for, or will be asked for again: `share` writes all itself.
    void forgetArriving();
    /// A blob that a neighbour has; empty: none has it.
    [[nodiscard]] Blob find(const BlobInfo& wanted);

    struct Counts {
        std::uint64_t own = 0, ownBytes = 0;      ///< that we have put there
        std::uint64_t found = 0, foundBytes = 0;  ///< that others had
    };
    [[nodiscard]] const Counts& counts() const { return counts_; }

private:
    struct Entry;
    class Directory;
    class OtherDirectory;
    [[nodiscard]] Blob keep(int file, const BlobInfo& info, const Blob* known);
    [[nodiscard]] Blob rival(const BlobInfo& info, std::uint64_t place);
    [[nodiscard]] Blob counted(Blob found);
    void meetNeighbours();

    Log& log_;
    Neighbours neighbours_;
    std::shared_ptr<Directory> own_;  ///< null: there is no such memory
    std::map<pid_t, std::unique_ptr<OtherDirectory>> others_;
    std::chrono::steady_clock::time_point metAt_{};
    Counts counts_;
    struct Arriving;
    std::unique_ptr<Arriving> arriving_;  ///< the blob whose pieces come; null: none
};

/// Processes of this user that run this program, but this one.
[[nodiscard]] std::vector<pid_t> processesOfThisProgram();

}  // namespace tessera

/// The scene's arrays in memory that the render hosts of one machine have in common, instead of once in each.
///
/// An array that has come lies in a sealed file in memory (memfd_create): nobody can change it, shorten it or leave it
/// behind, and it lives as long as anybody maps it. Each process lists its own in a directory, which the others find by
/// the process' open files
/// (/proc/PID/fd): processes of the same user that run the same program. Nothing that is found there is believed:
/// seals, size and hash are looked at first (each byte, where we have it ourselves), so that a neighbour can at worst
/// be of no help.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "client/share/ArrayDirectory.h"
#include "common/base/BlobMaker.h"
#include "common/base/Clock.h"
#include "common/base/Log.h"
#include "common/session/Messages.h"

namespace tessera {

/// One thread; the blobs that it makes are let go of on any. A thread of its own gives memory back. Without memory of
/// that kind (an old kernel, a full machine) blobs stay where they are.
class SharedArrays {
public:
    /// Below this a blob is not worth an open file.
    static constexpr std::size_t kLeastBytes = 65536;
    /// At most so many of ours are open at once; fewer where the process may not open as many files.
    static constexpr std::size_t kMostArrays = ArrayDirectory::kMost;

    /// Whose arrays may be looked at, asked for at most ten times a second; by default the same user's processes of the
    /// same program.
    using Neighbours = std::function<std::vector<pid_t>()>;
    explicit SharedArrays(Log& log, Neighbours neighbours = nullptr);
    ~SharedArrays();

    /// The blob in memory in common: a neighbour's where one has it, else a copy that neighbours may find. Small,
    /// absent and shared ones come back as they are, and so does one for which there is no room. One that has come to
    /// lie in its `place` stays there, until `step` has found a neighbour's.
    [[nodiscard]] Blob share(Blob blob);
    /// Where the bytes of a large blob come to lie from the first on: `share` then has nothing to copy. Null: nowhere.
    /// Not to be used after this is gone.
    [[nodiscard]] std::unique_ptr<BlobPlace> place(const BlobInfo& info);
    /// Of an array that two have fetched at once, the later one gives way to the earlier, in place: pages that have
    /// proved the same come to lie in the earlier file. So many with each step as take a fraction of a millisecond: all
    /// at once, hundreds of megabytes would keep a host from saying what it shows.
    void step(TimePoint now);
    /// When the next one is due; TimePoint::max(): none is.
    [[nodiscard]] TimePoint nextStep() const;
    /// A blob that a neighbour has; empty: none has it.
    [[nodiscard]] Blob find(const BlobInfo& wanted);

    struct Counts {
        std::uint64_t own = 0, ownBytes = 0;      ///< that we have put there
        std::uint64_t found = 0, foundBytes = 0;  ///< that others had
    };
    [[nodiscard]] const Counts& counts() const { return counts_; }

private:
    struct Kept;
    [[nodiscard]] Blob adopted(ArrayFile file, OthersArrayDirectory& from, const BlobInfo& info);
    [[nodiscard]] std::shared_ptr<Kept> takePlaced(const BlobId& id);
    [[nodiscard]] std::shared_ptr<Kept> copyOf(const Blob& blob);
    [[nodiscard]] Blob rival(const BlobInfo& info, std::uint64_t place);
    [[nodiscard]] Blob counted(Blob found);
    void count(const BlobInfo& own);
    void meetNeighbours();

    Log& log_;
    Neighbours neighbours_;
    std::shared_ptr<ArrayDirectory> own_;  ///< null: there is no such memory
    std::map<pid_t, std::unique_ptr<OthersArrayDirectory>> others_;
    std::chrono::steady_clock::time_point metAt_{};
    Counts counts_;
    class Place;
    struct Doubled;
    [[nodiscard]] bool findEarlier(Doubled& doubled);
    [[nodiscard]] bool compareOn(Doubled& doubled);
    void lookLater(TimePoint now, std::unique_ptr<Doubled> doubled);
    std::multimap<TimePoint, std::unique_ptr<Doubled>> later_;  ///< when to look whether a neighbour has it too
    std::unique_ptr<Doubled> compared_;                         ///< with a neighbour's; null: none is
    TimePoint stepAt_{};                                        ///< not before
    std::map<BlobId, std::weak_ptr<Kept>> placed_;              ///< finished there, and not shared yet
};

/// Processes of this user that run this program, but this one.
[[nodiscard]] std::vector<pid_t> processesOfThisProgram();

}  // namespace tessera

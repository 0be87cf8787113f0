/// Files that are looked at again and again: who is told when one has changed.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/base/LaneThreads.h"
#include "common/base/TimeSource.h"

namespace tessera {

/// What tells one state of a file from another one. Of what is not there all is 0.
struct FileStamp {
    std::uint64_t device = 0, node = 0, bytes = 0;
    std::int64_t written = 0, changed = 0;  ///< ns
    bool operator==(const FileStamp&) const = default;
};
/// Links are followed: one that leads elsewhere is another state.
[[nodiscard]] std::vector<FileStamp> stampsOf(const std::vector<std::string>& files);

struct WatchedFiles {
    std::vector<std::string> paths;   ///< the first one is the file itself: without it there is nothing to be read
    std::vector<FileStamp> stamps;    ///< as they were when they were read
    std::vector<std::string> called;  ///< names that lead to the file: as it was asked for, and whole ones
};

/// Looks at all of them kLooks times a second, on a lane of its own. So it works on file systems of other machines,
/// for files that are replaced by renaming, that are gone for a while, and whose folders are. It looks less often where
/// that takes it more than a tenth of its time: so many files, or so slow ones, cost no more.
///
/// A group of files is told once any of them has changed and all have been as they are for kQuiet, or have never been
/// so for kLongest: of a file that is written again and again something is seen. What is gone is not told until it is
/// back; when it has been gone for kGone, that is told once.
class FileWatch {
public:
    static constexpr int kLooks = 10;
    static constexpr std::chrono::milliseconds kQuiet{200}, kLongest{2000}, kGone{2000}, kAgain{2000};

    enum class News : std::uint8_t { kChanged, kGone };
    /// On the watch's lane.
    using Tell = std::function<void(std::uint64_t group, News news)>;
    explicit FileWatch(Tell tell, const MakeLane& lane = LaneThreads::make, const TimeSource& time = machineTime());

    /// In place of what the group had; `quiet`: for so long it is left alone first. Frame thread; does not wait for any
    /// file.
    void watch(std::uint64_t group, WatchedFiles files, Duration quiet = kQuiet);
    void forget(std::uint64_t group);
    /// Tells kChanged once more in kAgain: what was told could not be taken in. Frame thread.
    void again(std::uint64_t group);

private:
    struct Group {
        WatchedFiles files;  ///< with their stamps when it was told last
        Duration quiet = kQuiet;
        std::vector<FileStamp> seen;  ///< at the last look
        TimePoint since = {};         ///< as they were then
        TimePoint same = {};          ///< the last look at which they were as they had been told, or the file was gone
        bool goneTold = false;
    };
    void look();
    void lookAt(std::uint64_t number, Group& group, TimePoint now) const;

    Tell tell_;
    const TimeSource& time_;
    std::map<std::uint64_t, Group> groups_;  ///< the lane's
    std::unique_ptr<Lane> lane_;             ///< last
};

}  // namespace tessera

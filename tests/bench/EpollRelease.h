/// As many bare processes as a wall has hosts: each waits in epoll for a byte over loopback TCP and says when it came.
#pragma once

#include <sys/types.h>

#include <optional>
#include <vector>

namespace tessera::bench {

class EpollRelease {
public:
    /// `user`: whose the processes are; none: the caller's.
    EpollRelease(int processes, std::optional<uid_t> user);
    ~EpollRelease();
    EpollRelease(const EpollRelease&) = delete;
    EpollRelease& operator=(const EpollRelease&) = delete;

    /// Milliseconds from the first to the last that was there, of each release. In between all sleep for a sixtieth of
    /// a second.
    [[nodiscard]] std::vector<double> releases(int count) const;

private:
    std::vector<int> sockets_;
    std::vector<pid_t> processes_;
};

}  // namespace tessera::bench

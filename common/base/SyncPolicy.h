/// How the hosts of a wall wait for each other. Part of a wall's configuration; the session carries it out.
#pragma once

#include <chrono>
#include <cstdint>

namespace tessera {

/// What happens when a host is later than the others.
enum class LateFramePolicy : std::uint8_t {
    kWait,  ///< nobody is left behind, up to the frame deadline; then the host is lost
    kHold,  ///< the others go on without it for this frame; its tiles show their last image
    kDrop,  ///< as hold, and the host leaves the barrier until it has caught up
};

struct SyncPolicy {
    LateFramePolicy lateFrame = LateFramePolicy::kWait;
    std::chrono::milliseconds frameDeadline{10'000};
    /// Instead, if it is longer, until a first frame has been drawn: programs are compiled and meshes uploaded in it.
    std::chrono::milliseconds firstFrameDeadline{60'000};
    /// Hold and drop: how long the others wait for a late host before they go on, from the first host's Ready.
    std::chrono::milliseconds lateAfter{100};
    std::chrono::milliseconds heartbeat{100};
    std::chrono::milliseconds lostAfter{800};
    std::chrono::milliseconds startDeadline{30'000};
    bool operator==(const SyncPolicy&) const = default;
};

}  // namespace tessera

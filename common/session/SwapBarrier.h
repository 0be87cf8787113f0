/// Nobody shows frame n until everybody has drawn it.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "common/base/Clock.h"
#include "common/base/Error.h"

namespace tessera {

/// What happens when a host misses the frame deadline.
enum class LateFramePolicy : std::uint8_t {
    kWait,  ///< nobody is left behind, up to the deadline; then the host is lost
    kHold,  ///< the others go on without it for this frame; its tiles show their last image
    kDrop,  ///< as hold, and the host leaves the barrier until it has caught up
};

struct SyncPolicy {
    LateFramePolicy lateFrame = LateFramePolicy::kWait;
    std::chrono::milliseconds frameDeadline{10'000};
    /// Hold and drop: how long the others wait for a late host before they go on.
    std::chrono::milliseconds lateAfter{100};
    std::chrono::milliseconds heartbeat{50};
    std::chrono::milliseconds lostAfter{250};
    std::chrono::milliseconds startDeadline{30'000};
    bool operator==(const SyncPolicy&) const = default;
};

/// Pure state machine over host names: feed it events, carry out what it returns. Not thread-safe; one owner. Frames
/// begin and are released in order, each exactly once. Times are the caller's clock.
class SwapBarrier {
public:
    explicit SwapBarrier(SyncPolicy policy);

    /// Hosts take part from the next begun frame on.
    void enter(const std::string& host);
    /// Removes a host now (lost, resyncing). May release the current frame: see `poll`.
    void leave(const std::string& host);

    /// Begins `frame`, one past the last; only when no frame is open. Returns who has to draw it.
    std::vector<std::string> begin(std::uint64_t frame, TimePoint now);
    /// A repeat for the same frame is harmless, an older frame too (a straggler); a future frame, or one from a host that
    /// is not in the barrier, is a protocol error.
    [[nodiscard]] Expected<void> ready(const std::string& host, std::uint64_t frame, TimePoint now);

    struct Outcome {
        bool released = false;            ///< the open frame is complete: tell `show` to swap
        std::uint64_t frame = 0;
        std::vector<std::string> show;    ///< hosts that have drawn it
        std::vector<std::string> held;    ///< hosts that keep their last image (policy hold, drop)
        std::vector<std::string> stalled; ///< hosts that missed the frame deadline; they have left the barrier
        Duration barrierTime{};           ///< first ready to release
    };
    /// Call after every event and whenever the clock passes `nextDeadline()`.
    [[nodiscard]] Outcome poll(TimePoint now);
    /// When something would change without an event; TimePoint::max() for never.
    [[nodiscard]] TimePoint nextDeadline() const;

    [[nodiscard]] bool open() const;
    [[nodiscard]] std::uint64_t nextFrame() const;
    /// Who has not drawn the open frame yet: always known, and reported.
    [[nodiscard]] std::vector<std::string> waitingFor() const;
    [[nodiscard]] bool contains(const std::string& host) const;

private:
    struct Member {
        bool drawing = false;  ///< takes part in the open frame
        bool done = false;     ///< has drawn the open frame
        std::uint64_t lastReady = 0;
        bool everReady = false;
    };
    SyncPolicy policy_;
    std::map<std::string, Member> members_;
    std::vector<Duration> recentFrames_;
    std::uint64_t next_ = 0;
    bool open_ = false;
    TimePoint begun_{};
    TimePoint firstReady_{};
};

}  // namespace tessera

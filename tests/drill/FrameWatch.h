/// Somebody before the wall: an application on a thread of its own that writes down when frames are shown.
#pragma once

#include <optional>
#include <string>
#include <thread>
#include <variant>

#include "common/base/Channel.h"
#include "common/base/Clock.h"
#include "tests/drill/FrameTimeline.h"

namespace tessera::drill {

/// Connects, and again whenever the connection breaks, until it is destroyed. Its connections are made in the network
/// namespace of the thread that made it. One thread takes.
class FrameWatch {
public:
    explicit FrameWatch(const std::string& address);
    ~FrameWatch();
    FrameWatch(const FrameWatch&) = delete;
    FrameWatch& operator=(const FrameWatch&) = delete;

    struct Lost {
        TimePoint at;  ///< when the connection was found gone
    };
    using Seen = std::variant<SeenFrame, Lost>;
    /// Nothing when none has come.
    [[nodiscard]] std::optional<Seen> take() { return seen_.tryPop(); }

private:
    void watch(const std::stop_token& stop, const std::string& address);

    Channel<Seen> seen_{100'000};
    std::jthread thread_;
};

}  // namespace tessera::drill

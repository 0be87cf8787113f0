/// Others' protocols on simulated time: datagrams that a test sends, and servers of streams that it plays.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/net/Feeds.h"
#include "tests/support/wall/Timeline.h"

namespace tessera::simulation {

/// One thread. Datagrams arrive a moment later, in order.
class MemoryFeeds {
public:
    explicit MemoryFeeds(Timeline& timeline) : timeline_(timeline) {}

    /// The feeds of a program. They end with it.
    [[nodiscard]] MakeFeeds make();
    /// A datagram for whoever listens at that port then; `from`: an address in figures.
    void send(std::uint16_t port, ByteSpan bytes, const std::string& from = "127.0.0.1");
    void send(std::uint16_t port, std::string_view text, const std::string& from = "127.0.0.1") {
        send(port, asBytes(text), from);
    }

    /// Whether a server of streams is there. One that goes hangs up.
    void serve(std::uint16_t port, bool there);
    /// To all who have dialled it. False: there is nobody.
    bool say(std::uint16_t port, ByteSpan bytes);
    /// All that was said to it.
    [[nodiscard]] const Bytes& heard(std::uint16_t port) { return served_[port].heard; }

private:
    class Own;
    struct Listener {
        std::function<void(const Feeds::Datagram&)> onDatagram;
    };
    struct Dialled {
        Feeds::Stream stream;
        bool open = false;
        std::uint64_t attempt = 0;  ///< what was planned for an earlier one is over
        std::chrono::milliseconds pause{};
    };
    struct Served {
        bool there = false;
        Bytes heard = {};
        std::vector<std::weak_ptr<Dialled>> dialled = {};
    };
    void dial(std::uint16_t port, const std::shared_ptr<Dialled>& dialled);
    void lose(std::uint16_t port, const std::shared_ptr<Dialled>& dialled, const Error& why);
    void watch(std::uint16_t port, const std::shared_ptr<Dialled>& dialled);

    static constexpr Duration kOnItsWay = 100us;

    Timeline& timeline_;
    std::map<std::uint16_t, std::weak_ptr<Listener>> listeners_;
    std::map<std::uint16_t, Served> served_;
    std::uint16_t lastPort_ = 60'000;
};

}  // namespace tessera::simulation

/// Links in memory, on simulated time: what programs of one simulated wall are joined by.
#pragma once

#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "common/net/FrameReader.h"
#include "common/net/Transport.h"
#include "tests/support/wall/Timeline.h"

namespace tessera::simulation {

class MemoryTransport;

/// Carries encoded bytes, cut at random places, in order within one direction of one link, as TCP does. Programs are
/// named; `cutOff` and `reset` are what happens to cables and machines. One thread.
class MemoryNetwork {
public:
    struct Weather {
        Duration latency = 100us, jitter = 200us;  ///< of each piece
        std::size_t largestPiece = std::size_t{64} << 10;
    };
    MemoryNetwork(Timeline& timeline, Random random) : timeline_(timeline), random_(random) {}

    [[nodiscard]] Timeline& timeline() { return timeline_; }
    Weather weather = {};

    /// Makes the transports of a program of this name. `poke` is called when something has come for it.
    [[nodiscard]] MakeTransport transportOf(std::string program, std::function<void()> poke);
    /// Nothing goes to or from that program any more, and nobody is told.
    void cutOff(const std::string& program, bool cut);
    /// Its links break, as those of a program that was killed do, and nobody listens there.
    void reset(const std::string& program);
    /// Changes with every byte that arrives, and with when it does.
    [[nodiscard]] std::uint64_t fingerprint() const { return fingerprint_; }

private:
    friend class MemoryTransport;
    struct Connection;
    struct End {
        MemoryTransport* owner = nullptr;  ///< null: gone
        LinkId link;
        std::unique_ptr<FrameReader> reader;
        std::deque<ByteSlice> out;  ///< not arrived at the other end
        std::size_t outBytes = 0, untaken = 0;
        bool open = false;        ///< it has been told so
        bool carrying = false;    ///< a piece of `out` is on its way
        bool closing = false;     ///< by its owner
        bool otherEnded = false;  ///< nothing comes any more
        std::string reason;       ///< of the closing
        TimePoint sentAt{}, heardAt{};
        struct KeepAlive {
            Duration interval{};
            std::uint16_t type = 0;
            Epoch epoch;
            SharedChain payload;
        };
        std::optional<KeepAlive> keepAlive;
    };
    struct Connection {
        End ends[2];
        std::string programs[2];
        std::string peer[2];  ///< as each end is told of the other
    };
    using ConnectionPtr = std::shared_ptr<Connection>;

    [[nodiscard]] Duration delay() { return weather.latency + random_.between(Duration{}, weather.jitter); }
    [[nodiscard]] bool isCut(const Connection& connection) const;
    void dial(MemoryTransport& from, LinkId link, const Address& to, std::chrono::milliseconds timeout);
    void queue(const ConnectionPtr& connection, int side, std::uint16_t type, Epoch epoch, const SharedChain& payload);
    void carry(const ConnectionPtr& connection, int side);
    void arrive(const ConnectionPtr& connection, int side);
    void endOf(const ConnectionPtr& connection, int side);
    void finish(const ConnectionPtr& connection, int side, const std::string& reason);
    void breakLink(const ConnectionPtr& connection, int side, const std::string& reason);
    void beat(const ConnectionPtr& connection, int side);

    Timeline& timeline_;
    Random random_;
    std::map<std::uint16_t, MemoryTransport*> listeners_;
    std::map<std::string, bool> cut_;
    std::vector<std::weak_ptr<Connection>> connections_;
    std::uint64_t lastLink_ = 0, fingerprint_ = 0;
    std::uint16_t lastPort_ = 40'000;
};

/// One program's.
class MemoryTransport final : public Transport {
public:
    MemoryTransport(MemoryNetwork& network, std::string program, std::function<void()> poke, TransportLimits limits,
                    std::function<void(LinkEvent)> onEvent)
        : network_(network),
          program_(std::move(program)),
          poke_(std::move(poke)),
          limits_(std::move(limits)),
          onEvent_(std::move(onEvent)) {}
    ~MemoryTransport() override { end(); }

    using Transport::listen;
    using Transport::send;
    [[nodiscard]] Expected<std::uint16_t> listen(const Address& address,
                                                 const std::function<void(std::uint16_t)>& onBound) override;
    LinkId connect(const Address& address, std::chrono::milliseconds timeout) override;
    void send(LinkId link, std::uint16_t type, Epoch epoch, SharedChain payload) override;
    void keepAlive(LinkId link, std::chrono::milliseconds interval, std::uint16_t type, Epoch epoch,
                   SharedChain payload) override;
    void taken(LinkId link, std::size_t payloadBytes) override;
    void close(LinkId link, std::string reason) override;
    /// All that has come has been delivered: whoever drives this program calls it when there is more.
    [[nodiscard]] bool attend(TimePoint) override { return true; }
    void wake() override { poke_(); }
    void end() override;
    void judgeAgain() override {}
    [[nodiscard]] Traffic traffic() const override { return traffic_; }
    [[nodiscard]] std::size_t queuedBytes(LinkId link) const override;

private:
    friend class MemoryNetwork;
    struct LinkPlace {
        MemoryNetwork::ConnectionPtr connection;
        int side = 0;
    };
    void emit(decltype(LinkEvent::what) what);

    MemoryNetwork& network_;
    std::string program_;
    std::function<void()> poke_;
    TransportLimits limits_;
    std::function<void(LinkEvent)> onEvent_;
    std::map<LinkId, LinkPlace> links_;
    Traffic traffic_;
    bool ending_ = false;
};

}  // namespace tessera::simulation

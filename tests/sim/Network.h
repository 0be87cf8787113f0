/// Connections with latency, jitter and bandwidth; ordered within one direction of one connection, as TCP is.
#pragma once

#include <map>
#include <memory>

#include "common/session/ServerSession.h"
#include "tests/support/wall/Timeline.h"

namespace tessera::simulation {

/// Where connections end. Nothing is said about a connection before `opened` or after `closed`.
class End {
public:
    virtual ~End() = default;
    virtual void opened(ConnectionId connection) = 0;
    virtual void received(ConnectionId connection, Epoch epoch, std::shared_ptr<const Message> message) = 0;
    virtual void undecodable(ConnectionId) {}
    virtual void closed(ConnectionId connection) = 0;
};

struct Link {
    Duration latency = 1ms;
    Duration jitter = 0ms;
    double bytesPerSecond = 100e6;
};

class Network {
public:
    Network(Timeline& timeline, Random random) : timeline_(timeline), random_(random) {}

    void serve(End& server) { server_ = &server; }
    /// Both ends are told after the handshake.
    ConnectionId connect(const Link& link, End& client);
    void toServer(ConnectionId connection, Epoch epoch, Message message) {
        send(connection, kUp, epoch, std::move(message));
    }
    void toClient(ConnectionId connection, Epoch epoch, Message message) {
        send(connection, kDown, epoch, std::move(message));
    }
    /// Bytes that no codec understands.
    void garbageToServer(ConnectionId connection);
    /// What was sent before arrives; then the other end is told. What is on its way here is lost.
    void closeByClient(ConnectionId connection) { close(connection, kUp); }
    void closeByServer(ConnectionId connection) { close(connection, kDown); }
    /// Cable out: from now on nothing arrives in either direction, and nobody is told.
    void cut(ConnectionId connection);
    /// The connection breaks, and both ends notice.
    void sever(ConnectionId connection);

private:
    enum Direction { kUp = 0, kDown = 1 };
    struct Connection {
        Link link;
        End* client = nullptr;
        TimePoint free[2];                ///< when the last thing sent arrives, by direction
        bool openAt[2] = {false, false};  ///< kUp: as the server knows, kDown: as the client knows
        bool cut = false;
    };
    void send(ConnectionId connection, Direction direction, Epoch epoch, Message message);
    void close(ConnectionId connection, Direction direction);
    /// Runs `arrive(end)` at the far end, in order.
    void carry(ConnectionId connection, Direction direction, std::size_t bytes, std::function<void(End&)> arrive,
               bool last = false);
    [[nodiscard]] End& endOf(const Connection& c, Direction direction) {
        return direction == kUp ? *server_ : *c.client;
    }

    Timeline& timeline_;
    Random random_;
    End* server_ = nullptr;
    std::map<ConnectionId, Connection> connections_;
    std::uint64_t given_ = 0;
};

[[nodiscard]] std::size_t sizeOf(const Message& message);

}  // namespace tessera::simulation

/// A server session, its clock and what it did, for tests that speak for the peers.
#pragma once

#include <gtest/gtest.h>

#include "common/base/Hash.h"
#include "common/session/ServerSession.h"
#include "tests/unit/HistoryLiterals.h"

namespace tessera {

using namespace std::chrono_literals;
using Names = std::vector<std::string>;

inline SharedBytes textBytes(std::string_view text) {
    const ByteSpan bytes = asBytes(text);
    return share(Bytes(bytes.begin(), bytes.end()));
}
/// A stand-in for the scene's hash after list `sequence`.
inline StateHash hashAfter(Sequence sequence) {
    return StateHash(0x9E3779B97F4A7C15ull * (sequence.value + 1));
}

/// The envelope of a list that leads to `sequence`, of a scene that stands there, or of one made from nothing.
inline CommittedListPtr listAt(Sequence sequence, std::vector<BlobInfo> blobs = {}, ByteSlice encoded = {}) {
    return share(CommittedList{sequence, hashAfter(sequence), std::move(encoded), std::move(blobs)});
}

inline ServerSessionConfig twoHosts() {
    ServerSessionConfig config;
    config.hosts = {"a", "b"};
    config.schema = 77;
    config.sync.heartbeat = 50ms;
    config.sync.lostAfter = 250ms;
    config.sync.frameDeadline = 1'000ms;
    config.sync.firstFrameDeadline = 1'000ms;
    config.sync.lateAfter = 100ms;
    config.configuration = textBytes("the wall");
    return config;
}

struct ServerFixture {
    explicit ServerFixture(ServerSessionConfig config = twoHosts()) : session(config), schema(config.schema) {}

    ServerSession session;
    std::uint64_t schema;
    TimePoint now{10s};
    std::uint64_t lastConnection = 0;
    Sequence sequence{5};  ///< of the scene
    ServerActions done;    ///< since the last `forget()`
    std::map<ConnectionId, FrameNumber> toldToShow;
    bool showing = true;  ///< whoever is alive in `run` says what it shows

    void forget() { done.clear(); }
    void take(ServerActions actions) {
        for (const ServerAction& action : actions)
            if (const auto* send = std::get_if<server_action::Send>(&action))
                if (const auto* swap = std::get_if<message::Swap>(send->message.get()))
                    toldToShow[send->connection] = swap->frame;
        done.insert(done.end(), actions.begin(), actions.end());
    }
    void pass(Duration time) { now += time; }
    /// Time passes, everybody in `alive` heartbeats, and the session looks at the clock, as often as it asks to.
    void run(Duration time, const std::vector<ConnectionId>& alive = {}) {
        const TimePoint end = now + time;
        while (now < end) {
            now += 10ms;
            for (const ConnectionId c : alive) {
                say(c, message::Heartbeat{.sentAtNs = 1});
                if (showing) show(c);
            }
            take(session.advance(now));
        }
    }
    /// Says that it shows what it was last told to.
    void show(ConnectionId connection) {
        if (const auto told = toldToShow.extract(connection)) say(connection, message::Shown{told.mapped(), 1});
    }

    ConnectionId open() {
        const ConnectionId connection(++lastConnection);
        take(session.connectionOpened(connection, now));
        return connection;
    }
    void say(ConnectionId connection, const Message& message) {
        take(session.received(connection, session.epoch(), message, now));
    }
    void drop(ConnectionId connection) { take(session.connectionClosed(connection, now)); }
    message::Hello greeting(const std::string& name, PeerRole role = PeerRole::kHost) const {
        return {.schema = schema, .role = role, .name = name};
    }
    ConnectionId hello(const std::string& name, PeerRole role = PeerRole::kHost) {
        const ConnectionId connection = open();
        say(connection, greeting(name, role));
        return connection;
    }
    ConnectionId bulk(ConnectionId control) {
        const ConnectionId connection = open();
        message::Hello hello = greeting("");
        hello.channel = ChannelKind::kBulk;
        hello.token = sent<message::Welcome>(control).at(0).token;
        say(connection, hello);
        return connection;
    }
    void snapshot(ConnectionId connection) { take(session.snapshotReady(connection, {listAt(sequence)}, now)); }
    void synced(ConnectionId connection) { say(connection, message::Synced{sequence, hashAfter(sequence)}); }
    /// Hello, snapshot, synced: enters at the next frame.
    ConnectionId join(const std::string& name) {
        const ConnectionId connection = hello(name);
        snapshot(connection);
        synced(connection);
        return connection;
    }
    ConnectionId follow(const std::string& name) {
        const ConnectionId connection = hello(name, PeerRole::kApplication);
        snapshot(connection);
        return connection;
    }
    CommittedListPtr commit(std::vector<BlobInfo> blobs = {}) {
        sequence = sequence.next();
        return listAt(sequence, std::move(blobs), textBytes("list"));
    }
    /// Without a list the frame changes nothing.
    FrameNumber begin(CommittedListPtr list = nullptr) {
        const FrameNumber frame = session.nextFrame();
        if (!list) list = listAt(sequence);
        take(session.beginFrame({.frame = frame, .payload = textBytes("frame"), .list = std::move(list)}, now));
        return frame;
    }
    void ready(ConnectionId connection, FrameNumber frame) { readyAt(connection, frame, sequence); }
    void readyAt(ConnectionId connection, FrameNumber frame, Sequence at) {
        say(connection, message::Ready{frame, hashAfter(at), nullptr});
    }

    template <typename A>
    std::vector<A> actions() const {
        std::vector<A> found;
        for (const ServerAction& action : done)
            if (const A* a = std::get_if<A>(&action)) found.push_back(*a);
        return found;
    }
    template <typename M>
    std::vector<M> sent(ConnectionId connection) const {
        std::vector<M> found;
        for (const auto& send : actions<server_action::Send>())
            if (const M* m = std::get_if<M>(send.message.get()); m && send.connection == connection)
                found.push_back(*m);
        return found;
    }
    bool closed(ConnectionId connection) const {
        for (const auto& close : actions<server_action::Close>())
            if (close.connection == connection) return true;
        return false;
    }
    HostState state(const std::string& host) const {
        for (const auto& status : session.hosts())
            if (status.name == host) return status.state;
        return HostState::kAbsent;
    }
};

inline BlobInfo blobOf(std::string_view text) {
    return {blobIdOf(asBytes(text)), text.size()};
}

}  // namespace tessera

/// The server's session over real connections: bytes to events, actions to bytes.
#pragma once

#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "common/base/Blob.h"
#include "common/net/Platform.h"
#include "common/request/StatusRequests.h"
#include "common/session/ServerSession.h"
#include "common/tls/KeyRing.h"
#include "common/wall/Wall.h"

namespace tessera {

/// Of a server that starts, with this wall and epoch (journal/NextEpoch.h).
[[nodiscard]] ServerSessionConfig sessionConfigOf(const Wall& wall, Epoch epoch);

/// Owns transport and session. All members are for the frame thread; network events reach it through the `deliver`
/// function, which is called on the network thread (or here, in `attend`) and hands them over (a channel), and come
/// back by `handle`.
class Peers {
public:
    /// Of one connection: what has come and is not handled yet, and what waits to be sent. Above it nothing more is
    /// read from it, or nothing more of it is handled: a peer that asks faster than it listens waits for itself.
    static constexpr std::size_t kMaxUnhandledBytes = std::size_t{1} << 20;
    static constexpr std::size_t kMaxUnsentBytes = std::size_t{4} << 20;

    /// `keys`: the server's; null: no link is sealed. `onKeys`: what people should know of
    /// them, on a thread of theirs.
    Peers(ServerSessionConfig config, const BlobStore& blobs, std::function<void(LinkEvent)> deliver,
          const Platform& platform, std::shared_ptr<KeyRing> keys = nullptr,
          std::function<void(const std::string&)> onKeys = {});
    ~Peers();

    /// See Transport.
    [[nodiscard]] Expected<std::uint16_t> listen(const Address& address,
                                                 const std::function<void(std::uint16_t)>& onBound = {}) {
        return transport_->listen(address, onBound);
    }

    /// Waits for the network by doing its work: see Transport.
    [[nodiscard]] bool attend(TimePoint until) { return transport_->attend(until); }
    /// From any thread.
    void wake() { transport_->wake(); }

    /// What is left once sends and closes are done and blobs have been handed out (SessionActions).
    [[nodiscard]] ServerActions handle(const LinkEvent& event);
    [[nodiscard]] ServerActions advance(TimePoint now) { return perform(session_.advance(now)); }
    [[nodiscard]] ServerActions perform(ServerActions actions);

    /// Whether what this peer has said may be handled now.
    [[nodiscard]] bool mayServe(LinkId link) const { return transport_->queuedBytes(link) <= kMaxUnsentBytes; }
    /// A host's control connection, which frames wait for.
    [[nodiscard]] bool isHost(LinkId link) const { return session_.isHost(ConnectionId{link.value}); }
    /// Something that this peer has said waits for its turn: it is not silent, whenever its last word was handled.
    void waits(LinkId link, TimePoint now) { session_.heard(ConnectionId{link.value}, now); }

    [[nodiscard]] ServerSession& session() { return session_; }
    [[nodiscard]] const ServerSession& session() const { return session_; }
    /// Bytes on all links, and which keys end.
    void describe(answer::Status& status) const;
    [[nodiscard]] std::size_t connectionCount() const { return open_.size(); }
    [[nodiscard]] std::size_t hostCount() const;
    /// Of the other end; empty: it has gone.
    [[nodiscard]] std::string addressOf(ConnectionId connection) const;

private:
    [[nodiscard]] ServerActions received(const link_event::Received& received, TimePoint at);
    void send(ConnectionId connection, const MessagePtr& message);
    [[nodiscard]] message::BlobChunk chunkFor(const message::BlobRequest& request) const;

    const BlobStore& blobs_;
    const TimeSource& time_;
    std::shared_ptr<KeyRing> keys_;
    bool insecure_ = false;
    std::chrono::milliseconds heartbeat_;
    ServerSession session_;
    std::map<ConnectionId, std::string> open_;  ///< peers' addresses
    /// The message last encoded, so that one for everybody is encoded once.
    struct {
        MessagePtr message;
        SharedChain encoded;
    } last_;
    std::unique_ptr<Transport> transport_;  ///< last: its thread ends before the rest goes
};

}  // namespace tessera

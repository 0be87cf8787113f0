/// TLS for one connection, without its socket: bytes of the wire in and out, bytes of the program out and in.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>

#include "common/base/Bytes.h"
#include "common/tls/TlsContext.h"

namespace tessera {

/// One thread at a time. After an error nothing more is read.
class TlsChannel {
public:
    enum class Side { kAccepts, kDials };
    static constexpr std::byte kFirstByte{0x16};  ///< of whatever begins with a handshake; no message of ours does

    /// `target`: whom it dials; sessions are resumed by it.
    TlsChannel(std::shared_ptr<const TlsContext> context, Side side, std::string target = {});
    ~TlsChannel();
    TlsChannel(const TlsChannel&) = delete;
    TlsChannel& operator=(const TlsChannel&) = delete;

    /// Bytes from the peer. They are to stay where they are until the next `shake` or `read`, which `keep`s those that
    /// it does not come to.
    void arrived(ByteSpan wire);
    /// Goes on with the handshake: takes up to a millisecond of processor time. kRefused: the other side is not
    /// believed, which dialling again does not change; kNetwork: it does not speak TLS 1.3. What is to be sent is in
    /// `outgoing`, an alert too.
    [[nodiscard]] Expected<void> shake();
    [[nodiscard]] bool ready() const { return ready_; }
    /// Into `room`; returns how many bytes, zero: more have to arrive. kNetwork: they are no TLS, a message of TLS
    /// itself comes in pieces, or keys are changed more often than content asks for (64 messages of TLS itself are
    /// free, and one with each MiB).
    [[nodiscard]] Expected<std::size_t> read(std::span<std::byte> room);
    /// The peer has said that it sends nothing more.
    [[nodiscard]] bool peerEnded() const { return peerEnded_; }
    /// What has arrived and was not read is copied: its place may go.
    void keep();
    /// Once ready: seals bytes into `outgoing`. kNetwork: after what the peer has sent nothing more can be.
    [[nodiscard]] Expected<void> seal(ByteSpan bytes);
    /// Nothing more will be sealed: says so to the peer.
    void end();
    /// What is to be sent, in order. Whoever sends it takes it away.
    [[nodiscard]] Bytes& outgoing() { return outgoing_; }

    /// Once ready. None: it has shown no certificate.
    [[nodiscard]] const std::optional<Credential>& peer() const { return peer_; }
    /// Why the peer would not be let in by `context` now; empty: it would, or it has shown no certificate.
    [[nodiscard]] std::string faultNow(const TlsContext& context) const;
    [[nodiscard]] bool resumed() const;

private:
    friend struct TlsCallbacks;
    struct Impl;
    [[nodiscard]] Expected<void> judge();
    [[nodiscard]] Error faultOfHandshake() const;

    std::shared_ptr<const TlsContext> context_;
    Side side_;
    std::string target_;
    std::unique_ptr<Impl> impl_;
    ByteSpan incoming_;
    Bytes kept_;
    Bytes outgoing_;
    std::optional<Certificate> shown_;
    std::optional<Credential> peer_;
    std::string refusal_;  ///< why the other side's chain is not believed
    DateTime otherClock_{};
    bool ready_ = false, peerEnded_ = false, firstSeen_ = false, plain_ = false;
};

}  // namespace tessera

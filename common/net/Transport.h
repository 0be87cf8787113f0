/// Links that carry messages to other programs, whatever they are made of. TCP: TcpTransport.h. All that comes out of
/// them are events.
#pragma once

#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <variant>

#include "common/base/ByteSlice.h"
#include "common/base/Clock.h"
#include "common/base/Error.h"
#include "common/base/HistoryIds.h"
#include "common/base/Identity.h"
#include "common/base/SourceAddress.h"

namespace tessera {

class TlsContext;

using LinkId = StrongId<struct LinkIdTag>;

struct Address {
    std::string host;  ///< numeric IPv4, numeric IPv6 or a name
    std::uint16_t port = 0;
    [[nodiscard]] bool isLoopback() const;
};
/// "127.0.0.1:7000", "[::1]:7000", "wallhost:7000".
[[nodiscard]] Expected<Address> parseAddress(std::string_view text);
[[nodiscard]] std::string toString(const Address& address);

namespace link_event {
struct Opened {
    LinkId link;
    std::string peer;           ///< its address, for logs
    bool near = false;          ///< it is on this machine
    SourceAddress source = {};  ///< none: it was dialled
};
/// The link is sealed: from here on nobody else reads it or writes into it. Comes before whatever is received on it.
struct Secured {
    LinkId link;
    std::optional<Credential> peer;  ///< none: it has shown no certificate. Only who accepts is told of a fault in one
};
struct Received {
    LinkId link;
    std::uint16_t type = 0;
    Epoch epoch;
    ByteSlice payload;
};
/// Some bytes of a message that is not whole yet: the peer lives. At most one in `TransportLimits::heardEvery`.
struct Heard {
    LinkId link;
};
/// Always the last event of a link, once.
struct Closed {
    LinkId link;
    std::string reason;                    ///< for a person; closed by us: what `close` was given
    ErrorCode code = ErrorCode::kNetwork;  ///< kRefused: keys do not fit, and dialling again changes nothing
};
}  // namespace link_event

struct LinkEvent {
    TimePoint at;  ///< when the bytes arrived (steady clock)
    std::variant<link_event::Opened, link_event::Secured, link_event::Received, link_event::Heard, link_event::Closed>
        what;
};
[[nodiscard]] inline LinkId linkOf(const LinkEvent& event) {
    return std::visit([](const auto& what) { return what.link; }, event.what);
}

struct TransportLimits {
    std::size_t maxLinks = 1024;
    /// Accepted connections from which no whole message has come yet, or that we have closed and their peers have not.
    /// One of them gives way to a connection above this limit or `maxLinks`, or for which no descriptor is left. It is
    /// one of the address from which most of them are. Each has `patience` to speak, or to go, but where its address is
    /// crowded (`Crowd`). As many more wait to be let in; above that the oldest of the most crowded address is refused.
    std::size_t maxStrangers = 256;
    std::chrono::milliseconds patience{100};
    /// A connection that gives way or finds no room is sent this message, in epoch 0, as far as that takes no time.
    struct LastWord {
        std::uint16_t type = 0;
        SharedChain payload = {};  ///< none: nothing is sent
    } lastWord = {};
    std::size_t maxSendQueueBytes = std::size_t{1} << 30;  ///< per link; above it the link is closed as too slow
    /// Per link: bytes of messages that `onEvent` was given and that nobody has called `taken` for. Above it nothing
    /// more is read from the link, so that TCP holds its peer back. One message may exceed it. The default is for
    /// callers that take all at once.
    std::size_t maxUntakenBytes = std::numeric_limits<std::size_t>::max();
    std::chrono::milliseconds heardEvery{20};
    /// The keys as they are now. With it, dialled links are sealed (TLS 1.3). Accepted links are sealed where their
    /// peers begin so; the caller says which may come in plainly. Called on the network thread. Empty: nothing is
    /// sealed.
    std::function<std::shared_ptr<const TlsContext>()> tls = {};
    std::chrono::milliseconds handshakeTime{10'000};  ///< of a link that is sealed; then it is closed
    /// Called first on the thread inside, before it does anything. May be empty.
    std::function<void()> onThread = {};
    /// Largest payload for a message type; 0 refuses the type. Called on the network thread.
    std::function<std::size_t(std::uint16_t)> maxPayload;
};

/// All members may be called from any thread, from within `onEvent` too. `onEvent` must not block for long: nothing is
/// sent or received meanwhile. Frames of one thread to one link arrive in order, whole and as they were sent.
///
/// A thread that waits for events does the transport's work while it waits (`attend`).
class Transport {
public:
    Transport() = default;
    Transport(const Transport&) = delete;
    Transport& operator=(const Transport&) = delete;
    /// Sends what is queued (for at most a second) and closes everything; no event is delivered once it has begun. An
    /// `onEvent` that waits for room in a channel must be let go first (close the channel).
    virtual ~Transport() = default;

    /// Returns the bound port (for port 0). kNetwork: cannot bind, saying why.
    /// `onBound` is called with the port, which is ours, before anybody can connect. May be empty.
    [[nodiscard]] virtual Expected<std::uint16_t> listen(const Address& address,
                                                         const std::function<void(std::uint16_t)>& onBound) = 0;
    [[nodiscard]] Expected<std::uint16_t> listen(const Address& address) { return listen(address, {}); }
    /// Starts to connect; Opened or Closed follows within `timeout`.
    virtual LinkId connect(const Address& address, std::chrono::milliseconds timeout) = 0;
    /// Queues one frame, before Opened too. The payload is written from where it lies, so one payload may go to many
    /// links. A null payload is an empty one. Unknown and closed links are ignored. A link with more than
    /// `TransportLimits::maxSendQueueBytes` queued is closed.
    virtual void send(LinkId link, std::uint16_t type, Epoch epoch, SharedChain payload) = 0;
    void send(LinkId link, std::uint16_t type, Epoch epoch, ByteSlice payload) {
        send(link, type, epoch, share(ByteChain(std::move(payload))));
    }
    /// Sends this frame from now on, whenever nothing has been sent to this link for `interval`, whatever the caller's
    /// threads are at. The frame comes behind frames that the same thread has sent before. It is not sent while bytes
    /// wait to be sent.
    virtual void keepAlive(LinkId link, std::chrono::milliseconds interval, std::uint16_t type, Epoch epoch,
                           SharedChain payload) = 0;
    /// A message of so many payload bytes needs no room any more: see `TransportLimits::maxUntakenBytes`.
    virtual void taken(LinkId link, std::size_t payloadBytes) = 0;
    /// Sends what is queued, then closes; takes at most a second. `reason` comes back in Closed.
    virtual void close(LinkId link, std::string reason) = 0;
    /// Does the transport's work in the calling thread, until one of three things happens. An event has been delivered
    /// by anybody since the last call returned, `wake` has been called, or `until` has come. False at once: others do
    /// that work and have too much of it; wait for what `onEvent` does then. With a past `until` it does the work that
    /// is ready and returns. One thread at a time, not from within `onEvent`, which must not wait for this one.
    [[nodiscard]] virtual bool attend(TimePoint until) = 0;
    /// Ends the call of `attend` that is under way, or else the next one.
    virtual void wake() = 0;
    /// What destruction does, but `wake` may still be called. Not while somebody attends.
    virtual void end() = 0;
    /// The keys have changed: links whose peers would not be let in any more are closed. From any thread.
    virtual void judgeAgain() = 0;
    /// On all links so far, headers included.
    struct Traffic {
        std::uint64_t sent = 0, received = 0;       ///< bytes
        std::uint64_t handshakes = 0, resumed = 0;  ///< that ended well, and those of them that went on with a session
    };
    [[nodiscard]] virtual Traffic traffic() const = 0;
    /// Bytes waiting to be sent, headers included. Never waits.
    [[nodiscard]] virtual std::size_t queuedBytes(LinkId link) const = 0;
};

/// `limits.maxPayload` must be set.
using MakeTransport =
    std::function<std::unique_ptr<Transport>(TransportLimits limits, std::function<void(LinkEvent)> onEvent)>;

}  // namespace tessera

/// The inside of a TcpTransport. For TcpTransport.cpp and TcpTransportTls.cpp alone.
#pragma once

#include <fmt/format.h>
#include <sys/resource.h>

#include <array>
#include <atomic>
#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/write.hpp>
#include <thread>
#include <unordered_map>

#include "common/base/StartThread.h"
#include "common/net/FrameHeader.h"
#include "common/net/HandshakeTurns.h"
#include "common/net/LinkTable.h"
#include "common/net/NetworkThread.h"
#include "common/net/OwnAddress.h"
#include "common/net/Strangers.h"
#include "common/net/TcpTransport.h"
#include "common/net/TransportLink.h"

namespace tessera {
namespace transport {
namespace asio = boost::asio;
using boost::system::error_code;
using tcp = asio::ip::tcp;
using namespace std::chrono_literals;

constexpr auto kAcceptPause = 50ms;  ///< after a failed accept (no descriptors left): time for some to be closed
constexpr auto kFlushTime = 1s;      ///< for what is queued when a link is closed by us
constexpr int kBehindFrames = 10;    ///< niceness, of handshakes
constexpr std::size_t kWireBytes = std::size_t{256} << 10;  ///< read at a time of a sealed link
constexpr std::size_t kLarge = 64 * 1024;                   ///< a message that is work for a thread of its own
constexpr std::size_t kMessageCost = 256;                   ///< of a message that waits to be taken, beside its payload
constexpr std::size_t kWorthCaching = 64 * 1024;            ///< payloads whose checksum is kept for the next link

using LinkPtr = std::shared_ptr<TransportLink>;

inline std::string textOf(const tcp::endpoint& endpoint) {
    return toString(Address{endpoint.address().to_string(), endpoint.port()});
}

inline std::string reasonFor(const error_code& error, bool midFrame) {
    if (error == asio::error::eof)
        return midFrame ? "the peer closed the connection in the middle of a message"
                        : "the peer closed the connection";
    return fmt::format("the connection broke: {}", error.message());
}

}  // namespace transport

using namespace transport;

struct TcpTransport::Impl {
    Impl(TransportLimits l, std::function<void(LinkEvent)> f)
        : limits(std::move(l)), onEvent(std::move(f)), table(limits.maxLinks) {
        TESSERA_CHECK(limits.maxPayload != nullptr, "a transport needs to know how long messages may be");
        if (limits.tls) {
            wire.resize(kWireBytes);
            shaker = std::thread([this] {
                (void)::setpriority(PRIO_PROCESS, 0, kBehindFrames);  // Linux: of this thread
                while (!handshakesOver) {
                    if (const auto work = handshakes.tryPop())
                        (*work)();
                    else
                        handshakes.waitForNews();
                }
            });
        }
        try {
            thread.start(limits.onThread);
        } catch (...) {
            endHandshakes();
            throw;
        }
    }
    void endHandshakes() {
        handshakesOver = true;
        handshakes.close();
        if (shaker.joinable()) shaker.join();
    }

    /// Runs on any thread. When it is nobody's turn the caller writes, so that nobody needs to be woken for it.
    void send(LinkId id, std::uint16_t type, Epoch epoch, SharedChain payload) {
        const bool large = payload && payload->size() >= kLarge;
        if (!large && thread.tryHere([&] { queue(id, type, epoch, payload); })) return;
        thread.post([this, id, type, epoch, payload = std::move(payload)] { queue(id, type, epoch, payload); });
        if (large) thread.sendLarge();
    }

    // ---- all members below run on the network thread but those that say otherwise ----------------------------------

    static TimePoint now() { return std::chrono::steady_clock::now(); }

    void emit(decltype(LinkEvent::what) what, TimePoint at = now()) {
        if (ending) return;
        onEvent({at, std::move(what)});
        thread.delivered();
    }

    struct Listener {
        explicit Listener(asio::io_context& io) : acceptor(io), pause(io) {}
        tcp::acceptor acceptor;
        asio::steady_timer pause;
    };

    void accept(Listener& listener) {
        listener.acceptor.async_accept([this, &listener](const error_code& error, tcp::socket socket) {
            if (ending || error == asio::error::operation_aborted) return;
            if (!error) {
                come(std::move(socket));
                return accept(listener);
            }
            // It stays in the backlog, and trying again at once would only burn the processor.
            TimePoint due = now() + kAcceptPause;
            if (error == asio::error::no_descriptors && !strangers.waiting().empty()) {
                strangers.refuseOne();
                due = now();
            } else if (error == asio::error::no_descriptors && !strangers.empty()) {
                due = makeRoom();
            }
            listener.pause.expires_at(due);
            listener.pause.async_wait([this, &listener](const error_code& stopped) {
                if (!stopped) accept(listener);
            });
        });
    }
    /// Those who come are taken out of the backlog at once: in it one address would keep all others waiting.
    void come(tcp::socket socket) {
        error_code error;
        const tcp::endpoint peer = socket.remote_endpoint(error);
        if (error) return;  // it has gone already
        const SourceAddress from = sourceOf(*peer.data());
        if (strangers.waiting().countOf(from) == 0 && hasRoomFor(from)) return admit(std::move(socket), from);
        strangers.waiting().add(from, std::move(socket));
        if (strangers.tooManyWait()) strangers.refuseOne();
        look();
    }
    /// Makes room where others give way.
    bool hasRoomFor(SourceAddress from) {
        const auto isThere = [this] { return !strangers.full() && table.hasRoom(); };
        while (!isThere() && !strangers.empty()) {
            const LinkPtr goes = strangers.givesWayTo(from, now());
            if (!goes) return false;
            sendAway(goes);
        }
        return isThere();
    }
    void admit(tcp::socket socket, SourceAddress from) {
        const std::optional<LinkId> id = table.claim();
        if (!id) return strangers.sayLastWord(socket);  // another thread was quicker
        const auto link = std::make_shared<TransportLink>(*id, std::move(socket), limits);
        link->from = from;
        links.emplace(*id, link);
        strangers.add(link, now());
        open(link);
    }
    /// Whoever waits comes in, as far as there is room.
    void letIn() {
        auto& waiting = strangers.waiting();
        while (!waiting.empty() && hasRoomFor(waiting.turn())) {
            const SourceAddress from = waiting.turn();
            admit(waiting.takeTurn(), from);
        }
        // Where nobody is a stranger all links are in use, and nobody will give way.
        while (!waiting.empty() && strangers.empty()) strangers.refuseOne();
        look();
    }
    /// Looks for room again, once there may be some.
    void look() {
        if (strangers.waiting().empty()) return;
        const bool now = strangers.empty() || (!strangers.full() && table.hasRoom());
        entrance.expires_at(now ? Impl::now() : strangers.due());
        entrance.async_wait([this](const error_code& stopped) {
            if (!stopped && !ending) letIn();
        });
    }
    void sendAway(const LinkPtr& link) {
        strangers.sayLastWord(*link);
        finish(link, link->closeReason.empty() ? "others want in, and it has said nothing" : link->closeReason);
    }
    /// When to look for room again.
    TimePoint makeRoom() {
        const LinkPtr oldest = strangers.givesWay(now());
        if (!oldest) return strangers.due();
        sendAway(oldest);
        return now();
    }

    void open(const LinkPtr& link) {
        error_code ignored;
        link->socket.set_option(tcp::no_delay(true), ignored);
        link->socket.non_blocking(true, ignored);
        error_code error;
        const tcp::endpoint peer = link->socket.remote_endpoint(error);
        link->state = TransportLinkState::kOpen;
        link->timer.cancel();
        std::shared_ptr<const TlsContext> keys;
        if (limits.tls && !link->target.empty() && !(keys = limits.tls()))
            return finish(link, "there are no keys to dial with", ErrorCode::kRefused);
        // A program may choose from which of the machine's addresses it comes.
        const bool near = !error && isOwnAddress(peer.address().to_string());
        emit(link_event::Opened{link->id, error ? link->target : textOf(peer), near, link->from});
        if (keys) return seal(link, std::move(keys), TlsChannel::Side::kDials, {});
        read(link);
        write(link);
    }

    void dial(LinkId id, const Address& address, std::chrono::milliseconds timeout) {
        const auto link = std::make_shared<TransportLink>(id, tcp::socket(io), limits);
        link->target = toString(address);
        links.emplace(id, link);
        if (!table.holds(id))
            return finish(link, fmt::format("cannot connect to {}: {} connections are open already, which is the limit",
                                            link->target, limits.maxLinks));
        link->timer.expires_after(timeout);
        link->timer.async_wait([this, link, timeout](const error_code& error) {
            if (!error && link->state == TransportLinkState::kConnecting)
                finish(link, fmt::format("no answer from {} within {} ms", link->target, timeout.count()));
        });
        error_code notNumeric;
        const auto numeric = asio::ip::make_address(address.host, notNumeric);
        if (!notNumeric) return connectTo(link, std::array{tcp::endpoint(numeric, address.port)});
        // Asio resolves names on a thread of its own.
        const auto resolver = std::make_shared<tcp::resolver>(io);
        const auto found = [this, link, resolver](const error_code& error, const tcp::resolver::results_type& results) {
            if (link->state != TransportLinkState::kConnecting) return;
            if (error) return finish(link, fmt::format("cannot find {}: {}", link->target, error.message()));
            std::vector<tcp::endpoint> endpoints;
            for (const auto& entry : results) endpoints.push_back(entry.endpoint());
            connectTo(link, endpoints);
        };
        try {
            resolver->async_resolve(address.host, std::to_string(address.port), found);
        } catch (const std::exception&) {
            finish(link, fmt::format("cannot find {}: {}", link->target, kNoThread));
        }
    }

    template <typename Endpoints>
    void connectTo(const LinkPtr& link, const Endpoints& endpoints) {
        asio::async_connect(link->socket, endpoints, [this, link](const error_code& error, const tcp::endpoint&) {
            if (link->state != TransportLinkState::kConnecting) return;
            if (error) return finish(link, fmt::format("cannot connect to {}: {}", link->target, error.message()));
            open(link);
        });
    }

    void read(const LinkPtr& link) {
        if (link->sealed) return readSealed(link);
        const std::span<std::byte> room =
            link->state == TransportLinkState::kClosing ? std::span<std::byte>(discarded) : link->reader.room();
        link->socket.async_read_some(asio::buffer(room.data(), room.size()),
                                     [this, link](const error_code& error, std::size_t count) {
                                         const TimePoint now = std::chrono::steady_clock::now();
                                         if (link->state == TransportLinkState::kClosed) return;
                                         if (link->state == TransportLinkState::kClosing)
                                             return error ? finish(link, link->closeReason) : read(link);
                                         if (error) return finish(link, reasonFor(error, link->reader.midFrame()));
                                         received.fetch_add(count, std::memory_order_relaxed);
                                         if (!std::exchange(link->heard, true) && beginsSealed(link, count)) return;
                                         if (take(link, count, now)) read(link);
                                     });
    }

    /// Whether more may be read.
    bool take(const LinkPtr& link, std::size_t count, TimePoint arrived) {
        frames.clear();
        const Expected<void> good = link->reader.filled(count, frames);
        if (link->reader.arriving() >= kLarge) thread.seeLarge();
        std::size_t untaken = 0;
        for (ReceivedFrame& frame : frames) {
            untaken = table.handOut(link->id, costOf(frame.payload.size()));
            emit(link_event::Received{link->id, frame.type, frame.epoch, std::move(frame.payload)}, arrived);
        }
        if (!frames.empty()) {
            if (link->stranger) {
                strangers.forget(*link);
                look();
            }
            link->heardAt = arrived;
        } else if (arrived >= link->heardAt + limits.heardEvery) {
            link->heardAt = arrived;
            emit(link_event::Heard{link->id}, arrived);
        }
        if (!good) {
            finish(link, good.error().message);
            return false;
        }
        if (link->state == TransportLinkState::kClosed) return false;
        if (untaken <= limits.maxUntakenBytes) return true;
        table.rest(link->id, true);
        if (table.untaken(link->id) > limits.maxUntakenBytes / 2) return false;
        table.rest(link->id, false);  // it has been taken in between
        return true;
    }

    /// Reads a resting link again once half of what it may hold has been taken.
    void goOn(const LinkPtr& link) {
        if (!table.resting(link->id) || table.untaken(link->id) > limits.maxUntakenBytes / 2) return;
        table.rest(link->id, false);
        if (link->sealed)
            takeSealed(link, {}, now());
        else
            read(link);
    }

    /// A small message takes room beside its bytes.
    static std::size_t costOf(std::size_t payloadBytes) { return payloadBytes + kMessageCost; }

    void queue(LinkId id, std::uint16_t type, Epoch epoch, const SharedChain& payload) {
        const auto found = links.find(id);
        OutgoingFrame frame{{}, payload};
        if (found == links.end() || found->second->state == TransportLinkState::kClosing)
            return table.discharge(id, frame.bytes());
        frame.header = headerOf(type, epoch, payload);
        found->second->queue.push(std::move(frame));
        write(found->second);
    }

    /// One large payload for many links is hashed once.
    std::array<std::byte, FrameHeader::kBytes> headerOf(std::uint16_t type, Epoch epoch, const SharedChain& payload) {
        if (!payload || payload->size() < kWorthCaching)
            return encodeHeader(type, epoch, payload ? *payload : ByteChain());
        if (cached.type != type || cached.epoch != epoch || cached.payload.lock() != payload)
            cached = {type, epoch, payload, encodeHeader(type, epoch, *payload)};
        return cached.header;
    }

    void write(const LinkPtr& link) {
        using enum TransportLinkState;
        if (link->sealed) return writeSealed(link);
        if (link->queue.writing() || link->state == kConnecting || link->state == kClosed) return;
        while (!link->queue.empty()) {
            std::vector<asio::const_buffer> buffers;
            for (const ByteSpan piece : link->queue.next()) buffers.emplace_back(piece.data(), piece.size());
            // Nearly always all of it goes at once. What does not, and every error, is the reactor's.
            error_code laterAgain;
            std::size_t done = link->socket.write_some(buffers, laterAgain);
            sent.fetch_add(done, std::memory_order_relaxed);
            if (laterAgain || done < asio::buffer_size(buffers)) return writeRest(link, std::move(buffers), done);
            link->sentAt = now();
            table.discharge(link->id, link->queue.written());
        }
        if (link->state != TransportLinkState::kClosing) return;
        // The peer reads our last words and closes; closing first would take them away from it if anything of its own
        // were still unread here (TCP answers that with a reset).
        error_code ignored;
        link->socket.shutdown(tcp::socket::shutdown_send, ignored);
    }

    void writeRest(const LinkPtr& link, std::vector<asio::const_buffer> buffers, std::size_t done) {
        for (asio::const_buffer& buffer : buffers) {
            const std::size_t part = std::min(done, buffer.size());
            buffer += part;
            done -= part;
        }
        asio::async_write(link->socket, std::move(buffers), [this, link](const error_code& error, std::size_t bytes) {
            sent.fetch_add(bytes, std::memory_order_relaxed);
            if (link->state == TransportLinkState::kClosed) return;
            if (error)
                return finish(
                    link, link->state == TransportLinkState::kClosing ? link->closeReason : reasonFor(error, false));
            link->sentAt = now();
            table.discharge(link->id, link->queue.written());
            write(link);
        });
    }

    // ---- sealed links: TcpTransportTls.cpp
    // -----------------------------------------------------------------------------

    /// What comes first on an accepted link tells whether its peer seals it.
    bool beginsSealed(const LinkPtr& link, std::size_t count);
    void seal(const LinkPtr& link, std::shared_ptr<const TlsContext> keys, TlsChannel::Side side, ByteSpan first);
    /// Up to a millisecond of work, by a thread that no frame waits for. The channel is that thread's meanwhile.
    void shake(const LinkPtr& link, ByteSpan arrived);
    void shaken(const LinkPtr& link, const Expected<void>& good);
    void readSealed(const LinkPtr& link);
    void takeSealed(const LinkPtr& link, ByteSpan bytes, TimePoint arrived);
    void writeSealed(const LinkPtr& link);
    void writeSealedRest(const LinkPtr& link, std::size_t done);
    void wroteSealed(TransportLink& link);
    void judgeAgain();

    void keepAlive(LinkId id, TransportLink::KeepAlive beat) {
        const auto found = links.find(id);
        if (found == links.end()) return;
        pulseEvery = std::min(pulseEvery, std::max<Duration>(beat.interval / 2, 1ms));
        found->second->keepAlive = std::move(beat);
        if (!std::exchange(pulsing, true)) pulse();
    }

    void pulse() {
        pulseTimer.expires_after(pulseEvery);
        pulseTimer.async_wait([this](const error_code& error) {
            if (error || ending) return;
            const TimePoint at = now();
            bool any = false;
            for (const auto& [id, link] : links) {
                if (!link->keepAlive) continue;
                any = true;
                // Where bytes wait, the peer hears of us as soon as it can.
                if (link->state != TransportLinkState::kOpen || !link->queue.empty() ||
                    at < link->sentAt + link->keepAlive->interval)
                    continue;
                const TransportLink::KeepAlive& life = *link->keepAlive;
                // It is one of `links`, so it has a slot.
                static_cast<void>(table.charge(id, FrameHeader::kBytes + (life.payload ? life.payload->size() : 0)));
                queue(id, life.type, life.epoch, life.payload);
            }
            pulsing = any;
            if (any) pulse();
        });
    }

    void beginClose(const LinkPtr& link, std::string reason) {
        if (link->state == TransportLinkState::kConnecting) return finish(link, std::move(reason));
        if (link->state != TransportLinkState::kOpen) return;
        if (link->target.empty()) strangers.add(link, now());  // what it keeps may be wanted by another
        link->state = TransportLinkState::kClosing;
        link->closeReason = std::move(reason);
        if (table.resting(link->id)) {  // its end is read, whatever has not been taken
            table.rest(link->id, false);
            read(link);
        }
        link->timer.expires_after(kFlushTime);
        link->timer.async_wait([this, link](const error_code& error) {
            if (!error) finish(link, link->closeReason);
        });
        write(link);
    }

    void finish(const LinkPtr& link, std::string reason, ErrorCode code = ErrorCode::kNetwork) {
        if (link->state == TransportLinkState::kClosed) return;
        link->state = TransportLinkState::kClosed;
        strangers.forget(*link);
        link->timer.cancel();
        if (link->sealed) link->sealed->over = true;
        error_code ignored;
        link->socket.close(ignored);
        // The queue itself stays until the last handler lets go of the link: a write may still point into it.
        table.discharge(link->id, link->queue.bytes());
        table.release(link->id);
        links.erase(link->id);
        look();
        emit(link_event::Closed{link->id, std::move(reason), code});
        if (ending && links.empty()) io.stop();
    }

    void endAll() {
        ending = true;
        pulseTimer.cancel();
        entrance.cancel();
        for (const auto& listener : listeners) {
            error_code ignored;
            listener->acceptor.close(ignored);
            listener->pause.cancel();
        }
        if (links.empty()) return io.stop();
        std::vector<LinkPtr> all;
        for (const auto& [id, link] : links) all.push_back(link);
        for (const LinkPtr& link : all) beginClose(link, {});
    }

    /// Runs on the caller's thread.
    Expected<tcp::endpoint> resolveHere(const Address& address) {
        error_code error;
        const auto numeric = asio::ip::make_address(address.host, error);
        if (!error) return tcp::endpoint(numeric, address.port);
        tcp::resolver resolver(io);
        const auto found = resolver.resolve(address.host, std::to_string(address.port), error);
        if (error || found.empty())
            return fail(ErrorCode::kNetwork,
                        fmt::format("cannot listen on {}: {}", toString(address), error.message()));
        return found.begin()->endpoint();
    }

    struct CachedHeader {
        std::uint16_t type = 0;
        Epoch epoch;
        std::weak_ptr<const ByteChain> payload;
        std::array<std::byte, FrameHeader::kBytes> header{};
    };

    TransportLimits limits;
    std::function<void(LinkEvent)> onEvent;
    LinkTable table;
    NetworkThread thread;
    asio::io_context& io = thread.io();
    std::vector<std::unique_ptr<Listener>> listeners;
    std::unordered_map<LinkId, LinkPtr> links;
    Strangers strangers{limits};
    asio::steady_timer entrance{io};  ///< for who waits to be let in
    std::vector<ReceivedFrame> frames;
    std::array<std::byte, 4096> discarded;
    Bytes wire;  ///< what has just been read of a sealed link
    HandshakeTurns handshakes;
    std::atomic<std::size_t> waitingHandshakes{0};
    std::atomic<bool> handshakesOver{false};  ///< nobody needs handshakes any more
    std::thread shaker;
    CachedHeader cached;
    bool ending = false;

    std::atomic<std::uint64_t> sent{0}, received{0};   ///< bytes
    std::atomic<std::uint64_t> shakes{0}, resumed{0};  ///< handshakes that ended well
    asio::steady_timer pulseTimer{io};
    Duration pulseEvery = 1s;  ///< half the shortest interval in which anybody wants to be heard of
    bool pulsing = false;
};

}  // namespace tessera

/// The sealed links of a Transport: TLS 1.3 between its queues and its sockets.
#include "common/net/HungUp.h"
#include "common/net/TcpTransportImpl.h"

namespace tessera {
namespace {

std::string sealedReason(const TransportLink& link, const error_code& error) {
    if (link.sealed->channel.ready() || error != asio::error::eof) return reasonFor(error, link.reader.midFrame());
    return link.target.empty() ? "the peer left the handshake (TLS 1.3)"
                               : "the server ended the handshake (TLS 1.3): has it keys, and is it a Tessera?";
}

}  // namespace

bool TcpTransport::Impl::beginsSealed(const LinkPtr& link, std::size_t count) {
    const ByteSpan first = link->reader.room().first(count);
    if (!link->target.empty() || first.front() != TlsChannel::kFirstByte) return false;
    std::shared_ptr<const TlsContext> keys = limits.tls ? limits.tls() : nullptr;
    if (keys && keys->mayAccept())
        seal(link, std::move(keys), TlsChannel::Side::kAccepts, first);
    else
        finish(link, "the peer begins with TLS, and there are no keys here");
    return true;
}

void TcpTransport::Impl::seal(const LinkPtr& link, std::shared_ptr<const TlsContext> keys, TlsChannel::Side side,
                              ByteSpan first) {
    link->sealed = std::make_unique<SealedLink>(std::move(keys), side, link->target);
    link->timer.expires_after(limits.handshakeTime);
    link->timer.async_wait([this, link](const error_code& error) {
        if (error) return;
        finish(link, fmt::format("the handshake (TLS 1.3) took longer than {} ms", limits.handshakeTime.count()));
    });
    shake(link, first);
}

void TcpTransport::Impl::shake(const LinkPtr& link, ByteSpan arrived) {
    link->sealed->shaking = true;
    const int socket = link->socket.native_handle();
    const auto work = [this, link, socket, bytes = Bytes(arrived.begin(), arrived.end())] {
        // Who begins handshakes and goes costs no more than this look.
        --waitingHandshakes;
        if (link->sealed->over || hasHungUp(socket))
            return thread.post([this, link] { finish(link, "the peer left the handshake (TLS 1.3)"); });
        TlsChannel& channel = link->sealed->channel;
        channel.arrived(bytes);
        const Expected<void> good = channel.shake();
        channel.keep();
        thread.post([this, link, good] { shaken(link, good); });
    };
    const bool goesOn = std::exchange(link->sealed->begun, true) || !link->target.empty();
    if (waitingHandshakes >= limits.maxLinks) return finish(link, "too many handshakes are under way");
    ++waitingHandshakes;
    handshakes.push(link->from, goesOn, work);
}

void TcpTransport::Impl::shaken(const LinkPtr& link, const Expected<void>& good) {
    link->sealed->shaking = false;
    if (link->state == TransportLinkState::kClosed) return;
    // What it has waited for us is not its silence.
    if (link->stranger && link->state == TransportLinkState::kOpen) strangers.add(link, now());
    const TlsChannel& channel = link->sealed->channel;
    if (good && channel.ready() && link->state == TransportLinkState::kOpen) {
        link->timer.cancel();
        shakes.fetch_add(1, std::memory_order_relaxed);
        if (channel.resumed()) resumed.fetch_add(1, std::memory_order_relaxed);
        // The keys may have changed meanwhile.
        std::optional<Credential> peer = channel.peer();
        if (const auto keys = limits.tls(); keys && peer && peer->fault.empty()) peer->fault = channel.faultNow(*keys);
        emit(link_event::Secured{link->id, std::move(peer)});
    }
    write(link);  // an alert, too
    if (link->state == TransportLinkState::kClosed) return;
    if (!good) return finish(link, good.error().message, good.error().code);
    takeSealed(link, {}, now());
}

void TcpTransport::Impl::readSealed(const LinkPtr& link) {
    link->socket.async_wait(tcp::socket::wait_read, [this, link](const error_code& broken) {
        const TimePoint now = std::chrono::steady_clock::now();
        if (link->state == TransportLinkState::kClosed) return;
        error_code error = broken;
        const std::size_t count = error ? 0 : link->socket.read_some(asio::buffer(wire), error);
        if (error == asio::error::would_block) return readSealed(link);
        if (error && link->state == TransportLinkState::kClosing) return finish(link, link->closeReason);
        if (error) return finish(link, sealedReason(*link, error));
        link->heard = true;
        received.fetch_add(count, std::memory_order_relaxed);
        takeSealed(link, ByteSpan(wire).first(count), now);
    });
}
void TcpTransport::Impl::takeSealed(const LinkPtr& link, ByteSpan bytes, TimePoint arrived) {
    SealedLink& sealed = *link->sealed;
    if (!sealed.channel.ready()) return bytes.empty() ? readSealed(link) : shake(link, bytes);
    if (link->state == TransportLinkState::kClosing) return readSealed(link);
    sealed.channel.arrived(bytes);
    for (;;) {
        const Expected<std::size_t> count = sealed.channel.read(link->reader.room());
        if (!count) return finish(link, count.error().message, count.error().code);
        if (*count == 0) break;
        if (take(link, *count, arrived)) continue;
        if (link->state != TransportLinkState::kClosed) sealed.channel.keep();
        return;
    }
    if (sealed.channel.peerEnded()) return finish(link, reasonFor(asio::error::eof, link->reader.midFrame()));
    write(link);
    if (link->state != TransportLinkState::kClosed) readSealed(link);
}

void TcpTransport::Impl::writeSealed(const LinkPtr& link) {
    SealedLink& sealed = *link->sealed;
    if (sealed.shaking || sealed.writing || link->state == TransportLinkState::kClosed) return;
    for (;;) {
        if (sealed.channel.ready() && !sealed.ended) {
            if (const Expected<void> more = sealed.sealMore(link->queue); !more)
                return finish(link, more.error().message, more.error().code);
            if (link->state == TransportLinkState::kClosing && link->queue.empty()) {
                sealed.ended = true;
                sealed.channel.end();
            }
        }
        sealed.out.swap(sealed.channel.outgoing());
        if (sealed.out.empty()) break;
        error_code laterAgain;
        const std::size_t done = link->socket.write_some(asio::buffer(sealed.out), laterAgain);
        sent.fetch_add(done, std::memory_order_relaxed);
        if (laterAgain || done < sealed.out.size()) return writeSealedRest(link, done);
        wroteSealed(*link);
    }
    // What has nothing to say and has not begun is over.
    if (link->state == TransportLinkState::kClosing && !sealed.channel.ready() && link->queue.empty())
        return finish(link, link->closeReason);
    error_code ignored;
    if (sealed.ended) link->socket.shutdown(tcp::socket::shutdown_send, ignored);
}
void TcpTransport::Impl::writeSealedRest(const LinkPtr& link, std::size_t done) {
    link->sealed->writing = true;
    asio::async_write(link->socket, asio::buffer(link->sealed->out) + done,
                      [this, link](const error_code& error, std::size_t bytes) {
                          sent.fetch_add(bytes, std::memory_order_relaxed);
                          link->sealed->writing = false;
                          if (link->state == TransportLinkState::kClosed) return;
                          const bool closing = link->state == TransportLinkState::kClosing;
                          if (error) return finish(link, closing ? link->closeReason : reasonFor(error, false));
                          wroteSealed(*link);
                          writeSealed(link);
                      });
}
void TcpTransport::Impl::wroteSealed(TransportLink& link) {
    link.sealed->out.clear();
    link.sentAt = now();
    if (link.queue.writing() && link.sealed->drained()) table.discharge(link.id, link.queue.written());
}

void TcpTransport::Impl::judgeAgain() {
    const std::shared_ptr<const TlsContext> keys = limits.tls ? limits.tls() : nullptr;
    if (!keys) return;
    std::vector<LinkPtr> sealed;
    for (const auto& [id, link] : links)
        if (link->sealed && !link->sealed->shaking) sealed.push_back(link);
    for (const LinkPtr& link : sealed)
        if (std::string fault = link->sealed->channel.faultNow(*keys); !fault.empty())
            finish(link, std::move(fault), ErrorCode::kRefused);
}

}  // namespace tessera

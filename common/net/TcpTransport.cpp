#include "common/net/TcpTransport.h"

#include "common/net/PortHolder.h"
#include "common/net/TcpTransportImpl.h"

namespace tessera {

TcpTransport::TcpTransport(TransportLimits limits, std::function<void(LinkEvent)> onEvent)
    : impl_(std::make_unique<Impl>(std::move(limits), std::move(onEvent))) {}

TcpTransport::~TcpTransport() {
    end();
}

void TcpTransport::end() {
    if (!impl_->thread.joinable()) return;
    asio::post(impl_->io, [impl = impl_.get()] { impl->endAll(); });
    impl_->thread.join();
    impl_->endHandshakes();
}

bool TcpTransport::attend(TimePoint until) {
    return impl_->thread.attend(until);
}

void TcpTransport::wake() {
    impl_->thread.wake();
}

Expected<std::uint16_t> TcpTransport::listen(const Address& address,
                                             const std::function<void(std::uint16_t)>& onBound) {
    const Expected<tcp::endpoint> endpoint = impl_->resolveHere(address);
    if (!endpoint) return tl::unexpected(endpoint.error());
    auto listener = std::make_unique<Impl::Listener>(impl_->io);
    error_code error;
    listener->acceptor.open(endpoint->protocol(), error);
    if (!error) listener->acceptor.set_option(tcp::acceptor::reuse_address(endpoint->port() != 0), error);
    if (!error) listener->acceptor.bind(*endpoint, error);
    if (!error && onBound) onBound(listener->acceptor.local_endpoint(error).port());
    if (!error) listener->acceptor.listen(asio::socket_base::max_listen_connections, error);
    if (!error) listener->acceptor.set_option(tcp::acceptor::reuse_address(true), error);  // two could pick one before
    if (error == asio::error::address_in_use) {
        const std::string holder = holderOfPort(address.port);
        return fail(ErrorCode::kNetwork,
                    fmt::format("cannot listen on {}: {}; end it, or take another port (0 picks a free one)",
                                toString(address), holder.empty() ? error.message() : "it is held by " + holder));
    }
    if (error)
        return fail(ErrorCode::kNetwork, fmt::format("cannot listen on {}: {}", toString(address), error.message()));
    const std::uint16_t port = listener->acceptor.local_endpoint(error).port();
    impl_->thread.post([impl = impl_.get(), listener = std::move(listener)]() mutable {
        if (impl->ending) return;
        impl->listeners.push_back(std::move(listener));
        impl->accept(*impl->listeners.back());
    });
    return port;
}

LinkId TcpTransport::connect(const Address& address, std::chrono::milliseconds timeout) {
    const std::optional<LinkId> claimed = impl_->table.claim();
    const LinkId id = claimed ? *claimed : impl_->table.stillborn();
    impl_->thread.post([impl = impl_.get(), id, address, timeout] { impl->dial(id, address, timeout); });
    return id;
}

void TcpTransport::send(LinkId link, std::uint16_t type, Epoch epoch, SharedChain payload) {
    const std::size_t bytes = FrameHeader::kBytes + (payload ? payload->size() : 0);
    const std::optional<std::size_t> queued = impl_->table.charge(link, bytes);
    if (!queued) return;
    if (*queued > impl_->limits.maxSendQueueBytes) {
        impl_->table.discharge(link, bytes);
        impl_->thread.post([impl = impl_.get(), link, waiting = *queued - bytes] {
            if (const auto found = impl->links.find(link); found != impl->links.end())
                impl->finish(LinkPtr(found->second),
                             fmt::format("the peer reads too slowly: {} bytes wait for it and at most {} may", waiting,
                                         impl->limits.maxSendQueueBytes));
        });
        return;
    }
    impl_->send(link, type, epoch, std::move(payload));
}

void TcpTransport::keepAlive(LinkId link, std::chrono::milliseconds interval, std::uint16_t type, Epoch epoch,
                             SharedChain payload) {
    impl_->thread.post([impl = impl_.get(), link,
                        wanted = TransportLink::KeepAlive{interval, type, epoch, std::move(payload)}]() mutable {
        impl->keepAlive(link, std::move(wanted));
    });
}

void TcpTransport::taken(LinkId link, std::size_t payloadBytes) {
    const std::size_t left = impl_->table.take(link, Impl::costOf(payloadBytes));
    if (!impl_->table.resting(link) || left > impl_->limits.maxUntakenBytes / 2) return;
    impl_->thread.post([impl = impl_.get(), link] {
        if (const auto found = impl->links.find(link); found != impl->links.end()) impl->goOn(LinkPtr(found->second));
    });
}

void TcpTransport::close(LinkId link, std::string reason) {
    impl_->thread.post([impl = impl_.get(), link, reason = std::move(reason)]() mutable {
        if (const auto found = impl->links.find(link); found != impl->links.end())
            impl->beginClose(LinkPtr(found->second), std::move(reason));
    });
}

void TcpTransport::judgeAgain() {
    impl_->thread.post([impl = impl_.get()] { impl->judgeAgain(); });
}

Transport::Traffic TcpTransport::traffic() const {
    const auto read = [](const std::atomic<std::uint64_t>& count) { return count.load(std::memory_order_relaxed); };
    return {read(impl_->sent), read(impl_->received), read(impl_->shakes), read(impl_->resumed)};
}

std::size_t TcpTransport::queuedBytes(LinkId link) const {
    return impl_->table.queued(link);
}

}  // namespace tessera

/// Messages over TCP (Boost.Asio, epoll). Threads: one network thread inside, which rests while a caller that would
/// only wait does its work.
#pragma once

#include "common/net/Transport.h"

namespace tessera {

/// Owns the network thread, on which `onEvent` is called.
///
/// A thread that waits for events may be the network thread while it waits (`attend`). Then an arriving message wakes
/// one thread, not two, and its answer goes out at once. The thread inside takes over when the caller is away for
/// longer than `kAbsence`. It also takes over while much is sent or received, which is better done beside the caller's
/// work. Where nobody attends, it does everything.
///
/// Destruction joins the thread.
class TcpTransport final : public Transport {
public:
    static constexpr auto kAbsence = std::chrono::milliseconds(5);
    static constexpr auto kQuiet = std::chrono::milliseconds(100);  ///< after the last large message

    /// `limits.maxPayload` must be set.
    TcpTransport(TransportLimits limits, std::function<void(LinkEvent)> onEvent);
    ~TcpTransport() override;
    [[nodiscard]] static std::unique_ptr<Transport> make(TransportLimits limits,
                                                         std::function<void(LinkEvent)> onEvent) {
        return std::make_unique<TcpTransport>(std::move(limits), std::move(onEvent));
    }

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
    [[nodiscard]] bool attend(TimePoint until) override;
    void wake() override;
    void end() override;
    void judgeAgain() override;
    [[nodiscard]] Traffic traffic() const override;
    [[nodiscard]] std::size_t queuedBytes(LinkId link) const override;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace tessera

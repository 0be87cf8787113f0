/// Others' protocols over the machine's sockets. Threads: one inside, which calls all handlers.
#pragma once

#include "common/net/Feeds.h"

namespace tessera {

class SocketFeeds final : public Feeds {
public:
    SocketFeeds();
    ~SocketFeeds() override;
    [[nodiscard]] static std::unique_ptr<Feeds> make() { return std::make_unique<SocketFeeds>(); }

    [[nodiscard]] Expected<std::uint16_t> listen(const Address& address,
                                                 std::function<void(const Datagram&)> onDatagram) override;
    void dial(const Address& address, Stream stream) override;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace tessera

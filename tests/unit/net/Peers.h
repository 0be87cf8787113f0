/// What the tests of the network share: a transport that keeps its events, and a bare socket that can say anything.
#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <vector>

#include "common/base/Channel.h"
#include "common/net/FrameHeader.h"
#include "common/net/TcpTransport.h"

namespace tessera::test {

inline constexpr std::chrono::seconds kPatience{20};

inline Bytes pattern(std::size_t size, unsigned seed = 1) {
    Bytes bytes(size);
    for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::byte>((i * 2654435761u + seed * 97u) >> 7);
    return bytes;
}

/// A transport and the events that came out of it.
class Peer {
public:
    explicit Peer(TransportLimits limits = {})
        : events_(1 << 20),
          transport_(fill(std::move(limits)), [this](LinkEvent e) { events_.tryPush(std::move(e)); }) {}

    Transport& operator*() { return transport_; }
    Transport* operator->() { return &transport_; }

    std::uint16_t listen(const std::string& host = "127.0.0.1") {
        const auto port = transport_.listen({host, 0});
        EXPECT_TRUE(port) << (port ? "" : port.error().message);
        return port.value_or(0);
    }
    /// The next event of this kind; others are dropped on the way. Fails the test after kPatience.
    template <typename What>
    What next() {
        const auto end = std::chrono::steady_clock::now() + kPatience;
        while (std::chrono::steady_clock::now() < end) {
            auto event = events_.popFor(std::chrono::milliseconds(100));
            if (event && std::holds_alternative<What>(event->what)) return std::get<What>(event->what);
        }
        ADD_FAILURE() << "an expected event did not come";
        return {};
    }
    std::optional<LinkEvent> any(std::chrono::milliseconds within) { return events_.popFor(within); }

private:
    static TransportLimits fill(TransportLimits limits) {
        if (!limits.maxPayload)
            limits.maxPayload = [](std::uint16_t type) { return type < 100 ? std::size_t{64} << 20 : 0; };
        return limits;
    }
    Channel<LinkEvent> events_;
    TcpTransport transport_;
};

/// A TCP connection without any of our code behind it.
class BareSocket {
public:
    /// `from`: one of loopback's addresses.
    explicit BareSocket(std::uint16_t port, const char* from = "127.0.0.1") : fd_(::socket(AF_INET, SOCK_STREAM, 0)) {
        sockaddr_in own{};
        own.sin_family = AF_INET;
        EXPECT_EQ(inet_pton(AF_INET, from, &own.sin_addr), 1);
        EXPECT_EQ(::bind(fd_, reinterpret_cast<sockaddr*>(&own), sizeof own), 0);
        sockaddr_in address{};
        address.sin_family = AF_INET;
        address.sin_port = htons(port);
        address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        timeval patience{20, 0};
        ::setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
        EXPECT_EQ(::connect(fd_, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    }
    BareSocket(BareSocket&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
    ~BareSocket() {
        if (fd_ >= 0) ::close(fd_);
    }
    void say(ByteSpan bytes) {
        while (!bytes.empty()) {
            const ssize_t n = ::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
            if (n <= 0) return;
            bytes = bytes.subspan(static_cast<std::size_t>(n));
        }
    }
    void say(std::string_view text) { say(asBytes(text)); }
    /// Everything up to the other side's end.
    Bytes hear() {
        Bytes all;
        std::array<std::byte, 65536> part;
        for (;;) {
            const ssize_t n = ::recv(fd_, part.data(), part.size(), 0);
            if (n <= 0) return all;
            all.insert(all.end(), part.begin(), part.begin() + n);
        }
    }
    void closeNow() {
        ::close(fd_);
        fd_ = -1;
    }

private:
    int fd_;
};

inline Bytes frameBytes(std::uint16_t type, ByteSpan payload, Epoch epoch = {}) {
    const auto header = encodeHeader(type, epoch, ByteSlice(Bytes(payload.begin(), payload.end())));
    Bytes all(header.size() + payload.size());
    std::memcpy(all.data(), header.data(), header.size());
    if (!payload.empty()) std::memcpy(all.data() + header.size(), payload.data(), payload.size());
    return all;
}

}  // namespace tessera::test

/// A browser or program at a door, over TLS or without: by hand, so that it may stop anywhere.
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "common/tls/TlsChannel.h"

namespace tessera::test {

class SealedPeer {
public:
    using Clock = std::chrono::steady_clock;
    static constexpr std::chrono::seconds kPatience{20};

    explicit SealedPeer(std::uint16_t port) : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
        sockaddr_in to{};
        to.sin_family = AF_INET;
        to.sin_port = htons(port);
        to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        connected_ = ::connect(socket_, reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0;
    }
    SealedPeer(std::uint16_t port, std::shared_ptr<const TlsContext> keys) : SealedPeer(port) {
        channel_ = std::make_unique<TlsChannel>(std::move(keys), TlsChannel::Side::kDials);
        while (connected_ && !channel_->ready()) {
            const Expected<void> good = channel_->shake();
            if (!good) fault_ = good.error().message;
            push();
            if (!good || (!channel_->ready() && !pull(kPatience))) return;
        }
    }
    ~SealedPeer() { ::close(socket_); }
    SealedPeer(const SealedPeer&) = delete;
    SealedPeer& operator=(const SealedPeer&) = delete;

    [[nodiscard]] bool ready() const { return channel_ && channel_->ready(); }
    [[nodiscard]] const std::string& fault() const { return fault_; }
    void sayPlain(std::string_view text) const { (void)::send(socket_, text.data(), text.size(), MSG_NOSIGNAL); }
    void say(std::string_view text) {
        if (!channel_) return sayPlain(text);
        EXPECT_TRUE(channel_->seal(std::as_bytes(std::span(text))));
        push();
    }
    /// All that has been heard, once `mark` is in it; what is there where it does not come.
    std::string hear(std::string_view mark, std::chrono::milliseconds patience = kPatience) {
        const Clock::time_point until = Clock::now() + patience;
        take();  // what came with the end of the handshake
        while (heard_.find(mark) == std::string::npos && Clock::now() < until) {
            if (!pull(std::chrono::duration_cast<std::chrono::milliseconds>(until - Clock::now()))) break;
            take();
        }
        return heard_;
    }
    void forget() { heard_.clear(); }
    /// How long it takes until the door closes; none: it does not.
    std::optional<std::chrono::milliseconds> closes(std::chrono::milliseconds patience = kPatience) {
        const Clock::time_point from = Clock::now();
        while (!over_ && Clock::now() < from + patience) {
            pull(std::chrono::duration_cast<std::chrono::milliseconds>(from + patience - Clock::now()));
            if (ready() || !channel_) take();
        }
        if (!over_) return std::nullopt;
        return std::chrono::duration_cast<std::chrono::milliseconds>(Clock::now() - from);
    }
    [[nodiscard]] const std::string& heard() const { return heard_; }

private:
    void push() {
        Bytes& out = channel_->outgoing();
        for (std::size_t at = 0; at < out.size();) {
            const ssize_t count = ::send(socket_, out.data() + at, out.size() - at, MSG_NOSIGNAL);
            if (count <= 0) break;
            at += static_cast<std::size_t>(count);
        }
        out.clear();
    }
    /// False: nothing came, or it is over.
    bool pull(std::chrono::milliseconds patience) {
        pollfd wait{socket_, POLLIN, 0};
        if (over_ || ::poll(&wait, 1, static_cast<int>(patience.count())) <= 0) return false;
        const ssize_t count = ::recv(socket_, wire_.data(), wire_.size(), 0);
        over_ = count <= 0;
        if (over_) return false;
        const ByteSpan came = std::as_bytes(std::span(wire_)).first(static_cast<std::size_t>(count));
        if (channel_) {
            channel_->arrived(came);
            channel_->keep();
        } else {
            heard_.append(wire_.data(), static_cast<std::size_t>(count));
        }
        return true;
    }
    void take() {
        if (!channel_) return;
        std::array<char, 4096> room{};
        for (;;) {
            const Expected<std::size_t> count = channel_->read(std::as_writable_bytes(std::span(room)));
            if (!count || *count == 0) break;
            heard_.append(room.data(), *count);
        }
        channel_->keep();
    }

    int socket_ = -1;
    bool connected_ = false, over_ = false;
    std::unique_ptr<TlsChannel> channel_;
    std::string heard_, fault_;
    std::array<char, 16384> wire_{};
};

}  // namespace tessera::test

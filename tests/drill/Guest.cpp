#include "tests/drill/Guest.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <csignal>
#include <thread>

#include "common/access/LocalWalls.h"
#include "common/codec/ApplicationCodec.h"
#include "common/codec/MessageCodec.h"
#include "common/net/FrameHeader.h"
#include "common/net/Transport.h"
#include "common/scene/FieldTable.h"
#include "tests/drill/Crowd.h"
#include "tests/integration/MessageBytes.h"

namespace tessera::drill {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

volatile std::sig_atomic_t over = 0;

/// An application's control connection, byte by byte.
class GuestLink {
public:
    GuestLink(const std::string& address, bool follows, int receiveBytes = 0) {
        socket_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
        if (receiveBytes > 0) setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &receiveBytes, sizeof receiveBytes);
        const auto parsed = parseAddress(address);
        sockaddr_in to{};
        to.sin_family = AF_INET;
        to.sin_port = htons(parsed ? parsed->port : 0);
        inet_pton(AF_INET, parsed ? parsed->host.c_str() : "", &to.sin_addr);
        open_ = connect(socket_, reinterpret_cast<sockaddr*>(&to), sizeof to) == 0;
        const message::Hello hello{.schema = schemaHash(),
                                   .role = PeerRole::kApplication,
                                   .name = "guest",
                                   .wantBlobs = false,
                                   .follows = follows,
                                   .access = parsed ? accessTo(*parsed).value_or("") : ""};
        const Bytes bytes = test::messageBytes({}, hello);
        out_.insert(out_.end(), bytes.begin(), bytes.end());
    }
    ~GuestLink() { close(socket_); }
    GuestLink(const GuestLink&) = delete;
    GuestLink& operator=(const GuestLink&) = delete;

    [[nodiscard]] bool open() const { return open_; }
    [[nodiscard]] std::size_t unsent() const { return out_.size() - sent_; }
    [[nodiscard]] std::uint64_t replies() const { return replies_; }
    /// Only once the server has said in which epoch.
    [[nodiscard]] bool mayTalk() const { return epoch_.value != 0; }
    void say(const Message& message) {
        const Bytes bytes = test::messageBytes(epoch_, message);
        out_.insert(out_.end(), bytes.begin(), bytes.end());
    }

    /// Sends what it can, and reads at most `budget` bytes; waits for either for at most `wait`.
    void move(std::size_t budget, std::chrono::milliseconds wait) {
        if (mayTalk() && Clock::now() >= nextHeartbeat_) {
            say(message::Heartbeat{});
            nextHeartbeat_ = Clock::now() + 500ms;
        }
        const auto events = static_cast<short>((unsent() > 0 ? POLLOUT : 0) | (budget > 0 ? POLLIN : 0));
        pollfd handle{.fd = socket_, .events = events, .revents = 0};
        if (::poll(&handle, 1, static_cast<int>(wait.count())) <= 0) return;
        if (handle.revents & POLLOUT) {
            const ssize_t n = send(socket_, out_.data() + sent_, unsent(), MSG_NOSIGNAL | MSG_DONTWAIT);
            open_ = open_ && (n >= 0 || errno == EAGAIN);
            sent_ += static_cast<std::size_t>(std::max<ssize_t>(0, n));
            if (unsent() == 0) out_.clear(), sent_ = 0;
        }
        if ((handle.revents & (POLLERR | POLLHUP)) && budget == 0) open_ = false;
        if (!(handle.revents & (POLLIN | POLLERR | POLLHUP)) || budget == 0) return;
        std::array<std::byte, 65536> buffer;
        const ssize_t n = recv(socket_, buffer.data(), std::min(budget, buffer.size()), MSG_DONTWAIT);
        open_ = open_ && (n > 0 || (n < 0 && errno == EAGAIN));
        if (n > 0) read(ByteSpan(buffer).first(static_cast<std::size_t>(n)));
    }

private:
    /// Counts replies; skips the rest.
    void read(ByteSpan bytes) {
        static const std::uint16_t reply = wireType(Message(message::Reply{}));
        while (!bytes.empty()) {
            if (skip_ > 0) {
                const std::size_t n = std::min(skip_, bytes.size());
                skip_ -= n;
                bytes = bytes.subspan(n);
                continue;
            }
            const std::size_t n = std::min(header_.size() - headed_, bytes.size());
            std::copy_n(bytes.begin(), n, header_.begin() + static_cast<std::ptrdiff_t>(headed_));
            headed_ += n;
            bytes = bytes.subspan(n);
            if (headed_ < header_.size()) return;
            headed_ = 0;
            const auto header = decodeHeader(header_);
            if (!header) {
                open_ = false;
                return;
            }
            epoch_ = header->epoch;
            skip_ = header->payloadBytes;
            replies_ += header->type == reply ? 1 : 0;
        }
    }

    int socket_ = -1;
    bool open_ = false;
    Bytes out_;
    std::size_t sent_ = 0, skip_ = 0, headed_ = 0;
    std::array<std::byte, FrameHeader::kBytes> header_{};
    std::uint64_t replies_ = 0;
    Epoch epoch_;
    Clock::time_point nextHeartbeat_ = Clock::now();
};

/// As fast as it is answered, so many questions ahead.
std::uint64_t askOn(const std::string& address, const ApplicationRequest& question) {
    constexpr std::uint64_t kAhead = 64;
    GuestLink link(address, false);
    const ByteSlice body = share(encodeRequest(question));
    std::uint64_t asked = 0;
    while (!over && link.open()) {
        while (link.mayTalk() && asked < link.replies() + kAhead && link.unsent() < 65536)
            link.say(message::Request{++asked, body});
        link.move(65536, 100ms);
    }
    return link.replies();
}

/// Returns how often it had to come again.
std::uint64_t readSlowly(const std::string& address, std::size_t bytesAtOnce) {
    constexpr int kSmallBuffer = 16 * 1024;
    std::uint64_t times = 0;
    while (!over) {
        GuestLink link(address, true, kSmallBuffer);
        while (!over && link.open()) {
            link.move(link.mayTalk() ? bytesAtOnce : FrameHeader::kBytes, 100ms);
            std::this_thread::sleep_for(100ms);
        }
        ++times;
    }
    return times;
}

}  // namespace

int runGuest(const std::string& kind, const std::string& address) {
    struct sigaction action {};
    action.sa_handler = [](int) { over = 1; };
    sigaction(SIGTERM, &action, nullptr);
    if (kind == "crowd") {
        CrowdCount count;
        if (!standAround(address, over, count)) return 3;
        fmt::print("{} stood at most, {} came, {} were closed, {} failed\n", count.most, count.came, count.closed,
                   count.failed);
        return 0;
    }
    std::uint64_t answered = 0;
    if (kind == "status")
        answered = askOn(address, request::GetStatus{});
    else if (kind == "picks")
        answered = askOn(address, request::PickAt{{.xPx = 800, .yPx = 500, .wand = {}}});
    else if (kind == "images")
        answered = askOn(address, request::GetImages{});
    else if (kind == "tree")
        answered = askOn(address, request::GetTree{});
    else if (kind == "slow")
        answered = readSlowly(address, 6'400);
    else if (kind == "silent")
        answered = readSlowly(address, 0);
    else
        return 2;
    fmt::print("answered {}\n", answered);
    return 0;
}

}  // namespace tessera::drill

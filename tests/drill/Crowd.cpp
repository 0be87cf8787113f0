#include "tests/drill/Crowd.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/epoll.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <vector>

#include "common/base/Bytes.h"
#include "common/net/Transport.h"

namespace tessera::drill {
namespace {

/// A record of TLS that says 512 bytes and brings 43: a ClientHello up to its random number (RFC 8446, 4.1.2).
Bytes halfAClientHello() {
    constexpr std::array<unsigned char, 11> kHead = {0x16, 3, 1, 2, 0, 1, 0, 1, 0xfc, 3, 3};
    Bytes bytes(kHead.size() + 32, std::byte{0x5a});
    std::ranges::transform(kHead, bytes.begin(), [](unsigned char c) { return std::byte{c}; });
    return bytes;
}

class Crowd {
public:
    Crowd(const Address& address, CrowdCount& count) : count_(count), epoll_(epoll_create1(EPOLL_CLOEXEC)) {
        to_.sin_family = AF_INET;
        to_.sin_port = htons(address.port);
        inet_pton(AF_INET, address.host.c_str(), &to_.sin_addr);
    }
    ~Crowd() {
        for (const Place& place : places_)
            if (place.socket >= 0) ::close(place.socket);
        ::close(epoll_);
    }
    Crowd(const Crowd&) = delete;
    Crowd& operator=(const Crowd&) = delete;

    void stand(const volatile std::sig_atomic_t& over) {
        std::vector<epoll_event> events(1024);
        while (!over) {
            for (std::size_t i = 0; i < places_.size() && !over; ++i)
                if (places_[i].socket < 0) dial(i);
            const int ready = epoll_wait(epoll_, events.data(), static_cast<int>(events.size()), 20);
            for (int i = 0; i < ready; ++i) hear(events[static_cast<std::size_t>(i)]);
        }
    }

private:
    struct Place {
        int socket = -1;
        bool open = false;
    };

    void dial(std::size_t i) {
        const int socket = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
        if (socket < 0) return void(++count_.failed);
        if (::connect(socket, reinterpret_cast<const sockaddr*>(&to_), sizeof to_) != 0 && errno != EINPROGRESS) {
            ::close(socket);
            ++count_.failed;
            return;
        }
        places_[i] = {.socket = socket, .open = false};
        epoll_event event{.events = EPOLLOUT, .data = {.u64 = i}};
        epoll_ctl(epoll_, EPOLL_CTL_ADD, socket, &event);
    }

    void hear(const epoll_event& event) {
        Place& place = places_[event.data.u64];
        if ((event.events & (EPOLLERR | EPOLLHUP)) == 0 && !place.open) return opened(event.data.u64);
        std::array<char, 4096> last{};
        // It has been told something, at most: only the end counts.
        if ((event.events & (EPOLLERR | EPOLLHUP)) == 0 && ::recv(place.socket, last.data(), last.size(), 0) > 0)
            return;
        ::close(place.socket);
        ++(place.open ? count_.closed : count_.failed);
        standing_ -= place.open ? 1 : 0;
        place = {};
    }

    void opened(std::size_t i) {
        places_[i].open = true;
        epoll_event event{.events = EPOLLIN | EPOLLRDHUP, .data = {.u64 = i}};
        epoll_ctl(epoll_, EPOLL_CTL_MOD, places_[i].socket, &event);
        if (i % 2 == 1) (void)!::send(places_[i].socket, hello_.data(), hello_.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
        ++count_.came;
        count_.most = std::max(count_.most, ++standing_);
    }

    CrowdCount& count_;
    const Bytes hello_ = halfAClientHello();
    sockaddr_in to_{};
    int epoll_ = -1;
    std::vector<Place> places_ = std::vector<Place>(kCrowd);
    std::uint64_t standing_ = 0;
};

}  // namespace

bool standAround(const std::string& address, const volatile std::sig_atomic_t& over, CrowdCount& count) {
    const rlimit wanted{.rlim_cur = kCrowd + 64, .rlim_max = kCrowd + 64};
    rlimit has{};
    const auto parsed = parseAddress(address);
    if (!parsed || getrlimit(RLIMIT_NOFILE, &has) != 0) return false;
    if (has.rlim_cur < wanted.rlim_cur && setrlimit(RLIMIT_NOFILE, &wanted) != 0) return false;
    Crowd(*parsed, count).stand(over);
    return true;
}

}  // namespace tessera::drill

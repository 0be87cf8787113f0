#include "tests/bench/EpollRelease.h"

#include <arpa/inet.h>
#include <grp.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <signal.h>
#include <sys/epoll.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <thread>

namespace tessera::bench {
namespace {

std::int64_t nowNs() {
    timespec now{};
    ::clock_gettime(CLOCK_MONOTONIC, &now);
    return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

void atOnce(int socket) {
    const int one = 1;
    (void)::setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, &one, sizeof one);
}

[[noreturn]] void wait(const sockaddr_in& server, std::optional<uid_t> user) {
    if (user && (::setgroups(0, nullptr) != 0 || ::setgid(*user) != 0 || ::setuid(*user) != 0)) ::_exit(1);
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    const int socket = ::socket(AF_INET, SOCK_STREAM, 0), waiting = ::epoll_create1(0);
    if (::connect(socket, reinterpret_cast<const sockaddr*>(&server), sizeof server) != 0) ::_exit(1);
    atOnce(socket);
    epoll_event event{.events = EPOLLIN, .data = {.fd = socket}};
    if (::epoll_ctl(waiting, EPOLL_CTL_ADD, socket, &event) != 0) ::_exit(1);
    for (char byte = 0;;) {
        if (::epoll_wait(waiting, &event, 1, -1) < 0) continue;
        if (::read(socket, &byte, 1) <= 0) ::_exit(0);
        const std::int64_t at = nowNs();
        if (::write(socket, &at, sizeof at) != sizeof at) ::_exit(0);
    }
}

}  // namespace

EpollRelease::EpollRelease(int processes, std::optional<uid_t> user) {
    if (user && ::geteuid() != 0) user.reset();
    const int listener = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (::bind(listener, reinterpret_cast<sockaddr*>(&at), sizeof at) != 0 || ::listen(listener, processes) != 0)
        std::abort();
    socklen_t size = sizeof at;
    ::getsockname(listener, reinterpret_cast<sockaddr*>(&at), &size);
    for (int i = 0; i < processes; ++i) {
        const pid_t pid = ::fork();
        if (pid == 0) wait(at, user);
        processes_.push_back(pid);
        sockets_.push_back(::accept4(listener, nullptr, nullptr, SOCK_CLOEXEC));
        atOnce(sockets_.back());
    }
    ::close(listener);
}

EpollRelease::~EpollRelease() {
    for (const int socket : sockets_) ::close(socket);
    for (const pid_t process : processes_) {
        ::kill(process, SIGKILL);  // one holds the connections of those before it
        ::waitpid(process, nullptr, 0);
    }
}

std::vector<double> EpollRelease::releases(int count) const {
    std::vector<double> spreads;
    for (int i = 0; i < count; ++i) {
        std::this_thread::sleep_for(std::chrono::microseconds(16'667));
        const char byte = 1;
        for (const int socket : sockets_)
            if (::write(socket, &byte, 1) != 1) std::abort();
        std::int64_t first = INT64_MAX, last = 0;
        for (const int socket : sockets_) {
            std::int64_t at = 0;
            if (::recv(socket, &at, sizeof at, MSG_WAITALL) != sizeof at) std::abort();
            first = std::min(first, at);
            last = std::max(last, at);
        }
        spreads.push_back(static_cast<double>(last - first) * 1e-6);
    }
    return spreads;
}

}  // namespace tessera::bench

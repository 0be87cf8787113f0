#include "tests/integration/CountingProxy.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>

namespace tessera::test {
namespace {

sockaddr_in loopback(std::uint16_t port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(port);
    return address;
}

/// Passes on what has come. The number of bytes; 0: that side has closed.
std::size_t passOnce(int from, int to) {
    std::array<char, 65'536> buffer;
    const ssize_t got = ::recv(from, buffer.data(), buffer.size(), 0);
    for (ssize_t sent = 0; sent < got;) {
        const ssize_t now = ::send(to, buffer.data() + sent, static_cast<std::size_t>(got - sent), MSG_NOSIGNAL);
        if (now <= 0) return 0;
        sent += now;
    }
    return got > 0 ? static_cast<std::size_t>(got) : 0;
}

}  // namespace

CountingProxy::CountingProxy(const std::string& server)
    : serverPort_(static_cast<std::uint16_t>(std::stoi(server.substr(server.rfind(':') + 1)))),
      listener_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address = loopback(0);
    socklen_t size = sizeof(address);
    if (::bind(listener_, reinterpret_cast<sockaddr*>(&address), sizeof(address)) == 0 &&
        ::listen(listener_, 16) == 0 && ::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size) == 0)
        port_ = ntohs(address.sin_port);
    thread_ = std::thread([this] { run(); });
}

CountingProxy::~CountingProxy() {
    done_ = true;
    thread_.join();
    for (std::thread& connection : passing_) connection.join();
    ::close(listener_);
}

std::string CountingProxy::address() const {
    return "127.0.0.1:" + std::to_string(port_);
}

void CountingProxy::run() {
    while (!done_) {
        pollfd waiting{listener_, POLLIN, 0};
        if (::poll(&waiting, 1, 50) <= 0) continue;
        const int client = ::accept(listener_, nullptr, nullptr);
        if (client >= 0) passing_.emplace_back([this, client] { passOn(client); });
    }
}

void CountingProxy::passOn(int client) {
    const int server = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    const sockaddr_in address = loopback(serverPort_);
    bool open = ::connect(server, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0;
    while (open && !done_) {
        std::array<pollfd, 2> sides = {pollfd{client, POLLIN, 0}, pollfd{server, POLLIN, 0}};
        if (::poll(sides.data(), sides.size(), 50) <= 0) continue;
        if (sides[0].revents != 0) open = passOnce(client, server) > 0;
        if (open && sides[1].revents != 0) {
            const std::size_t bytes = passOnce(server, client);
            fromServer_ += bytes;
            open = bytes > 0;
        }
    }
    ::close(server);
    ::close(client);
}

}  // namespace tessera::test

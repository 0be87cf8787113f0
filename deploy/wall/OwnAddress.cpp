#include "deploy/wall/OwnAddress.h"

#include <arpa/inet.h>
#include <netdb.h>
#include <sys/socket.h>

#include <algorithm>
#include <memory>

#include "common/base/FileHandle.h"

namespace tessera {

namespace {

/// Without a port and a scope.
std::optional<std::string> numbersOf(const sockaddr* address) {
    char text[INET6_ADDRSTRLEN] = {};
    const void* from = nullptr;
    if (address->sa_family == AF_INET) from = &reinterpret_cast<const sockaddr_in*>(address)->sin_addr;
    if (address->sa_family == AF_INET6) from = &reinterpret_cast<const sockaddr_in6*>(address)->sin6_addr;
    if (from == nullptr || ::inet_ntop(address->sa_family, from, text, sizeof text) == nullptr) return std::nullopt;
    return std::string(text);
}

}  // namespace

std::optional<std::string> addressTowards(const std::string& name) {
    addrinfo wanted{};
    wanted.ai_socktype = SOCK_DGRAM;
    addrinfo* found = nullptr;
    if (::getaddrinfo(name.c_str(), "22", &wanted, &found) != 0) return std::nullopt;
    const std::unique_ptr<addrinfo, void (*)(addrinfo*)> keep(found, &::freeaddrinfo);
    for (const addrinfo* one = found; one != nullptr; one = one->ai_next) {
        // Connecting a datagram's socket asks the kernel for the way, and nobody else.
        const FileHandle socket(::socket(one->ai_family, SOCK_DGRAM | SOCK_CLOEXEC, 0));
        if (socket.get() < 0 || ::connect(socket.get(), one->ai_addr, one->ai_addrlen) != 0) continue;
        sockaddr_storage own{};
        socklen_t size = sizeof own;
        if (::getsockname(socket.get(), reinterpret_cast<sockaddr*>(&own), &size) != 0) continue;
        if (auto numbers = numbersOf(reinterpret_cast<const sockaddr*>(&own))) return numbers;
    }
    return std::nullopt;
}

ServerAddresses chooseAddresses(const std::vector<std::string>& reachedBy) {
    ServerAddresses chosen;
    bool six = false, one = true;
    for (const std::string& address : reachedBy) {
        const bool isSix = address.find(':') != std::string::npos;
        six = six || isSix;
        one = one && address == reachedBy.front();
        chosen.dial.push_back(isSix ? "[" + address + "]" : address);
    }
    const std::string all = six ? "[::]" : "0.0.0.0";  // the one for IPv6 hears IPv4 too
    chosen.listen = (reachedBy.empty() ? "127.0.0.1" : one ? chosen.dial.front() : all) + ":0";
    return chosen;
}

}  // namespace tessera

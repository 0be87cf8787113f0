#include "common/net/OwnAddress.h"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <sys/socket.h>

#include <boost/asio/ip/address.hpp>

#include <array>
#include <memory>
#include <string_view>

namespace tessera {

namespace ip = boost::asio::ip;

std::string plainAddress(const std::string& address) {
    boost::system::error_code error;
    const ip::address number = ip::make_address(address.substr(0, address.find('%')), error);
    if (error) return address;
    if (number.is_v6() && number.to_v6().is_v4_mapped())
        return ip::make_address_v4(ip::v4_mapped, number.to_v6()).to_string();
    return number.to_string();
}

namespace {

/// By its name or number.
bool isLink(std::string_view scope, const char* name) {
    return scope == name || scope == std::to_string(::if_nametoindex(name));
}

}  // namespace

bool isOwnAddress(const std::string& address) {
    const std::string plain = plainAddress(address);
    boost::system::error_code error;
    const ip::address number = ip::make_address(plain, error);
    if (error) return false;
    if (number.is_loopback()) return true;
    // On each of a machine's links somebody else may have an address of this kind.
    const bool onLink = number.is_v6() && number.to_v6().is_link_local();
    const std::size_t scope = address.find('%');
    if (onLink && scope == std::string::npos) return false;
    ifaddrs* all = nullptr;
    if (::getifaddrs(&all) != 0) return false;
    const std::unique_ptr<ifaddrs, void (*)(ifaddrs*)> keep(all, &::freeifaddrs);
    for (const ifaddrs* one = all; one != nullptr; one = one->ifa_next) {
        if (one->ifa_addr == nullptr) continue;
        std::array<char, INET6_ADDRSTRLEN> text{};
        const void* from = nullptr;
        if (one->ifa_addr->sa_family == AF_INET) from = &reinterpret_cast<const sockaddr_in*>(one->ifa_addr)->sin_addr;
        if (one->ifa_addr->sa_family == AF_INET6)
            from = &reinterpret_cast<const sockaddr_in6*>(one->ifa_addr)->sin6_addr;
        if (from != nullptr && ::inet_ntop(one->ifa_addr->sa_family, from, text.data(), text.size()) != nullptr &&
            plainAddress(text.data()) == plain &&
            (!onLink || isLink(std::string_view(address).substr(scope + 1), one->ifa_name)))
            return true;
    }
    return false;
}

}  // namespace tessera

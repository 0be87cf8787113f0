#include "common/base/SourceAddress.h"

#include <arpa/inet.h>
#include <netinet/in.h>

#include <array>
#include <cstdint>
#include <cstring>

namespace tessera {
namespace {

constexpr std::uint64_t kVersion4 = 0xFFFFFFFF00000000;  // with these nobody's address begins: ffff:ffff:: is a group's

SourceAddress sourceOf(const in_addr& address) {
    return SourceAddress(kVersion4 | ntohl(address.s_addr));
}

}  // namespace

SourceAddress sourceOf(const sockaddr& address) {
    if (address.sa_family == AF_INET) return sourceOf(reinterpret_cast<const sockaddr_in&>(address).sin_addr);
    if (address.sa_family != AF_INET6) return {};
    const in6_addr& bytes = reinterpret_cast<const sockaddr_in6&>(address).sin6_addr;
    if (IN6_IS_ADDR_V4MAPPED(&bytes)) {
        in_addr within{};
        std::memcpy(&within, &bytes.s6_addr[12], sizeof within);
        return sourceOf(within);
    }
    std::uint64_t value = 0;
    for (int i = 0; i < 8; ++i) value = value << 8 | bytes.s6_addr[i];
    // Nobody's beside this machine's own, ::1, which is not "none".
    return SourceAddress(value == 0 ? 1 : value);
}

std::string toString(SourceAddress source) {
    std::array<char, INET6_ADDRSTRLEN> text{};
    if ((source.value & kVersion4) == kVersion4) {
        const in_addr address{htonl(static_cast<std::uint32_t>(source.value))};
        inet_ntop(AF_INET, &address, text.data(), text.size());
        return text.data();
    }
    in6_addr address{};
    for (int i = 0; i < 8; ++i) address.s6_addr[i] = static_cast<std::uint8_t>(source.value >> (56 - 8 * i));
    inet_ntop(AF_INET6, &address, text.data(), text.size());
    return std::string(text.data()) + "/64";
}

}  // namespace tessera

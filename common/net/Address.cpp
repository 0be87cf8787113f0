#include <boost/asio/ip/address.hpp>
#include <charconv>

#include <fmt/format.h>

#include "common/net/Transport.h"

namespace tessera {

bool Address::isLoopback() const {
    if (host == "localhost") return true;
    boost::system::error_code error;
    const auto numeric = boost::asio::ip::make_address(host, error);
    return !error && numeric.is_loopback();
}

Expected<Address> parseAddress(std::string_view text) {
    const auto refuse = [&](std::string_view why) {
        return fail(ErrorCode::kUsage,
                    // A page's link has a token behind that.
                    fmt::format("\"{}\" is not an address: {}; write HOST:PORT, e.g. 127.0.0.1:7000 or [::1]:7000",
                                text.substr(0, text.find('?')), why));
    };
    if (text.size() > 300) return fail(ErrorCode::kUsage, "an address of more than 300 characters");
    const std::size_t colon = text.rfind(':');
    if (colon == std::string_view::npos) return refuse("it has no port");
    std::string_view host = text.substr(0, colon);
    const std::string_view port = text.substr(colon + 1);
    if (host.starts_with('[')) {
        if (!host.ends_with(']')) return refuse("its bracket is not closed");
        host = host.substr(1, host.size() - 2);
    } else if (host.find(':') != std::string_view::npos) {
        return refuse("an IPv6 address stands in brackets");
    }
    if (host.empty()) return refuse("it names no host (0.0.0.0 means all of this machine's addresses)");
    Address address{std::string(host), 0};
    const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), address.port);
    if (error != std::errc() || end != port.data() + port.size())
        return refuse("its port is not a number from 0 to 65535");
    return address;
}

std::string toString(const Address& address) {
    const bool v6 = address.host.find(':') != std::string::npos;
    return v6 ? fmt::format("[{}]:{}", address.host, address.port) : fmt::format("{}:{}", address.host, address.port);
}

}  // namespace tessera

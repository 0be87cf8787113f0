#include "common/base/HostRange.h"

#include <arpa/inet.h>

#include <algorithm>
#include <charconv>
#include <string>

#include <fmt/format.h>

namespace tessera {

bool HostRange::contains(const HostBytes& host) const {
    const auto whole = static_cast<std::size_t>(bits / 8);
    if (!std::equal(first.begin(), first.begin() + static_cast<std::ptrdiff_t>(whole), host.begin())) return false;
    const int rest = bits % 8;
    return rest == 0 || ((first[whole] ^ host[whole]) >> (8 - rest)) == 0;
}

Expected<HostRange> parseHostRange(std::string_view text) {
    const auto refuse = [&](std::string_view why) {
        return fail(ErrorCode::kBadInput,
                    fmt::format("\"{}\" is no address or range of addresses: {}; write e.g. 10.0.0.5 "
                                "or 10.0.0.0/24",
                                text.substr(0, 60), why));
    };
    const std::size_t slash = text.find('/');
    const std::string address(text.substr(0, slash));
    HostRange range;
    int most = 128;
    if (std::uint8_t v4[4]; inet_pton(AF_INET, address.c_str(), v4) == 1) {
        range.first[10] = range.first[11] = 0xff;
        std::copy(v4, v4 + 4, range.first.begin() + 12);
        most = 32;
    } else if (inet_pton(AF_INET6, address.c_str(), range.first.data()) != 1) {
        return refuse("names are not looked up here");
    }
    if (slash == std::string_view::npos) return range;
    const std::string_view bits = text.substr(slash + 1);
    int given = 0;
    const auto [end, error] = std::from_chars(bits.data(), bits.data() + bits.size(), given);
    if (error != std::errc() || end != bits.data() + bits.size() || given < 0 || given > most)
        return refuse(most == 32 ? "behind the slash stand 0 to 32 bits" : "behind the slash stand 0 to 128 bits");
    range.bits = 128 - most + given;
    return range;
}

}  // namespace tessera

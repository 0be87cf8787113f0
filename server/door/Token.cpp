#include "server/door/Token.h"

#include <sys/random.h>

#include <array>

#include "common/base/Error.h"

namespace tessera {

std::string freshToken() {
    static constexpr std::string_view kLetters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
    std::array<unsigned char, 43> random{};
    TESSERA_CHECK(getrandom(random.data(), random.size(), 0) == static_cast<ssize_t>(random.size()),
                  "the kernel has no randomness");
    std::string token;
    for (const unsigned char byte : random) token += kLetters[byte & 63];
    return token;
}

bool sameToken(std::string_view a, std::string_view b) {
    if (a.size() != b.size()) return false;
    unsigned differ = 0;
    for (std::size_t i = 0; i < a.size(); ++i)
        differ |= static_cast<unsigned>(static_cast<unsigned char>(a[i]) ^ static_cast<unsigned char>(b[i]));
    return differ == 0;
}

}  // namespace tessera

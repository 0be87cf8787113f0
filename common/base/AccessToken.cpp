#include "common/base/AccessToken.h"

#include <sys/random.h>

#include <algorithm>
#include <array>

#include "common/base/Error.h"

namespace tessera {

namespace {
constexpr std::string_view kLetters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
}  // namespace

std::string freshToken() {
    std::array<unsigned char, 43> random{};
    TESSERA_CHECK(getrandom(random.data(), random.size(), 0) == static_cast<ssize_t>(random.size()),
                  "the kernel has no randomness");
    std::string token;
    for (const unsigned char byte : random) token += kLetters[byte & 63];
    return token;
}

bool isToken(std::string_view text) {
    constexpr std::size_t kShortest = 16, kLongest = 128;
    return text.size() >= kShortest && text.size() <= kLongest &&
           text.find_first_not_of(kLetters) == std::string_view::npos;
}

bool sameToken(std::string_view a, std::string_view b) {
    if (a.size() != b.size()) return false;
    unsigned differ = 0;
    for (std::size_t i = 0; i < a.size(); ++i)
        differ |= static_cast<unsigned>(static_cast<unsigned char>(a[i]) ^ static_cast<unsigned char>(b[i]));
    return differ == 0;
}

std::optional<Entrant> AccessTokens::byDoor(std::string_view said) const {
    if (door.empty() || said.size() <= door.size() || said[door.size()] != '/') return std::nullopt;
    if (!sameToken(said.substr(0, door.size()), door)) return std::nullopt;
    return readEntrant(said.substr(door.size() + 1));
}

std::optional<Role> AccessTokens::roleOf(std::string_view token) const {
    std::optional<Role> found;
    for (const Role role : {Role::kViewer, Role::kEditor, Role::kOperator})
        if (!of(role).empty() && sameToken(of(role), token)) found = role;
    return found;
}

}  // namespace tessera

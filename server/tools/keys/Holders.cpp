#include "server/tools/keys/Holders.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/base/Nearest.h"
#include "common/base/Utf8.h"

namespace tessera {
namespace {

using Kind = Identity::Kind;

/// "server", "host/left", "person/anna": no two holders are called the same.
std::string fullName(const Identity& holder) {
    std::string name(wordFor(holder.kind));
    return holder.kind == Kind::kServer ? name : name + "/" + holder.name;
}

}  // namespace

std::string_view wordFor(Kind kind) {
    return kind == Kind::kServer ? "server" : kind == Kind::kHost ? "host" : "person";
}

bool isSameHolder(const Identity& a, const Identity& b) {
    return a.kind == b.kind && a.name == b.name;
}

Expected<void> checkHolderName(const std::string& name) {
    constexpr std::size_t kLongest = 64;
    const auto isControl = [](char c) { return (c >= 0 && c < ' ') || c == 0x7F; };
    const bool good = !name.empty() && name.size() <= kLongest && name.front() != '.' &&
                      name.find('/') == std::string::npos && isUtf8(name) && std::ranges::none_of(name, isControl);
    if (good) return {};
    std::string shown(cutUtf8(name, kLongest));
    std::ranges::replace_if(shown, isControl, '?');
    return fail(ErrorCode::kUsage,
                fmt::format("'{}' is no name of a host or person: 1 to {} bytes of UTF-8, no '/', no control "
                            "characters, no dot in front",
                            shown, kLongest));
}

std::vector<IssuedKey> newestOf(std::span<const IssuedKey> issued) {
    std::vector<IssuedKey> newest;
    for (const IssuedKey& key : issued) {
        const auto before =
            std::ranges::find_if(newest, [&](const IssuedKey& one) { return isSameHolder(one.holder, key.holder); });
        if (before == newest.end())
            newest.push_back(key);
        else
            *before = key;
    }
    return newest;
}

Expected<IssuedKey> findHolder(std::span<const IssuedKey> issued, const std::string& name) {
    std::vector<IssuedKey> found;
    std::vector<std::string> known;
    for (const IssuedKey& key : newestOf(issued)) {
        const std::string full = fullName(key.holder);
        if (name == full) return key;
        if (key.holder.kind != Kind::kServer && name == key.holder.name) found.push_back(key);
        const bool withKind = key.holder.kind == Kind::kServer || name.find('/') != std::string::npos;
        known.push_back(withKind ? full : key.holder.name);
    }
    if (found.size() == 1) return found.front();
    if (!found.empty())
        return fail(ErrorCode::kUsage, fmt::format("a host and a person are called '{0}': host/{0} or person/{0} says "
                                                   "which one is meant",
                                                   name));
    const std::string nearest = nearestName(name, known);
    return fail(ErrorCode::kNotFound,
                fmt::format("nobody called '{}' has a key{}", name,
                            nearest.empty() ? "" : fmt::format(" (did you mean '{}'?)", nearest)));
}

}  // namespace tessera

#include "common/wall/WallNames.h"

#include <fmt/format.h>

#include "common/base/Nearest.h"

namespace tessera {

std::optional<std::string> nameFault(std::string_view kind, std::size_t index, const std::string& name,
                                     std::size_t maxBytes, std::set<std::string>& taken) {
    if (name.empty()) return fmt::format("{} {} has no name", kind, index + 1);
    if (name.size() > maxBytes)
        return fmt::format("the name of {} {} is longer than {} bytes", kind, index + 1, maxBytes);
    const auto allowed = [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_' ||
               c == '.';
    };
    for (const char c : name) {
        if (!allowed(c)) {
            return fmt::format(
                "the name of {} {} has a character that file names should not have: letters, "
                "digits, '-', '_' and '.' are allowed",
                kind, index + 1);
        }
    }
    if (name.front() == '.') return fmt::format("the name \"{}\" begins with a dot", name);
    if (!taken.insert(name).second)
        return fmt::format("there are two {}s \"{}\": give each a name of its own", kind, name);
    return std::nullopt;
}

std::string unknownName(std::string_view kind, const std::string& name, const std::vector<std::string>& known) {
    const std::string nearest = nearestName(name, known);
    std::string all;
    for (std::size_t i = 0; i < known.size() && i < 8; ++i)
        all += fmt::format("{}\"{}\"", i == 0 ? "" : ", ", known[i]);
    if (known.size() > 8) all += ", …";
    return fmt::format("there is no {} \"{}\"{}; known: {}", kind, name,
                       nearest.empty() ? "" : fmt::format(" (did you mean \"{}\"?)", nearest),
                       all.empty() ? "none" : all);
}

}  // namespace tessera

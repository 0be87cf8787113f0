#include "server/door/HttpMessage.h"

namespace tessera {
namespace {

std::optional<int> digit(char c) {
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    if (c >= 'A' && c <= 'F') return c - 'A' + 10;
    return std::nullopt;
}

std::optional<std::string> plain(std::string_view text, bool plusIsSpace) {
    std::string out;
    for (std::size_t i = 0; i < text.size(); ++i) {
        char c = text[i];
        if (c == '%') {
            const std::optional<int> high = i + 2 < text.size() ? digit(text[i + 1]) : std::nullopt;
            const std::optional<int> low = high ? digit(text[i + 2]) : std::nullopt;
            if (!low) return std::nullopt;
            c = static_cast<char>(*high * 16 + *low);
            i += 2;
        } else if (c == '+' && plusIsSpace) {
            c = ' ';
        }
        if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) return std::nullopt;
        out += c;
    }
    return out;
}

}  // namespace

std::optional<HttpTarget> readTarget(std::string_view target) {
    if (!target.starts_with('/')) return std::nullopt;
    const std::size_t mark = target.find('?');
    HttpTarget read;
    const std::optional<std::string> path = plain(target.substr(0, mark), false);
    if (!path) return std::nullopt;
    read.path = *path;
    std::string_view query = mark == std::string_view::npos ? std::string_view() : target.substr(mark + 1);
    while (!query.empty()) {
        const std::string_view one = query.substr(0, query.find('&'));
        query.remove_prefix(std::min(one.size() + 1, query.size()));
        const std::size_t equals = one.find('=');
        const std::optional<std::string> name = plain(one.substr(0, equals), true);
        const std::optional<std::string> value =
            plain(equals == std::string_view::npos ? std::string_view() : one.substr(equals + 1), true);
        if (!name || !value) return std::nullopt;
        read.query.emplace(*name, *value);
    }
    return read;
}

}  // namespace tessera

#include "common/base/Identity.h"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <optional>
#include <vector>

namespace tessera {
namespace {

constexpr std::string_view kScheme = "tessera://";
constexpr std::array kRoles{Role::kViewer, Role::kEditor, Role::kOperator};

bool isPlain(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '.' ||
           c == '_' || c == '~';
}

std::string escaped(std::string_view text) {
    std::string out;
    for (const char c : text) {
        if (isPlain(c))
            out += c;
        else
            out += fmt::format("%{:02X}", static_cast<unsigned char>(c));
    }
    return out;
}

/// One text has one way of writing: another one is none.
std::optional<std::string> unescaped(std::string_view text) {
    std::string out;
    for (std::size_t at = 0; at < text.size(); ++at) {
        if (text[at] != '%') {
            out += text[at];
            continue;
        }
        unsigned value = 0;
        const char* const digits = text.data() + at + 1;
        if (text.size() - at < 3 || std::from_chars(digits, digits + 2, value, 16).ptr != digits + 2)
            return std::nullopt;
        out += static_cast<char>(value);
        at += 2;
    }
    if (escaped(out) != text) return std::nullopt;
    return out;
}

}  // namespace

std::string toUri(const Identity& identity) {
    const std::string wall = escaped(identity.wall);
    switch (identity.kind) {
        case Identity::Kind::kServer:
            return fmt::format("{}{}/server", kScheme, wall);
        case Identity::Kind::kHost:
            return fmt::format("{}{}/host/{}", kScheme, wall, escaped(identity.name));
        case Identity::Kind::kPerson:
            break;
    }
    return fmt::format("{}{}/person/{}/{}", kScheme, wall, escaped(identity.name), nameOf(identity.role));
}

Expected<Identity> parseIdentity(std::string_view uri) {
    const auto none = [&] {
        return fail(ErrorCode::kBadInput, fmt::format("'{}' does not name a server, host or person of a wall", uri));
    };
    if (!uri.starts_with(kScheme)) return none();
    std::vector<std::string> parts;
    for (std::string_view rest = uri.substr(kScheme.size());;) {
        const std::size_t end = std::min(rest.find('/'), rest.size());
        std::optional<std::string> part = unescaped(rest.substr(0, end));
        if (!part || part->empty()) return none();
        parts.push_back(std::move(*part));
        if (end == rest.size()) break;
        rest.remove_prefix(end + 1);
    }
    Identity identity{.wall = parts[0], .kind = Identity::Kind::kServer, .name = {}};
    if (parts.size() == 2 && parts[1] == "server") return identity;
    if (parts.size() < 3) return none();
    identity.name = parts[2];
    identity.kind = Identity::Kind::kHost;
    if (parts.size() == 3 && parts[1] == "host") return identity;
    identity.kind = Identity::Kind::kPerson;
    if (parts.size() != 4 || parts[1] != "person") return none();
    for (const Role role : kRoles) {
        identity.role = role;
        if (parts[3] == nameOf(role)) return identity;
    }
    return none();
}

std::string describe(const Identity& identity) {
    switch (identity.kind) {
        case Identity::Kind::kServer:
            return fmt::format("the server of the wall '{}'", identity.wall);
        case Identity::Kind::kHost:
            return fmt::format("the host '{}' of the wall '{}'", identity.name, identity.wall);
        case Identity::Kind::kPerson:
            break;
    }
    return fmt::format("'{}', {} of the wall '{}'", identity.name, nameOf(identity.role), identity.wall);
}

}  // namespace tessera

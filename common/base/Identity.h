/// What a key says of its holder.
#pragma once

#include <string>
#include <string_view>

#include "common/base/Error.h"
#include "common/base/Role.h"

namespace tessera {

/// Keys name walls and people, not addresses.
struct Identity {
    enum class Kind : std::uint8_t { kServer, kHost, kPerson };

    std::string wall;
    Kind kind = Kind::kServer;
    std::string name;           ///< of the host or person; of a server empty
    Role role = Role::kViewer;  ///< of a person
    bool operator==(const Identity&) const = default;
};

/// As certificates carry it: "tessera://WALL/server", "tessera://WALL/host/NAME", "tessera://WALL/person/NAME/ROLE".
/// What is no letter, digit, or one of "-._~" is written as %XX (RFC 3986).
[[nodiscard]] std::string toUri(const Identity& identity);
/// kBadInput: it is none of these.
[[nodiscard]] Expected<Identity> parseIdentity(std::string_view uri);
/// "the host 'left' of the wall 'cave'"
[[nodiscard]] std::string describe(const Identity& identity);

/// Whom the other end of a link has proved to be.
struct Credential {
    Identity identity;
    std::string serial;      ///< of its certificate
    std::string fault = {};  ///< why it lets nobody in, for a person; empty: nothing is wrong with it
};

}  // namespace tessera

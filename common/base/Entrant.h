/// Who has come in, and by what.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "common/base/Role.h"

namespace tessera {

/// What somebody has proved, as those read it who look afterwards who changed what. A name that a program gives itself
/// is none of this.
struct Entrant {
    enum class By : std::uint8_t {
        kNothing,  ///< nobody was asked for anything
        kWord,     ///< the server's own token of a role, which its user's programs find
        kPass,     ///< a token that was given for some time
        kKey,
    };

    Role role = Role::kViewer;
    By by = By::kNothing;
    std::string name = {};   ///< of the person, the token, or the server's user
    std::string from = {};   ///< the address, where a door asks for it; empty: the link's own
    std::string panel = {};  ///< AccessPass::panel
    bool operator==(const Entrant&) const = default;
    /// The same one, wherever from.
    [[nodiscard]] bool isSameAs(const Entrant& other) const {
        return role == other.role && by == other.by && name == other.name && panel == other.panel;
    }
};

/// Whether somebody who holds `own` of so many places, of which others hold some, may have one more. Who has a key or a
/// token that was given away has at most half of what others leave: so nobody keeps all others out. Not the server's
/// own user, whose programs all have one name.
[[nodiscard]] constexpr bool hasShare(Entrant::By by, std::size_t own, std::size_t others, std::size_t places) {
    if (own + others >= places) return false;
    return (by != Entrant::By::kPass && by != Entrant::By::kKey) || own < (places - others + 1) / 2;
}

/// "nothing", "the server's token", "a token", "a key"
[[nodiscard]] std::string_view nameOf(Entrant::By by);

/// One line, as a door says to its server for whom it asks: "editor/3//10.0.0.7/ada".
[[nodiscard]] std::string toText(const Entrant& entrant);
/// None: it is not such a line.
[[nodiscard]] std::optional<Entrant> readEntrant(std::string_view text);

}  // namespace tessera

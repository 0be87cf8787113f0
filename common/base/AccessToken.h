/// The words that let programs in.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

#include "common/base/Entrant.h"

namespace tessera {

/// 256 bits of the kernel's randomness, as 43 letters that may stand in a link.
[[nodiscard]] std::string freshToken();
/// 16 to 128 letters of those that stand in a fresh one.
[[nodiscard]] bool isToken(std::string_view text);
/// Takes as long whatever differs.
[[nodiscard]] bool sameToken(std::string_view a, std::string_view b);

/// What a word that was given for some time lets its holder do.
struct AccessPass {
    std::string name;
    Role role = Role::kViewer;
    /// Its name among the keys: it reaches that panel's fields alone. Empty: all that its role does.
    std::string panel = {};
};

/// One for each role; empty: nobody is asked for any.
struct AccessTokens {
    std::array<std::string, 3> words{};  ///< by role
    /// By it the server's own door comes in, and nobody else: it is believed for whom it asks.
    std::string door = {};

    [[nodiscard]] static AccessTokens fresh() { return {{freshToken(), freshToken(), freshToken()}, freshToken()}; }
    [[nodiscard]] const std::string& of(Role role) const { return words[static_cast<std::size_t>(role)]; }
    [[nodiscard]] std::string& of(Role role) { return words[static_cast<std::size_t>(role)]; }
    [[nodiscard]] bool empty() const { return of(Role::kOperator).empty(); }
    /// What the door says to come in for somebody.
    [[nodiscard]] std::string ofDoorFor(const Entrant& who) const { return door + '/' + toText(who); }
    /// None: it is not the door's.
    [[nodiscard]] std::optional<Entrant> byDoor(std::string_view said) const;
    /// None: it is nobody's.
    [[nodiscard]] std::optional<Role> roleOf(std::string_view token) const;
};

}  // namespace tessera

/// The door's own pages, for people. Nothing in them is from elsewhere.
#pragma once

#include <optional>

#include "server/door/HttpMessage.h"

namespace tessera {

/// The console (server/door/page).
[[nodiscard]] HttpAnswer consolePage();
/// What whose token is of a panel sees instead.
[[nodiscard]] HttpAnswer panelPage();
/// A script or a style sheet of these. Nothing: there is none of that name.
[[nodiscard]] std::optional<HttpAnswer> consoleFile(std::string_view name);
/// Asks for a token: status 401. Whoever has shown one in this window, and loads the page again, is let in by a script.
[[nodiscard]] HttpAnswer tokenPage();
/// All that can be asked, made from the descriptions.
[[nodiscard]] HttpAnswer apiPage(const std::string& wall);
[[nodiscard]] HttpAnswer stylePage();
/// Text as HTML shows it.
[[nodiscard]] std::string escaped(std::string_view text);

}  // namespace tessera

/// The door's own pages, for people. Plain: no script, nothing from elsewhere.
#pragma once

#include "server/door/HttpMessage.h"

namespace tessera {

/// Asks for a token: status 401.
[[nodiscard]] HttpAnswer tokenPage();
/// All that can be asked, made from the descriptions.
[[nodiscard]] HttpAnswer apiPage(const std::string& wall);
[[nodiscard]] HttpAnswer stylePage();
/// Text as HTML shows it.
[[nodiscard]] std::string escaped(std::string_view text);

}  // namespace tessera

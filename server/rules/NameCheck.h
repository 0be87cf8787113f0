/// Names of nodes stand in lists, in paths and on terminals: each is part of one line.
#pragma once

#include <string>
#include <string_view>

#include "common/change/ChangeList.h"
#include "server/rules/Fault.h"

namespace tessera {

/// Whether the text, UTF-8, has neither line breaks nor other control characters (U+0000 to U+001F, U+007F to U+009F,
/// U+2028, U+2029).
[[nodiscard]] bool isOneLine(std::string_view text);
/// Each of them, and each byte that is no UTF-8, as a question mark.
[[nodiscard]] std::string asOneLine(std::string_view text);

/// Of the nodes that the list names. The root keeps its empty name, and has no core.
[[nodiscard]] Sound checkNames(const ChangeList& list);

}  // namespace tessera

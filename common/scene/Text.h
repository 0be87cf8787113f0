/// Text in scenes is UTF-8, so that reports, terminals and other programs can show it.
#pragma once

#include <string>
#include <string_view>

namespace tessera {

/// The text with every malformed byte replaced by U+FFFD, cut to at most `maxBytes` at a character's end. For names
/// from files, which may hold anything.
[[nodiscard]] std::string toUtf8(std::string_view text, std::size_t maxBytes);

/// "widthPx" as "width_px": a field of the table as scene files name it. ASCII.
[[nodiscard]] std::string snakeCase(std::string_view camel);

}  // namespace tessera

/// Which files can be imported, as far as their names say.
#pragma once

#include <span>
#include <string_view>

namespace tessera {

/// In lower case, without dots, in alphabetical order.
[[nodiscard]] std::span<const std::string_view> modelEndings();
/// `extension`: in lower case, without its dot. What a file holds is looked at by the importer alone.
[[nodiscard]] bool isModelEnding(std::string_view extension);

}  // namespace tessera

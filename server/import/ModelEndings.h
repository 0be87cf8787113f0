/// Which files can be imported, as far as their names say.
#pragma once

#include <string_view>

namespace tessera {

/// `extension`: in lower case, without its dot. What a file holds is looked at by the importer alone.
[[nodiscard]] bool isModelEnding(std::string_view extension);

}  // namespace tessera

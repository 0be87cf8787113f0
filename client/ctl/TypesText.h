/// All types of objects and their fields, as the table has them: `tessera-ctl types`.
#pragma once

#include <string>

namespace tessera {

/// A type per paragraph, a field per line; for people.
[[nodiscard]] std::string typesText();

}  // namespace tessera

/// All types of objects and their fields, as the table has them: `tessera-ctl types`.
#pragma once

#include <string>

#include "common/base/Error.h"

namespace tessera {

/// A type per paragraph, a field per line; for people.
[[nodiscard]] std::string typesText();
/// One type, with a sentence for each field. kNotFound names the nearest.
[[nodiscard]] Expected<std::string> typeText(const std::string& name);
/// The same as data, on a line.
[[nodiscard]] Expected<std::string> typeLine(const std::string& name);

}  // namespace tessera

/// Writes the report whole or not at all.
#pragma once

#include <string>
#include <string_view>

#include "common/base/Error.h"

namespace tessera {

/// To a temporary name beside `path`, then renamed. Makes missing folders.
[[nodiscard]] Expected<void> writeReport(const std::string& path, std::string_view text);

}  // namespace tessera

/// What a person at a terminal sees while a file is read.
#pragma once

#include <memory>
#include <string>

#include "server/import/ImportWatch.h"

namespace tessera {

/// Writes how far it is on one line of stderr, from half a second on, and takes that away in the end. Null where stderr
/// is no terminal.
[[nodiscard]] std::shared_ptr<ImportWatch> progressOnTerminal(const std::string& path);

}  // namespace tessera

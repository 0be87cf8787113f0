/// Numbers that nobody can guess, from the system's own source.
#pragma once

#include "common/base/Hash.h"

namespace tessera {

/// 128 bits of getrandom(2). Never all zero, which means "nothing". Thread-safe.
[[nodiscard]] Hash128 systemRandom();

}  // namespace tessera

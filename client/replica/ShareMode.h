/// Whether hosts of one machine share parts of pictures and the arrays of the scene.
#pragma once

#include <cstdint>
#include <string_view>

#include "common/base/Error.h"

namespace tessera {

enum class ShareMode : std::uint8_t {
    kOff,
    kAuto,    ///< where the last frames say that it pays
    kAlways,  ///< every picture, and everybody helps who can: for tests
};
/// "off", "auto", "always"; kUsage names them.
[[nodiscard]] Expected<ShareMode> parseShareMode(std::string_view name);

}  // namespace tessera

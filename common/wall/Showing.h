/// What all tiles of a wall show: its scene, or a picture to set it up by.
#pragma once

#include <cstdint>

namespace tessera {

/// As numbers on the wire.
enum class Showing : std::uint8_t {
    kScene = 0,
    kTestPicture = 1,         ///< still
    kCountedTestPicture = 2,  ///< with the number of each frame in every tile
};
inline constexpr std::uint32_t kLastShowing = 2;

}  // namespace tessera

/// How render hosts find out what leaves no pixel. No choice changes a picture.
#pragma once

#include <cstdint>
#include <string_view>

#include "common/base/Error.h"

namespace tessera {

enum class CullerKind : std::uint8_t {
    kNone,
    kFrustum,
    kMasked,  ///< what is hidden too, by a depth buffer in software
    kAuto,    ///< masked where that pays, else frustum
};

/// "none", "frustum", "masked", "auto".
[[nodiscard]] Expected<CullerKind> parseCuller(std::string_view name);
[[nodiscard]] std::string_view nameOf(CullerKind kind);

}  // namespace tessera

/// Which encoded pictures have no colours.
#pragma once

#include "common/base/Bytes.h"

namespace tessera {

/// Whether a PNG or JPEG says that it is grey, with opacity or without. VRML's grey pictures make a colour darker, all
/// others replace it. No other format is looked into.
[[nodiscard]] bool isGreyPicture(ByteSpan encoded);

}  // namespace tessera

/// What OpenEXR believes of a file's headers, and should not.
#pragma once

#include "common/base/Bytes.h"

namespace tessera {

/// Whether all attributes of all headers have the bytes that they say, and those that their types ask for, and whether
/// there is room for the places of all chunks: the library takes memory for them first, and goes on behind an attribute
/// where its type ends. By "OpenEXR File Layout". `bytes`: a whole file, that begins as one.
[[nodiscard]] bool hasSoundExrHeaders(ByteSpan bytes);

}  // namespace tessera

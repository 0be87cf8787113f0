/// Compressed images as plain pixels, for what GL cannot read as it is. No GL.
#pragma once

#include <cstdint>

#include "common/base/Bytes.h"
#include "common/cores/ShippedTypes.h"

namespace tessera {

/// One slice or face of bc1 to bc5 as RGBA, rows from the top; `blocks` are as many as its size needs. bc4 is grey. bc5
/// is red and green, and blue what makes a unit normal of them, as normal maps of two channels mean it. S3TC and RGTC:
/// Khronos Data Format 1.3, sections 18 and 19; thirds and sevenths are rounded.
[[nodiscard]] Bytes decodeBlocks(ByteSpan blocks, std::int64_t encoding, std::int64_t widthPx, std::int64_t heightPx);

}  // namespace tessera

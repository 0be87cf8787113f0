/// Images as files that others read.
#pragma once

#include <optional>

#include "common/base/Bytes.h"
#include "common/cores/Image.h"
#include "common/export/ExportNotes.h"

namespace tessera {

/// As PNG. Nothing, and a note about `node`: it has another shape than a flat one, blocks, a wide range of light, or
/// more pixels than PNG's readers take. `tint`: from 0 to 1, linear, of light and of opacity, which become darker by
/// it.
[[nodiscard]] std::optional<Bytes> pngOf(const Image& image, ExportNotes& notes, ObjectId node,
                                         const Vec4f& tint = Vec4f::Ones());

/// A pair of texture coordinates where the image is placed by itself (Image.h: scaled, turned, moved).
[[nodiscard]] Vec2f placedTexcoord(const Image& image, const Vec2f& uv);
/// The mean of its red, green and blue, as light or as the numbers are; 1 of images that cannot leave.
[[nodiscard]] Vec3f meanColor(const Image& image, bool linear);
[[nodiscard]] bool isPlaced(const Image& image);

}  // namespace tessera

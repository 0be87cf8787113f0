/// Pictures of floating point numbers (PFM): "PF", width and height, a scale whose sign says the order of bytes, then
/// three numbers for each pixel. In MPCDI rows come from the top.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "common/base/Bytes.h"
#include "common/base/Error.h"

namespace tessera {

struct FloatPicture {
    int widthPx = 0, heightPx = 0;
    std::vector<std::array<float, 3>> pixels;
    [[nodiscard]] const std::array<float, 3>& at(int x, int y) const {
        return pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(widthPx) + static_cast<std::size_t>(x)];
    }
};

/// 2 to 8192 pixels each way. kBadInput says what is wrong; never crashes whatever the bytes are.
[[nodiscard]] Expected<FloatPicture> readPfm(ByteSpan bytes, const std::string& name);

}  // namespace tessera

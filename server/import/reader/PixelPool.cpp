#include "server/import/reader/PixelPool.h"

#include <fmt/format.h>

namespace tessera {

Expected<void> PixelPool::take(std::string_view what, std::uint64_t pixels) {
    const std::uint64_t most = kFree + kPerByte * bytes_;
    if (pixels > most - std::min(most, taken_))
        return fail(
            ErrorCode::kLimit,
            fmt::format("{}{}, which are more than the {:.0f} million pixels that are decoded of so few bytes: "
                        "save the pictures smaller, or with mipmaps",
                        what, taken_ > 0 ? ", with the pictures before it" : "", static_cast<double>(most) / 1e6));
    taken_ += pixels;
    return {};
}

}  // namespace tessera

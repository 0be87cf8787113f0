/// How many pixels of pictures are decoded of a file: time and memory go by them, however few bytes they take.
#pragma once

#include <cstdint>
#include <string_view>

#include "common/base/Error.h"

namespace tessera {

/// Of all pictures together, also of those that are made smaller or left out later.
class PixelPool {
public:
    /// One of 8192 × 8192, or six of 4096 × 4096, may be of one colour each, which takes next to no bytes. No format
    /// gives what is not plain fewer bytes than the other bound says.
    static constexpr std::uint64_t kFree = std::uint64_t{6} << 24, kPerByte = 64;

    /// So many bytes were read of files, in all.
    void grant(std::uint64_t bytes) { bytes_ = bytes; }
    /// Before so many pixels are decoded. kLimit: they are too many, and none are taken. `what`: of which picture, for
    /// the message.
    [[nodiscard]] Expected<void> take(std::string_view what, std::uint64_t pixels);

private:
    std::uint64_t bytes_ = 0, taken_ = 0;
};

}  // namespace tessera

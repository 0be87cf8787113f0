/// What the server and the child that decodes a film say to each other.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace tessera {

/// Pictures lie in memory that both have mapped, whose size neither can change: slot i begins at i * kFilmSlotBytes.
/// Only pages that are written take memory.
inline constexpr std::size_t kFilmSlots = 4, kFilmSlotBytes = std::size_t{24} << 20;
/// Sides beyond are halved until they fit; a picture then lies in a slot with its mipmaps, as blocks of 16 bytes too.
inline constexpr int kMostFilmSidePx = 4096;
/// Up to here a picture travels as it is; larger ones as blocks (bc1; bc3 where something lets through), with mipmaps.
inline constexpr int kMostPlainFilmPixels = 256 * 256;

/// Descriptors of the child: the film's file is its stdin, answers go to its stdout.
inline constexpr int kFilmRequestsFd = 3, kFilmMemoryFd = 4;

/// For the picture that is shown at a time.
struct FilmRequest {
    static constexpr std::uint32_t kMagic = 0x514d4c46;
    static constexpr std::uint32_t kFollowing =
        1;  ///< the one after the last that was told; unless that has ended by `seconds`
    static constexpr std::uint32_t kLoop = 2;  ///< after the last one comes the first one
    std::uint32_t magic = kMagic;
    std::uint32_t flags = 0;
    std::uint32_t slot = 0;  ///< where it shall lie; nobody looks there until the answer
    std::uint32_t reserved = 0;
    std::uint64_t serial = 0;
    double seconds = 0;
};

/// One for each request, in their order; or why there will be none.
struct FilmAnswer {
    static constexpr std::uint32_t kMagic = 0x414d4c46;
    enum class Kind : std::uint32_t { kPicture = 1, kTrouble = 2 };
    std::uint32_t magic = kMagic;
    Kind kind = Kind::kPicture;
    std::uint32_t slot = 0;
    std::uint32_t wrapped = 0;  ///< it came after the last one
    std::uint64_t serial = 0;
    double begin = 0, end = 0;  ///< s from the film's start
    double seconds = 0;         ///< the film's length, as far as it is known; 0: it is not
    std::uint32_t widthPx = 0, heightPx = 0, mipmaps = 1;
    std::uint32_t encoding = 0;  ///< as Image's: srgb, bc1 or bc3
    std::uint64_t sizeBytes = 0;
    std::array<char, 248> text{};  ///< of kTrouble
};
static_assert(sizeof(FilmRequest) == 32 && sizeof(FilmAnswer) == 320,
              "written and read whole: below a pipe's atomic size");

}  // namespace tessera

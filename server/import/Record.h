/// What the importing child process says to its parent through a pipe: a few records, each with its length and hash.
///
/// progress* (while it reads), size, scene (a SceneFile in plain form, without its blobs), blob* (in their order),
/// note* (a remark for the person), fault* (what is wrong and was left away), file* (what was read or looked for), end;
/// or one error. Everything in it is a foreign file's word until the parent has checked it.
#pragma once

#include <cstdint>

namespace tessera {

struct ImportRecord {
    static constexpr std::uint32_t kMagic = 0x31495354;  ///< "TSI1"; the same machine reads it, so native byte order

    enum class Kind : std::uint32_t {
        kScene = 1,
        kBlob = 2,
        kNote = 3,
        kError = 4,
        kEnd = 5,
        kFault = 6,
        kFile = 7,
        kProgress = 8,
        kSize = 9
    };

    std::uint32_t magic = kMagic;
    Kind kind = Kind::kEnd;
    std::uint64_t sizeBytes = 0;  ///< of the payload that follows
    std::uint64_t hash = 0;       ///< hash64 of the payload
};
static_assert(sizeof(ImportRecord) == 24);

/// The payload of an error: the number of an ErrorCode in one byte, then the message. Of a progress: this.
struct ImportProgress {
    std::uint64_t done = 0, total = 0;  ///< in what its reader counts; 0 of 0: nobody knows
    std::uint64_t converting = 0;       ///< 1: all is read
};
/// That of a size: the bytes that follow it with the scene and the blobs, as a number of 8 bytes.

}  // namespace tessera

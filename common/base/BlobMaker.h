/// A blob whose bytes come piece after piece.
#pragma once

#include <optional>

#include "common/base/Blob.h"

namespace tessera {

/// Takes memory as the bytes come, not as they are announced. A large blob lies in pages from the beginning (Blob::paged), and is
/// never there twice.
class BlobMaker {
public:
    explicit BlobMaker(std::uint64_t sizeBytes) : sizeBytes_(sizeBytes) {}

    /// No more than is missing.
    void append(ByteSpan bytes);
    [[nodiscard]] std::uint64_t missing() const { return sizeBytes_ - filled_; }
    /// Once nothing is missing. Hashes it.
    [[nodiscard]] Blob finish();

private:
    std::uint64_t sizeBytes_, filled_ = 0;
    std::optional<PagedBytes::Maker> pages_;
    Bytes bytes_;  ///< where there are no pages to be had
};

}  // namespace tessera

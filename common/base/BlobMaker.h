/// A blob whose bytes come piece after piece.
#pragma once

#include <memory>
#include <vector>

#include "common/base/Blob.h"

namespace tessera {

/// Where the bytes of a large blob come to lie. Ranges lie inside.
class BlobPlace {
public:
    virtual ~BlobPlace() = default;
    /// False: there is no memory for them.
    [[nodiscard]] virtual bool write(std::size_t offset, ByteSpan bytes) = 0;
    /// Of what has been written.
    virtual void read(std::size_t offset, std::span<std::byte> to) const = 0;
    /// All has been written, and nothing will be any more. Null: it cannot be had in one piece; `read` still can.
    [[nodiscard]] virtual std::shared_ptr<const PagedBytes> finish() = 0;
};

/// Takes memory as the bytes come, not as they are announced. A large blob lies in pages from the beginning
/// (Blob::paged), and is there once, but for a place that cannot be had in one piece: that is copied at the end. Each
/// of its leaves is hashed when it comes, if it comes in one piece. One thread at a time.
class BlobMaker {
public:
    /// `place`: for a large one, instead of pages of this process. May be null.
    explicit BlobMaker(std::uint64_t sizeBytes, std::unique_ptr<BlobPlace> place = nullptr);

    /// In any order; a range may come again. It lies inside.
    void write(std::uint64_t offset, ByteSpan bytes);
    /// Once every range has come. Hashes what is not hashed yet; this is over.
    [[nodiscard]] Blob finish();
    /// Of bytes, Blob::kPagedBytes and more, that are all in their place.
    [[nodiscard]] static Blob whole(std::uint64_t sizeBytes, std::unique_ptr<BlobPlace> place);

private:
    /// The bytes of this leaf have changed: they are hashed when it is known.
    void hash(std::size_t leaf, ByteSpan bytes);
    [[nodiscard]] std::size_t bytesOf(std::size_t leaf) const;
    void read(std::size_t offset, std::span<std::byte> to) const;
    void moveToHeap();

    std::uint64_t sizeBytes_, end_ = 0;  ///< behind all that has come
    std::unique_ptr<BlobPlace> place_;
    Bytes bytes_;                  ///< where there is no place
    std::vector<Hash128> leaves_;  ///< up to the last that is known
    std::vector<bool> known_;      ///< of each of these
};

}  // namespace tessera

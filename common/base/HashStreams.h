/// Hashes of bytes that come in pieces, so that they need not be in memory together.
#pragma once

#include <memory>
#include <vector>

#include "common/base/Blob.h"

namespace tessera {

/// hash64 of all pieces in a row.
class Hash64Stream {
public:
    Hash64Stream();
    ~Hash64Stream();
    Hash64Stream(const Hash64Stream&) = delete;
    Hash64Stream& operator=(const Hash64Stream&) = delete;

    void add(ByteSpan piece);
    [[nodiscard]] std::uint64_t hash() const;

private:
    struct State;
    std::unique_ptr<State> state_;
};

/// blobIdOf of all pieces in a row. Holds a leaf's bytes, and of each leaf before it the hash.
class BlobIdStream {
public:
    void add(ByteSpan piece);
    [[nodiscard]] BlobId id() const;

private:
    std::vector<Hash128> leaves_;
    Bytes begun_;  ///< of the leaf that is not whole yet
    std::uint64_t bytes_ = 0;
};

}  // namespace tessera

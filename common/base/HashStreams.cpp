#include "common/base/HashStreams.h"

#include <algorithm>

#ifndef XXH_INLINE_ALL
#define XXH_INLINE_ALL
#endif
#include <xxhash.h>

namespace tessera {

struct Hash64Stream::State {
    XXH3_state_t hash;
};

Hash64Stream::Hash64Stream() : state_(std::make_unique<State>()) {
    XXH3_64bits_reset(&state_->hash);
}
Hash64Stream::~Hash64Stream() = default;

void Hash64Stream::add(ByteSpan piece) {
    XXH3_64bits_update(&state_->hash, piece.data(), piece.size());
}

std::uint64_t Hash64Stream::hash() const {
    return XXH3_64bits_digest(&state_->hash);
}

void BlobIdStream::add(ByteSpan piece) {
    bytes_ += piece.size();
    while (!piece.empty()) {
        const std::size_t wanted = std::min(kBlobLeafBytes - begun_.size(), piece.size());
        if (wanted == kBlobLeafBytes) {
            leaves_.push_back(hash128(piece.first(wanted)));
        } else {
            begun_.insert(begun_.end(), piece.begin(), piece.begin() + static_cast<std::ptrdiff_t>(wanted));
            if (begun_.size() == kBlobLeafBytes) {
                leaves_.push_back(hash128(begun_));
                begun_.clear();
            }
        }
        piece = piece.subspan(wanted);
    }
}

BlobId BlobIdStream::id() const {
    if (bytes_ <= kBlobLeafBytes) return leaves_.empty() ? hash128(begun_) : leaves_.front();
    std::vector<Hash128> all = leaves_;
    if (!begun_.empty()) all.push_back(hash128(begun_));
    all.push_back({bytes_, kBlobLeafBytes});
    return hash128(std::as_bytes(std::span(all)));
}

}  // namespace tessera

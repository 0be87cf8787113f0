#include "common/base/ByteSlice.h"

#include "common/base/Hash.h"

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace tessera {

Bytes ByteChain::joined() const {
    Bytes all;
    all.reserve(size_);
    for (const ByteSlice& slice : slices_) all.insert(all.end(), slice.begin(), slice.end());
    return all;
}

std::uint64_t ByteChain::hash64(std::uint64_t seed) const {
    if (slices_.empty()) return tessera::hash64({}, seed);
    if (slices_.size() == 1) return tessera::hash64(slices_.front(), seed);
    XXH3_state_t state{};  // reset looks at what was there before
    XXH3_64bits_reset_withSeed(&state, seed);
    for (const ByteSlice& slice : slices_) XXH3_64bits_update(&state, slice.data(), slice.size());
    return XXH3_64bits_digest(&state);
}

}  // namespace tessera

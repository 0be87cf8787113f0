#include "common/drawable/Derivation.h"

#include <array>

#include "common/drawable/ContentCache.h"

namespace tessera {
namespace {

/// One a process, as content is the same for whoever asks: hosts of several tiles, a server's collision, picks and
/// report.
ContentCache<DerivedMesh>& derivedMeshes() {
    static ContentCache<DerivedMesh> cache(kMostUnusedDerivedBytes);
    return cache;
}

Hash128 keyOfState(const Hash128& recipe, const BlobId& points) {
    const std::array<Hash128, 2> both{recipe, points};
    return hash128(std::as_bytes(std::span(both)));
}

}  // namespace

MeshArrays derivedArrays(const Derivation& derivation, const void* core, const Fineness& fineness) {
    const std::optional<DerivedSource> source = derivation.source(core, fineness);
    if (!source) return {};
    ContentCache<DerivedMesh>& cache = derivedMeshes();
    const auto make = [&]() -> DerivedMesh {
        for (const Blob::Origin& origin : source->points.origins()) {
            const std::shared_ptr<const DerivedMesh> known = cache.find(keyOfState(source->recipe, origin.id));
            if (!known || known->arrays.positions.empty()) continue;
            const EarlierMesh earlier{*known, {origin.begin, origin.end}};
            return derivation.derive(core, fineness, &earlier);
        }
        return derivation.derive(core, fineness, nullptr);
    };
    return cache.get(keyOfState(source->recipe, source->points.id()), make)->arrays;
}

}  // namespace tessera

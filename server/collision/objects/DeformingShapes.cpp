#include "server/collision/objects/DeformingShapes.h"

#include <algorithm>

namespace tessera {

namespace {

using End = DeformingShapes::End;

/// Nothing where they are not as many as the mesh has, or not finite.
std::optional<End> endOfAll(std::span<const float> xyz, std::size_t count) {
    if (xyz.size() != 3 * count) return std::nullopt;
    End out;
    out.positions.resize(count);
    for (std::size_t i = 0; i < count; ++i) {
        out.positions[i] = Vec3d(xyz[3 * i], xyz[3 * i + 1], xyz[3 * i + 2]);
        if (!out.positions[i].allFinite()) return std::nullopt;
    }
    return out;
}

/// Nothing where the arrays do not fit the mesh. `from`: the array that the mesh has.
std::optional<End> endOfArrays(const MeshArrays& arrays, const BlobId& from, std::size_t count) {
    if (arrays.kind == MeshKind::kPoints) {
        const std::optional<MeshData> octahedra = octahedraOf(arrays);
        return octahedra ? endOfAll(octahedra->positions, count) : std::nullopt;
    }
    if (!arrays.positions.resident() || arrays.positions.sizeBytes() % sizeof(float) != 0) return std::nullopt;
    const auto origins = arrays.positions.origins();
    const auto origin = std::ranges::find(origins, from, &Blob::Origin::id);
    if (origin == origins.end() || arrays.positions.sizeBytes() != 3 * sizeof(float) * count)
        return endOfAll(arrays.positions.as<float>(), count);
    constexpr std::uint64_t kVertex = 3 * sizeof(float);
    const std::size_t first = origin->begin / kVertex,
                      end = std::min<std::size_t>(count, (origin->end + kVertex - 1) / kVertex);
    std::optional<End> out = endOfAll(arrays.positions.values<float>(3 * first, 3 * (end - first)), end - first);
    if (out) out->first = static_cast<std::uint32_t>(first);
    return out;
}

}  // namespace

/// Nothing where it is no longer a smooth surface of as many control points.
std::optional<DeformingShapes::Own::SmoothEnd> DeformingShapes::smoothEndOf(const Own& own, const Drawable& drawable) {
    std::optional<DerivedSource> source = drawable ? drawable.source() : std::nullopt;
    if (!source || !own.source) return std::nullopt;
    Own::SmoothEnd out{.source = *source, .first = 0, .points = {}, .surface = std::nullopt};
    const auto& subdivision = own.shape->smoothSurface()->subdivision();
    if (!subdivision || source->recipe != own.source->recipe) {
        out.surface = smoothShapeOf(drawable);
        return out.surface ? std::optional(std::move(out)) : std::nullopt;
    }
    // Three floats each (SmoothSurface.h).
    constexpr std::uint64_t kPoint = 3 * sizeof(float);
    std::size_t end = subdivision->positions.size();
    if (!source->points.resident() || source->points.sizeBytes() != 3 * sizeof(float) * end) return std::nullopt;
    const auto origins = source->points.origins();
    if (const auto origin = std::ranges::find(origins, own.source->points.id(), &Blob::Origin::id);
        origin != origins.end()) {
        out.first = origin->begin / kPoint;
        end = std::min<std::size_t>(end, (origin->end + kPoint - 1) / kPoint);
    }
    const std::vector<float> xyz = source->points.values<float>(3 * out.first, 3 * (end - out.first));
    for (std::size_t i = 0; i + 2 < xyz.size(); i += 3) out.points.emplace_back(xyz[i], xyz[i + 1], xyz[i + 2]);
    return out;
}

std::shared_ptr<const CollisionShape> DeformingShapes::follow(const Key& key, const MeshArrays& arrays, bool jump,
                                                              const Drawable& drawable) {
    Own& own = shapes_[key];
    const bool smooth = own.shape && own.shape->smoothSurface() != nullptr;
    const std::optional<DerivedSource> source =
        asksForSmooth(key.choice) && drawable ? drawable.source() : std::nullopt;
    // What had no smooth surface may have one of another recipe.
    const bool mayBecomeSmooth = !smooth && source && !(own.source && own.source->recipe == source->recipe);
    if (own.shape && !mayBecomeSmooth && own.indices == arrays.indices.id() && own.kind == arrays.kind &&
        own.pointRadius == arrays.pointRadius) {
        const BlobId positions = arrays.positions.id();
        const auto isOf = [&](const DerivedSource& known) {
            return source && known.recipe == source->recipe && known.points.id() == source->points.id();
        };
        if (own.positions == positions && (!smooth || isOf(*own.source))) {
            own.end.reset();
            own.smoothEnd.reset();
            return own.shape;
        }
        if (!jump) {
            if (own.end && own.endPositions == positions && (!smooth || isOf(own.smoothEnd->source))) return own.shape;
            own.end = endOfArrays(arrays, own.positions, own.shape->mesh().vertexCount());
            own.endPositions = positions;
            own.smoothEnd = smooth && own.end ? smoothEndOf(own, drawable) : std::nullopt;
            if (own.end && (!smooth || own.smoothEnd)) return own.shape;
        }
    }
    own = {.shape = ShapeCache::ownShape(arrays, key.choice, drawable),
           .positions = arrays.positions.id(),
           .indices = arrays.indices.id(),
           .kind = arrays.kind,
           .pointRadius = arrays.pointRadius,
           .endPositions = {},
           .end = {},
           .source = source,
           .smoothEnd = {}};
    return own.shape;
}

const DeformingShapes::End* DeformingShapes::endOf(const Key& key) const {
    const auto own = shapes_.find(key);
    return own != shapes_.end() && own->second.end ? &*own->second.end : nullptr;
}

void DeformingShapes::settle() {
    for (auto& [key, own] : shapes_) {
        if (!own.end) continue;
        const Expected<void> moved = own.shape->move(own.end->first, own.end->positions);
        TESSERA_CHECK(moved.has_value(), "an end is taken only where its vertices fit the mesh");
        own.positions = own.endPositions;
        own.end.reset();
        if (!own.smoothEnd) continue;
        if (own.smoothEnd->surface) {
            own.shape->setSmoothSurface(std::move(*own.smoothEnd->surface));
        } else {
            const Expected<void> followed = own.shape->moveControlPoints(own.smoothEnd->first, own.smoothEnd->points);
            TESSERA_CHECK(followed.has_value(), "of control points that are too far there are no triangles");
        }
        own.source = own.smoothEnd->source;
        own.smoothEnd.reset();
    }
}

void DeformingShapes::keepOnly(std::span<const Key> keys) {
    std::erase_if(shapes_,
                  [&](const auto& entry) { return !std::binary_search(keys.begin(), keys.end(), entry.first); });
}

}  // namespace tessera

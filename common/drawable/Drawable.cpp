#include "common/drawable/Drawable.h"

#include <algorithm>
#include <functional>

namespace tessera {
namespace {

const Geometry& geometry(const void* core) {
    return *static_cast<const Geometry*>(core);
}

constexpr DrawableType kDrawables[] = {
    {.type = typeOf<Geometry>(),
     .arrays = [](const void* core) -> MeshArrays {
         const Geometry& g = geometry(core);
         return {.positions = g.positions,
                 .normals = g.normals,
                 .colors = g.colors,
                 .texcoords = g.texcoords,
                 .indices = g.indices};
     },
     .material = [](const void* core) { return geometry(core).material; }},
};

}  // namespace

const DrawableType* findDrawable(ObjectType type) {
    for (const DrawableType& known : kDrawables)
        if (known.type == type) return &known;
    return nullptr;
}

Drawable drawableOf(const Object& core) {
    const DrawableType* type = core ? findDrawable(core.info().type) : nullptr;
    return type ? Drawable(*type, core.data()) : Drawable();
}

MeshKey Drawable::key() const {
    const MeshArrays all = arrays();
    return {all.positions.id(), all.normals.id(), all.colors.id(), all.texcoords.id(), all.indices.id()};
}

bool Drawable::resident() const {
    const MeshArrays all = arrays();
    for (const Blob* blob : {&all.positions, &all.normals, &all.colors, &all.texcoords, &all.indices})
        if (!blob->empty() && !blob->resident()) return false;
    return true;
}

Box Drawable::bounds() const {
    return boundsOf(arrays().positions.as<float>());
}

std::uint64_t Drawable::triangleCount() const {
    return arrays().indices.sizeBytes() / (3 * sizeof(std::uint32_t));
}

std::vector<MeshOrigin> originsOf(const MeshArrays& arrays) {
    const std::array<const Blob*, 5> blobs = {&arrays.positions, &arrays.normals, &arrays.colors, &arrays.texcoords,
                                              &arrays.indices};
    std::vector<MeshOrigin> origins;
    MeshOrigin origin{.key = {}, .changed = {}};
    // Each array as it is, or some edits back, so many of all arrays together: they need not have been edited together.
    const std::function<void(std::size_t, std::size_t)> choose = [&](std::size_t i, std::size_t back) {
        if (i == blobs.size()) {
            if (back == 0) origins.push_back(origin);
            return;
        }
        origin.key[i] = blobs[i]->id();
        origin.changed[i] = {};
        choose(i + 1, back);
        const std::span<const Blob::Origin> earlier = blobs[i]->origins();
        for (std::size_t k = 0; k < std::min(back, earlier.size()); ++k) {
            origin.key[i] = earlier[k].id;
            origin.changed[i] = {earlier[k].begin, earlier[k].end};
            choose(i + 1, back - k - 1);
        }
    };
    for (std::size_t back = 1; back <= Blob::kOrigins; ++back) choose(0, back);
    return origins;
}

Expected<void> Drawable::check(const MeshKey& sound) const {
    const MeshArrays all = arrays();
    if (all.positions.empty() && all.indices.empty()) return {};
    if (sound != MeshKey() && resident())
        for (const MeshOrigin& origin : originsOf(all))
            if (origin.key == sound && soundWithin(all, origin.changed)) return {};
    return checkMesh(all);
}

}  // namespace tessera

#include "common/drawable/Drawable.h"

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

Expected<void> Drawable::check() const {
    const MeshArrays all = arrays();
    if (all.positions.empty() && all.indices.empty()) return {};
    return checkMesh(all);
}

}  // namespace tessera

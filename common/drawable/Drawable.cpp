#include "common/drawable/Drawable.h"

#include <algorithm>
#include <functional>

#include "common/cores/SubdivisionSurface.h"
#include "common/cores/Text.h"
#include "common/drawable/DeformationArrays.h"
#include "common/drawable/EmitterArrays.h"
#include "common/drawable/GlyphArrays.h"
#include "common/drawable/NurbsArrays.h"
#include "common/drawable/ParticleArrays.h"
#include "common/drawable/PrimitiveArrays.h"
#include "common/drawable/ProxyArrays.h"
#include "common/drawable/SkinArrays.h"
#include "common/drawable/SubdivisionArrays.h"
#include "common/drawable/TextArrays.h"
#include "common/drawable/VolumeArrays.h"

namespace tessera {
namespace {

const Geometry& geometry(const void* core) {
    return *static_cast<const Geometry*>(core);
}

constexpr DrawableType kDrawables[] = {
    {.type = typeOf<Geometry>(),
     .arrays = [](const void* core) { return arraysOf(geometry(core)); },
     .material = [](const void* core) { return geometry(core).material; }},
    {.type = typeOf<SubdivisionSurface>(),
     .material = [](const void* core) { return static_cast<const SubdivisionSurface*>(core)->material; },
     .derivation = &kSubdivisionDerivation},
    {.type = typeOf<NurbsSurfaceCore>(),
     .material = [](const void* core) { return static_cast<const NurbsSurfaceCore*>(core)->material; },
     .derivation = &kNurbsDerivation},
    {.type = typeOf<Deformation>(),
     .material = [](const void* core) { return static_cast<const Deformation*>(core)->material; },
     .derivation = &kDeformationDerivation},
    {.type = typeOf<Text>(),
     .material = [](const void* core) { return static_cast<const Text*>(core)->material; },
     .derivation = &kTextDerivation},
    {.type = typeOf<Skin>(),
     .material = [](const void* core) { return static_cast<const Skin*>(core)->material; },
     .derivation = &kSkinDerivation},
    {.type = typeOf<Particles>(),
     .material = [](const void* core) { return static_cast<const Particles*>(core)->material; },
     .derivation = &kParticleDerivation},
    {.type = typeOf<ParticleEmitter>(),
     .material = [](const void* core) { return static_cast<const ParticleEmitter*>(core)->material; },
     .derivation = &kEmitterDerivation},
    {.type = typeOf<Glyphs>(),
     .material = [](const void* core) { return static_cast<const Glyphs*>(core)->material; },
     .derivation = &kGlyphDerivation},
    {.type = typeOf<Volume>(),
     .material = [](const void* core) { return static_cast<const Volume*>(core)->material; },
     .derivation = &kVolumeDerivation},
    {.type = typeOf<ProxyGroup>(), .material = [](const void*) { return ObjectId(); }, .derivation = &kProxyDerivation},
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

MeshKey keyOf(const MeshArrays& arrays) {
    return {.arrays = {arrays.positions.id(), arrays.normals.id(), arrays.colors.id(), arrays.texcoords.id(),
                       arrays.indices.id(), arrays.texcoords1.id(), arrays.lines.id(), arrays.tangents.id(),
                       arrays.copies.id()},
            .kind = arrays.kind,
            .sorted = arrays.sorted,
            .pointRadius = arrays.pointRadius};
}

bool Drawable::resident() const {
    if (type_->derivation) return type_->derivation->resident(core_);
    const MeshArrays all = arrays();
    for (const Blob* blob : {&all.positions, &all.normals, &all.colors, &all.texcoords, &all.indices, &all.texcoords1,
                             &all.lines, &all.tangents, &all.copies})
        if (!blob->empty() && !blob->resident()) return false;
    return true;
}

std::vector<MeshOrigin> originsOf(const MeshArrays& arrays) {
    const std::array<const Blob*, kMeshArrays> blobs = {&arrays.positions, &arrays.normals,  &arrays.colors,
                                                        &arrays.texcoords, &arrays.indices,  &arrays.texcoords1,
                                                        &arrays.lines,     &arrays.tangents, &arrays.copies};
    std::vector<MeshOrigin> origins;
    MeshOrigin origin{.key = keyOf(arrays), .changed = {}};
    // Each array as it is, or some edits back, so many of all arrays together: they need not have been edited together.
    const std::function<void(std::size_t, std::size_t)> choose = [&](std::size_t i, std::size_t back) {
        if (i == blobs.size()) {
            if (back == 0) origins.push_back(origin);
            return;
        }
        origin.key.arrays[i] = blobs[i]->id();
        origin.changed[i] = {};
        choose(i + 1, back);
        const std::span<const Blob::Origin> earlier = blobs[i]->origins();
        for (std::size_t k = 0; k < std::min(back, earlier.size()); ++k) {
            origin.key.arrays[i] = earlier[k].id;
            origin.changed[i] = {earlier[k].begin, earlier[k].end};
            choose(i + 1, back - k - 1);
        }
    };
    for (std::size_t back = 1; back <= Blob::kOrigins; ++back) choose(0, back);
    return origins;
}

Expected<void> Drawable::check(const MeshKey& sound) const {
    if (type_->derivation) return type_->derivation->check(core_);
    if (type_->type == typeOf<Geometry>())
        if (Expected<void> made = checkPrimitives(geometry(core_)); !made) return made;
    const MeshArrays all = arrays();
    if (all.positions.empty() && all.indices.empty() && all.lines.empty()) return {};
    if (sound != MeshKey() && resident()) {
        MeshKey same = keyOf(all);
        same.pointRadius = sound.pointRadius;  // the table of types bounds it
        if (same == sound) return {};
        for (const MeshOrigin& origin : originsOf(all))
            if (origin.key == sound && soundWithin(all, origin.changed)) return {};
    }
    return checkMesh(all);
}

}  // namespace tessera

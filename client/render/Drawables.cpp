#include "client/render/Drawables.h"

namespace tessera {

MeshKey Drawable::key() const {
    return {core_->positions.id(), core_->normals.id(), core_->colors.id(), core_->texcoords.id(), core_->indices.id()};
}

bool Drawable::resident() const {
    for (const Blob* blob : {&core_->positions, &core_->normals, &core_->colors, &core_->texcoords, &core_->indices})
        if (!blob->empty() && !blob->resident()) return false;
    return true;
}

MeshArrays Drawable::arrays() const {
    return {.positions = core_->positions,
            .normals = core_->normals,
            .colors = core_->colors,
            .texcoords = core_->texcoords,
            .indices = core_->indices};
}

ObjectId Drawable::material() const {
    return core_->material;
}

bool isDrawable(ObjectType type) {
    return type == typeOf<Geometry>();
}

Drawable drawableOf(const Aspect& aspect, ObjectId core) {
    Drawable drawable;
    drawable.core_ = core ? aspect.get<Geometry>(core) : nullptr;
    return drawable;
}

}  // namespace tessera

#include "client/render/scene/LookSources.h"

#include <utility>

#include "client/render/DrawMesh.h"
#include "common/cores/SurfaceParts.h"

namespace tessera {

std::shared_ptr<const LookSource> LookSources::acquire(const Aspect& aspect, ObjectId material) {
    Use& use = uses_[material];
    if (use.users++ == 0) {
        use.source = std::make_shared<LookSource>(LookSource{.material = material, .serial = nextSerial()});
        look(aspect, use);
    }
    return use.source;
}

void LookSources::release(ObjectId material) {
    const auto use = uses_.find(material);
    if (--use->second.users > 0) return;
    setParts(use->second, {});
    uses_.erase(use);
}

void LookSources::changed(const Aspect& aspect, ObjectId id) {
    const auto renew = [&](ObjectId material) {
        Use& use = uses_.at(material);
        ++use.source->version;
        look(aspect, use);
    };
    if (const auto users = madeOf_.find(id); users != madeOf_.end()) {
        const std::set<ObjectId> materials = users->second;  // they may be made of other things now
        for (const ObjectId material : materials) renew(material);
    }
    if (uses_.contains(id)) renew(id);
}

void LookSources::clear() {
    uses_.clear();
    madeOf_.clear();
}

void LookSources::look(const Aspect& aspect, Use& use) {
    describe(aspect, *use.source);
    std::set<ObjectId> parts;
    const auto* core = aspect.get<Material>(use.source->material);
    const auto add = [&parts](ObjectId id) {
        if (id) parts.insert(id);
    };
    if (core) {
        for (const ObjectId id : {core->baseColorImage, core->metallicRoughnessImage, core->normalImage,
                                  core->occlusionImage, core->emissiveImage, core->program})
            add(id);
        for (const ObjectId id : core->layers) {
            add(id);
            if (const auto* layer = aspect.get<TextureLayer>(id)) add(layer->image);
        }
        for (const ObjectId id : core->uniforms) {
            add(id);
            if (const auto* uniform = aspect.get<Uniform>(id)) add(uniform->image);
        }
    }
    setParts(use, std::move(parts));
}

void LookSources::setParts(Use& use, std::set<ObjectId> parts) {
    if (use.parts == parts) return;
    for (const ObjectId part : use.parts) {
        const auto users = madeOf_.find(part);
        users->second.erase(use.source->material);
        if (users->second.empty()) madeOf_.erase(users);
    }
    use.parts = std::move(parts);
    for (const ObjectId part : use.parts) madeOf_[part].insert(use.source->material);
}

}  // namespace tessera

#include "client/render/DrawMaterial.h"

#include <algorithm>

#include "client/render/DrawMesh.h"
#include "common/cores/SurfaceParts.h"

namespace tessera {

bool hasBadProgram(const Aspect& aspect, const Material& material) {
    const auto* program = material.program ? aspect.get<SurfaceProgram>(material.program) : nullptr;
    return program && !(program->surface.empty() && program->vertex.empty()) &&
           program->verdict == SurfaceProgram::kBad;
}

std::vector<ObjectId> passesOf(const Aspect& aspect, const Material& material) {
    std::vector<ObjectId> passes;
    for (const ObjectId id : material.passes)
        if (passes.size() < Material::kMostPasses && aspect.get<Material>(id)) passes.push_back(id);
    return passes;
}

std::vector<ObjectId> coarserOf(const Aspect& aspect, const Material& material) {
    std::vector<ObjectId> chain;
    const Material* at = &material;
    while (at && at->coarser && chain.size() < kMostCoarser) {
        const ObjectId next = at->coarser;
        at = aspect.get<Material>(next);
        if (!at || at == &material || std::ranges::find(chain, next) != chain.end()) break;
        chain.push_back(next);
    }
    return chain;
}

bool isBlended(const Material& pass) {
    return pass.alphaMode == Material::kBlend || pass.transmission > 0 ||
           (pass.alphaMode == Material::kAutoAlpha && pass.baseColor.w() < 1);
}

void describe(const Aspect& aspect, LookSource& source) {
    const auto* core = source.material ? aspect.get<Material>(source.material) : nullptr;
    source.doubleSided = core && core->doubleSided;
    source.normalImage = nullptr;
    if (const auto* image = core && core->normalImage ? aspect.get<Image>(core->normalImage) : nullptr) {
        auto placed = std::make_shared<Image>(*image);
        placed->pixels = Blob();
        source.normalImage = std::move(placed);
    }
    source.shapes = core && (core->alphaMode == Material::kMask || core->program);
}

std::vector<DrawMaterial::Level> levelsOf(const Aspect& aspect, ObjectId material, const SourceOf& source) {
    static const Material kDefault;
    const auto layer = [&](ObjectId id) {
        const auto* core = aspect.get<Material>(id);
        const Material& of = core ? *core : kDefault;
        return DrawMaterial::Layer{.look = source(id),
                                   .blended = isBlended(of),
                                   .fill = of.fill,
                                   .lineWidth = of.fill == Material::kEdges     ? of.lineWidth
                                                : of.fill == Material::kCorners ? of.pointSize
                                                                                : 0};
    };
    std::vector<DrawMaterial::Level> levels;
    const auto add = [&](ObjectId id) {
        DrawMaterial::Level& level = levels.emplace_back();
        level.own = layer(id);
        const auto* core = aspect.get<Material>(id);
        if (!core) return;
        level.coarserBelow = core->coarserBelow;
        if (!hasBadProgram(aspect, *core))
            for (const ObjectId pass : passesOf(aspect, *core)) level.passes.push_back(layer(pass));
    };
    add(material);
    if (const auto* core = aspect.get<Material>(material))
        for (const ObjectId id : coarserOf(aspect, *core)) add(id);
    return levels;
}

std::shared_ptr<const DrawMaterial> drawMaterialOf(const Aspect& aspect, ObjectId material) {
    const auto source = [&aspect](ObjectId id) {
        auto made = std::make_shared<LookSource>(LookSource{.material = id, .serial = nextSerial()});
        describe(aspect, *made);
        return made;
    };
    return std::make_shared<const DrawMaterial>(DrawMaterial{.levels = levelsOf(aspect, material, source)});
}

}  // namespace tessera

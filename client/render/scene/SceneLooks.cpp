#include "client/render/scene/SceneLooks.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "common/cores/Image.h"
#include "common/cores/SurfaceParts.h"
#include "common/drawable/ImageLayout.h"
#include "common/drawable/VolumeShapes.h"

namespace tessera {

namespace {

/// As screens draw it where nothing is finer.
Drawable drawableOnScreens(const Aspect& aspect, ObjectId core) {
    const Drawable drawable = drawableOf(aspect, core);
    return drawable ? drawable.at(finenessOnScreens(aspect, core)) : drawable;
}

bool isGlossy(const Material& material) {
    static const Material kPlain;
    return material.shading == Material::kPhong || material.specular != kPlain.specular ||
           material.specularColor != kPlain.specularColor || material.ior != kPlain.ior;
}

}  // namespace

SceneLook SceneLooks::of(const Aspect& aspect, ObjectId core) {
    std::uint32_t slot = drawables_.find(core);
    if (slot == kNone) {
        slot = drawables_.add(core);
        const Drawable drawable = drawableOnScreens(aspect, core);
        if (drawable) {
            drawables_[slot].mesh = meshes_.acquire(drawable);
            setMaterial(aspect, slot, drawable.material());
            drawables_[slot].lineWidth = drawable.arrays().lineWidth;
            keep(slot, drawable);
        }
    }
    const DrawableUse& use = drawables_[slot];
    return lookOf(use, use.materialId, use.material);
}

SceneLook SceneLooks::of(const Aspect& aspect, ObjectId core, ObjectId held) {
    (void)of(aspect, core);
    return lookOf(drawables_[drawables_.find(core)], held, materials_.find(held));
}

SceneLook SceneLooks::lookOf(const DrawableUse& use, ObjectId materialId, std::uint32_t materialSlot) const {
    SceneLook look{.mesh = use.mesh,
                   .material = materialId,
                   .lineWidth = use.lineWidth,
                   .lineLayers = 1,
                   .byScreen = use.screenError > 0,
                   .slack = use.slack};
    if (use.mesh) look.kind = use.mesh->kind();
    look.occludes = use.mesh && use.mesh->opaque && rowOf(look.kind).hides && use.mesh->triangles > 0;
    look.fineness = rowOf(look.kind).fineness;
    if (rowOf(look.kind).volume) {
        look.material = {};
    } else if (materialSlot != kNone) {
        const MaterialUse& material = materials_[materialSlot];
        look.drawn = material.drawn;
        look.transparent = material.transparent || (material.blends && use.mesh && !use.mesh->opaque);
        look.occludes = look.occludes && material.opaque;
        look.detailed = material.detailed;
        look.coated = material.coated;
        look.glossy = material.glossy;
        look.asWhole = material.moved && rowOf(look.kind).surface;
        look.lineLayers = material.layers;
        if (look.asWhole) look.slack += material.reach;
        if (look.kind == MeshKind::kTriangles) {
            look.fill = material.fill;
            look.lineWidth = material.outline;
            look.lineLayers = material.outlines;
            look.cornersAlone = !material.edges;
            if (look.fill != Material::kFilled) {
                // Drawn as lines are: seen through, without shadow, from everywhere.
                look.kind = MeshKind::kLines;
                look.asWhole = true;
                look.occludes = false;
            }
        }
        look.over = material.over && !look.transparent;
        look.coarser = material.coarser;
        look.cut = material.cut;
        look.state = material.state;
    }
    look.transparent = look.transparent || rowOf(look.kind).particles || rowOf(look.kind).volume;
    static_assert(kDrawKinds.size() <= 16);
    if (use.mesh) look.state = static_cast<std::uint16_t>(16 * look.state + static_cast<unsigned>(look.kind));
    return look;
}

void SceneLooks::drop(ObjectId core) {
    const std::uint32_t slot = drawables_.find(core);
    if (slot == kNone) return;
    meshes_.release(drawables_[slot].mesh);
    releaseSteps(drawables_[slot]);
    leaveMaterial(slot);
    drawables_.erase(slot);
}

void SceneLooks::clear() {
    for (std::size_t slot = 0; slot < drawables_.slots().size(); ++slot) {
        const DrawableUse& use = drawables_.slots()[slot];
        if (!use.id) continue;
        meshes_.release(use.mesh);
        for (const KeptStep& step : use.steps) meshes_.release(step.mesh);
        for (const KeptPattern& pattern : use.patterns) meshes_.release(pattern.mesh);
    }
    drawables_.clear();
    stepped_.clear();
    materials_.clear();
    images_.clear();
    sources_.clear();
    partUsers_.clear();
}

void SceneLooks::shapeChanged(const Aspect& aspect, ObjectId id, std::vector<ObjectId>& changed) {
    const std::uint32_t slot = drawables_.find(id);
    const Drawable drawable = slot == kNone ? Drawable() : drawableOnScreens(aspect, id);
    if (!drawable) return;
    const RenderMesh* before = drawables_[slot].mesh;
    drawables_[slot].mesh = meshes_.acquire(drawable);
    meshes_.release(before);
    const bool wasByScreen = drawables_[slot].screenError > 0;
    keep(slot, drawable);
    // What screens make of it has changed with it.
    if (drawables_[slot].mesh != before || wasByScreen || drawables_[slot].screenError > 0) changed.push_back(id);
}

void SceneLooks::keep(std::uint32_t slot, const Drawable& now) {
    DrawableUse& use = drawables_[slot];
    if (!now.byScreen() || !use.mesh || !use.mesh->drawable()) {
        releaseSteps(use);
        use.keeper = nullptr;
        use.parts = nullptr;
        use.screenError = use.slack = 0;
        return;
    }
    use.kept = now.kept(use.keeper);
    use.screenError = use.kept.screenError();
    use.parts = use.kept.parts();
    const std::size_t steps = use.parts ? 1 : std::size_t{use.kept.finest()} + 1;
    if (use.steps.size() != steps) releaseSteps(use);
    use.steps.resize(steps);
    for (KeptStep& step : use.steps) step.stale = true;
    for (KeptPattern& pattern : use.patterns) pattern.stale = true;
    use.steps[0].deviation = use.kept.deviation();
    // What is as far off is not wholly in the box of numbers that are rounded.
    const Box& bounds = use.mesh->bounds;
    use.slack = use.steps[0].deviation +
                1e-6 * std::max(bounds.lower.cwiseAbs().maxCoeff(), bounds.upper.cwiseAbs().maxCoeff());
}

void SceneLooks::releaseSteps(DrawableUse& use) {
    for (const KeptStep& step : use.steps) meshes_.release(step.mesh);
    for (const KeptPattern& pattern : use.patterns) meshes_.release(pattern.mesh);
    use.steps.clear();
    use.patterns.clear();
    stepped_.erase(use.id);
}

SceneLooks::Step SceneLooks::stepOf(ObjectId core, unsigned fineness) {
    DrawableUse& use = drawables_[drawables_.find(core)];
    KeptStep& step = use.steps[fineness];
    if (fineness == 0) return {use.mesh, step.deviation};
    if (!step.mesh || step.stale) {
        // The one before is let go of when this one has been made, which may take over some of it.
        const RenderMesh* before = step.mesh;
        const Drawable finer = use.kept.at(fineness);
        step.mesh = meshes_.acquire(finer);
        meshes_.release(before);
        step.deviation = step.mesh && step.mesh->drawable() ? finer.deviation() : 0;
        step.stale = false;
        stepped_.insert(core);
    }
    step.look = look_;
    return {step.mesh, step.deviation};
}

const RenderMesh* SceneLooks::meshOf(ObjectId core, const Fineness& fineness) {
    DrawableUse& use = drawables_[drawables_.find(core)];
    if (fineness == Fineness()) return use.mesh;
    auto pattern = std::find_if(use.patterns.begin(), use.patterns.end(),
                                [&fineness](const KeptPattern& kept) { return kept.fineness == fineness; });
    if (pattern == use.patterns.end())
        pattern = use.patterns.insert(use.patterns.end(), {.fineness = fineness, .mesh = nullptr, .stale = true});
    if (pattern->stale) {
        // As in stepOf.
        const RenderMesh* before = pattern->mesh;
        pattern->mesh = meshes_.acquire(use.kept.at(fineness));
        meshes_.release(before);
        pattern->stale = false;
        stepped_.insert(core);
    }
    pattern->look = look_;
    return pattern->mesh;
}

// Screens of one host look in turn, and eyes go back and forth. Of patterns an eye that moves leaves one behind with
// every few frames.
void SceneLooks::endLook() {
    constexpr std::uint64_t kKeptLooks = 64, kKeptPatterns = 8;
    const bool steps = look_ % kKeptLooks == 0;
    bool anyErased = false;
    for (auto core = stepped_.begin(); core != stepped_.end();) {
        DrawableUse& use = drawables_[drawables_.find(*core)];
        std::erase_if(use.patterns, [this, &anyErased](const KeptPattern& pattern) {
            const bool old = pattern.look + kKeptPatterns <= look_;
            if (old) meshes_.release(pattern.mesh);
            anyErased = anyErased || old;
            return old;
        });
        bool any = !steps || !use.patterns.empty();
        for (KeptStep& step : use.steps) {
            if (!steps) break;
            if (step.mesh && step.look + kKeptLooks <= look_) {
                meshes_.release(step.mesh);
                step.mesh = nullptr;
            }
            any = any || step.mesh;
        }
        core = any ? std::next(core) : stepped_.erase(core);
    }
    // While an eye alone moves, no update comes that would.
    if (anyErased) meshes_.dropUnused();
}

void SceneLooks::lookChanged(const Aspect& aspect, ObjectId id, std::vector<ObjectId>& changed) {
    sources_.changed(aspect, id);
    if (const auto part = partUsers_.find(id); part != partUsers_.end()) {
        const std::set<std::uint32_t> users = part->second;
        for (const std::uint32_t m : users)
            if (refresh(aspect, m)) appendDrawables(m, changed);
    }
    if (const std::uint32_t slot = drawables_.find(id); slot != kNone) {
        const Drawable drawable = drawableOnScreens(aspect, id);
        if (!drawable) return;
        const MeshArrays arrays = drawable.arrays();
        // Colours and ramps of particles are in their arrays, planes of volumes too: those that nothing is left of
        // included.
        if (rowOf(arrays.kind).particles || finenessOnScreens(aspect, id) != Fineness())
            shapeChanged(aspect, id, changed);
        const float lineWidth = arrays.lineWidth;
        if (drawable.material() == drawables_[slot].materialId && lineWidth == drawables_[slot].lineWidth) return;
        drawables_[slot].lineWidth = lineWidth;
        setMaterial(aspect, slot, drawable.material());
        changed.push_back(id);
    } else if (const std::uint32_t material = materials_.find(id); material != kNone) {
        if (refresh(aspect, material)) appendDrawables(material, changed);
    } else if (const std::uint32_t image = images_.find(id); image != kNone) {
        for (std::uint32_t m = images_[image].firstMaterial, next = kNone; m != kNone; m = next) {
            next = materials_[m].ofImage.next;  // it may take to another image here
            if (refresh(aspect, m)) appendDrawables(m, changed);
        }
    }
}

void SceneLooks::appendDrawables(std::uint32_t material, std::vector<ObjectId>& to) const {
    if (materials_[material].held > 0) to.push_back(materials_[material].id);
    for (std::uint32_t d = materials_[material].firstDrawable; d != kNone; d = drawables_[d].ofMaterial.next)
        to.push_back(drawables_[d].id);
}

void SceneLooks::setMaterial(const Aspect& aspect, std::uint32_t drawable, ObjectId material) {
    leaveMaterial(drawable);
    if (!material) return;
    DrawableUse& use = drawables_[drawable];
    use.materialId = material;
    use.material = knownMaterial(aspect, material);
    linkFirst(drawables_, materials_[use.material].firstDrawable, drawable, &DrawableUse::ofMaterial);
}

std::uint32_t SceneLooks::knownMaterial(const Aspect& aspect, ObjectId material) {
    std::uint32_t slot = materials_.find(material);
    if (slot != kNone) return slot;
    slot = materials_.add(material);
    refresh(aspect, slot);
    return slot;
}

void SceneLooks::forgetUnused(std::uint32_t material) {
    if (materials_[material].firstDrawable != kNone || materials_[material].held > 0) return;
    setImage(material, {});
    setParts(material, {});
    releaseSources(materials_[material].drawn->levels);
    materials_.erase(material);
}

void SceneLooks::hold(const Aspect& aspect, ObjectId material) {
    const std::uint32_t slot = knownMaterial(aspect, material);
    ++materials_[slot].held;
}

void SceneLooks::release(ObjectId material) {
    const std::uint32_t slot = materials_.find(material);
    --materials_[slot].held;
    forgetUnused(slot);
}

void SceneLooks::leaveMaterial(std::uint32_t drawable) {
    DrawableUse& use = drawables_[drawable];
    if (use.material != kNone) {
        MaterialUse& material = materials_[use.material];
        unlink(drawables_, material.firstDrawable, drawable, &DrawableUse::ofMaterial);
        forgetUnused(use.material);
    }
    use.materialId = {};
    use.material = kNone;
}

void SceneLooks::setImage(std::uint32_t material, ObjectId image) {
    MaterialUse& use = materials_[material];
    const ObjectId before = use.image == kNone ? ObjectId() : images_[use.image].id;
    if (before == image) return;
    if (use.image != kNone) {
        unlink(materials_, images_[use.image].firstMaterial, material, &MaterialUse::ofImage);
        if (images_[use.image].firstMaterial == kNone) images_.erase(use.image);
    }
    use.image = kNone;
    if (!image) return;
    use.image = images_.find(image);
    if (use.image == kNone) use.image = images_.add(image);
    linkFirst(materials_, images_[use.image].firstMaterial, material, &MaterialUse::ofImage);
}

void SceneLooks::setParts(std::uint32_t material, std::set<ObjectId> parts) {
    MaterialUse& use = materials_[material];
    if (use.parts == parts) return;
    for (const ObjectId part : use.parts) {
        const auto users = partUsers_.find(part);
        users->second.erase(material);
        if (users->second.empty()) partUsers_.erase(users);
    }
    use.parts = std::move(parts);
    for (const ObjectId part : use.parts) partUsers_[part].insert(material);
}

void SceneLooks::releaseSources(std::span<const DrawMaterial::Level> levels) {
    for (const DrawMaterial::Level& level : levels) {
        sources_.release(level.own.look->material);
        for (const DrawMaterial::Layer& pass : level.passes) sources_.release(pass.look->material);
    }
}

bool SceneLooks::refresh(const Aspect& aspect, std::uint32_t material) {
    std::shared_ptr<DrawMaterial>& drawn = materials_[material].drawn;
    if (!drawn) drawn = std::make_shared<DrawMaterial>();
    const std::vector<DrawMaterial::Level> before = std::exchange(
        drawn->levels,
        levelsOf(aspect, materials_[material].id, [&](ObjectId id) { return sources_.acquire(aspect, id); }));
    releaseSources(before);
    const auto* core = aspect.get<Material>(materials_[material].id);
    if (!core) return false;
    setImage(material, core->baseColorImage);
    // Before the server has tried it a program says nothing; a bad one is drawn as what is wrong.
    std::set<ObjectId> parts;
    bool written = false, moved = false, over = false, passDetailed = false, passCoated = false, passGlossy = false;
    double reach = 0;
    float outline = 0;
    // Of the material, or of that one of the coarser ones that has most.
    unsigned outlines = 0, layers = 0, outlinesOfThis = 0, layersOfThis = 0;
    bool edges = false;
    const auto lookAt = [&](const Material& of) {
        ++layersOfThis;
        outlinesOfThis += of.fill != Material::kFilled;
        edges = edges || of.fill == Material::kEdges;
        if (of.fill != Material::kFilled)
            outline = std::max(outline, of.fill == Material::kEdges ? of.lineWidth : of.pointSize);
        const auto* program = of.program ? aspect.get<SurfaceProgram>(of.program) : nullptr;
        if (of.program) parts.insert(of.program);
        if (!program || program->verdict == SurfaceProgram::kUntried ||
            (program->surface.empty() && program->vertex.empty()))
            return;
        written = true;
        if (program->verdict != SurfaceProgram::kGood || program->vertex.empty()) return;
        moved = true;
        reach = std::max(reach, program->reach);
    };
    // What shadows follow from besides arrays. Coarser ones cast none.
    bool cuts = false;
    const auto lookForCuts = [&](const Material& of) {
        if (of.alphaMode != Material::kMask && !of.program) return;
        cuts = true;
        for (const ObjectId image :
             {of.baseColorImage, of.metallicRoughnessImage, of.normalImage, of.occlusionImage, of.emissiveImage})
            if (image) parts.insert(image);
        for (const ObjectId id : of.uniforms) {
            parts.insert(id);
            const auto* uniform = aspect.get<Uniform>(id);
            if (uniform && uniform->image) parts.insert(uniform->image);
        }
    };
    lookForCuts(*core);
    for (const ObjectId pass : passesOf(aspect, *core)) lookForCuts(*aspect.get<Material>(pass));
    lookAt(*core);
    const bool ownWritten = written;
    const auto lookAtOther = [&](const Material& other) {
        lookAt(other);
        passDetailed = passDetailed || other.metallicRoughnessImage || other.occlusionImage || other.emissiveImage;
        passCoated = passCoated || other.clearcoat > 0;
        passGlossy = passGlossy || isGlossy(other);
    };
    const auto lookAtPasses = [&](const Material& of) {
        for (const ObjectId id : passesOf(aspect, of)) {
            const auto& pass = *aspect.get<Material>(id);
            lookAtOther(pass);
            over = over || isBlended(pass);
        }
        for (const ObjectId pass : of.passes) parts.insert(pass);
        outlines = std::max(outlines, std::exchange(outlinesOfThis, 0));
        layers = std::max(layers, std::exchange(layersOfThis, 0));
    };
    lookAtPasses(*core);
    // Of any of the coarser ones that a screen may draw in its place. It hides things where all of them surely do.
    bool coarserOpaque = true;
    const std::vector<ObjectId> coarser = coarserOf(aspect, *core);
    for (const ObjectId id : coarser) {
        parts.insert(id);
        const Material& other = *aspect.get<Material>(id);
        lookAtOther(other);
        lookAtPasses(other);
        const bool plain = other.alphaMode == Material::kOpaque || (other.alphaMode == Material::kAutoAlpha &&
                                                                    other.baseColor.w() >= 1 && !other.baseColorImage);
        coarserOpaque =
            coarserOpaque && plain && !other.program && other.fill == Material::kFilled && !(other.transmission > 0);
    }
    if (core->coarser) parts.insert(core->coarser);
    setParts(material, std::move(parts));
    MaterialUse& use = materials_[material];
    const bool detailed =
        written || passDetailed || core->metallicRoughnessImage || core->occlusionImage || core->emissiveImage;
    const bool coated = passCoated || core->clearcoat > 0;
    const bool glossy = passGlossy || isGlossy(*core);
    const bool blends = core->alphaMode == Material::kBlend;
    const bool thin = core->baseColor.w() < 1.0f;
    bool transparent = core->transmission > 0 || (thin && (blends || core->alphaMode == Material::kAutoAlpha));
    // An image is looked through only where that decides something.
    const bool ignored = core->alphaMode == Material::kOpaque;
    // A cutoff above 1 leaves nothing; at 1 rounding may.
    const bool cut = core->alphaMode == Material::kMask && core->alphaCutoff > 0.99f;
    const bool opaque = !ownWritten && !moved && coarserOpaque && !transparent && !cut &&
                        (ignored || (!thin && (use.image == kNone || imageOpaque(aspect, use.image))));
    transparent = transparent || (blends && !opaque);
    std::uint16_t state = ownWritten;
    for (const bool bit : {bool(core->baseColorImage), bool(core->metallicRoughnessImage), bool(core->normalImage),
                           bool(core->occlusionImage), bool(core->emissiveImage), core->alphaMode == Material::kMask,
                           core->doubleSided != 0, !core->layers.empty()})
        state = static_cast<std::uint16_t>(2 * state + bit);
    const bool another = transparent != use.transparent || blends != use.blends || opaque != use.opaque ||
                         detailed != use.detailed || coated != use.coated || glossy != use.glossy ||
                         state != use.state || moved != use.moved || reach != use.reach || core->fill != use.fill ||
                         outline != use.outline || outlines != use.outlines || layers != use.layers ||
                         edges != use.edges || over != use.over || coarser.empty() == use.coarser || cuts ||
                         use.cut != 0;
    use.transparent = transparent;
    use.blends = blends;
    use.opaque = opaque;
    use.detailed = detailed;
    use.coated = coated;
    use.glossy = glossy;
    use.state = state;
    use.moved = moved;
    use.reach = reach;
    use.fill = core->fill;
    use.outline = outline;
    use.outlines = static_cast<std::uint8_t>(outlines);
    use.layers = static_cast<std::uint8_t>(layers);
    use.edges = edges;
    use.over = over;
    use.cut = cuts ? ++cuts_ : 0;
    use.coarser = !coarser.empty();
    return another;
}

bool SceneLooks::imageOpaque(const Aspect& aspect, std::uint32_t image) {
    ImageUse& use = images_[image];
    const auto* core = aspect.get<Image>(use.id);
    if (!core) return true;
    if (!core->pixels.resident()) return false;
    // One that does not fit its bytes is drawn as none.
    if (!checkImage(*core)) return true;
    if (core->pixels.id() != use.pixels || core->encoding != use.encoding) {
        use.pixels = core->pixels.id();
        use.encoding = core->encoding;
        use.opaque = isOpaque(*core);
    }
    return use.opaque;
}

}  // namespace tessera

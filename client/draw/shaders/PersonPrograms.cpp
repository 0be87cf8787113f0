#include "client/draw/shaders/PersonPrograms.h"

#include <algorithm>

#include "client/draw/shaders/ShaderText.h"
#include "common/cores/Material.h"
#include "common/cores/SurfaceParts.h"
#include "common/drawable/ProgramImages.h"

namespace tessera {
namespace {

const SurfaceProgram* programOf(const Aspect& aspect, const Material& material) {
    const auto* program = material.program ? aspect.get<SurfaceProgram>(material.program) : nullptr;
    return program && !(program->surface.empty() && program->vertex.empty()) ? program : nullptr;
}

}  // namespace

PersonPrograms::PersonPrograms() {
    known_.emplace(kError, Known{.text = {.surface = shader_text::kErrorSurface, .vertex = {}, .uniforms = {}}});
}

PersonPrograms::Found PersonPrograms::find(const Aspect& aspect, const Material& material) {
    const SurfaceProgram* program = programOf(aspect, material);
    if (!program || program->verdict == SurfaceProgram::kUntried || program->verdict == SurfaceProgram::kHeavy)
        return {};
    if (program->verdict != SurfaceProgram::kGood) return {.drawn = kError};
    if (uniformOfAnotherShape(aspect, material)) return {};
    const auto [it, isNew] = ids_.try_emplace({program->surface, program->vertex}, next_);
    if (isNew) {
        Known known;
        if (auto text = preparePersonText(program->surface, program->vertex)) {
            known.text = std::move(*text);
        } else {
            known.refused = true;
            trouble_ = text.error().message;
        }
        known_.emplace(next_++, std::move(known));
    }
    Known& known = known_.at(it->second);
    clock_.use(known.uses);
    known.object = material.program;
    if (known.refused) return {.drawn = kError, .known = it->second};
    const bool left = known.heldUpFor > Duration::zero() || (known.text.surface.empty() && known.text.vertex.empty());
    return {.drawn = left ? kNone : it->second, .known = it->second};
}

PersonValues PersonPrograms::valuesOf(const Aspect& aspect, const Material& material, std::uint32_t person,
                                      TextureCache& textures) const {
    PersonValues values;
    if (person <= kError) return values;
    values.reach = static_cast<float>(aspect.get<SurfaceProgram>(material.program)->reach);
    const auto said = [&](const std::string& name) -> const Uniform* {
        for (const ObjectId id : material.uniforms)
            if (const auto* uniform = aspect.get<Uniform>(id); uniform && uniform->name == name) return uniform;
        return nullptr;
    };
    for (const PersonUniform& wanted : textOf(person).uniforms) {
        const Uniform* uniform = said(wanted.name);
        if (wanted.width > 0) {
            const Vec4f value = uniform ? uniform->value : Vec4f(Vec4f::Zero());
            values.numbers.push_back({value.x(), value.y(), value.z(), value.w()});
            continue;
        }
        const auto* image = uniform && uniform->image ? aspect.get<Image>(uniform->image) : nullptr;
        const TextureCache::Found texture = image ? textures.find(*image, ImageUse::kColor) : nullptr;
        values.maps.push_back({texture, texture ? TextureCache::samplerOf(*image) : TextureCache::SamplerKey{}});
    }
    return values;
}

void PersonPrograms::judged() {
    ++changes_;
    ++verdicts_;
}

void PersonPrograms::refused(std::uint32_t person, std::string problem) {
    known_.at(person).refused = true;
    judged();
    trouble_ = "a program of a material: " + personProblem(problem);
}

void PersonPrograms::holdsUp(std::uint32_t person, Duration took) {
    known_.at(person).heldUpFor = std::max(took, Duration(1));
    judged();
}

std::vector<HeldUpBy> PersonPrograms::heldUpBy(const Aspect& aspect) {
    std::vector<HeldUpBy> all;
    for (const auto& [texts, person] : ids_) {
        Known& known = known_.at(person);
        if (known.heldUpFor == Duration::zero()) continue;
        const auto* program = aspect.get<SurfaceProgram>(known.object);
        if (!program || program->verdict != SurfaceProgram::kGood || program->surface != texts.first ||
            program->vertex != texts.second) {
            known.heldUpFor = {};
            judged();
        } else {
            all.push_back({known.object, known.heldUpFor});
        }
    }
    return all;
}

std::vector<std::uint32_t> PersonPrograms::forgetUnused() {
    std::vector<std::uint32_t> gone;
    if (known_.size() <= kKept) return gone;
    for (const auto& candidate : clock_.lastNeededFirst(known_)) {
        if (candidate.nextUse != UseClock::kNever || known_.size() - gone.size() <= kKept) break;
        if (*candidate.key != kError) gone.push_back(*candidate.key);
    }
    for (const std::uint32_t id : gone) known_.erase(id);
    changes_ += !gone.empty();
    if (!gone.empty()) std::erase_if(ids_, [this](const auto& entry) { return !known_.contains(entry.second); });
    return gone;
}

}  // namespace tessera

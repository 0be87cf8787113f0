#include "client/draw/passes/LightBuffers.h"

#include <algorithm>
#include <cmath>

namespace tessera {

LightBuffers::LightBuffers(GlState& gl) : gl_(gl) {
    gl_.CreateBuffers(1, &listBuffer_);
    gl_.CreateTextures(GL_TEXTURE_BUFFER, 1, &listTexture_);
    // Programs are compiled for the formats that are bound, before there is anything to list.
    const std::array<std::uint32_t, 4> nothing{};
    gl_.fill(listTexture_, GL_R32UI, listBuffer_, std::as_bytes(std::span(nothing)));
    now_ = oldest();
}

LightBuffers::~LightBuffers() {
    gl_.DeleteTextures(1, &listTexture_);
    gl_.DeleteBuffers(1, &listBuffer_);
    for (const Made& made : made_) {
        gl_.DeleteTextures(1, &made.texture);
        gl_.DeleteBuffers(1, &made.buffer);
    }
}

std::size_t LightBuffers::oldest() {
    if (made_.size() == kKept)
        return static_cast<std::size_t>(std::ranges::min_element(made_, {}, &Made::lastUse) - made_.begin());
    Made& made = made_.emplace_back();
    gl_.CreateBuffers(1, &made.buffer);
    gl_.CreateTextures(GL_TEXTURE_BUFFER, 1, &made.texture);
    return made_.size() - 1;
}

LightLists LightBuffers::begin(std::span<const LightItem> lights, const ScreenCamera& camera,
                               const ShadowMaps::Texels& shadowViews, bool everywhere) {
    const auto known = std::ranges::find_if(made_, [&](const Made& made) {
        return made.seenFrom && everywhere == made.everywhere && drawAlike(camera, *made.seenFrom) &&
               shineAlike(lights, made.of) && shadowViews.lights == made.shadowViews.lights &&
               shadowViews.cubes == made.shadowViews.cubes;
    });
    const bool isNew = known == made_.end();
    now_ = isNew ? oldest() : static_cast<std::size_t>(known - made_.begin());
    Made& made = made_[now_];
    made.lastUse = ++begun_;
    if (!isNew) return made.kind;
    ++prepared_;
    made.seenFrom = camera;
    made.everywhere = everywhere;
    made.of.assign(lights.begin(), lights.end());
    made.shadowViews = shadowViews;
    made.clusters.setEverywhere(everywhere);
    return made.kind = collect(made);
}

LightLists LightBuffers::collect(Made& made) {
    LightClusters& clusters = made.clusters;
    const ShadowMaps::Texels& shadowViews = made.shadowViews;
    clusters.collect(made.of, *made.seenFrom, !shadowViews.lights.empty());
    made.scoped = std::ranges::any_of(made.of, [](const LightItem& light) { return light.scope != 0; });
    texels_.clear();
    const auto add = [&](const LightTexels& light) {
        texels_.insert(texels_.end(), {light.place, light.radiance, light.cone, light.falloff});
    };
    for (const LightTexels& light : clusters.lights()) add(light);
    const std::size_t shadowed = clusters.shadowed().size();
    const std::size_t cubes = texels_.size() + shadowed * (4 + ShadowMaps::kTexels);
    for (std::size_t i = 0; i < shadowed; ++i) {
        add(clusters.shadowed()[i]);
        const auto view = std::span(shadowViews.lights).subspan(i * ShadowMaps::kTexels, ShadowMaps::kTexels);
        texels_.insert(texels_.end(), view.begin(), view.end());
        // Of a cube where its views are.
        std::array<float, 4>& first = texels_[texels_.size() - ShadowMaps::kTexels + 5];
        if (first[0] < 0) first[1] += static_cast<float>(cubes);
    }
    texels_.insert(texels_.end(), shadowViews.cubes.begin(), shadowViews.cubes.end());
    gl_.fill(made.texture, GL_RGBA32F, made.buffer, std::as_bytes(std::span(texels_)));
    if (shadowed > 0) return LightLists::kShadows;
    if (!clusters.hasLists() && !made.scoped && findSuns(made))
        return clusters.everywhere() <= 1 ? LightLists::kSun : LightLists::kSuns;
    if (!made.scoped && !clusters.isEverywhere() && findFew(made)) return LightLists::kFew;
    return clusters.hasLists() ? LightLists::kClusters : LightLists::kAll;
}

bool LightBuffers::findSuns(Made& made) {
    made.suns = {};
    if (made.clusters.everywhere() > made.suns.size()) return false;
    for (std::size_t i = 0; i < made.clusters.everywhere(); ++i) {
        const LightTexels& light = made.clusters.lights()[i];
        const auto [x, y, z, w] = light.place;
        if (w != 0) return false;
        const float length = std::sqrt(std::max(x * x + y * y + z * z, 1e-8f));
        made.suns[i] = {.towards = {x / length, y / length, z / length, 0}, .radiance = light.radiance};
    }
    return true;
}

/// In the order of the lists, as sums are made in it.
bool LightBuffers::findFew(Made& made) {
    constexpr float kUtmost = 1e18f;  // its square is a number
    made.few = {};
    made.few[0].place = {0, 0, 1, 0};
    const std::span<const LightTexels> lights =
        std::span(made.clusters.lights()).first(made.clusters.lights().size() - 1);
    std::size_t lamps = 0;
    for (std::size_t i = 0; i < lights.size(); ++i) {
        const LightTexels& light = lights[i];
        const LightTexels plain{.place = light.place, .radiance = light.radiance, .cone = {0, 0, 0, 1}};
        const bool sun = light.place[3] == 0;
        if (light.cone != plain.cone || light.falloff != plain.falloff || (sun ? i > 0 : lamps == kMostLamps))
            return false;
        for (const float number : light.place)
            if (!(std::abs(number) <= kUtmost)) return false;
        made.few[sun ? 0 : ++lamps] = {.place = light.place, .radiance = light.radiance};
    }
    return true;
}

std::array<float, 4> LightBuffers::beginCell(const ScreenCamera& cell, const PixelRect& scissor) {
    LightClusters& clusters = made_[now_].clusters;
    const auto everywhere = static_cast<float>(clusters.everywhere());
    if (now().kind == LightLists::kFew) return {};
    if (!clusters.hasLists() && clusters.shadowed().empty()) return {0, 0, everywhere, std::max(everywhere, 1.0f)};
    clusters.assign(cell, scissor);
    const std::vector<std::uint32_t>& lists = clusters.lists();
    gl_.fill(listTexture_, GL_R32UI, listBuffer_, std::as_bytes(std::span(lists)));
    const auto [scale, offset] = clusters.sliceScaleAndOffset();
    return {scale, offset, everywhere, 0};
}

void LightBuffers::bind(GLuint lightUnit, GLuint listUnit) const {
    gl_.BindTextureUnit(lightUnit, now().texture);
    gl_.BindTextureUnit(listUnit, listTexture_);
}

}  // namespace tessera

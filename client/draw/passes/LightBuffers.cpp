#include "client/draw/passes/LightBuffers.h"

#include <algorithm>
#include <cmath>

namespace tessera {

LightBuffers::LightBuffers(GlState& gl) : gl_(gl) {
    for (GLuint* buffer : {&lightBuffer_, &listBuffer_}) gl_.CreateBuffers(1, buffer);
    for (GLuint* texture : {&lightTexture_, &listTexture_}) gl_.CreateTextures(GL_TEXTURE_BUFFER, 1, texture);
    // Programs are compiled for the formats that are bound, before there is anything to list.
    const std::array<std::uint32_t, 4> nothing{};
    gl_.fill(listTexture_, GL_R32UI, listBuffer_, std::as_bytes(std::span(nothing)));
}

LightBuffers::~LightBuffers() {
    for (const GLuint* texture : {&lightTexture_, &listTexture_}) gl_.DeleteTextures(1, texture);
    for (const GLuint* buffer : {&lightBuffer_, &listBuffer_}) gl_.DeleteBuffers(1, buffer);
}

LightLists LightBuffers::begin(std::span<const LightItem> lights, const ScreenCamera& camera,
                               const ShadowMaps::Texels& shadowViews, bool everywhere) {
    const bool known = seenFrom_ && everywhere == everywhere_ && drawAlike(camera, *seenFrom_) &&
                       shineAlike(lights, of_) && shadowViews.lights == shadowViews_.lights &&
                       shadowViews.cubes == shadowViews_.cubes;
    if (known) return kind_;
    seenFrom_ = camera;
    everywhere_ = everywhere;
    of_.assign(lights.begin(), lights.end());
    shadowViews_ = shadowViews;
    clusters_.setEverywhere(everywhere);
    return kind_ = collect();
}

LightLists LightBuffers::collect() {
    clusters_.collect(of_, *seenFrom_, !shadowViews_.lights.empty());
    cubes_ = !shadowViews_.cubes.empty();
    scoped_ = std::ranges::any_of(of_, [](const LightItem& light) { return light.scope != 0; });
    texels_.clear();
    const auto add = [&](const LightTexels& light) {
        texels_.insert(texels_.end(), {light.place, light.radiance, light.cone, light.falloff});
    };
    for (const LightTexels& light : clusters_.lights()) add(light);
    const std::size_t shadowed = clusters_.shadowed().size();
    const std::size_t cubes = texels_.size() + shadowed * (4 + ShadowMaps::kTexels);
    for (std::size_t i = 0; i < shadowed; ++i) {
        add(clusters_.shadowed()[i]);
        const auto view = std::span(shadowViews_.lights).subspan(i * ShadowMaps::kTexels, ShadowMaps::kTexels);
        texels_.insert(texels_.end(), view.begin(), view.end());
        // Of a cube where its views are.
        std::array<float, 4>& first = texels_[texels_.size() - ShadowMaps::kTexels + 5];
        if (first[0] < 0) first[1] += static_cast<float>(cubes);
    }
    texels_.insert(texels_.end(), shadowViews_.cubes.begin(), shadowViews_.cubes.end());
    gl_.fill(lightTexture_, GL_RGBA32F, lightBuffer_, std::as_bytes(std::span(texels_)));
    isFew_ = false;
    if (shadowed > 0) return LightLists::kShadows;
    if (!clusters_.hasLists() && !scoped_ && findSuns())
        return clusters_.everywhere() <= 1 ? LightLists::kSun : LightLists::kSuns;
    if (isFew_ = !scoped_ && !clusters_.isEverywhere() && findFew(); isFew_) return LightLists::kFew;
    return clusters_.hasLists() ? LightLists::kClusters : LightLists::kAll;
}

bool LightBuffers::findSuns() {
    suns_ = {};
    if (clusters_.everywhere() > suns_.size()) return false;
    for (std::size_t i = 0; i < clusters_.everywhere(); ++i) {
        const LightTexels& light = clusters_.lights()[i];
        const auto [x, y, z, w] = light.place;
        if (w != 0) return false;
        const float length = std::sqrt(std::max(x * x + y * y + z * z, 1e-8f));
        suns_[i] = {.towards = {x / length, y / length, z / length, 0}, .radiance = light.radiance};
    }
    return true;
}

/// In the order of the lists, as sums are made in it.
bool LightBuffers::findFew() {
    constexpr float kUtmost = 1e18f;  // its square is a number
    few_ = {};
    few_[0].place = {0, 0, 1, 0};
    const std::span<const LightTexels> lights = std::span(clusters_.lights()).first(clusters_.lights().size() - 1);
    std::size_t lamps = 0;
    for (std::size_t i = 0; i < lights.size(); ++i) {
        const LightTexels& light = lights[i];
        const LightTexels plain{.place = light.place, .radiance = light.radiance, .cone = {0, 0, 0, 1}};
        const bool sun = light.place[3] == 0;
        if (light.cone != plain.cone || light.falloff != plain.falloff || (sun ? i > 0 : lamps == kMostLamps))
            return false;
        for (const float number : light.place)
            if (!(std::abs(number) <= kUtmost)) return false;
        few_[sun ? 0 : ++lamps] = {.place = light.place, .radiance = light.radiance};
    }
    return true;
}

std::array<float, 4> LightBuffers::beginCell(const ScreenCamera& cell, const PixelRect& scissor) {
    const auto everywhere = static_cast<float>(clusters_.everywhere());
    if (isFew_) return {};
    if (!clusters_.hasLists() && clusters_.shadowed().empty()) return {0, 0, everywhere, std::max(everywhere, 1.0f)};
    clusters_.assign(cell, scissor);
    const std::vector<std::uint32_t>& lists = clusters_.lists();
    gl_.fill(listTexture_, GL_R32UI, listBuffer_, std::as_bytes(std::span(lists)));
    const auto [scale, offset] = clusters_.sliceScaleAndOffset();
    return {scale, offset, everywhere, 0};
}

void LightBuffers::bind(GLuint lightUnit, GLuint listUnit) const {
    gl_.BindTextureUnit(lightUnit, lightTexture_);
    gl_.BindTextureUnit(listUnit, listTexture_);
}

}  // namespace tessera

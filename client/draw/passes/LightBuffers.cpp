#include "client/draw/passes/LightBuffers.h"

#include "client/draw/passes/ShadowMaps.h"

#include <algorithm>
#include <cmath>

namespace tessera {

LightBuffers::LightBuffers(GlState& gl) : gl_(gl) {
    for (GLuint* buffer : {&lightBuffer_, &listBuffer_}) gl_.CreateBuffers(1, buffer);
    for (GLuint* texture : {&lightTexture_, &listTexture_}) gl_.CreateTextures(GL_TEXTURE_BUFFER, 1, texture);
    // Programs are compiled for the formats that are bound, before there is anything to list.
    const std::array<std::uint32_t, 4> nothing{};
    gl_.NamedBufferData(listBuffer_, sizeof nothing, nothing.data(), GL_STREAM_DRAW);
    gl_.TextureBuffer(listTexture_, GL_R32UI, listBuffer_);
}

LightBuffers::~LightBuffers() {
    for (const GLuint* texture : {&lightTexture_, &listTexture_}) gl_.DeleteTextures(1, texture);
    for (const GLuint* buffer : {&lightBuffer_, &listBuffer_}) gl_.DeleteBuffers(1, buffer);
}

LightLists LightBuffers::begin(std::span<const LightItem> lights, const ScreenCamera& camera,
                               std::span<const std::array<float, 4>> shadowViews) {
    clusters_.collect(lights, camera, !shadowViews.empty());
    scoped_ = std::ranges::any_of(lights, [](const LightItem& light) { return light.scope != 0; });
    texels_.clear();
    const auto add = [&](const LightTexels& light) {
        texels_.insert(texels_.end(), {light.place, light.radiance, light.cone, light.falloff});
    };
    for (const LightTexels& light : clusters_.lights()) add(light);
    const std::size_t shadowed = clusters_.shadowed().size();
    for (std::size_t i = 0; i < shadowed; ++i) {
        add(clusters_.shadowed()[i]);
        const auto view = shadowViews.subspan(i * ShadowMaps::kTexels, ShadowMaps::kTexels);
        texels_.insert(texels_.end(), view.begin(), view.end());
    }
    gl_.NamedBufferData(lightBuffer_, static_cast<GLsizeiptr>(texels_.size() * sizeof texels_[0]), texels_.data(),
                        GL_STREAM_DRAW);
    gl_.TextureBuffer(lightTexture_, GL_RGBA32F, lightBuffer_);
    if (shadowed > 0) return LightLists::kShadows;
    if (clusters_.hasLists()) return LightLists::kClusters;
    if (scoped_ || !findSuns()) return LightLists::kNone;
    return clusters_.everywhere() <= 1 ? LightLists::kSun : LightLists::kSuns;
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

std::array<float, 4> LightBuffers::beginCell(const ScreenCamera& cell, const PixelRect& scissor) {
    const auto everywhere = static_cast<float>(clusters_.everywhere());
    if (!clusters_.hasLists() && clusters_.shadowed().empty()) return {0, 0, everywhere, std::max(everywhere, 1.0f)};
    clusters_.assign(cell, scissor);
    const std::vector<std::uint32_t>& lists = clusters_.lists();
    gl_.NamedBufferData(listBuffer_, static_cast<GLsizeiptr>(lists.size() * sizeof lists[0]), lists.data(),
                        GL_STREAM_DRAW);
    gl_.TextureBuffer(listTexture_, GL_R32UI, listBuffer_);
    const auto [scale, offset] = clusters_.sliceScaleAndOffset();
    return {scale, offset, everywhere, 0};
}

void LightBuffers::bind(GLuint lightUnit, GLuint listUnit) const {
    gl_.BindTextureUnit(lightUnit, lightTexture_);
    gl_.BindTextureUnit(listUnit, listTexture_);
}

}  // namespace tessera

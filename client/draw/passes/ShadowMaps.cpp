#include "client/draw/passes/ShadowMaps.h"

#include <algorithm>
#include <cmath>

namespace tessera {

ShadowMaps::ShadowMaps(GlState& gl) : gl_(gl) {
    gl_.CreateSamplers(1, &sampler_);
    for (const GLenum wrap : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T})
        gl_.SamplerParameteri(sampler_, wrap, GL_CLAMP_TO_EDGE);
    for (const GLenum filter : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER})
        gl_.SamplerParameteri(sampler_, filter, GL_LINEAR);
    gl_.SamplerParameteri(sampler_, GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
    gl_.SamplerParameteri(sampler_, GL_TEXTURE_COMPARE_FUNC, GL_GEQUAL);
    // Small, and of the format that programs are compiled for; sides that are powers of two, as all that follow have: a
    // software rasteriser compiles for that, too.
    makeTexture(64, 1);
}

ShadowMaps::~ShadowMaps() {
    gl_.DeleteFramebuffers(1, &framebuffer_);
    gl_.DeleteTextures(1, &texture_);
    gl_.DeleteSamplers(1, &sampler_);
}

void ShadowMaps::makeTexture(int sidePx, int layers) {
    if (texture_) gl_.DeleteTextures(1, &texture_);
    if (!framebuffer_) gl_.CreateFramebuffers(1, &framebuffer_);
    gl_.CreateTextures(GL_TEXTURE_2D_ARRAY, 1, &texture_);
    gl_.TextureStorage3D(texture_, 1, GL_DEPTH_COMPONENT32F, sidePx, sidePx, layers);
    gl_.NamedFramebufferTextureLayer(framebuffer_, GL_DEPTH_ATTACHMENT, texture_, 0, 0);
}

Expected<void> ShadowMaps::reach(int layers) {
    if (layers <= layers_) return {};
    layers_ = layers;
    makeTexture(kSunMapPx, layers_);
    drawn_.clear();
    return gl_.check("making room for shadows");
}

void ShadowMaps::attach(std::size_t view) {
    gl_.NamedFramebufferTextureLayer(framebuffer_, GL_DEPTH_ATTACHMENT, texture_, 0, places_[view].layer);
}

Expected<std::vector<std::size_t>> ShadowMaps::begin(std::shared_ptr<const ShadowCasters> casters) {
    casters_ = std::move(casters);
    views_.clear();
    if (!casters_) return std::vector<std::size_t>();
    views_ = casters_->views;
    middle_ = near_ = casters_->sun;
    if (casters_->middle) middle_ = near_ = views_.size(), views_.push_back(casters_->middle);
    if (casters_->near) near_ = views_.size(), views_.push_back(casters_->near);
    // Large ones first, whatever the order of the lights.
    const std::vector<Place> before = std::move(places_);
    places_.assign(views_.size(), {});
    int layers = 0, small = 0;
    for (const bool large : {true, false}) {
        for (std::size_t i = 0; i < views_.size(); ++i) {
            const int side = views_[i]->camera.pixels.width;
            if ((side == kSunMapPx) != large) continue;
            if (large) {
                places_[i] = {.layer = layers++, .rect = {.x = 0, .y = 0, .width = side, .height = side}};
            } else {
                places_[i] = {
                    .layer = layers + small / 4,
                    .rect = {.x = small % 2 * side, .y = small / 2 % 2 * side, .width = side, .height = side}};
                ++small;
            }
        }
    }
    if (auto room = reach(layers + (small + 3) / 4); !room) return tl::unexpected(room.error());
    drawn_.resize(views_.size());
    std::vector<std::size_t> stale;
    for (std::size_t i = 0; i < views_.size(); ++i) {
        const bool moved = i >= before.size() || before[i] != places_[i];
        if (moved || drawn_[i] != views_[i]) stale.push_back(i);
    }
    return stale;
}

std::vector<std::array<float, 4>> ShadowMaps::texels(const ScreenCamera& camera) const {
    std::vector<std::array<float, 4>> texels;
    for (std::size_t i = 0; casters_ && i < casters_->views.size(); ++i) {
        const bool sun = i == casters_->sun;
        for (const std::size_t view : {sun ? near_ : i, sun ? middle_ : i, i}) addTexels(view, camera, texels);
    }
    return texels;
}

void ShadowMaps::addTexels(std::size_t index, const ScreenCamera& camera,
                           std::vector<std::array<float, 4>>& texels) const {
    const ScreenCamera& view = views_[index]->camera;
    const PixelRect& place = places_[index].rect;
    const double metres = std::cbrt(std::abs(camera.eye_T_world.linear().determinant()));
    const Mat4d clip = view.clip_T_eye * (view.eye_T_world * camera.eye_T_world.inverse()).matrix();
    // Pixel (ndc + 1) / 2 · side + corner; depth reversed, as FrameBlock has it.
    const auto row = [&](const Eigen::RowVector4d& r) {
        texels.push_back(
            {static_cast<float>(r[0]), static_cast<float>(r[1]), static_cast<float>(r[2]), static_cast<float>(r[3])});
    };
    row((0.5 * place.width * clip.row(0) + (0.5 * place.width + place.x) * clip.row(3)) / kSunMapPx);
    row((0.5 * place.height * clip.row(1) + (0.5 * place.height + place.y) * clip.row(3)) / kSunMapPx);
    row(0.5 * (clip.row(3) - clip.row(2)));
    row(clip.row(3));
    const double pixel = 2 / (view.clip_T_eye(0, 0) * place.width) * metres;
    const bool spot = view.clip_T_eye(3, 3) == 0;
    texels.push_back({spot ? 0 : static_cast<float>(pixel), spot ? static_cast<float>(pixel) : 0,
                      static_cast<float>(places_[index].layer), 0});
    const auto shareOf = [](int px) { return static_cast<float>(px) / kSunMapPx; };
    texels.push_back({shareOf(place.x + 4), shareOf(place.y + 4), shareOf(place.x + place.width - 4),
                      shareOf(place.y + place.height - 4)});
}

void ShadowMaps::bind(GLuint unit) const {
    gl_.BindTextureUnit(unit, texture_);
    gl_.BindSampler(unit, sampler_);
}

}  // namespace tessera

#include "client/draw/passes/ShadowMaps.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <utility>

namespace tessera {

namespace {

/// The texture's while there is no map.
constexpr int kSmallPx = 64;

}  // namespace

ShadowMaps::ShadowMaps(GlState& gl, std::size_t budgetBytes)
    : gl_(gl), budgetBytes_(budgetBytes), spareBytes_(budgetBytes / 2) {
    gl_.CreateSamplers(1, &sampler_);
    for (const GLenum wrap : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T})
        gl_.SamplerParameteri(sampler_, wrap, GL_CLAMP_TO_EDGE);
    for (const GLenum filter : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER})
        gl_.SamplerParameteri(sampler_, filter, GL_LINEAR);
    gl_.SamplerParameteri(sampler_, GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
    gl_.SamplerParameteri(sampler_, GL_TEXTURE_COMPARE_FUNC, GL_GEQUAL);
    gl_.CreateFramebuffers(1, &framebuffer_);
    // Small, and of the format that programs are compiled for; sides that are powers of two, as all that follow have: a
    // software rasteriser compiles for that, too.
    makeTexture(kSmallPx, 1);
}

ShadowMaps::~ShadowMaps() {
    for (const auto& [layer, texture] : kept_) gl_.DeleteTextures(1, &texture);
    gl_.DeleteFramebuffers(1, &framebuffer_);
    gl_.DeleteTextures(1, &texture_);
    gl_.DeleteSamplers(1, &sampler_);
}

void ShadowMaps::makeTexture(int sidePx, int layers) {
    gl_.CreateTextures(GL_TEXTURE_2D_ARRAY, 1, &texture_);
    gl_.TextureStorage3D(texture_, 1, GL_DEPTH_COMPONENT32F, sidePx, sidePx, layers);
    gl_.NamedFramebufferTextureLayer(framebuffer_, GL_DEPTH_ATTACHMENT, texture_, 0, 0);
}

/// Half as many again, as all of them are copied: a head that goes on asks for one after the other.
Expected<void> ShadowMaps::reachLayers() {
    if (layers_ <= textureLayers_) return {};
    std::vector<int> from(static_cast<std::size_t>(textureLayers_));
    std::iota(from.begin(), from.end(), 0);
    const int spare = static_cast<int>(spareBytes_ / kLayerBytes) - static_cast<int>(kept_.size());
    return makeLayers(std::max(layers_, std::min(textureLayers_ + textureLayers_ / 2, spare)), from);
}

/// The texture anew; the first of its layers are `from` these of before.
Expected<void> ShadowMaps::makeLayers(int layers, std::span<const int> from) {
    const GLuint before = texture_;
    layers > 0 ? makeTexture(kSunMapPx, layers) : makeTexture(kSmallPx, 1);
    for (std::size_t i = 0; i < from.size(); ++i)
        gl_.CopyImageSubData(before, GL_TEXTURE_2D_ARRAY, 0, 0, 0, from[i], texture_, GL_TEXTURE_2D_ARRAY, 0, 0, 0,
                             static_cast<GLint>(i), kSunMapPx, kSunMapPx, 1);
    gl_.DeleteTextures(1, &before);
    textureLayers_ = layers;
    return gl_.check("making room for shadows");
}

Expected<void> ShadowMaps::letGo(std::uint64_t keptFrames) {
    std::vector<int> numbers(static_cast<std::size_t>(layers_), -1);  // of layers, from here on
    for (Slot& slot : slots_) {
        if (slot.usedIn + keptFrames > frame_) {
            numbers[static_cast<std::size_t>(slot.layer)] = 0;
        } else {
            slot.drawn.reset();
            slot.keeps = false;
        }
    }
    std::vector<int> from;
    for (int layer = 0; layer < layers_; ++layer) {
        dropKept(layer);
        int& number = numbers[static_cast<std::size_t>(layer)];
        if (number < 0) continue;
        number = static_cast<int>(from.size());
        from.push_back(layer);
    }
    if (static_cast<int>(from.size()) == textureLayers_) return {};
    const auto numberOf = [&](int layer) { return numbers[static_cast<std::size_t>(layer)]; };
    std::erase_if(slots_, [&](const Slot& slot) { return numberOf(slot.layer) < 0; });
    for (Slot& slot : slots_) slot.layer = numberOf(slot.layer);
    std::map<int, GLuint> kept;
    for (const auto& [layer, texture] : kept_) kept.emplace(numberOf(layer), texture);
    kept_ = std::move(kept);
    layers_ = static_cast<int>(from.size());
    return makeLayers(layers_, from);
}

void ShadowMaps::addLayer(bool large) {
    const int side = large ? kSunMapPx : kSpotMapPx, maps = large ? 1 : 4;
    for (int i = 0; i < maps; ++i)
        slots_.push_back(
            {.layer = layers_, .rect = {.x = i % 2 * side, .y = i / 2 * side, .width = side, .height = side}});
    ++layers_;
}

/// Of those that were used last before that frame; `known` ones, too.
std::size_t ShadowMaps::longestUnused(const PixelRect& rect, std::uint64_t usedBefore, bool known,
                                      const std::vector<bool>& taken) const {
    std::size_t found = kNone;
    for (std::size_t i = 0; i < slots_.size(); ++i)
        if (!taken[i] && slots_[i].rect == rect && slots_[i].usedIn < usedBefore && (known || !slots_[i].drawn) &&
            (found == kNone || slots_[i].usedIn < slots_[found].usedIn))
            found = i;
    return found;
}

Expected<void> ShadowMaps::begin(std::shared_ptr<const ShadowCasters> casters) {
    casters_ = std::move(casters);
    views_.clear();
    slotOf_.clear();
    if (!told_ || std::exchange(frameBegins_, false)) {
        ++frame_;
        // Not each time that one is too old: all layers are copied.
        if (const std::uint64_t kept = bytes() > spareBytes_ ? kKeptAbove : kKeptFrames; frame_ % kept == 0)
            if (auto gone = letGo(kept); !gone) return gone;
    }
    if (!casters_) return {};
    views_ = casters_->all();
    middle_ = near_ = casters_->sun;
    if (casters_->middle) middle_ = near_ = casters_->views.size();
    if (casters_->near) near_ = views_.size() - 1;
    // A small one lies in the quarter of its number among the small ones.
    std::vector<PixelRect> rects;
    int small = 0;
    for (const auto& view : views_) {
        const int side = view->camera.pixels.width, quarter = side == kSunMapPx ? 0 : small++ % 4;
        rects.push_back({.x = quarter % 2 * side, .y = quarter / 2 * side, .width = side, .height = side});
    }
    slotOf_.assign(views_.size(), kNone);
    std::vector<bool> taken(slots_.size(), false);
    const auto take = [&](std::size_t view, std::size_t slot) {
        slotOf_[view] = slot;
        if (slot != kNone) taken[slot] = true;
    };
    for (std::size_t i = 0; i < views_.size(); ++i)
        for (std::size_t s = 0; s < slots_.size() && slotOf_[i] == kNone; ++s)
            if (!taken[s] && slots_[s].drawn && slots_[s].drawn->kin == views_[i]->kin && slots_[s].rect == rects[i])
                take(i, s);
    const auto grow = [&](const PixelRect& rect) {
        addLayer(rect.width == kSunMapPx);
        taken.resize(slots_.size(), false);
        return longestUnused(rect, 1, false, taken);
    };
    for (std::size_t i = 0; i < views_.size(); ++i) {
        if (slotOf_[i] != kNone) continue;
        // What nothing is known of; what there is room for beside maps that somebody may come back to; one of those; of
        // maps that are asked for now only above the budget.
        std::size_t slot = longestUnused(rects[i], frame_ + 1, false, taken);
        if (slot == kNone && hasRoom(spareBytes_)) slot = grow(rects[i]);
        if (slot == kNone) slot = longestUnused(rects[i], frame_ - 1, true, taken);
        if (slot == kNone && hasRoom(budgetBytes_)) slot = grow(rects[i]);
        if (slot == kNone) slot = longestUnused(rects[i], frame_ + 1, true, taken);
        if (slot == kNone) slot = grow(rects[i]);
        take(i, slot);
    }
    for (std::size_t i = 0; i < views_.size(); ++i) {
        Slot& slot = slots_[slotOf_[i]];
        slot.usedIn = frame_;
        if (slot.drawn && slot.drawn->kin != views_[i]->kin) slot.drawn.reset();
    }
    return reachLayers();
}

PixelRect ShadowMaps::inLayer(const Slot& slot, const PixelRect& rect) {
    return {.x = slot.rect.x + rect.x, .y = slot.rect.y + rect.y, .width = rect.width, .height = rect.height};
}

std::vector<ShadowMaps::Drawn::Moving> ShadowMaps::movingOf(const ShadowView& view) {
    std::vector<Drawn::Moving> moving;
    moving.reserve(view.moving.size());
    for (const ShadowCaster& caster : view.moving) moving.push_back({caster.item.node, caster.since, caster.rect});
    return moving;
}

ShadowMaps::Update ShadowMaps::update(std::size_t index) {
    Slot& slot = slots_[slotOf_[index]];
    const ShadowView& view = *views_[index];
    Update update;
    if (slot.drawn && slot.drawn->state == view.state) return update;
    update.any = true;
    update.forgotten = forgotten_;
    slot.before = std::exchange(slot.drawn, std::nullopt);
    const bool kept = std::exchange(slot.keeps, false) && slot.before;
    MapBlocks everything;
    everything.add(slot.rect);
    if (!slot.before) {
        update.still = update.moving = everything;
        update.throughKept = !view.moving.empty() && makeKept(slot.layer);
        if (update.throughKept) update.copied = everything;
        return update;
    }
    const Drawn& before = *slot.before;
    const StillChanges& changes = view.still->changes;
    if (before.state < changes.knownAfter())
        update.still = everything;
    else
        changes.after(before.state, [&](const PixelRect& rect) { update.still.add(inLayer(slot, rect)); });
    MapBlocks moved = update.still;
    const auto addOthers = [&](const std::vector<Drawn::Moving>& of, const std::vector<Drawn::Moving>& than) {
        std::set<std::pair<ObjectId, std::uint64_t>> same;
        for (const Drawn::Moving& one : than) same.emplace(one.node, one.since);
        for (const Drawn::Moving& one : of)
            if (!same.contains({one.node, one.since})) moved.add(inLayer(slot, one.rect));
    };
    const std::vector<Drawn::Moving> movesNow = movingOf(view);
    addOthers(before.moving, movesNow);
    addOthers(movesNow, before.moving);
    update.moving = moved;
    if (kept) {
        update.throughKept = true;
        update.copied = moved;
    } else if (before.moving.empty()) {
        // The map has what rests and nothing else.
        update.keep = !view.moving.empty() && makeKept(slot.layer);
    } else {
        update.still = moved;
    }
    return update;
}

void ShadowMaps::setDrawn(std::size_t index, const Update& update) {
    Slot& slot = slots_[slotOf_[index]];
    const ShadowView& view = *views_[index];
    slot.before.reset();
    if (update.forgotten != forgotten_) return;
    slot.drawn = {.kin = view.kin, .state = view.state, .moving = movingOf(view)};
    slot.keeps = (update.throughKept || update.keep) && !view.moving.empty();
    dropKept(slot.layer);
}

bool ShadowMaps::makeKept(int layer) {
    if (kept_.contains(layer)) return true;
    if (bytes() + kLayerBytes > budgetBytes_) return false;
    GLuint texture = 0;
    gl_.CreateTextures(GL_TEXTURE_2D, 1, &texture);
    gl_.TextureStorage2D(texture, 1, GL_DEPTH_COMPONENT32F, kSunMapPx, kSunMapPx);
    kept_[layer] = texture;
    return true;
}

/// Where no map of the layer keeps anything.
void ShadowMaps::dropKept(int layer) {
    const auto kept = kept_.find(layer);
    if (kept == kept_.end()) return;
    const auto needs = [layer](const Slot& slot) { return slot.layer == layer && slot.keeps; };
    if (std::ranges::any_of(slots_, needs)) return;
    gl_.DeleteTextures(1, &kept->second);
    kept_.erase(kept);
}

void ShadowMaps::forget() {
    ++forgotten_;
    for (Slot& slot : slots_) {
        slot.drawn.reset();
        slot.keeps = false;
    }
}

void ShadowMaps::attach(std::size_t view, bool kept) {
    const int layer = slots_[slotOf_[view]].layer;
    if (kept)
        gl_.NamedFramebufferTexture(framebuffer_, GL_DEPTH_ATTACHMENT, kept_.at(layer), 0);
    else
        gl_.NamedFramebufferTextureLayer(framebuffer_, GL_DEPTH_ATTACHMENT, texture_, 0, layer);
}

void ShadowMaps::keep(std::size_t view) {
    const Slot& slot = slots_[slotOf_[view]];
    const PixelRect& r = slot.rect;
    gl_.CopyImageSubData(texture_, GL_TEXTURE_2D_ARRAY, 0, r.x, r.y, slot.layer, kept_.at(slot.layer), GL_TEXTURE_2D, 0,
                         r.x, r.y, 0, r.width, r.height, 1);
}

void ShadowMaps::copyKept(std::size_t view, const MapBlocks& blocks) {
    const Slot& slot = slots_[slotOf_[view]];
    for (const PixelRect& r : blocks.rectangles())
        gl_.CopyImageSubData(kept_.at(slot.layer), GL_TEXTURE_2D, 0, r.x, r.y, 0, texture_, GL_TEXTURE_2D_ARRAY, 0, r.x,
                             r.y, slot.layer, r.width, r.height, 1);
}

ShadowMaps::Texels ShadowMaps::texels(const ScreenCamera& camera) const {
    Texels texels;
    for (std::size_t light = 0; casters_ && light < casters_->firstOf.size(); ++light) {
        const std::size_t i = casters_->firstOf[light];
        if (casters_->countOf(light) == kCubeViews) {
            texels.lights.resize(texels.lights.size() + kTexels);
            texels.lights[texels.lights.size() - kTexels + 5] = {-1, static_cast<float>(texels.cubes.size()), 0, 0};
            for (std::size_t side = 0; side < kCubeViews; ++side) addTexels(i + side, camera, texels.cubes);
            continue;
        }
        const bool sun = i == casters_->sun;
        for (const std::size_t view : {sun ? near_ : i, sun ? middle_ : i, i}) addTexels(view, camera, texels.lights);
    }
    return texels;
}

void ShadowMaps::addTexels(std::size_t index, const ScreenCamera& camera,
                           std::vector<std::array<float, 4>>& texels) const {
    const ScreenCamera& view = views_[index]->camera;
    const Slot& slot = slots_[slotOf_[index]];
    const PixelRect& place = slot.rect;
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
                      static_cast<float>(slot.layer), 0});
    const auto shareOf = [](int px) { return static_cast<float>(px) / kSunMapPx; };
    texels.push_back({shareOf(place.x + 4), shareOf(place.y + 4), shareOf(place.x + place.width - 4),
                      shareOf(place.y + place.height - 4)});
}

void ShadowMaps::bind(GLuint unit) const {
    gl_.BindTextureUnit(unit, texture_);
    gl_.BindSampler(unit, sampler_);
}

}  // namespace tessera

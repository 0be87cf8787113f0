#include "client/render/DrawList.h"

#include <algorithm>
#include <cstring>

namespace tessera {

namespace {

template <typename Matrix>
bool sameBits(const Matrix& a, const Matrix& b) {
    return std::memcmp(a.data(), b.data(), static_cast<std::size_t>(a.size()) * sizeof(*a.data())) == 0;
}

/// By content: a mesh may have been let go of, and resolved again.
bool same(const std::shared_ptr<const DrawMesh>& a, const std::shared_ptr<const DrawMesh>& b) {
    return a == b || (a && b && a->key == b->key);
}

bool same(const DrawItem& a, const DrawItem& b) {
    return a.node == b.node && a.geometry == b.geometry && a.material == b.material && a.mirrored == b.mirrored &&
           a.kind == b.kind && a.lineWidth == b.lineWidth && a.widestLinePx == b.widestLinePx &&
           a.pointRadius == b.pointRadius && a.fill == b.fill && a.over == b.over && same(a.mesh, b.mesh) &&
           a.sortedFrom == b.sortedFrom && a.sortedCount == b.sortedCount && a.scopes == b.scopes &&
           sameBits(a.world_T_item.matrix(), b.world_T_item.matrix());
}

bool same(const LightItem& a, const LightItem& b) {
    return a.kind == b.kind && a.range == b.range && a.innerAngle == b.innerAngle && a.outerAngle == b.outerAngle &&
           a.shadows == b.shadows && a.scope == b.scope && a.outside == b.outside && sameBits(a.position, b.position) &&
           sameBits(a.direction, b.direction) && sameBits(a.radiance, b.radiance) &&
           sameBits(a.attenuation, b.attenuation);
}

template <typename Item>
bool same(const std::vector<Item>& a, const std::vector<Item>& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const Item& x, const Item& y) { return same(x, y); });
}

}  // namespace

bool drawAlike(const DrawList& a, const DrawList& b) {
    return a.shadowState == b.shadowState && same(a.opaque, b.opaque) && same(a.transparent, b.transparent) &&
           a.sortedTriangles == b.sortedTriangles && same(a.lights, b.lights) &&
           sameBits(a.environment.sky, b.environment.sky) && sameBits(a.environment.ground, b.environment.ground) &&
           sameBits(a.environment.background, b.environment.background) && a.environment.image == b.environment.image &&
           a.environment.strength == b.environment.strength && a.environment.turn == b.environment.turn &&
           a.environment.showImage == b.environment.showImage && a.environment.exposure == b.environment.exposure &&
           a.environment.toneMap == b.environment.toneMap && a.environment.metered == b.environment.metered &&
           a.detailed == b.detailed && a.coated == b.coated && a.glossy == b.glossy && a.studio == b.studio;
}

bool shineAlike(std::span<const LightItem> a, std::span<const LightItem> b) {
    return std::ranges::equal(a, b, [](const LightItem& x, const LightItem& y) { return same(x, y); });
}

bool drawAlike(const ScreenCamera& a, const ScreenCamera& b) {
    return sameBits(a.eyeWorld, b.eyeWorld) && sameBits(a.eye_T_world.matrix(), b.eye_T_world.matrix()) &&
           sameBits(a.clip_T_eye, b.clip_T_eye) && a.pixels.width == b.pixels.width &&
           a.pixels.height == b.pixels.height && a.user == b.user && a.detail == b.detail &&
           sameBits(a.headWorld, b.headWorld) && a.studio == b.studio && a.exposure == b.exposure;
}

}  // namespace tessera

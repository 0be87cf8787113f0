#include "client/draw/passes/LightClusters.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tessera {
namespace {

/// Beyond this all numbers of a picture are white; what is computed with them stays finite.
constexpr double kBrightest = 1e18;
/// Above this many entries all clusters share one list: 16 MB for a cell.
constexpr std::size_t kMostEntries = std::size_t{1} << 22;
/// A pixel's place is told from its depth, a float: spheres are larger than they are by this part of their size, and of
/// their distance.
constexpr double kSizeMargin = 1e-3, kDistanceMargin = 1e-4;

std::array<float, 4> asTexel(const Vec3d& v, double w) {
    return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z()), static_cast<float>(w)};
}

std::array<float, 4> brightness(const Vec3f& radiance, double factor, double inverseRange) {
    std::array<float, 4> texel{0, 0, 0, static_cast<float>(inverseRange)};
    for (int i = 0; i < 3; ++i) {
        const double value = radiance[i] * factor;
        texel[static_cast<std::size_t>(i)] = static_cast<float>(value > 0 ? std::min(value, kBrightest) : 0);
    }
    return texel;
}

/// As KHR_lights_punctual computes it; the difference is bounded, so that equal angles make an edge.
std::array<float, 4> coneOf(const LightItem& light, const Mat3d& eye_R_world) {
    if (light.kind != LightItem::Kind::kSpot) return {0, 0, 0, 1};
    const double outer = std::cos(light.outerAngle);
    const double slope = 1 / std::max(1e-3, std::cos(light.innerAngle) - outer);
    return asTexel((eye_R_world * light.direction).normalized() * slope, -outer * slope);
}

/// `radiance` is that at a world unit times the square of metres per world unit. What is not said falls off nowhere.
std::array<float, 4> falloffOf(const Vec3f& attenuation, double scale) {
    constexpr double kUtmost = 1e30;  // squares of distances are below 1e8 of these
    Vec3d said = attenuation.cast<double>().cwiseMax(0.0);
    if (!(said.maxCoeff() > 0)) said = Vec3d::UnitX();
    return asTexel((said.array() * Eigen::Array3d(scale * scale, scale, 1)).min(kUtmost).matrix(), 0);
}

}  // namespace

void LightClusters::collect(std::span<const LightItem> lights, const ScreenCamera& camera, bool shadowed) {
    lights = lights.first(std::min(lights.size(), DrawList::kMaxLights));
    lights_.clear();
    spheres_.clear();
    // Metres per world unit: a wall may stand in a world of any scale.
    const double scale = std::cbrt(std::abs(camera.eye_T_world.linear().determinant()));
    const Mat3d eye_R_world = camera.eye_T_world.linear() / (scale > 0 ? scale : 1.0);
    const auto hasRange = [](const LightItem& light) {
        return light.kind != LightItem::Kind::kDirectional && light.range > 0;
    };
    const auto withoutScope = [&](const LightItem& light) -> LightTexels {
        if (light.kind == LightItem::Kind::kDirectional) {
            const Vec3d towards = (eye_R_world * -light.direction).normalized();
            return {asTexel(towards, 0), brightness(light.radiance, 1, 0), {0, 0, 0, 1}};
        }
        return {asTexel(camera.eye_T_world * light.position, 1),
                brightness(light.radiance, scale * scale, hasRange(light) ? 1 / (light.range * scale) : 0),
                coneOf(light, eye_R_world), falloffOf(light.attenuation, scale)};
    };
    const auto texelsOf = [&](const LightItem& light) {
        LightTexels texels = withoutScope(light);
        texels.falloff[3] = light.outside ? -static_cast<float>(light.scope) : static_cast<float>(light.scope);
        return texels;
    };
    shadowed_.clear();
    for (const LightItem& light : lights) {
        if (shadowed && light.shadows)
            shadowed_.push_back(texelsOf(light));
        else if (!hasRange(light))
            lights_.push_back(texelsOf(light));
    }
    everywhere_ = lights_.size();
    for (const LightItem& light : lights) {
        if (!hasRange(light) || (shadowed && light.shadows)) continue;
        const Vec3d place = camera.eye_T_world * light.position;
        const double range = light.range * scale;
        Sphere sphere{place, range, static_cast<std::uint32_t>(lights_.size())};
        if (light.kind == LightItem::Kind::kSpot && light.outerAngle < 1.5f) {
            // The smallest ball around the cone's part of the ball.
            const double cosine = std::cos(light.outerAngle), sine = std::sin(light.outerAngle);
            const double along = cosine > 0.7072 ? range / (2 * cosine) : range * cosine;
            sphere.center += (eye_R_world * light.direction).normalized() * along;
            sphere.radius = cosine > 0.7072 ? along : range * sine;
            // What cosines of floats are off, near the axis most.
            sphere.radius += 2e-3 * range;
        }
        sphere.radius += kSizeMargin * range + kDistanceMargin * sphere.center.norm();
        lights_.push_back(texelsOf(light));
        if (sphere.center.allFinite() && std::isfinite(sphere.radius)) spheres_.push_back(sphere);
    }
    lights_.push_back({{0, 0, 1, 0}, {0, 0, 0, 0}, {0, 0, 0, 1}});
}

void LightClusters::assign(const ScreenCamera& cell, const PixelRect& scissor) {
    clip_T_eye_ = cell.clip_T_eye;
    widthPx_ = cell.pixels.width;
    heightPx_ = cell.pixels.height;
    left_ = scissor.x / kSidePx;
    below_ = scissor.y / kSidePx;
    right_ = std::min((scissor.x + scissor.width - 1) / kSidePx, kColumns - 1);
    above_ = std::min((scissor.y + scissor.height - 1) / kSidePx, kRows - 1);
    sliceScale_ = 0;
    sliceOffset_ = 0.5f;
    visible_.clear();
    for (std::uint32_t i = 0; i < spheres_.size(); ++i) {
        bool seen = false;
        forEachTouched(spheres_[i], [&](int, int, int, int, int) { seen = true; });
        if (seen) visible_.push_back(i);
    }
    if (bruteForce_) return shareOneList();
    fitSlices();
    if (!fill()) shareOneList();
}

/// Slices from the first depth to the last at which any light that is seen reaches something.
void LightClusters::fitSlices() {
    double from = std::numeric_limits<double>::infinity(), to = 0;
    for (const std::uint32_t i : visible_) {
        from = std::min(from, -spheres_[i].center.z() - spheres_[i].radius);
        to = std::max(to, -spheres_[i].center.z() + spheres_[i].radius);
    }
    // Nearer than a hundredth of the way nobody cuts finely.
    from = std::max(from, 0.01 * to);
    if (!(to > from && std::isfinite(to) && from > 1e-30)) return;
    // One slice more before and behind, for what is outside.
    const double scale = (kSlices - 2) / (std::log2(to) - std::log2(from));
    sliceScale_ = static_cast<float>(std::min(scale, 1e4));
    sliceOffset_ = static_cast<float>(1 - sliceScale_ * std::log2(from));
}

template <typename Visit>
void LightClusters::forEachTouched(const Sphere& sphere, const Visit& visit) const {
    const double nearest = -sphere.center.z() - sphere.radius, farthest = -sphere.center.z() + sphere.radius;
    if (!(farthest > 0)) return;
    const auto sliceOf = [&](double depth) {
        if (sliceScale_ == 0 || !(depth > 0)) return 0;
        const double slice = std::floor(std::log2(depth) * sliceScale_ + sliceOffset_);
        return static_cast<int>(std::clamp(slice, 0.0, double{kSlices - 1}));
    };
    // The shader's logarithm is a float's: a little is given to both sides.
    const int first = sliceOf(nearest * 0.999), last = sliceOf(farthest * 1.001);
    for (int slice = first; slice <= last; ++slice) {
        // Depths of the slice that the sphere has; the first and the last slice go on.
        double from = nearest, to = farthest;
        if (sliceScale_ > 0) {
            if (slice > 0) from = std::max(from, 0.999 * std::exp2((slice - sliceOffset_) / sliceScale_));
            if (slice < kSlices - 1) to = std::min(to, 1.001 * std::exp2((slice + 1 - sliceOffset_) / sliceScale_));
        }
        const double middle = -sphere.center.z();
        const double off = middle < from ? from - middle : middle > to ? middle - to : 0;
        const double reach = std::sqrt(std::max(0.0, sphere.radius * sphere.radius - off * off)) + 1e-9 * sphere.radius;
        // The slab's part of the sphere lies in a box, the box's picture between those of its corners.
        double lowX = std::numeric_limits<double>::infinity(), highX = -lowX, lowY = lowX, highY = -lowX;
        for (int corner = 0; corner < 8; ++corner) {
            const double x = sphere.center.x() + (corner & 1 ? reach : -reach);
            const double y = sphere.center.y() + (corner & 2 ? reach : -reach);
            const double z = -(corner & 4 ? from : to);
            const double w = clip_T_eye_(3, 0) * x + clip_T_eye_(3, 1) * y + clip_T_eye_(3, 2) * z + clip_T_eye_(3, 3);
            if (!(w > 1e-9 * (std::abs(z) + reach))) {  // reaches beside the eye
                lowX = lowY = -1;
                highX = highY = 1;
                break;
            }
            const double px =
                (clip_T_eye_(0, 0) * x + clip_T_eye_(0, 1) * y + clip_T_eye_(0, 2) * z + clip_T_eye_(0, 3)) / w;
            const double py =
                (clip_T_eye_(1, 0) * x + clip_T_eye_(1, 1) * y + clip_T_eye_(1, 2) * z + clip_T_eye_(1, 3)) / w;
            lowX = std::min(lowX, px);
            highX = std::max(highX, px);
            lowY = std::min(lowY, py);
            highY = std::max(highY, py);
        }
        const auto tileOf = [](double clip, int sidePx, double morePx) {
            const double px = (clip + 1) / 2 * sidePx + morePx;
            return static_cast<int>(std::floor(std::clamp(px / kSidePx, -1.0, 1000.0)));
        };
        const int firstColumn = std::max(tileOf(lowX, widthPx_, -1), left_),
                  lastColumn = std::min(tileOf(highX, widthPx_, 1), right_);
        const int firstRow = std::max(tileOf(lowY, heightPx_, -1), below_),
                  lastRow = std::min(tileOf(highY, heightPx_, 1), above_);
        if (firstColumn <= lastColumn && firstRow <= lastRow) visit(firstColumn, lastColumn, firstRow, lastRow, slice);
    }
}

bool LightClusters::fill() {
    const auto clusterOf = [](int column, int row, int slice) {
        return static_cast<std::size_t>((slice * kRows + row) * kColumns + column);
    };
    const auto forEachEntry = [&](const auto& entry) {
        for (const std::uint32_t i : visible_)
            forEachTouched(spheres_[i], [&](int c0, int c1, int r0, int r1, int slice) {
                for (int row = r0; row <= r1; ++row)
                    for (int column = c0; column <= c1; ++column)
                        entry(clusterOf(column, row, slice), spheres_[i].light);
            });
    };
    counts_.assign(kClusters, 0);
    std::size_t entries = 0;
    forEachEntry([&](std::size_t cluster, std::uint32_t) {
        ++counts_[cluster];
        ++entries;
    });
    if (entries > kMostEntries) return false;
    const auto all = static_cast<std::uint32_t>(everywhere_);
    const std::size_t dark = 2 * kClusters;
    // Lists are looked up at place + k with k from `all` on: places may lie before their lists, modulo 2^32.
    lists_.assign(dark + 1 + entries, static_cast<std::uint32_t>(lights_.size() - 1));
    auto place = static_cast<std::uint32_t>(dark + 1);
    for (std::size_t i = 0; i < kClusters; ++i) {
        const bool darkAlone = counts_[i] + all == 0;
        lists_[2 * i] = (darkAlone ? static_cast<std::uint32_t>(dark) : place) - all;
        lists_[2 * i + 1] = std::max(counts_[i] + all, 1u);
        place += counts_[i];
        counts_[i] = place - counts_[i];  // from here on: where its next entry goes
    }
    forEachEntry([&](std::size_t cluster, std::uint32_t light) { lists_[counts_[cluster]++] = light; });
    return true;
}

void LightClusters::shareOneList() {
    const auto all = static_cast<std::uint32_t>(everywhere_);
    lists_.assign(2 * kClusters, 0);
    // By brute force those that are not seen, too.
    if (bruteForce_)
        for (std::size_t i = everywhere_; i + 1 < lights_.size(); ++i) lists_.push_back(static_cast<std::uint32_t>(i));
    else
        for (const std::uint32_t i : visible_) lists_.push_back(spheres_[i].light);
    const auto own = static_cast<std::uint32_t>(lists_.size() - 2 * kClusters);
    lists_.push_back(static_cast<std::uint32_t>(lights_.size() - 1));
    for (std::size_t i = 0; i < kClusters; ++i) {
        lists_[2 * i] = static_cast<std::uint32_t>(2 * kClusters) - all;
        lists_[2 * i + 1] = std::max(own + all, 1u);
    }
}

}  // namespace tessera

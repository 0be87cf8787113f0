/// Random volumes, random places for them, and rays that are followed in double, straight from what Volume.h says.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <random>

#include "client/draw/store/VolumeTextures.h"
#include "common/drawable/VolumeShapes.h"
#include "tests/unit/draw/RendererStage.h"

namespace tessera {

/// Its seeds: those named, or one that TESSERA_SEED says.
inline std::vector<unsigned> volumeSeeds(unsigned count) {
    if (const char* one = std::getenv("TESSERA_SEED")) return {static_cast<unsigned>(std::atoi(one))};
    std::vector<unsigned> seeds(count);
    for (unsigned i = 0; i < count; ++i) seeds[i] = i + 1;
    return seeds;
}

class FieldDice {
public:
    explicit FieldDice(unsigned seed) : random_(seed) {}
    double any(double from, double to) { return std::uniform_real_distribution<double>(from, to)(random_); }
    std::uint32_t below(std::uint32_t n) { return static_cast<std::uint32_t>(random_() % n); }
    Vec3d vector(double size) { return {any(-size, size), any(-size, size), any(-size, size)}; }
    Quatd turn() { return Quatd(any(-1, 1), any(-1, 1), any(-1, 1), any(-1, 1)).normalized(); }

private:
    std::mt19937 random_;
};

template <typename Number>
Blob numbersFrom(const std::vector<double>& values) {
    std::vector<Number> numbers;
    for (const double value : values) numbers.push_back(static_cast<Number>(value));
    return Blob::of(std::span<const Number>(numbers));
}

inline Volume someVolume(FieldDice& dice) {
    Volume v;
    v.sizeX = 2 + dice.below(6);
    v.sizeY = 2 + dice.below(6);
    v.sizeZ = 2 + dice.below(6);
    v.format = dice.below(4);
    const double least = v.format == Volume::kInt16 ? -32768 : v.format == Volume::kFloat ? -3 : 0;
    const double most = v.format == Volume::kUint8    ? 255
                        : v.format == Volume::kUint16 ? 65535
                        : v.format == Volume::kInt16  ? 32767
                                                      : 5;
    std::vector<double> values;
    for (std::int64_t i = 0; i < v.sizeX * v.sizeY * v.sizeZ; ++i)
        values.push_back(v.format == Volume::kFloat ? dice.any(least, most) : std::round(dice.any(least, most)));
    v.voxels = v.format == Volume::kUint8    ? numbersFrom<std::uint8_t>(values)
               : v.format == Volume::kUint16 ? numbersFrom<std::uint16_t>(values)
               : v.format == Volume::kInt16  ? numbersFrom<std::int16_t>(values)
                                             : numbersFrom<float>(values);
    v.spacing = Vec3d(dice.any(0.1, 0.5), dice.any(0.1, 0.5), dice.any(0.1, 0.5));
    v.origin = -0.5 * v.spacing.cwiseProduct(Vec3d(static_cast<double>(v.sizeX - 1), static_cast<double>(v.sizeY - 1),
                                                   static_cast<double>(v.sizeZ - 1))) +
               dice.vector(0.2);
    v.low = least + dice.any(-0.2, 0.4) * (most - least);
    v.high = v.low + dice.any(0.3, 1) * (most - least);
    std::vector<std::uint8_t> transfer;
    for (std::uint32_t i = 0, stops = dice.below(6); i < 4 * stops; ++i)
        transfer.push_back(static_cast<std::uint8_t>(dice.below(4) == 0 ? 255 * dice.below(2) : dice.below(256)));
    v.transfer = transfer.empty() ? Blob() : Blob::of(std::span<const std::uint8_t>(transfer));
    v.thickness = dice.any(0.1, 2);
    v.step = 0.05;
    v.shaded = false;
    std::vector<double> planes;
    for (std::uint32_t i = 0, count = dice.below(3); i < count; ++i) {
        const Vec3d n = dice.vector(2);
        planes.insert(planes.end(), {n.x(), n.y(), n.z(), dice.any(-0.3, 0.8) * n.norm()});
    }
    if (!planes.empty()) v.clipPlanes = Blob::of(std::span<const double>(planes));
    return v;
}

/// What the header says is seen at a place, of 1.
struct SeenThere {
    std::array<double, 3> color{};
    double opacity = 0;
};

inline SeenThere byTransfer(const Volume& v, double value) {
    const std::vector<std::uint8_t> grey = {0, 0, 0, 0, 255, 255, 255, 255};
    std::span<const std::uint8_t> stops =
        v.transfer.empty() ? std::span<const std::uint8_t>(grey) : v.transfer.as<std::uint8_t>();
    const std::size_t count = stops.size() / 4;
    const double at = std::clamp((value - v.low) / (v.high - v.low), 0.0, 1.0) * static_cast<double>(count - 1);
    const std::size_t first = std::min(static_cast<std::size_t>(at), count - 1), next = std::min(first + 1, count - 1);
    const double f = at - static_cast<double>(first);
    const auto channel = [&](std::size_t c) {
        return (stops[4 * first + c] * (1 - f) + stops[4 * next + c] * f) / 255;
    };
    return {{channel(0), channel(1), channel(2)}, channel(3)};
}

inline double valueAt(const Volume& v, const Vec3d& place) {
    return gridOf(v).linearAt((place - v.origin).cwiseQuotient(v.spacing));
}

/// Of a ray in the node's coordinates, t in lengths of them.
struct FieldRay {
    Vec3d from, along;  ///< of length 1
    double begin = 0, end = 0;

    FieldRay(const Volume& v, const Vec3d& eye, const Vec3d& direction, double nearest, double solid)
        : from(eye), along(direction), begin(nearest), end(solid) {
        const Vec3d upper =
            v.origin + v.spacing.cwiseProduct(Vec3d(static_cast<double>(v.sizeX - 1), static_cast<double>(v.sizeY - 1),
                                                    static_cast<double>(v.sizeZ - 1)));
        for (int axis = 0; axis < 3; ++axis) {
            cut(Vec3d::Unit(axis), upper[axis]);
            cut(-Vec3d::Unit(axis), -v.origin[axis]);
        }
        const std::span<const double> planes = v.clipPlanes.as<double>();
        for (std::size_t i = 0; i < planes.size(); i += 4)
            cut({planes[i], planes[i + 1], planes[i + 2]}, planes[i + 3]);
    }
    void cut(const Vec3d& n, double d) {
        const double towards = n.dot(along), before = d - n.dot(from);
        if (towards > 0) end = std::min(end, before / towards);
        if (towards < 0) begin = std::max(begin, before / towards);
        if (towards == 0 && before < 0) end = -1;
    }
};

/// What becomes of a colour (sRGB, of 1) at a place in the node's coordinates.
using ColorThere = std::function<std::array<double, 3>(const Vec3d& place, const std::array<double, 3>& color)>;

/// Pieces that end at multiples of `step`, each looked at `times` times. `lit`: of what is shaded.
inline SeenThere followed(const Volume& v, const FieldRay& ray, double step, int times, const ColorThere& lit = {}) {
    SeenThere seen;
    double clear = 1, greatest = -1e300;
    for (double at = ray.begin; at < ray.end;) {
        const double next = std::min(ray.end, (std::floor(at / step + 1e-9) + 1) * step), piece = (next - at) / times;
        for (int i = 0; i < times; ++i) {
            const Vec3d place = ray.from + (at + (i + 0.5) * piece) * ray.along;
            const double value = valueAt(v, place);
            greatest = std::max(greatest, value);
            SeenThere here = byTransfer(v, value);
            if (lit && here.opacity > 0) here.color = lit(place, here.color);
            const double a = 1 - std::pow(1 - std::min(here.opacity, 1 - std::ldexp(1, -16)), piece / v.thickness);
            for (std::size_t c = 0; c < 3; ++c) seen.color[c] += clear * a * here.color[c];
            clear *= 1 - a;
        }
        at = next;
    }
    seen.opacity = 1 - clear;
    if (v.mode != Volume::kMaximum || greatest == -1e300) return seen;
    seen = byTransfer(v, greatest);
    for (double& c : seen.color) c *= seen.opacity;
    return seen;
}

class VolumeStage : public RendererTest {
protected:
    struct Stage {
        Aspect aspect;
        ScreenCamera camera;
        Affine3d world_T_node;
        Rgb background;
        double solidZ = -1e9;  ///< a sheet right across the view
    };
    /// Stretched below a turn: sheared, mirrored now and then.
    static Stage someStage(FieldDice& dice, const Volume& v) {
        Stage stage;
        TestScene scene;
        const Vec3f behind(0.2f, 0.5f, 0.1f);
        scene.setDark(behind);
        stage.background = expectedOf(behind);
        const Quatd outer = dice.turn(), inner = dice.turn();
        const Vec3d scale(dice.any(0.6, 1.6), dice.any(0.6, 1.6),
                          dice.below(3) == 0 ? -dice.any(0.6, 1.2) : dice.any(0.6, 1.6)),
            shift = dice.vector(0.3);
        scene.addNode(scene.addCore(v),
                      scene.addTransform(Vec3d::Zero(), inner, Vec3d::Ones(), scene.addTransform(shift, outer, scale)));
        stage.world_T_node = Eigen::Translation3d(shift) * outer * Eigen::Scaling(scale) * inner;
        if (dice.below(2) == 0) {
            stage.solidZ = dice.any(-1, 0.2);  // before every eye
            const Vec3f color(0.7f, 0.2f, 0.4f);
            scene.place(scene.add(makeSheet(60, 60), scene.add(unlit(color))), {0, 0, stage.solidZ});
            stage.background = expectedOf(color);
        }
        stage.aspect = scene.take();
        stage.camera =
            cameraOf(kSidePx, kSidePx,
                     {dice.any(-0.5, 0.5), dice.any(-0.5, 0.5), dice.below(2) == 0 ? dice.any(0.3, 0.8) : 2.4});
        return stage;
    }
    /// Through a pixel's middle, in the world; the eye is where it begins.
    static Vec3d throughPixel(const ScreenCamera& camera, double x, double y) {
        const Vec4d clip(2 * x / kSidePx - 1, 1 - 2 * y / kSidePx, 0, 1);
        const Vec4d eye = camera.clip_T_eye.inverse() * clip;
        return camera.eye_T_world.inverse() * Vec3d(eye.head<3>() / eye.w());
    }
    /// The part of the ray in the volume, before what is solid.
    static FieldRay rayOf(const Stage& stage, const Volume& v, double x, double y) {
        const Vec3d place = throughPixel(stage.camera, x, y), eye = stage.camera.eyeWorld;
        const Affine3d node_T_world = stage.world_T_node.inverse();
        const Vec3d from = node_T_world * eye, all = node_T_world * place - from;
        const double lengthPerWay = all.norm(), solid = (stage.solidZ - eye.z()) / (place.z() - eye.z());
        // As of all things, nothing of it is seen before the near plane.
        const double nearest = kNearPlaneMetres / -(stage.camera.eye_T_world * place).z();
        return FieldRay(v, from, all / lengthPerWay, nearest * lengthPerWay, solid > 0 ? solid * lengthPerWay : 1e9);
    }
    struct SeenPixel {
        int x, y;
        FieldRay ray;
        std::array<int, 3> is;
    };
    /// Some of the picture, from pixel `first` on each side, every so many; without those at the rim of the box, where
    /// a ray's rounding decides whether it meets it.
    static std::vector<SeenPixel> pixelsOf(const Picture& picture, const Stage& stage, const Volume& v, int first,
                                           int every) {
        std::vector<SeenPixel> all;
        for (int y = first; y < kSidePx; y += every)
            for (int x = first; x < kSidePx; x += every) {
                const FieldRay ray = rayOf(stage, v, x + 0.5, y + 0.5);
                const Rgb is = pixel(picture, x, y);
                if (std::abs(ray.end - ray.begin) >= 1e-3) all.push_back({x, y, ray, {is.r, is.g, is.b}});
            }
        return all;
    }
    static int over(double color, double opacity, int background) {
        return static_cast<int>(std::lround(std::clamp(255 * color + (1 - opacity) * background, 0.0, 255.0)));
    }
};

}  // namespace tessera

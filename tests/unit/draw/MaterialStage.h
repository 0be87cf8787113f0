/// Materials on a sheet under one light, and images made pixel by pixel.
#pragma once

#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include "tests/unit/draw/RendererStage.h"

namespace tessera {

using Rgba = std::array<std::uint8_t, 4>;

/// An image whose pixel is what `of` says at its column and row.
inline Image imageOf(int side, const std::function<Rgba(int, int)>& of) {
    std::vector<std::uint8_t> pixels;
    for (int y = 0; y < side; ++y)
        for (int x = 0; x < side; ++x) {
            const Rgba value = of(x, y);
            pixels.insert(pixels.end(), value.begin(), value.end());
        }
    return {.pixels = Blob::of(std::span<const std::uint8_t>(pixels)), .widthPx = side, .heightPx = side};
}
inline Image plain(const Rgba& value) {
    return imageOf(2, [&](int, int) { return value; });
}

inline double linearOf(int srgb) {
    const double s = srgb / 255.0;
    return s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4);
}

class MaterialTest : public RendererTest {
protected:
    /// A sheet that is as large as the picture at the wall's plane, seen from in front, with light from `light` alone.
    TestScene lit(const Vec3d& light, float intensity = 0.5f) {
        TestScene scene;
        scene.setEnvironment(Vec3f::Zero(), Vec3f::Zero(), Vec3f::Zero());
        scene.addDirectionalLight(-light, Vec3f::Ones(), intensity);
        return scene;
    }
    static Material of(const Vec3d& base) {
        Material material;
        material.baseColor << base.cast<float>(), 1.0f;
        material.roughness = 1;
        return material;
    }
    Rgb middleOf(TestScene& scene, const Material& material, const Quatd& turned = Quatd::Identity()) {
        scene.place(scene.add(makeSheet(1.0, 1.0), scene.add(material)), {0, 0, -0.001}, turned);
        return center(draw(scene));
    }
    /// From the middle of the pixel that `center` looks at.
    static Vec3d towardsEye() { return Vec3d(-0.5 * 3.2 / kSidePx, 0.5 * 3.2 / kSidePx, 2.4).normalized(); }
};
}  // namespace tessera

/// What a picture of the surroundings gives off: computed from it once, on the processor, in double. No GL.
#pragma once

#include <array>
#include <vector>

#include "client/render/DrawList.h"
#include "common/base/Error.h"

namespace tessera {

/// Directions are the picture's own: its middle lies along -Z, +X is right of it, +Y up (Environment::image).
///
/// Reflections are kept in octahedral maps (Cigolle et al. 2014), one for each of a few roughnesses, one above the other in
/// one texture. Each texel is the mean of the surroundings over GGX's lobe, seen along the normal (Karis 2013, "Real shading
/// in Unreal Engine 4": the split sum); the sum goes over a quadtree of the sharp map, farther nodes coarser. A map has a
/// border of one texel that goes on around its edge, so that it can be read with linear filters.
class EnvironmentLight {
public:
    static constexpr int kLevels = 6;
    static constexpr std::array<int, kLevels> kSides = {512, 128, 64, 32, 32, 32};  ///< without borders
    /// Of a level: 0, 0.2, …, 1.
    [[nodiscard]] static constexpr double roughnessOf(int level) { return level / (kLevels - 1.0); }
    static constexpr int kAtlasWidth = 514;
    static constexpr int kAtlasHeight = 514 + 130 + 66 + 3 * 34;
    /// The row where a level begins, its border included.
    [[nodiscard]] static int firstRow(int level);

    /// kBadInput, with the reason: no picture of all around. The pixels must be here.
    [[nodiscard]] static Expected<EnvironmentLight> of(const Image& image);

    /// Radiance, for a direction of unit length: the nearest texel's of the sharp map.
    [[nodiscard]] Vec3d radiance(const Vec3d& direction) const;
    /// What a white surface with this normal reflects, from the expansion: E / pi.
    [[nodiscard]] Vec3d diffuse(const Vec3d& normal) const;
    /// A level's texel, counted without borders.
    [[nodiscard]] Vec3d reflected(int level, int x, int y) const;
    [[nodiscard]] static Vec3d directionOf(int level, int x, int y);

    /// Nine coefficients such that what is diffusely reflected is their sum times 1, y, z, x, xy, yz, 3z² - 1, xz, x² - y²
    /// (Ramamoorthi and Hanrahan 2001).
    [[nodiscard]] const std::array<Vec3f, 9>& harmonics() const { return harmonics_; }
    /// RGBA, kAtlasWidth × kAtlasHeight.
    [[nodiscard]] const std::vector<float>& atlas() const { return atlas_; }

private:
    struct Node {
        Vec3d sum = Vec3d::Zero();  ///< radiance × solid angle
        Vec3d direction = Vec3d::UnitZ();
        double solidAngle = 0;
    };
    void buildTree(const Image& image);
    void project();
    void filter(int level);
    [[nodiscard]] Vec3d lobeMean(const Vec3d& axis, double roughness) const;
    void store(int level, int x, int y, const Vec3d& value);
    void closeBorders(int level);

    std::vector<std::vector<Node>> tree_;  ///< by side: 1, 2, 4, … 512
    std::array<Vec3f, 9> harmonics_{};
    std::vector<float> atlas_;
};

}  // namespace tessera

/// What a picture of the surroundings gives off: computed from it once, on the processor, in double. No GL.
#pragma once

#include <array>
#include <vector>

#include "client/render/DrawList.h"
#include "common/base/Error.h"
#include "common/math/Srgb.h"

namespace tessera {

/// What there is to see all around, linear: an equirectangular picture, or six squares as Image::kCube has them, one
/// after the other; rows from the top.
struct SurroundingsPicture {
    bool cube = false;
    std::size_t width = 0, height = 0;  ///< of a face
    std::vector<Vec3f> pixels;

    /// Linear between pixels, across its seams too.
    [[nodiscard]] Vec3d at(const Vec3d& direction) const;
    /// Means of 2 × 2 pixels; both sides are 2 at least.
    void halve();
};

/// Directions are the picture's own: its middle lies along -Z, +X is right of it, +Y up (Environment::image); of cubes
/// the faces' own.
///
/// Reflections are kept in octahedral maps (Cigolle et al. 2014), one for each of a few roughnesses, one above the
/// other in one texture. Each texel is the mean of the surroundings over GGX's lobe, seen along the normal (Karis 2013,
/// "Real shading in Unreal Engine 4": the split sum); the sum goes over a quadtree of the sharp map, farther nodes
/// coarser. A map has a border of one texel that goes on around its edge, so that it can be read with linear filters.
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

    /// kBadInput, with the reason: no picture of all around, a compressed one (EnvironmentTexture). The pixels must be
    /// here.
    [[nodiscard]] static Expected<EnvironmentLight> of(const Image& image);
    [[nodiscard]] static EnvironmentLight of(const SurroundingsPicture& picture);
    /// Whether it is one by its fields; kBadInput as above.
    [[nodiscard]] static Expected<void> check(const Image& image);

    /// Radiance, for a direction of unit length: the nearest texel's of the sharp map.
    [[nodiscard]] Vec3d radiance(const Vec3d& direction) const;
    /// A level's texel, counted without borders.
    [[nodiscard]] Vec3d reflected(int level, int x, int y) const;
    [[nodiscard]] static Vec3d directionOf(int level, int x, int y);

    /// Nine coefficients such that what a white surface with the normal (x, y, z) reflects, E / pi, is their sum times
    /// 1, y, z, x, xy, yz, 3z² - 1, xz, x² - y² (Ramamoorthi and Hanrahan 2001).
    [[nodiscard]] const std::array<Vec3f, 9>& harmonics() const { return harmonics_; }
    /// RGBA, kAtlasWidth × kAtlasHeight.
    [[nodiscard]] const std::vector<float>& atlas() const { return atlas_; }

private:
    struct Node {
        Vec3d sum = Vec3d::Zero();  ///< radiance × solid angle
        Vec3d direction = Vec3d::UnitZ();
        double solidAngle = 0;
    };
    void buildTree(const SurroundingsPicture& picture);
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

/// From the world to the pixels of one tile, and how far a renderer in single precision may be off there.
#pragma once

#include <algorithm>

#include "client/render/PlaceKernels.h"
#include "common/math/Box.h"
#include "common/wall/View.h"

namespace tessera {

/// What of a tile a box can reach. Pixels count from the tile's lower left; pixel (i, j) is the square [i, i+1] × [j,
/// j+1].
struct Footprint {
    bool nearPlane =
        false;  ///< reaches into the near plane: may be anywhere; the rectangle is that of what is beyond it
    double lowerX = 0, lowerY = 0, upperX = 0, upperY = 0;
    double nearest = 0;   ///< greatest inverse depth, noise added
    double farthest = 0;  ///< of the corners, metres

    void grow(double px) {
        lowerX -= px;
        lowerY -= px;
        upperX += px;
        upperY += px;
    }
};

/// Depth is kept as *inverse depth*, 1 / clip w, in 1/m: greater is nearer, and it is affine over a triangle's pixels.
///
/// Noise: a renderer makes eye_T_item in double and applies it to vertices in single precision. Each clip coordinate is
/// then off by at most `noise` metres, a few roundings of the greatest intermediate value; that displaces a pixel at
/// inverse depth d by at most noise · pixelsPerMetre · d, and depth by a share of itself.
class TileProjection {
public:
    /// `marginPx`: how far things may stand out beside their places on the screen, as lines do.
    TileProjection(const ScreenCamera& camera, const PixelRect& pixels, double marginPx = 0);

    /// False for projections that are not a perspective along the eye's -z; nothing is said about hiding then.
    [[nodiscard]] bool usable() const { return usable_; }
    [[nodiscard]] int widthPx() const { return width_; }
    [[nodiscard]] int heightPx() const { return height_; }
    [[nodiscard]] const Mat4d& clip_T_world() const { return clip_T_world_; }
    [[nodiscard]] double nearMetres() const { return near_; }
    [[nodiscard]] double farMetres() const { return far_; }                            ///< infinite, as screens have it
    [[nodiscard]] double pixelsPerMetre() const { return pixelsPerMetre_; }            ///< at 1 m, at the most
    [[nodiscard]] double leastPixelsPerMetre() const { return leastPixelsPerMetre_; }  ///< across or up, at 1 m
    [[nodiscard]] double metresPerUnit() const { return metresPerUnit_; }
    /// Farther than any pixel of the screen is from its corner: planes of attributes are rounded there.
    [[nodiscard]] double screenReachPx() const { return screenReach_; }

    [[nodiscard]] double xPx(double clipX, double clipW) const { return clipX / clipW * halfWidth_ + offsetX_; }
    [[nodiscard]] double yPx(double clipY, double clipW) const { return clipY / clipW * halfHeight_ + offsetY_; }

    /// In metres, for a mesh with this reach (see SceneItem) whose own origin is here.
    [[nodiscard]] double noise(double reach, const Vec3d& origin) const {
        return kRounding * metresPerUnit_ * (reach + (origin - eye_).norm());
    }
    /// In metres, for all meshes up to this reach within the box.
    [[nodiscard]] double noise(double reach, const Box& box) const {
        return noise(2 * reach + 0.5 * box.size().norm(), box.center());
    }
    /// Inverse depth as the renderer may see it at the least, and at the most.
    [[nodiscard]] double farther(double inverseDepth, double noise) const {
        return inverseDepth * (1 - 2 * noise / depthSlope_) - depthNoise_;
    }
    [[nodiscard]] double nearer(double inverseDepth, double noise) const {
        return inverseDepth * (1 + 2 * noise / depthSlope_) + depthNoise_;
    }

    /// Of triangles no nearer than this inverse depth: what is higher than so many pixels shows the side that it has
    /// without rounding, whatever a grid of 1/256 pixel and single precision do to its corners.
    [[nodiscard]] double flattestPx(double noise, double inverseDepth) const {
        return std::max(kFlattestPx, 8 * noise * pixelsPerMetre_ * inverseDepth);
    }

    /// For the kernels of ItemPlaces.h.
    [[nodiscard]] places::Screen screen() const;
    [[nodiscard]] Footprint footprint(const Mat4d& clip_T_box, const Box& box, double noise) const;
    /// What the box covers of the tile, in pixels; exact but for rounding.
    [[nodiscard]] double coveredPx(const Mat4d& clip_T_box, const Box& box) const;

private:
    /// Four products and their sum, matrices rounded before: eight half units in the last place, doubled.
    static constexpr double kRounding = 1.0 / (1 << 20);
    static constexpr double kFlattestPx = 0.02;

    /// Metres, the noise left out. Half of the near distance more than needed: nothing is lost, things that close are
    /// nearly always visible.
    [[nodiscard]] double leastDepth() const { return 1.5 * near_; }

    bool usable_ = false;
    int width_ = 0, height_ = 0;
    Mat4d clip_T_world_;
    double halfWidth_ = 0, halfHeight_ = 0, offsetX_ = 0, offsetY_ = 0;
    double near_ = 0, far_ = 0;
    double depthSlope_ = 1;  ///< of normalised depth over inverse depth
    double depthNoise_ = 0;  ///< in inverse depth: what a 32-bit depth buffer and its interpolation round off
    double pixelsPerMetre_ = 0, leastPixelsPerMetre_ = 0, metresPerUnit_ = 1, screenReach_ = 0, margin_ = 0;
    Vec3d eye_;
};

}  // namespace tessera

/// Where many items lie, before an eye and on a screen: what the kernels of two instruction sets share.
///
/// Plain data: this header is compiled into files of different instruction sets and must bring no inline function with
/// it. Each item gets the same IEEE operations in the same order whatever the instruction set (nothing is contracted),
/// so pictures do not depend on the processor. ItemPlaces.h is for others.
#pragma once

#include <cstddef>

namespace tessera::places {

/// A matrix of Eigen's, column by column: what does not move has (0, 0, 0, 1) as its last row.
using Matrix = const double*;
/// Three rows of four numbers from an item to the eye, then three of what turns its normals (the fourth is 0).
inline constexpr std::size_t kRowFloats = 24;

/// See TileProjection.
struct Screen {
    double clip_T_world[16];
    double eye[3];      ///< world
    double rounding;    ///< metres of noise per world unit
    double leastDepth;  ///< metres: what reaches nearer may be anywhere
    double pixelsPerMetre;
    double halfWidth, halfHeight, offsetX, offsetY, margin;  ///< pixels
};

/// Pixels; not a number on any side: nobody knows.
struct Rectangle {
    double lowerX, lowerY, upperX, upperY;
};

struct PlaceKernels {
    /// `rows[i]`: kRowFloats of item i.
    void (*beforeEye)(Matrix eye_T_world, const Matrix* world_T_item, float* const* rows, std::size_t count);
    /// Of boxes in the world: three lower, three upper sides each.
    void (*onScreen)(const Screen& screen, const double* const* boxes, const Matrix* world_T_item, Rectangle* found,
                     std::size_t count);
};

}  // namespace tessera::places

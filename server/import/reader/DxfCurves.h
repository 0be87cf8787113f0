/// Curves of DXF as chords.
#pragma once

#include <span>
#include <vector>

#include "common/math/Types.h"

namespace tessera {

using DxfPath = std::vector<Vec3d>;

/// Axes of an object's own coordinates in those of the world, as columns, by the "arbitrary axis algorithm" of
/// AutoCAD's DXF Reference. `extrusion` need not be of length 1; none is +Z.
[[nodiscard]] Mat3d dxfFrame(const Vec3d& extrusion);

/// Angles of an arc that goes counter-clockwise, in radians: above 0, at most a whole turn.
[[nodiscard]] double dxfSweep(double start, double end);

/// How finely. Of drawings with very many curves it is less.
struct DxfChords {
    int perTurn = 64, perSpan = 16;
    int fewest = 8;  ///< of an arc, however short
};
inline constexpr DxfChords kCoarseChords{16, 3, 2}, kRoughChords{8, 2, 2};

/// Adds center + cos(t) major + sin(t) minor, t from `start` on over `sweep`, which may be negative.
void addDxfEllipse(DxfPath& path, const Vec3d& center, const Vec3d& major, const Vec3d& minor, double start,
                   double sweep, const DxfChords& chords);

/// Adds what leads from the path's last point to `to`: the tangent of a quarter of the arc's angle, above 0
/// counter-clockwise about +Z.
void addDxfBulge(DxfPath& path, const Vec3d& to, double bulge, const DxfChords& chords);

struct DxfSpline {
    std::size_t degree = 3;
    std::vector<double> knots, weights;  ///< no weights: all are 1
    std::vector<Vec3d> points;           ///< control points
    std::vector<Vec3d> through;          ///< of one that has no control points
    bool closed = false;                 ///< of the latter
};

/// Chords between knots (de Boor's algorithm). Empty where the numbers are not those of a spline: a degree from 1
/// to 11, degree + 1 knots more than points, ascending, weights above 0.
[[nodiscard]] DxfPath dxfSplinePath(const DxfSpline& spline, const DxfChords& chords);

}  // namespace tessera

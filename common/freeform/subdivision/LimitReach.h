/// Where each control face's limit surface can be, and how far it is from triangles between its points, by level: what
/// says how fine a face is worth drawing. From control points alone, in time proportional to the faces that are asked
/// for.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/freeform/subdivision/LimitPlan.h"

namespace tessera {

struct LimitReach {
    /// Around the control points that the face depends on: no limit point, and no triangle between such, is outside, as
    /// no weight is below 0.
    std::array<float, 3> lower{}, upper{};
    /// By level: about how far surface and triangles are from each other, rather too much than too little; across the
    /// surface, along what is sharp or a boundary in all directions. Rounding to floats is not in it. Also of triangles
    /// that a finer neighbour's vertices cut smaller. Of polygons the first is the second.
    std::array<float, LimitPlan::kFinestLevel + 1> deviation{};
};

/// `faces`: control faces; those without surface get nothing. `points`: xyz of each control point, finite. `reaches`:
/// by control face.
///
/// Regular faces: second derivatives at sixteen points (Loop: seven) and what they can do to a triangle (Filip,
/// Magedson and Markot, Surface algorithms using bounds on derivatives, CAGD 3, 1986), across the surface. Others:
/// points of the third level (bilinear: second; beside creases that end fourth) beside the triangles of those before
/// it; from there on falling off as the subdivision matrix's curvature does, and not at all while a crease is not yet
/// smooth. Factors for what lies between these points were chosen so that 800 seeds of wild meshes find none that is
/// farther off (LimitReachTest.cpp).
void measureReaches(const LimitPlan& plan, std::span<const std::uint32_t> faces, std::span<const float> points,
                    std::span<LimitReach> reaches);

}  // namespace tessera

/// Surfaces whose closed form is known: exact as rational surfaces. For scenes that are made, and as truth.
///
/// Piegl and Tiller, The NURBS Book, chapters 7 and 8: circles of nine control points with weights 1 and 1/√2, surfaces
/// of revolution. About the y axis, normals outwards; u runs from 0 to 4 around (a quarter turn each, not by angle), v
/// along the profile. Refused where a number makes no surface, or a loop is none. Values only; any thread.
#pragma once

#include <vector>

#include "common/freeform/nurbs/NurbsSurface.h"

namespace tessera {

/// Around the origin; v from the south pole at 0 over the equator at 1 to the north pole at 2.
[[nodiscard]] Expected<NurbsSurface> sphereSurface(double radius, std::vector<TrimLoop> loops = {});
/// `radius` from the axis to the middle of the tube; v from 0 to 4 around the tube, from its outside over its top.
[[nodiscard]] Expected<NurbsSurface> torusSurface(double radius, double tubeRadius, std::vector<TrimLoop> loops = {});
/// From y = 0 at v = 0 to y = height at v = 1, without lids.
[[nodiscard]] Expected<NurbsSurface> cylinderSurface(double radius, double height, std::vector<TrimLoop> loops = {});
/// A cylinder whose upper radius is another one; 0: a cone.
[[nodiscard]] Expected<NurbsSurface> coneSurface(double lowerRadius, double upperRadius, double height,
                                                 std::vector<TrimLoop> loops = {});

}  // namespace tessera

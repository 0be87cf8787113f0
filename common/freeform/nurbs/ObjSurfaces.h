/// Free-form surfaces of Wavefront OBJ files.
///
/// Wavefront, Object Files (.obj), version 3.0. Read are v, vp, cstype, deg, bmat, step, surf, curv2, parm, trim, hole
/// and end: types bspline and bezier as they are, bmatrix and cardinal converted exactly, each rational or not; taylor,
/// and statements of version 2.11 (bzp, bsp, cdc, cdp, res), are refused by name. curv, scrv, sp and con change no
/// surface: they are read past, and so are polygons and whatever else there is outside of a body. `call` and `csh` are
/// refused: nothing but this text is read. Values only; any thread.
#pragma once

#include <string_view>
#include <vector>

#include "common/freeform/nurbs/NurbsSurface.h"

namespace tessera {

struct ObjSurfaceLimits {
    /// Control points of all surfaces and loops together. Curves that loops share and bases that are converted make
    /// more of them than the text has.
    std::size_t maxPoints = 4'000'000;
};

/// In the file's order: the surface with the index n is "patch n" wherever somebody names one by a number, from 0; its
/// parameters are those of its knots. Errors: "FILE:LINE: what is wrong", the line where a statement begins; kLimit
/// beyond the limits, else kBadInput. A text without a surface is refused.
[[nodiscard]] Expected<std::vector<NurbsSurface>> readNurbsObj(std::string_view text, std::string_view fileName,
                                                               const ObjSurfaceLimits& limits = {});

}  // namespace tessera

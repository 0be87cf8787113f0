/// A piece of the plane z = 0 as a surface, with trims: what their tests are about is nothing but these.
#pragma once

#include <utility>
#include <vector>

#include "common/freeform/nurbs/NurbsSurface.h"

namespace tessera {

/// Its x and y are the parameters, its normal is +z.
inline Expected<NurbsSurface> planeSurface(const ParameterRectangle& r, std::vector<TrimLoop> loops = {}) {
    NurbsDefinition d{.u = {.degree = 1, .knots = {r.u.lower, r.u.lower, r.u.upper, r.u.upper}},
                      .v = {.degree = 1, .knots = {r.v.lower, r.v.lower, r.v.upper, r.v.upper}},
                      .points = {},
                      .rangeU = {},
                      .rangeV = {},
                      .loops = std::move(loops)};
    for (const double y : {r.v.lower, r.v.upper})
        for (const double x : {r.u.lower, r.u.upper}) d.points.emplace_back(x, y, 0, 1);
    return NurbsSurface::make(std::move(d));
}

}  // namespace tessera

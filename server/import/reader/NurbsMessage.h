/// NURBS surfaces as a scene's text and the importer's pipe say them.
#pragma once

#include "common/base/Error.h"
#include "common/freeform/nurbs/NurbsSurface.h"
#include "proto/scene.pb.h"

namespace tessera {

/// Degrees, knots, points, weights, range and loops; material and tolerances stay.
void setSurface(proto::scene::NurbsSurface& message, const NurbsSurface& surface);

/// The same surface by its control points: what is a sphere, a torus, a cylinder or a cone in the text is none beyond
/// here. kBadInput says what makes none, or that it is said twice.
[[nodiscard]] Expected<proto::scene::NurbsSurface> byControlPoints(const proto::scene::NurbsSurface& message);

}  // namespace tessera

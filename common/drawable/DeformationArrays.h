/// How the arrays of a Deformation are made: its mesh at rest, moved by its lattice of control points.
#pragma once

#include "common/cores/Deformation.h"
#include "common/drawable/Derivation.h"

namespace tessera {

extern const Derivation kDeformationDerivation;

/// Those that move nothing, for whoever wants to edit some of them. Refused as the deformation would be.
[[nodiscard]] Expected<Blob> controlPointsAtRest(const Deformation& deformation);

}  // namespace tessera

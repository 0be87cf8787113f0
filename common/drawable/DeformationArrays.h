/// How the arrays of a Deformation are made: its mesh at rest, moved by its lattice of control points.
#pragma once

#include "common/drawable/Derivation.h"

namespace tessera {

extern const Derivation kDeformationDerivation;

}  // namespace tessera

/// A SubdivisionSurface's triangles.
#pragma once

#include "common/drawable/Derivation.h"

namespace tessera {

extern const Derivation kSubdivisionDerivation;

}  // namespace tessera

/// Triangles of a Text: its outlines, flat and seen from both sides, or solid.
#pragma once

#include "common/drawable/Derivation.h"

namespace tessera {

/// Letters one after the other; of each its front, then its back, then, of solid ones, its sides, all facing outwards.
/// Whole whenever anything changes. Each step of fineness has chords within a quarter of the distance; 0 within 1/512
/// em.
extern const Derivation kTextDerivation;

}  // namespace tessera

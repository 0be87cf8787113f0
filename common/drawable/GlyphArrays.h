/// How glyphs are drawn, and what else they are.
///
/// On screens (kGlyphsOnScreens) they are one shape and its copies (MeshKind::kGlyphs), with a colour each. Copies
/// that follow each other lie near each other (Morton's order of their places), so that runs of them are culled by
/// their boxes. For all others each is the box around its shape, turned with it, twelve triangles, in the arrays' own
/// order.
///
/// Colours are multiplied as the bytes stand, and linear between the stops of `transfer`: whole numbers, the same on
/// every host.
#pragma once

#include "common/cores/Glyphs.h"
#include "common/drawable/Derivation.h"

namespace tessera {

inline constexpr unsigned kGlyphsOnScreens = 1;
/// Of one core; a shape of one's own may have so much.
inline constexpr std::size_t kMostGlyphs = 1'000'000, kMostShapeVertices = 1024, kMostShapeTriangles = 2048;

/// Refused in words: arrays that are not of as many glyphs as `positions`, numbers beyond 1e30, more glyphs or vertices
/// than these, more than MeshLimits::maxTriangles in all, a shape that is no sound mesh, low not below high.
extern const Derivation kGlyphDerivation;

}  // namespace tessera

/// How particles are drawn: places with what each looks like now, made of their ages and ramps.
///
/// They travel in the arrays of lines, which nobody collides with and no ray meets, and are told from those of a
/// Geometry by a radius, which lines have not:
///   points and quads  `positions` one each; `texcoords` (size, 0); quads `texcoords1` (cosine and sine of the turn);
///   no `lines` lines             `positions` tail and head in turn, which `lines` name; `texcoords` (width in pixels,
///   0), the same twice
/// `colors` are what is seen, own times ramp, or none: white. Who is not shown has size 0. `pointRadius`: as far as
/// anything reaches around its position, and at least the smallest number above 0; negative where they are drawn as the
/// arrays have them, not sorted.
///
/// Ramps are linear between their stops as the bytes stand; colours are multiplied as the bytes stand: whole numbers,
/// the same on every host.
#pragma once

#include <cstddef>

#include "common/cores/Particles.h"
#include "common/drawable/Derivation.h"

namespace tessera {

/// As many as one core may have: GL takes 192 bytes each.
inline constexpr std::size_t kMostParticles = 1'000'000;
/// As wide as lines are drawn that want to be wider; what a size may be otherwise.
inline constexpr double kGreatestParticleSize = 1e12;

[[nodiscard]] inline bool areParticles(const MeshArrays& arrays) {
    return arrays.primitive == Primitive::kLines && arrays.pointRadius != 0;
}

/// Refused in words: arrays that are not of as many particles as `positions`, lines without tails, more than
/// kMostParticles, places that are not finite, ages and turns that are no numbers, sizes below 0 or beyond
/// kGreatestParticleSize.
extern const Derivation kParticleDerivation;

}  // namespace tessera

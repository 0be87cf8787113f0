/// How particles are drawn: places with what each looks like now, made of their ages and ramps.
///
/// They have no triangles, so that nobody collides with them and no ray meets them:
///   kDiscs, kSprites  `positions` one each; `texcoords` (size, 0); sprites `texcoords1` (cosine and sine of the turn)
///   kStreaks          `positions` tail and head in turn, which `lines` name; `texcoords` (width in pixels, 0), the
///                     same twice
/// `colors` are what is seen, own times ramp, or none: white. Who is not shown has size 0.
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

/// Refused in words: arrays that are not of as many particles as `positions`, lines without tails, more than
/// kMostParticles, places that are not finite, ages and turns that are no numbers, sizes below 0 or beyond
/// kGreatestParticleSize.
extern const Derivation kParticleDerivation;

}  // namespace tessera

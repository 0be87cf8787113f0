/// Where the particles of an emitter are, as a function of its fields alone.
///
/// With the emitter's time T, particle n = 0, 1, … is born at n / rate and has the age t = T - n / rate. It is there
/// while 0 <= t < life · (1 - lifeSpread · u0). Random numbers u0, u1, … of it are hashes of (seed, n, 0), (seed, n,
/// 1), …: nobody has to have made the particles before it.
///
/// It was born at p in its place, with the velocity v; a is the acceleration, d the drag. From x'' = a - d x':
///     x(t) = p + v E + a F,   E = (1 - e^(-dt)) / d,   F = (t - E) / d;   without drag E = t, F = t² / 2.
/// Both grow with t and are never below 0, so all that is ever there lies within p's box + v's box · [0, E(life)] + a ·
/// [0, F(life)]: the bounds.
///
/// Only +, -, ×, / and square roots are used, which processors agree on to the bit; series stand for e, sine and
/// cosine.
#pragma once

#include "common/cores/ParticleEmitter.h"
#include "common/drawable/Derivation.h"

namespace tessera {

/// The arrays are those of Particles (ParticleArrays.h), the oldest first. Refused in words: more than kMostLive at a
/// time, no direction. Its bounds hold at any time.
extern const Derivation kEmitterDerivation;

}  // namespace tessera

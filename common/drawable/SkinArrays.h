/// How the arrays of a Skin are made: its mesh at rest, morphed, then moved by its joints.
///
/// As glTF 2.0 has it ("Skins", "Morph Targets"): position + Σ weight · delta, target after target; then Σ weight ·
/// pose[joint] over the vertex's four joints, their weights divided by their sum. Sums are taken in doubles in that
/// order, so every host gets the same bytes. Normals follow by the cofactors of that matrix: upright on the deformed
/// surface under uneven scales too, on its triangles' front side under mirrors. Tangents follow by the matrix itself.
#pragma once

#include "common/cores/Skin.h"
#include "common/drawable/Derivation.h"

namespace tessera {

/// What a number of `pose`, `weights` and of the morph targets may be, either way: so that nothing made of them is
/// infinite.
inline constexpr double kGreatestSkinNumber = 1e15;

/// Refused in words: a mesh at rest that is none; numbers that are none or too great; joints, inverse binds and pose of
/// different counts; a vertex that names a joint beyond them, has a negative weight or none above 0; morph targets that
/// do not have a number for each vertex; weights of another count than targets. An array that other ones only make
/// sense with may come later: joint indices without weights, weights without targets.
extern const Derivation kSkinDerivation;

}  // namespace tessera

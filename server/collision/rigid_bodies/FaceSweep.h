/// A convex solid on its way among the faces of a surface that may move too. For PathSweep.
#pragma once

#include "server/collision/rigid_bodies/PathSweep.h"

namespace tessera::rigid {

/// As `sweep`. `solid` has one, of `faces` the tree is looked at; they may get `allowed` deep. `known`: points that
/// hold them as the frame begins; what they rest on, they mostly go on resting on.
[[nodiscard]] SweepHit sweepAmongFaces(const SweptPart& solid, const SweptPart& faces, bool solidIsA,
                                       std::span<const ContactPoint> known, double allowed, SweepScratch& scratch,
                                       QueryWork& work);

}  // namespace tessera::rigid

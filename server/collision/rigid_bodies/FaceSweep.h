/// A convex solid on its way among the faces of a surface that may move too. For PathSweep.
#pragma once

#include "server/collision/rigid_bodies/PathSweep.h"

namespace tessera::rigid {

/// As `sweep`. `solid` has one, of `faces` the tree is looked at, unless all that can be met are known already; they
/// may get `allowed` deep. `known`: its points hold them as the frame begins; what they rest on, they mostly go on
/// resting on. `way`: they come no nearer to each other than by this.
[[nodiscard]] SweepHit sweepAmongFaces(const SweptPart& solid, const SweptPart& faces, bool solidIsA,
                                       const KnownGap& known, double way, double allowed, SweepScratch& scratch,
                                       QueryWork& work, bool wantPoints);

}  // namespace tessera::rigid

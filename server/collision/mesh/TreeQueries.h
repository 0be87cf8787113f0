/// The pairwise stage: which triangles of two bodies meet?
///
/// `a_T_b` maps B's frame to A's; any finite affine map will do (non-uniform scale and mirroring included). Answers are
/// those of trianglesIntersect on A's vertices and on B's vertices mapped to A's frame in double. Every query counts
/// its work and gives up, saying so, where the count passes a bound; the answer never depends on time or threads.
#pragma once

#include "server/collision/mesh/AabbTree.h"
#include "server/collision/mesh/QueryWork.h"
#include "server/collision/mesh/TriangleContact.h"

namespace tessera {

[[nodiscard]] Touch anyTouching(const AabbTree& a, const AabbTree& b, const Affine3d& a_T_b, QueryWork& work);
[[nodiscard]] FacePairs allTouching(const AabbTree& a, const AabbTree& b, const Affine3d& a_T_b, QueryWork& work);

/// A body on its way past a fixed one: every vertex goes straight from where `start` puts it to where `end` does.
struct StraightMotion {
    Affine3d fixed_T_start;
    Affine3d fixed_T_end;
    /// How far the true path may leave the straight one, in the fixed body's frame; boxes grow by it.
    double deviation = 0;
};

/// Pairs (a: fixed, b: moving) that meet on the way or at its end: the moved triangle, the sides it sweeps, and the
/// fixed triangle's way through it are tested. Pairs that meet at the start only may be left out. For a pure
/// translation nothing is passed by, however thin; with rotation the sides are those of the straight motion.
[[nodiscard]] Touch anyTouchingOnTheWay(const AabbTree& fixed, const AabbTree& moving, const StraightMotion& motion,
                                        QueryWork& work);
[[nodiscard]] FacePairs allTouchingOnTheWay(const AabbTree& fixed, const AabbTree& moving, const StraightMotion& motion,
                                            QueryWork& work);

/// The box around a box seen in another frame, grown so that it holds every vertex as rounding will put it there.
[[nodiscard]] Box conservativeBox(const Affine3d& to_T_from, const Box& box);

}  // namespace tessera

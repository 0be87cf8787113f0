/// How large a scene gets while its animations play: what the first view has to show.
#pragma once

#include <cstdint>
#include <vector>

#include "common/math/Box.h"
#include "common/scene/Aspect.h"

namespace tessera {

struct AnimatedBounds {
    Box box;       ///< world
    Box now = {};  ///< of where all stands at the moment
    /// Some of the places of what is drawn, evenly among all, at most about kMostSamples, and the outermost; none where
    /// something moves.
    std::vector<Vec3d> samples = {};
    std::uint64_t looks = 0;     ///< times that were looked at
    std::uint64_t placed = 0;    ///< nodes that were placed for them
    std::uint64_t measured = 0;  ///< corners that were looked at for samples: of each mesh once
};

/// World bounds of all that is drawn and that switches show now, wherever animations and motions take it: those that
/// play together, through one run of the longest; of those that stand the first kMostAlone, each by itself, as if
/// somebody played it. Arrays must be resident.
///
/// Followed are the poses of nodes, the joints of skins, and the weights of morph targets. Times looked at: all keys,
/// and between them so many that two are at most 1/60 s apart, and nothing turns by more than 0.1, or goes farther than
/// a hundredth of it all, from one to the next, unless it leaps. What turns then counts as an arc of a circle, what
/// changes its speed as evenly accelerated; what goes straight is exact. A joint takes along the box of the vertices
/// that follow it, seen from the joint, and targets count with all weights that they ever have: the box may be too
/// large, by up to 75 % on real characters. It may be too small where looks are fewer than that (see below), where
/// several animations that play meet otherwise in a later run, and of fields that are not followed (arrays of
/// positions, levels of detail).
///
/// Cost: for samples each mesh is looked at once. All else is that of sceneBounds, a look at all keys, and looks ×
/// nodes that move. Of these there are at most kMostPlaced: with more nodes there are fewer looks, evenly among the
/// times. There are kFewestLooks at least (at each that stands: kFewestLooksAlone). 0.2 s for 20,000 keys and up to
/// 10,000 nodes, 1.4 s for 200,000 (unit_sim --gtest_filter='AnimatedBounds.Cost*' --gtest_output=xml).
inline constexpr std::uint64_t kMostPlaced = 2'000'000, kFewestLooks = 32, kFewestLooksAlone = 8;
inline constexpr std::size_t kMostAlone = 16, kMostSamples = 16'384;
[[nodiscard]] AnimatedBounds animatedBounds(const Aspect& scene);

}  // namespace tessera

/// Do two convex hulls meet, how far are they apart, how deep are they in each other?
///
/// `a_T_b` maps B's frame to A's; any finite affine map will do (non-uniform scale, mirroring, flattening). Everything
/// is about the hull of A's vertices and the hull of B's vertices mapped to A's frame in double; lengths, points and
/// normals are in A's frame. Hulls are closed and solid: touching counts, and one inside the other counts.
///
/// GJK (E. G. Gilbert, D. W. Johnson, S. S. Keerthi, "A Fast Procedure for Computing the Distance Between Complex
/// Objects in Three-Dimensional Space", 1988) in double, with rigorous bounds on what rounding can do. Where these
/// leave a doubt, the same descent is done in exact arithmetic (ExactDescent.h), so yes and no are exactly right as
/// long as the coordinates other than 0, in A's frame, are between 1e-30 and 1 times the largest. Thread-safe.
#pragma once

#include <array>
#include <cstdint>
#include <limits>

#include "common/math/Types.h"
#include "server/collision/convex/ConvexHull.h"
#include "server/collision/mesh/QueryWork.h"

namespace tessera {

/// Work done so far and allowed at most; hand the same one to many queries to bound them together.
struct ConvexWork {
    std::uint64_t supports = 0;               ///< pairs of farthest vertices asked for, one of A's and one of B's
    std::uint64_t looks = 0;                  ///< vertices looked at for them
    std::uint64_t exact = 0;                  ///< queries that rounding left in doubt
    std::uint64_t limit = ~std::uint64_t{0};  ///< of supports
    [[nodiscard]] bool exhausted() const { return supports >= limit; }
};

struct VertexPair {
    std::uint32_t a = 0, b = 0;
    bool operator==(const VertexPair&) const = default;
};

/// What the last query about a pair of hulls ended with: its simplex of the Minkowski difference A - B (up to four
/// pairs of vertices). For bodies that have moved little the next query begins next to its end. A hint: it changes no
/// yes or no, and distances to rounding only; one of other hulls does no harm.
struct ConvexCache {
    std::array<VertexPair, 4> simplex;
    std::uint8_t size = 0;  ///< 0: nothing is known
    VertexPair last;        ///< farthest vertices asked for last
};

/// kUnknown where the work was exhausted, and for maps that lead to numbers that are not finite. The answer is exact
/// for A's vertices and B's mapped vertices.
[[nodiscard]] Touch hullsTouching(const ConvexHull& a, const ConvexHull& b, const Affine3d& a_T_b, ConvexWork& work,
                                  ConvexCache* cache = nullptr);

struct HullDistance {
    double distance = 0;                             ///< 0 iff they touch
    Vec3d onA = Vec3d::Zero(), onB = Vec3d::Zero();  ///< nearest points; a common point where they touch
    bool complete = true;  ///< false: as Touch::kUnknown; distance is then a *lower* bound and says nothing else
};

/// To rounding: within about 1e-14 of the distance, plus 1e-14 of the largest coordinate.
[[nodiscard]] HullDistance hullDistance(const ConvexHull& a, const ConvexHull& b, const Affine3d& a_T_b,
                                        ConvexWork& work, ConvexCache* cache = nullptr);

struct HullDepth {
    bool touching = false;
    /// Touching: B moved by depth · normal touches A without being in it, and that always holds; no shorter way does,
    /// to rounding and to within the tolerance. Not touching: minus the distance.
    double depth = 0;
    Vec3d normal = Vec3d::UnitX();                   ///< unit length, from A to B
    Vec3d onA = Vec3d::Zero(), onB = Vec3d::Zero();  ///< onA - onB = depth · normal: each the deepest in the other
    bool complete = true;  ///< false: work exhausted; B gets free by depth · normal, but there may be a shorter way.
                           ///< Where not even `touching` is known, it is set, and depth is infinite
};

struct HullDepthOptions {
    double tolerance = 0;  ///< the depth may be larger than the least by this much
    /// Supports for the depth alone, after which it is not complete: nested round bodies have thousands of ways out.
    std::uint64_t maxSupports = 20'000;
};

/// The expanding polytope algorithm (G. van den Bergen, "Proximity Queries and Penetration Depth Computation on 3D Game
/// Objects", 2001) on exact sides of a polytope of rounded corners: flat hulls and sides in one plane do not upset it.
[[nodiscard]] HullDepth hullDepth(const ConvexHull& a, const ConvexHull& b, const Affine3d& a_T_b, ConvexWork& work,
                                  ConvexCache* cache = nullptr, const HullDepthOptions& options = {});

}  // namespace tessera

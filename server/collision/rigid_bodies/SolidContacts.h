/// Contacts of two convex solids.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "server/collision/convex/ConvexQuery.h"
#include "server/collision/mesh/QueryWork.h"
#include "server/collision/rigid_bodies/ContactPoint.h"
#include "server/collision/rigid_bodies/Solid.h"

namespace tessera::rigid {

/// What separates two solids best, or holds them apart least: a side of one, or an edge of each.
struct SolidAxis {
    enum class Kind : std::uint8_t { kNone, kSideOfA, kSideOfB, kEdges };
    Kind kind = Kind::kNone;
    std::uint32_t a = 0, b = 0;  ///< sides, or placed edges
    double gap = 0;
    Vec3d normal = Vec3d::Zero();  ///< from A to B
};

/// What a pair of solids remembers from frame to frame: where to look first. Changes no answer but by rounding.
struct SolidMemory {
    SolidAxis::Kind kind = SolidAxis::Kind::kNone;
    std::uint32_t a = 0, b = 0;
    ConvexCache cache;  ///< of large hulls
};

/// Buffers, kept between calls.
struct ClipScratch {
    std::vector<Vec3d> polygon, other;
    std::vector<std::uint32_t> edgesA, edgesB;
    std::vector<double> heights, heightsOfOther;  ///< of corners, along some direction
    // Of a solid over a triangle.
    std::vector<std::array<double, 3>> across;  ///< of its sides' normals, along the triangle's rims
    std::vector<std::uint32_t> acrossOf;        ///< of which triangle those are
};

/// A convex solid of the frame, as both queries want it.
struct SolidPart {
    const PlacedSolid* placed = nullptr;
    const ConvexHull* hull = nullptr;
    const Affine3d* world = nullptr;
};

struct SolidQuery {
    double margin = 0;  ///< gaps up to this are wanted
    /// Differences in gap that do not matter: of axes as good as that, sides are taken before edges, for they hold with
    /// more than one point.
    double fine = 0;
    double near = 0;                 ///< points as near to each other count as one
    Vec3d approach = Vec3d::Zero();  ///< of B, seen from A, within the frame
};

/// Along a direction from A to B they are parted by so much, at least; below 0: they overlap by that along it.
struct SolidGap {
    double gap = 0;
    Vec3d normal = Vec3d::Zero();
};

/// Appends points. False: the work was exhausted or the numbers are beyond all bounds; nothing is known.
[[nodiscard]] bool contactsOfSolids(const SolidPart& a, const SolidPart& b, const SolidQuery& query,
                                    SolidMemory& memory, ClipScratch& scratch, QueryWork& work,
                                    std::vector<ContactPoint>& out, SolidGap& parted);

/// The widest gap among all axes, or any that is wider than `margin`.
[[nodiscard]] SolidAxis widestGap(const PlacedSolid& a, const PlacedSolid& b, double margin, double fine,
                                  const SolidMemory& memory, ClipScratch& scratch);

/// So many axes that the library's descent (../convex) is cheaper than looking at all of them.
[[nodiscard]] bool manyAxes(const PlacedSolid& a, const PlacedSolid& b);

/// Appends the points with which they hold each other along an axis.
void contactManifold(const PlacedSolid& a, const PlacedSolid& b, const SolidAxis& axis, const SolidQuery& query,
                     ClipScratch& scratch, std::vector<ContactPoint>& out);

/// The polygon in the scratch, cut off at the planes through the edges of an outline, square to its plane.
/// `turn`: -1 where the outline runs clockwise seen against `normal`.
void clipToOutline(std::span<const Vec3d> corners, std::span<const std::uint32_t> outline, const Vec3d& normal,
                   double turn, ClipScratch& scratch);

/// The side that looks most along a direction.
[[nodiscard]] std::uint32_t sideAlong(const PlacedSolid& solid, const Vec3d& direction);

/// Nearest points of the segments from p to p + u and from q to q + v.
void nearestOfSegments(const Vec3d& p, const Vec3d& u, const Vec3d& q, const Vec3d& v, Vec3d& onP, Vec3d& onQ);

}  // namespace tessera::rigid

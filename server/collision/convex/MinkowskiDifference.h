/// The set A - B of two hulls, which has the origin in it iff they meet.
#pragma once

#include <array>
#include <cstdint>

#include "server/collision/convex/ConvexHull.h"
#include "server/collision/convex/ConvexQuery.h"
#include "server/collision/mesh/Predicates.h"

namespace tessera {

/// A corner of it, and what it came from.
struct DifferencePoint {
    VertexPair from;
    Vec3d a, b;  ///< in A's frame; b is the vertex as mapped
    Vec3d w;     ///< a - b, rounded
};

class MinkowskiDifference {
public:
    MinkowskiDifference(const ConvexHull& a, const ConvexHull& b, const Affine3d& a_T_b)
        : a_(a), b_(b), a_T_b_(a_T_b), b_R_a_(a_T_b.linear().transpose()) {
        const auto reach = [](const Box& box) -> Vec3d { return box.lower.cwiseAbs().cwiseMax(box.upper.cwiseAbs()); };
        reach_ = reach(a.bounds()) + a_T_b.linear().cwiseAbs() * reach(b.bounds()) + a_T_b.translation().cwiseAbs();
    }

    [[nodiscard]] bool finite() const { return reach_.allFinite(); }
    [[nodiscard]] const ConvexHull& a() const { return a_; }
    [[nodiscard]] const ConvexHull& b() const { return b_; }
    [[nodiscard]] Vec3d mapped(std::uint32_t vertexOfB) const { return a_T_b_ * b_.vertices()[vertexOfB]; }
    [[nodiscard]] Vec3d centre() const { return a_.centre() - a_T_b_ * b_.centre(); }
    [[nodiscard]] bool has(const VertexPair& p) const {
        return p.a < a_.vertices().size() && p.b < b_.vertices().size();
    }
    [[nodiscard]] DifferencePoint at(const VertexPair& from) const {
        DifferencePoint p{from, a_.vertices()[from.a], mapped(from.b), {}};
        p.w = p.a - p.b;
        return p;
    }

    /// A point with least d · w, to within margin(d). `last` is where to look first and becomes what was found.
    [[nodiscard]] DifferencePoint lowest(const Vec3d& d, VertexPair& last, ConvexWork& work) const {
        ++work.supports;
        last = {a_.support(-d, last.a, work.looks), b_.support(b_R_a_ * d, last.b, work.looks)};
        return at(last);
    }

    /// No point of the difference of the mapped vertices lies lower than the one found, as computed, by more than this.
    /// Rounding is that of B's map (4 per coordinate), of the direction in B's frame (4), of both scans (2 · 3), of w
    /// and of its product with d (5): each a unit of 2^-53 of |d| · reach at most.
    [[nodiscard]] double margin(const Vec3d& d) const { return 64 * exact::kRounding * d.cwiseAbs().dot(reach_); }
    /// The same for any unit direction.
    [[nodiscard]] double margin() const { return 64 * exact::kRounding * reach_.norm(); }

private:
    const ConvexHull& a_;
    const ConvexHull& b_;
    const Affine3d& a_T_b_;
    Mat3d b_R_a_;  ///< takes directions of A's frame, as normals, to B's
    Vec3d reach_;
};

}  // namespace tessera

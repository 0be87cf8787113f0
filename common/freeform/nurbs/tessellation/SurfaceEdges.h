/// The four edges of a surface, or of a part of it between places where it jumps: where they are cut, and the points
/// there.
///
/// An edge's curve alone decides, the same from either end. Values only; any thread.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "common/base/Error.h"
#include "common/freeform/nurbs/tessellation/ParameterLattice.h"

namespace tessera {

/// Knot spans of a surface, the ends not included: all of it, or what lies between jumps.
struct SpanRange {
    std::size_t beginU = 0, endU = 0, beginV = 0, endV = 0;
};

class SurfaceEdges {
public:
    enum Edge { kLowU = 0, kHighU = 1, kLowV = 2, kHighV = 3 };

    /// Chords are within `tolerance` of the edges' curves, at the same parameter. Refused (kLimit) beyond `maxPoints`
    /// points.
    [[nodiscard]] static Expected<SurfaceEdges> make(const NurbsSurface& surface, const LatticeSurface& lattice,
                                                     const SpanRange& part, double tolerance, std::size_t maxPoints);

    /// Whether the edges that pass through it may have a vertex there: where they are cut, and anywhere on an edge that
    /// is one point.
    [[nodiscard]] bool mayHave(Edge edge, const LatticePoint& p) const;
    /// Where an edge is cut within a span, ascending.
    [[nodiscard]] std::vector<LatticePoint> cutsWithin(Edge edge, std::size_t span) const;
    /// The surface at a place on an edge, the same bits on both sides of a seam; nothing of a place on no edge.
    [[nodiscard]] std::optional<Vec3d> at(const LatticePoint& p) const;

    [[nodiscard]] std::int64_t lowU() const { return lowU_; }
    [[nodiscard]] std::int64_t highU() const { return highU_; }
    [[nodiscard]] std::int64_t lowV() const { return lowV_; }
    [[nodiscard]] std::int64_t highV() const { return highV_; }

private:
    struct SpanCurve {
        std::vector<Vec4d> points;
        std::vector<std::int64_t> cuts;  ///< from the span's begin, without its ends
        std::vector<Vec3d> places;       ///< of the cuts
        std::optional<Vec3d> pole;       ///< all of it is this place
    };
    [[nodiscard]] const SpanCurve& curve(Edge edge, std::size_t span) const {
        return curves_[edge][span - (edge <= kHighU ? part_.beginV : part_.beginU)];
    }

    SpanRange part_;
    std::int64_t lowU_ = 0, highU_ = 0, lowV_ = 0, highV_ = 0;
    bool closedU_ = false, closedV_ = false;
    std::array<std::vector<SpanCurve>, 4> curves_;
};

}  // namespace tessera

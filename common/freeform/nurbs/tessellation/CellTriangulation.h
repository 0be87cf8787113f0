/// Triangles of one convex cell of a surface's parameters: its rim's vertices, places within, and the pieces of trims
/// that cross it.
///
/// A constrained triangulation by insertion and flips (Sloan 1993), each decision exact on the lattice. One thread
/// each.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <vector>

#include "common/freeform/nurbs/tessellation/ParameterLattice.h"
#include "common/math/Types.h"

namespace tessera {

class CellTriangulation {
public:
    using PlaceOf = std::function<Vec3d(const LatticePoint&)>;

    /// `rim`: counterclockwise, convex but for vertices along its sides, none twice. `placeOf`: where on the surface,
    /// to choose well among the ways to triangulate; no answer depends on it.
    CellTriangulation(std::span<const LatticePoint> rim, PlaceOf placeOf);

    /// False where the rim cannot be triangulated, or a trim meets another one or leaves the rim: what is here then
    /// means nothing.
    [[nodiscard]] bool sound() const { return sound_; }
    /// What lies on the left of the way from a to b is kept, on its right not.
    void trim(const LatticePoint& a, const LatticePoint& b);
    /// Flips what no trim holds until no flip makes the worse of two triangles rounder.
    void improve();

    /// The triangles that are kept, counterclockwise; all or none of them, as said, where nothing is trimmed.
    [[nodiscard]] std::vector<std::array<LatticePoint, 3>> kept(bool whereNoTrims);

private:
    static constexpr std::uint32_t kNone = ~0u;
    enum Side : std::int8_t { kOff = -1, kNoTrim = 0, kOn = 1 };
    struct Triangle {
        std::array<std::uint32_t, 3> corner{};
        std::array<std::uint32_t, 3> across{kNone, kNone, kNone};  ///< beyond the edge that is opposite of the corner
        std::array<Side, 3> side{};                                ///< of this triangle, told by a trim along that edge
    };

    void triangulateRim(std::vector<std::uint32_t> rim);
    void joinNeighbours();
    [[nodiscard]] std::uint32_t insert(const LatticePoint& p);
    [[nodiscard]] std::uint32_t find(const LatticePoint& p) const;
    void splitInside(std::uint32_t t, std::uint32_t p);
    void splitEdge(std::uint32_t t, int edge, std::uint32_t p);
    void connect(std::uint32_t a, std::uint32_t b);
    [[nodiscard]] bool canFlip(std::uint32_t t, int edge) const;
    void flip(std::uint32_t t, int edge);
    void retarget(std::uint32_t t, std::uint32_t from, std::uint32_t to);
    /// The triangles around a vertex.
    [[nodiscard]] std::vector<std::uint32_t> around(std::uint32_t vertex) const;
    /// The triangle that has the edge from a to b counterclockwise, and which of its edges it is.
    [[nodiscard]] std::pair<std::uint32_t, int> edgeOf(std::uint32_t a, std::uint32_t b) const;
    void mark(std::uint32_t t, int edge, Side side);
    [[nodiscard]] int turn(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
        return turnOf(points_[a], points_[b], points_[c]);
    }
    [[nodiscard]] double roundness(std::uint32_t a, std::uint32_t b, std::uint32_t c) const;
    [[nodiscard]] std::uint32_t add(const LatticePoint& p);

    std::vector<LatticePoint> points_;
    std::vector<Vec3d> places_;
    std::vector<std::uint32_t> triangleOf_;  ///< of each vertex, one
    std::map<LatticePoint, std::uint32_t> known_;
    std::vector<Triangle> triangles_;
    PlaceOf placeOf_;
    bool sound_ = true;
};

}  // namespace tessera

#include "common/freeform/subdivision/CornerLimit.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/freeform/subdivision/PortableTrigonometry.h"

namespace tessera {
namespace {

constexpr double kPi = std::numbers::pi;

/// The points around a corner: edge i and, of a quadrilateral between edges i and i + 1, the vertex opposite the
/// corner.
struct CornerRing {
    std::vector<std::uint32_t> edges, opposites;
    std::size_t center = 0;  ///< the face asked for lies between edges center and center + 1
    bool closed = false;
    [[nodiscard]] std::size_t next(std::size_t edge) const { return (edge + 1) % edges.size(); }
};

CornerRing ringOf(const TaggedMesh& mesh, std::uint32_t corner) {
    const Sector sector = sectorOf(mesh, 0, corner);
    CornerRing ring{.center = sector.center, .closed = sector.closed};
    for (const Sector::Face& f : sector.faces) {
        const auto vertices = mesh.verticesOf(f.face);
        const std::size_t size = vertices.size();
        ring.edges.push_back(vertices[(f.at + 1) % size]);
        ring.opposites.push_back(vertices[(f.at + 2) % size]);
    }
    if (!sector.closed) {
        const Sector::Face& last = sector.faces.back();
        const auto vertices = mesh.verticesOf(last.face);
        ring.edges.push_back(vertices[(last.at + vertices.size() - 1) % vertices.size()]);
    }
    return ring;
}

/// The tangent along edge `k` of a smooth vertex.
void addSmoothTangent(RowSum& sum, const CornerRing& ring, std::size_t k, bool loop) {
    const auto n = static_cast<double>(ring.edges.size());
    const double angle = 2 * kPi / n;
    if (loop) {
        // In a regular hexagon of unit steps the sum of squared cosines is 3.
        for (std::size_t i = 0; i < ring.edges.size(); ++i) {
            sum.add(ring.edges[i], portableCos(angle * (static_cast<double>(i) - static_cast<double>(k))) * 2 / n);
        }
        return;
    }
    if (ring.edges.size() == 2) {  // folded: the faces' own points have no part in it
        sum.add(ring.edges[k], 0.5);
        sum.add(ring.edges[1 - k], -0.5);
        return;
    }
    const double c = portableCos(angle);
    const double eigenvalue = (5 + c + portableCos(angle / 2) * std::sqrt(2 * (9 + c))) / 16;
    // 1/12 for valence 4, where this is the spline's derivative.
    const double scale = 1 / (3 * n);
    for (std::size_t i = 0; i < ring.edges.size(); ++i) {
        const double here = angle * (static_cast<double>(i) - static_cast<double>(k));
        sum.add(ring.edges[i], scale * 4 * portableCos(here));
        sum.add(ring.opposites[i], scale * (portableCos(here) + portableCos(here + angle)) / (4 * eigenvalue - 1));
    }
}

/// Across a crease or boundary, into the sector, as long as along a crease of equal steps in the regular case.
///
/// Published formulas are for other rules along the crease (Hoppe et al., Biermann et al.). For these the left
/// eigenvector weighs inner edge i by sin(iθ), θ = π/faces, opposite points by the sums of two; `a` for the crease's
/// ends and `b` for the vertex follow from their two columns of the subdivision matrix: a (λ - 1/2) - b/8 = r1, b (λ -
/// 3/4) - a = r2.
void addCrossTangent(RowSum& sum, const CornerRing& ring, std::uint32_t corner, bool loop, double weight) {
    const std::size_t faces = ring.opposites.size(), last = ring.edges.size() - 1;
    if (faces == 1) {
        sum.add(corner, -2 * weight);
        for (const std::uint32_t p : ring.edges) sum.add(p, weight);
        return;
    }
    const auto k = static_cast<double>(faces);
    const double angle = kPi / k, c = portableCos(angle), s = portableSin(angle),
                 sumOfSines = portableCos(angle / 2) / portableSin(angle / 2);
    const double eigenvalue = loop ? 0.375 + c / 4 : (5 + c + portableCos(angle / 2) * std::sqrt(2 * (9 + c))) / 16;
    const double inner = loop ? 2 / k : 4 / (3 * k), opposite = loop ? 0 : inner / (4 * (4 * eigenvalue - 1));
    const double r1 = loop ? inner * s / 8 : inner * s / 16 + opposite * s / 4,
                 r2 = sumOfSines * (0.375 * inner + 0.5 * opposite);
    const double b = (r1 + r2 * (eigenvalue - 0.5)) / ((eigenvalue - 0.75) * (eigenvalue - 0.5) - 0.125),
                 a = b * (eigenvalue - 0.75) - r2;
    sum.add(corner, weight * b);
    sum.add(ring.edges.front(), weight * a);
    sum.add(ring.edges.back(), weight * a);
    for (std::size_t i = 1; i < last; ++i)
        sum.add(ring.edges[i], weight * inner * portableSin(static_cast<double>(i) * angle));
    if (loop) return;
    for (std::size_t i = 0; i < faces; ++i) {
        const auto n = static_cast<double>(i);
        sum.add(ring.opposites[i], weight * opposite * (portableSin(n * angle) + portableSin((n + 1) * angle)));
    }
}

/// Along edge `k` of a vertex on a crease.
void addCreaseTangent(RowSum& sum, const CornerRing& ring, std::uint32_t corner, std::size_t k, bool loop) {
    const std::size_t last = ring.edges.size() - 1;
    const double angle = kPi * static_cast<double>(k) / static_cast<double>(last);
    const double along = k == 0      ? 1
                         : k == last ? -1
                                     : portableCos(angle),
                 across = k == 0 || k == last ? 0 : portableSin(angle);
    sum.add(ring.edges.front(), along / 2);
    sum.add(ring.edges.back(), -along / 2);
    if (across > 0) addCrossTangent(sum, ring, corner, loop, across);
}

}  // namespace

bool isDart(const TaggedMesh& mesh, std::uint32_t corner) {
    if (mesh.vertexSharpness[corner] > 0) return false;
    int sharp = 0;
    for (const std::uint32_t e : mesh.edgesAt(corner)) sharp += mesh.edges[e].sharpness > 0 ? 1 : 0;
    return sharp == 1;
}

bool isSettled(const TaggedMesh& mesh, std::uint32_t corner, SubdivisionScheme scheme) {
    const auto semiSharp = [](float s) { return s > 0 && !isInfinitelySharp(s); };
    if (semiSharp(mesh.vertexSharpness[corner])) return false;
    for (const std::uint32_t e : mesh.edgesAt(corner)) {
        if (semiSharp(mesh.edges[e].sharpness)) return false;
    }
    const std::uint32_t size = scheme == SubdivisionScheme::kLoop ? 3 : 4;
    for (const Sector::Face& f : sectorOf(mesh, 0, corner).faces) {
        if (mesh.faceSize(f.face) != size) return false;
    }
    return true;
}

CornerLimit cornerLimitOf(const TaggedMesh& mesh, std::uint32_t corner, SubdivisionScheme scheme) {
    const bool loop = scheme == SubdivisionScheme::kLoop;
    const CornerRing ring = ringOf(mesh, corner);
    const std::size_t outgoing = ring.center, incoming = ring.closed ? ring.next(outgoing) : outgoing + 1;
    RowSum sum(mesh.vertexCount());
    CornerLimit limit;
    if (mesh.vertexSharpness[corner] > 0 || (!ring.closed && isFixedCorner(mesh, corner))) {
        sum.add(corner, 1);
        sum.moveInto(limit.rows);
        for (const std::size_t k : {outgoing, incoming}) {
            sum.add(corner, -1);
            sum.add(ring.edges[k], 1);
            sum.moveInto(limit.rows);
        }
    } else if (ring.closed) {
        const auto n = static_cast<double>(ring.edges.size());
        if (loop) {
            const double each = 1 / (n + 3 / (8 * loopNeighbourWeight(ring.edges.size())));
            sum.add(corner, 1 - n * each);
            for (const std::uint32_t p : ring.edges) sum.add(p, each);
        } else {
            const double each = 1 / (n * (n + 5));
            sum.add(corner, n / (n + 5));
            for (std::size_t i = 0; i < ring.edges.size(); ++i) {
                sum.add(ring.edges[i], 4 * each);
                sum.add(ring.opposites[i], each);
            }
        }
        sum.moveInto(limit.rows);
        for (const std::size_t k : {outgoing, incoming}) {
            addSmoothTangent(sum, ring, k, loop);
            sum.moveInto(limit.rows);
        }
    } else {
        sum.add(corner, 4.0 / 6);
        // Its sharp edges: the sector's ends, or where the sector's ends are one edge, that and another.
        for (const std::uint32_t e : mesh.edgesAt(corner)) {
            if (mesh.edges[e].sharpness > 0) sum.add(mesh.otherEnd(e, corner), 1.0 / 6);
        }
        sum.moveInto(limit.rows);
        for (const std::size_t k : {outgoing, incoming}) {
            addCreaseTangent(sum, ring, corner, k, loop);
            sum.moveInto(limit.rows);
        }
    }
    return limit;
}

}  // namespace tessera

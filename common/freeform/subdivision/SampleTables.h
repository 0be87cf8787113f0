/// Rows for a grid of points of one kind of neighbourhood: point and two tangents each, by the neighbourhood's points.
///
/// A grid of n segments has the points (i / n, j / n), i first; of a triangle those with i + j up to n. n is a power of
/// two, so that refinement leads to every one of them: to a regular patch, or to a corner whose limit is known. Pure
/// but for the graph.
#pragma once

#include "common/freeform/subdivision/NeighbourhoodGraph.h"

namespace tessera {

[[nodiscard]] constexpr std::size_t gridSamples(std::size_t segments, bool triangular) {
    return triangular ? (segments + 1) * (segments + 2) / 2 : (segments + 1) * (segments + 1);
}
[[nodiscard]] constexpr std::size_t gridSample(std::size_t i, std::size_t j, std::size_t segments, bool triangular) {
    return triangular ? i + j * (segments + 1) - j * (j - 1) / 2 : i + j * (segments + 1);
}

/// Values and derivatives of the four uniform cubic B-splines, t from 0 to 1.
struct CubicSplineBasis {
    std::array<double, 4> value, slope;
    explicit CubicSplineBasis(double t);
};

/// samples × 3 × 12: of the quartic box spline's points.
[[nodiscard]] std::vector<double> boxSplineTable(std::size_t segments);
/// samples × 3 × points of the node. Tangents have the direction of derivatives by u and v, or any two whose cross
/// product has the same.
[[nodiscard]] std::vector<double> sampleTable(NeighbourhoodGraph& graph, const NeighbourhoodGraph::Node& node,
                                              std::size_t segments);
/// Of one part of another polygon, over the polygon's own points.
[[nodiscard]] std::vector<double> polygonPartTable(NeighbourhoodGraph& graph, const NeighbourhoodGraph::Node& polygon,
                                                   std::uint32_t corner, std::size_t segments);
/// Of the bilinear scheme: over the face's vertices. `corner` as PtexFace has it.
[[nodiscard]] std::vector<double> bilinearTable(std::size_t faceSize, std::uint32_t corner, std::size_t segments);

}  // namespace tessera

#include "common/freeform/subdivision/SampleTables.h"

#include <algorithm>

#include "common/freeform/BezierTriangle.h"

namespace tessera {
namespace {

/// rows by a child's points, made rows by its parent's: `to` and `from` are numbers of samples.
void appendThrough(const SparseRows& childPoints, std::span<const double> childRow, std::span<double> row) {
    for (std::size_t k = 0; k < childRow.size(); ++k) {
        const double weight = childRow[k];
        if (weight == 0) continue;
        for (std::uint32_t i = childPoints.begin[k]; i < childPoints.begin[k + 1]; ++i)
            row[childPoints.columns[i]] += weight * childPoints.weights[i];
    }
}

/// weights of spline points · the spline's rows.
std::vector<double> throughSpline(const SparseRows& spline, std::span<const double> weights, std::size_t columns) {
    const std::size_t width = spline.count(), rows = weights.size() / width;
    std::vector<double> out(rows * columns, 0.0);
    for (std::size_t r = 0; r < rows; ++r)
        appendThrough(spline, weights.subspan(r * width, width), std::span(out).subspan(r * columns, columns));
    return out;
}

std::vector<double> bicubicTable(std::size_t segments) {
    std::vector<double> out;
    out.reserve(gridSamples(segments, false) * 48);
    for (std::size_t j = 0; j <= segments; ++j) {
        const CubicSplineBasis v(static_cast<double>(j) / static_cast<double>(segments));
        for (std::size_t i = 0; i <= segments; ++i) {
            const CubicSplineBasis u(static_cast<double>(i) / static_cast<double>(segments));
            for (int row = 0; row < 3; ++row)
                for (std::size_t y = 0; y < 4; ++y)
                    for (std::size_t x = 0; x < 4; ++x)
                        out.push_back((row == 1 ? u.slope : u.value)[x] * (row == 2 ? v.slope : v.value)[y]);
        }
    }
    return out;
}

}  // namespace

CubicSplineBasis::CubicSplineBasis(double t) {
    const double s = 1 - t;
    value = {s * s * s / 6, (4 - 6 * t * t + 3 * t * t * t) / 6, (4 - 6 * s * s + 3 * s * s * s) / 6, t * t * t / 6};
    slope = {-s * s / 2, (-4 * t + 3 * t * t) / 2, (4 * s - 3 * s * s) / 2, t * t / 2};
}

std::vector<double> boxSplineTable(std::size_t segments) {
    std::vector<double> out(gridSamples(segments, true) * 36);
    // Three columns at a time, as the coordinates of points.
    for (std::size_t first = 0; first < 12; first += 3) {
        std::array<Vec3d, 12> box;
        box.fill(Vec3d::Zero());
        for (std::size_t k = 0; k < 3; ++k) box[first + k][static_cast<int>(k)] = 1;
        const auto bezier = bezierOfBoxSpline(box);
        const BezierTriangle patch{.degree = 4, .points = {bezier.begin(), bezier.end()}};
        for (std::size_t j = 0; j <= segments; ++j) {
            for (std::size_t i = 0; i + j <= segments; ++i) {
                const SurfacePoint p = evaluate(patch, static_cast<double>(i) / static_cast<double>(segments),
                                                static_cast<double>(j) / static_cast<double>(segments));
                double* const at = out.data() + gridSample(i, j, segments, true) * 36 + first;
                for (int k = 0; k < 3; ++k) {
                    at[k] = p.point[k];
                    at[12 + k] = p.du[k];
                    at[24 + k] = p.dv[k];
                }
            }
        }
    }
    return out;
}

std::vector<double> sampleTable(NeighbourhoodGraph& graph, const NeighbourhoodGraph::Node& node, std::size_t segments) {
    const bool triangular = node.faceSize() == 3;
    const std::size_t columns = node.pointCount();
    if (node.spline)
        return throughSpline(*node.spline, triangular ? boxSplineTable(segments) : bicubicTable(segments), columns);
    std::vector<double> out(gridSamples(segments, triangular) * 3 * columns, 0.0);
    const auto rowsAt = [&](std::size_t i, std::size_t j) {
        return std::span(out).subspan(gridSample(i, j, segments, triangular) * 3 * columns, 3 * columns);
    };
    if (segments == 1) {
        for (std::uint32_t c = 0; c < node.faceSize(); ++c) {
            const SparseRows& limit = graph.limitAt(node, c).rows;
            const auto rows =
                triangular ? rowsAt(c == 1 ? 1 : 0, c == 2 ? 1 : 0) : rowsAt(c == 1 || c == 2 ? 1 : 0, c > 1 ? 1 : 0);
            for (std::size_t row = 0; row < 3; ++row)
                for (std::uint32_t i = limit.begin[row]; i < limit.begin[row + 1]; ++i)
                    rows[row * columns + limit.columns[i]] = limit.weights[i];
        }
        return out;
    }
    const std::size_t half = segments / 2;
    for (std::uint32_t c = 0; c < node.children.size(); ++c) {
        const NeighbourhoodGraph::Child& child = graph.childOf(node, c);
        const std::vector<double> finer = sampleTable(graph, *child.node, half);
        const std::size_t width = child.node->pointCount();
        for (std::size_t j = 0; j <= half; ++j) {
            for (std::size_t i = 0; i <= (triangular ? half - j : half); ++i) {
                const bool right = c == 1 || (!triangular && c == 2), up = triangular ? c == 2 : c > 1;
                const bool middle =
                    triangular && c == 3;  // turned over; both tangents are, and their cross product is not
                const auto rows =
                    middle ? rowsAt(half - i, half - j) : rowsAt(i + (right ? half : 0), j + (up ? half : 0));
                std::fill(rows.begin(), rows.end(), 0.0);  // parts share their edges: the last one's rows count
                for (std::size_t row = 0; row < 3; ++row)
                    appendThrough(child.points,
                                  std::span<const double>(finer).subspan(
                                      (gridSample(i, j, half, triangular) * 3 + row) * width, width),
                                  rows.subspan(row * columns, columns));
            }
        }
    }
    return out;
}

std::vector<double> polygonPartTable(NeighbourhoodGraph& graph, const NeighbourhoodGraph::Node& polygon,
                                     std::uint32_t corner, std::size_t segments) {
    const NeighbourhoodGraph::Child& child = graph.childOf(polygon, corner);
    return throughSpline(child.points, sampleTable(graph, *child.node, segments), polygon.pointCount());
}

std::vector<double> bilinearTable(std::size_t faceSize, std::uint32_t corner, std::size_t segments) {
    // The part's corners by the face's vertices.
    std::array<std::vector<double>, 4> corners;
    corners.fill(std::vector<double>(faceSize, 0.0));
    if (corner == kNoIndex) {
        for (std::size_t i = 0; i < 4; ++i) corners[i][i] = 1;
    } else {
        corners[0][corner] = 1;
        corners[1][corner] += 0.5;
        corners[1][(corner + 1) % faceSize] += 0.5;
        corners[2].assign(faceSize, 1.0 / static_cast<double>(faceSize));
        corners[3][corner] += 0.5;
        corners[3][(corner + faceSize - 1) % faceSize] += 0.5;
    }
    std::vector<double> out;
    for (std::size_t j = 0; j <= segments; ++j) {
        const double v = static_cast<double>(j) / static_cast<double>(segments);
        for (std::size_t i = 0; i <= segments; ++i) {
            const double u = static_cast<double>(i) / static_cast<double>(segments);
            const std::array<std::array<double, 4>, 3> weights{
                {{(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v}, {v - 1, 1 - v, v, -v}, {u - 1, -u, u, 1 - u}}};
            for (const auto& row : weights)
                for (std::size_t k = 0; k < faceSize; ++k)
                    out.push_back(row[0] * corners[0][k] + row[1] * corners[1][k] + row[2] * corners[2][k] +
                                  row[3] * corners[3][k]);
        }
    }
    return out;
}

}  // namespace tessera

#include "server/collision/convex/ConvexHull.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <string>
#include <utility>

#include "server/collision/convex/QuickHull.h"
#include "server/collision/mesh/Predicates.h"

namespace tessera {

namespace {

constexpr double kTiny = 1e-60;

/// Distinct points in lexicographic order, each with the first input point that it was.
struct Distinct {
    std::vector<Vec3d> points;
    std::vector<std::uint32_t> sources;
};

Distinct distinct(std::span<const Vec3d> points) {
    const auto flushed = [&](std::uint32_t i) {
        Vec3d p = points[i];
        for (int k = 0; k < 3; ++k)
            if (std::abs(p[k]) < kTiny) p[k] = 0;
        return p;
    };
    std::vector<std::pair<Vec3d, std::uint32_t>> all;
    all.reserve(points.size());
    for (std::uint32_t i = 0; i < points.size(); ++i) all.emplace_back(flushed(i), i);
    std::sort(all.begin(), all.end(), [](const auto& a, const auto& b) {
        if (a.first != b.first) return lexicographicallyLess(a.first, b.first);
        return a.second < b.second;
    });
    Distinct out;
    for (const auto& [p, i] : all)
        if (out.points.empty() || out.points.back() != p) {
            out.points.push_back(p);
            out.sources.push_back(i);
        }
    return out;
}

/// The point for which `measure` is greatest, if `fits`; else the first that fits. The measure is rounded, a wish;
/// `fits` decides.
template <typename Measure, typename Fits>
std::optional<std::uint32_t> farthestThat(std::span<const Vec3d> points, const Measure& measure, const Fits& fits) {
    std::uint32_t best = 0;
    double most = -1;
    for (std::uint32_t i = 0; i < points.size(); ++i)
        if (const double m = measure(points[i]); m > most) {
            most = m;
            best = i;
        }
    if (fits(points[best])) return best;
    for (std::uint32_t i = 0; i < points.size(); ++i)
        if (fits(points[i])) return i;
    return std::nullopt;
}

/// Leaves out one coordinate.
/// The corners of the hull of points in one plane, counter-clockwise in a projection along an axis; `triangle` is some
/// triangle of theirs that has area. (A. M. Andrew, "Another Efficient Algorithm for Convex Hulls in Two Dimensions",
/// 1979.)
std::vector<std::uint32_t> polygon(std::span<const Vec3d> points, const Triangle& triangle) {
    int axis = 0;
    while (orient2d(project(triangle[0], axis), project(triangle[1], axis), project(triangle[2], axis)) == 0) ++axis;
    std::vector<std::uint32_t> order(points.size());
    std::iota(order.begin(), order.end(), 0u);
    std::sort(order.begin(), order.end(), [&](std::uint32_t i, std::uint32_t j) {
        const Vec2d a = project(points[i], axis), b = project(points[j], axis);
        return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y();
    });
    std::vector<std::uint32_t> corners;
    const auto chain = [&](auto from, auto to) {
        const std::size_t fixed = corners.size();
        for (auto it = from; it != to; ++it) {
            const Vec2d p = project(points[*it], axis);
            while (corners.size() >= fixed + 2 && orient2d(project(points[corners[corners.size() - 2]], axis),
                                                           project(points[corners.back()], axis), p) <= 0)
                corners.pop_back();
            corners.push_back(*it);
        }
        corners.pop_back();  // it begins the other chain
    };
    chain(order.begin(), order.end());
    chain(order.rbegin(), order.rend());
    return corners;
}

/// Diagonals that halve: no corner of a polygon of n gets more than about 2 log n of them, and any two corners are that
/// few edges apart.
template <typename Emit>
void triangulate(std::span<const std::uint32_t> corners, const Emit& emit) {
    if (corners.size() < 3) return;
    const std::size_t middle = (corners.size() - 1) / 2;
    emit(corners.front(), corners[middle], corners.back());
    triangulate(corners.subspan(0, middle + 1), emit);
    triangulate(corners.subspan(middle), emit);
}

/// The sides of a hull: triangles of one plane, joined, as cycles of those corners at which they turn.
std::vector<std::vector<std::uint32_t>> sidesOf(const HullSurface& surface, std::span<const Vec3d> points) {
    std::vector<std::vector<std::uint32_t>> sides;
    std::vector<char> taken(surface.triangles.size(), 0);
    std::vector<std::uint32_t> follows(points.size(), 0);
    std::vector<std::uint32_t> members, rim;
    for (std::uint32_t first = 0; first < surface.triangles.size(); ++first) {
        if (taken[first]) continue;
        const auto& t = surface.triangles[first];
        members.assign(1, first);
        taken[first] = 1;
        rim.clear();
        for (std::size_t k = 0; k < members.size(); ++k) {
            const auto& corners = surface.triangles[members[k]];
            for (std::size_t i = 0; i < 3; ++i) {
                const std::uint32_t other = surface.across[members[k]][i];
                // A triangle of this plane next to this one is in `members`, or is put there now.
                bool inPlane = true;
                for (const std::uint32_t c : surface.triangles[other])
                    inPlane = inPlane && (c == t[0] || c == t[1] || c == t[2] ||
                                          orient3d(points[t[0]], points[t[1]], points[t[2]], points[c]) == 0);
                if (!inPlane) {
                    follows[corners[i]] = corners[(i + 1) % 3];
                    rim.push_back(corners[i]);
                } else if (!taken[other]) {
                    taken[other] = 1;
                    members.push_back(other);
                }
            }
        }
        if (members.size() == 1) {
            sides.push_back({t.begin(), t.end()});
            continue;
        }
        std::vector<std::uint32_t> corners;
        std::uint32_t before = rim.front();
        for (std::size_t k = 0; k < rim.size(); ++k) {
            const std::uint32_t at = follows[before];
            if (!isDegenerate({points[before], points[at], points[follows[at]]})) corners.push_back(at);
            before = at;
        }
        sides.push_back(std::move(corners));
    }
    return sides;
}

}  // namespace

Expected<ConvexHull> ConvexHull::make(const TriangleMesh& mesh, const ConvexHullLimits& limits) {
    std::vector<char> used(mesh.vertexCount(), 0);
    for (const std::uint32_t vertex : mesh.indices()) used[vertex] = 1;
    std::vector<Vec3d> points;
    std::vector<std::uint32_t> vertices;
    for (std::uint32_t v = 0; v < used.size(); ++v)
        if (used[v]) {
            points.push_back(mesh.positions()[v]);
            vertices.push_back(v);
        }
    Expected<ConvexHull> hull = make(points, limits);
    if (hull)
        for (std::uint32_t& source : hull->sources_) source = vertices[source];
    return hull;
}

Expected<ConvexHull> ConvexHull::make(std::span<const Vec3d> input, const ConvexHullLimits& limits) {
    if (input.empty()) return fail(ErrorCode::kBadInput, "no points, so no convex hull");
    if (input.size() > limits.maxPoints)
        return fail(ErrorCode::kLimit,
                    std::to_string(input.size()) + " points, at most " + std::to_string(limits.maxPoints));
    for (std::size_t i = 0; i < input.size(); ++i)
        if (!(input[i].cwiseAbs().array() <= limits.maxCoordinate).all())
            return fail(ErrorCode::kBadInput,
                        "point " + std::to_string(i) + " has a coordinate that is not finite or too large");

    const Distinct all = distinct(input);
    const std::span<const Vec3d> points(all.points);
    // The ends of the order are corners of the hull.
    const std::uint32_t low = 0, high = static_cast<std::uint32_t>(points.size() - 1);
    const Vec3d& p = points[low];
    const Vec3d along = points[high] - p;

    std::vector<std::vector<std::uint32_t>> sides;
    int dimension = 0;
    if (low != high) {
        dimension = 1;
        const auto third = farthestThat(
            points, [&](const Vec3d& q) { return along.cross(q - p).norm(); },
            [&](const Vec3d& q) {
                return !isDegenerate({p, points[high], q});
            });
        if (third) {
            dimension = 2;
            const Triangle base{p, points[high], points[*third]};
            const Vec3d normal = along.cross(points[*third] - p);
            const auto fourth = farthestThat(
                points, [&](const Vec3d& q) { return std::abs(normal.dot(q - p)); },
                [&](const Vec3d& q) { return orient3d(base[0], base[1], base[2], q) != 0; });
            if (fourth) {
                dimension = 3;
                sides = sidesOf(quickHull(points, {low, high, *third, *fourth}), points);
            } else {
                sides.push_back(polygon(points, base));
                sides.emplace_back(sides.front().rbegin(), sides.front().rend());
            }
        }
    }

    // Corners in the order in which they came.
    std::vector<std::uint32_t> corners;
    for (const auto& side : sides) corners.insert(corners.end(), side.begin(), side.end());
    if (dimension < 2) corners = {low, high};
    std::sort(corners.begin(), corners.end(),
              [&](std::uint32_t i, std::uint32_t j) { return all.sources[i] < all.sources[j]; });
    corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
    std::vector<std::uint32_t> place(points.size(), 0);
    std::vector<Vec3d> vertices;
    std::vector<std::uint32_t> sources;
    for (const std::uint32_t c : corners) {
        place[c] = static_cast<std::uint32_t>(vertices.size());
        vertices.push_back(points[c]);
        sources.push_back(all.sources[c]);
    }
    std::vector<Face> faces;
    for (auto& side : sides) {
        for (std::uint32_t& c : side) c = place[c];
        std::rotate(side.begin(), std::min_element(side.begin(), side.end()), side.end());
        triangulate(std::span<const std::uint32_t>(side), [&](std::uint32_t i, std::uint32_t j, std::uint32_t k) {
            Face f{i, j, k};
            std::rotate(f.begin(), std::min_element(f.begin(), f.end()), f.end());
            faces.push_back(f);
        });
    }
    std::sort(faces.begin(), faces.end());

    ConvexHull hull;
    hull.finish(std::move(vertices), std::move(sources), std::move(faces), dimension);
    return hull;
}

void ConvexHull::finish(std::vector<Vec3d> vertices, std::vector<std::uint32_t> sources, std::vector<Face> faces,
                        int dimension) {
    dimension_ = dimension;
    vertices_ = std::move(vertices);
    sources_ = std::move(sources);
    faces_ = std::move(faces);
    const double share = 1.0 / static_cast<double>(vertices_.size());
    for (const Vec3d& v : vertices_) {
        bounds_.extend(v);
        centre_ += share * v;
    }
    connect();
    if (vertices_.size() > kScannedVertices) {
        keepStarts();
        return;
    }
    const std::size_t rows = (vertices_.size() + 3) / 4 * 4;
    for (int axis = 0; axis < 3; ++axis)
        for (std::size_t i = 0; i < rows; ++i) columns_.push_back(vertices_[i < vertices_.size() ? i : 0][axis]);
}

void ConvexHull::connect() {
    std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
    for (const Face& f : faces_)
        for (std::size_t i = 0; i < 3; ++i) {
            edges.emplace_back(f[i], f[(i + 1) % 3]);
            if (dimension_ == 2) edges.emplace_back(f[(i + 1) % 3], f[i]);
        }
    if (dimension_ == 1) edges = {{0, 1}, {1, 0}};
    std::sort(edges.begin(), edges.end());
    edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
    firstNeighbour_.assign(vertices_.size() + 1, 0);
    for (const auto& [from, to] : edges) {
        ++firstNeighbour_[from + 1];
        neighbours_.push_back(to);
    }
    std::partial_sum(firstNeighbour_.begin(), firstNeighbour_.end(), firstNeighbour_.begin());
}

bool ConvexHull::contains(const Vec3d& p) const {
    if (!bounds_.contains(p)) return false;
    if (dimension_ == 3) {
        return std::all_of(faces_.begin(), faces_.end(), [&](const Face& f) {
            return orient3d(vertices_[f[0]], vertices_[f[1]], vertices_[f[2]], p) <= 0;
        });
    }
    const Triangle point{p, p, p};
    if (dimension_ < 2) return trianglesIntersect(point, {vertices_.front(), vertices_.back(), vertices_.back()});
    return std::any_of(faces_.begin(), faces_.end(), [&](const Face& f) {
        return trianglesIntersect(point, {vertices_[f[0]], vertices_[f[1]], vertices_[f[2]]});
    });
}

std::size_t ConvexHull::memoryBytes() const {
    const auto bytes = [](const auto& v) { return v.capacity() * sizeof(v[0]); };
    return sizeof(*this) + bytes(vertices_) + bytes(sources_) + bytes(faces_) + bytes(firstNeighbour_) +
           bytes(neighbours_) + bytes(columns_) + bytes(starts_);
}

}  // namespace tessera

#include "server/collision/rigid_bodies/Solid.h"

#include <algorithm>
#include <array>
#include <numeric>

namespace tessera::rigid {

namespace {

constexpr std::uint32_t kNone = ~std::uint32_t{0};
/// Triangles within so many sizes of a plane, and turned by less than acos of that, are taken for one side with it.
constexpr double kFlatness = 1e-4;
constexpr double kSameDirection = 0.999;

/// Which triangles make a side together.
class SideFinder {
public:
    explicit SideFinder(const ConvexHull& hull) : faces_(hull.faces()), vertices_(hull.vertices()) {
        tolerance_ = kFlatness * hull.bounds().size().norm();
        normals_.resize(faces_.size());
        areas_.resize(faces_.size());
        for (std::size_t f = 0; f < faces_.size(); ++f) {
            const Vec3d& p = vertices_[faces_[f][0]];
            const Vec3d n = (vertices_[faces_[f][1]] - p).cross(vertices_[faces_[f][2]] - p);
            areas_[f] = n.norm();
            normals_[f] = areas_[f] > 0 ? Vec3d(n / areas_[f]) : Vec3d::Zero();
        }
        findNeighbours();
    }

    /// Per triangle its side; sides are numbered from 0.
    std::vector<std::uint32_t> merged() {
        // From large to small: the direction of a sliver is mostly rounding.
        std::vector<std::uint32_t> order(faces_.size());
        std::iota(order.begin(), order.end(), 0U);
        std::stable_sort(order.begin(), order.end(),
                         [&](std::uint32_t x, std::uint32_t y) { return areas_[x] > areas_[y]; });
        std::vector<std::uint32_t> side(faces_.size(), kNone), open;
        std::uint32_t count = 0;
        for (const std::uint32_t seed : order) {
            if (side[seed] != kNone) continue;
            side[seed] = count;
            open.assign(1, seed);
            while (!open.empty()) {
                const std::uint32_t f = open.back();
                open.pop_back();
                for (const std::uint32_t g : across_[f])
                    if (g != kNone && side[g] == kNone && inPlane(g, seed)) {
                        side[g] = count;
                        open.push_back(g);
                    }
            }
            ++count;
        }
        return side;
    }

    [[nodiscard]] std::uint32_t across(std::size_t face, std::size_t corner) const { return across_[face][corner]; }

private:
    [[nodiscard]] bool inPlane(std::uint32_t face, std::uint32_t seed) const {
        const Vec3d& n = normals_[seed];
        if (areas_[face] > 1e-3 * areas_[seed] && n.dot(normals_[face]) < kSameDirection) return false;
        if (n.dot(normals_[face]) < 0) return false;
        const double offset = n.dot(vertices_[faces_[seed][0]]);
        return std::all_of(faces_[face].begin(), faces_[face].end(),
                           [&](std::uint32_t v) { return std::abs(n.dot(vertices_[v]) - offset) <= tolerance_; });
    }

    void findNeighbours() {
        struct HalfEdge {
            std::uint32_t from, to, face, corner;
        };
        std::vector<HalfEdge> edges;
        edges.reserve(3 * faces_.size());
        for (std::uint32_t f = 0; f < faces_.size(); ++f)
            for (std::uint32_t i = 0; i < 3; ++i) edges.push_back({faces_[f][i], faces_[f][(i + 1) % 3], f, i});
        const auto key = [](std::uint32_t u, std::uint32_t v) { return std::uint64_t{u} << 32 | v; };
        std::sort(edges.begin(), edges.end(),
                  [&](const HalfEdge& x, const HalfEdge& y) { return key(x.from, x.to) < key(y.from, y.to); });
        across_.assign(faces_.size(), {kNone, kNone, kNone});
        for (const HalfEdge& e : edges) {
            const std::uint64_t wanted = key(e.to, e.from);
            auto twin = std::lower_bound(edges.begin(), edges.end(), wanted,
                                         [&](const HalfEdge& x, std::uint64_t k) { return key(x.from, x.to) < k; });
            // Both sides of what is flat have the edge: the one that looks the same way goes on across it.
            double best = -2;
            for (; twin != edges.end() && key(twin->from, twin->to) == wanted; ++twin) {
                const double alike = normals_[twin->face].dot(normals_[e.face]);
                if (!(alike > best)) continue;
                best = alike;
                across_[e.face][e.corner] = twin->face;
            }
        }
    }

    std::span<const ConvexHull::Face> faces_;
    std::span<const Vec3d> vertices_;
    std::vector<std::array<std::uint32_t, 3>> across_;
    std::vector<Vec3d> normals_;
    std::vector<double> areas_;
    double tolerance_ = 0;
};

/// Outlines and edges for a numbering of the sides; false where a side's boundary is not one loop.
bool outline(const ConvexHull& hull, const SideFinder& finder, const std::vector<std::uint32_t>& side,
             SolidShape& out) {
    const std::span<const ConvexHull::Face> faces = hull.faces();
    const std::uint32_t count = side.empty() ? 0 : 1 + *std::max_element(side.begin(), side.end());
    std::vector<std::vector<std::array<std::uint32_t, 2>>> boundary(count);
    out.edges.clear();
    for (std::size_t f = 0; f < faces.size(); ++f)
        for (std::size_t i = 0; i < 3; ++i) {
            const std::uint32_t other = finder.across(f, i);
            if (other == kNone) return false;
            if (side[other] == side[f]) continue;
            const std::uint32_t from = faces[f][i], to = faces[f][(i + 1) % 3];
            boundary[side[f]].push_back({from, to});
            if (from < to) out.edges.push_back({from, to, side[f], side[other]});
        }
    out.firstOfSide.assign(1, 0);
    out.outlines.clear();
    for (std::vector<std::array<std::uint32_t, 2>>& edges : boundary) {
        if (edges.size() < 3) return false;
        std::sort(edges.begin(), edges.end());
        for (std::size_t i = 1; i < edges.size(); ++i)
            if (edges[i][0] == edges[i - 1][0]) return false;
        std::uint32_t at = edges.front()[0];
        for (std::size_t i = 0; i < edges.size(); ++i) {
            out.outlines.push_back(at);
            const auto next = std::lower_bound(edges.begin(), edges.end(), std::array<std::uint32_t, 2>{at, 0});
            if (next == edges.end() || (*next)[0] != at) return false;
            at = (*next)[1];
            if (at == edges.front()[0] && i + 1 != edges.size()) return false;
        }
        out.firstOfSide.push_back(static_cast<std::uint32_t>(out.outlines.size()));
    }
    return true;
}

/// Per corner, ascending.
void listEdges(SolidShape& shape) {
    shape.firstOfCorner.assign(shape.corners.size() + 1, 0);
    for (const SolidShape::Edge& e : shape.edges)
        for (const std::uint32_t corner : {e.from, e.to}) ++shape.firstOfCorner[corner + 1];
    std::partial_sum(shape.firstOfCorner.begin(), shape.firstOfCorner.end(), shape.firstOfCorner.begin());
    shape.edgesOfCorners.resize(2 * shape.edges.size());
    std::vector<std::uint32_t> next(shape.firstOfCorner.begin(), shape.firstOfCorner.end() - 1);
    for (std::uint32_t e = 0; e < shape.edges.size(); ++e)
        for (const std::uint32_t corner : {shape.edges[e].from, shape.edges[e].to})
            shape.edgesOfCorners[next[corner]++] = e;
}

/// Newell's: as good as the outline is flat.
Vec3d areaVector(std::span<const std::uint32_t> outline, std::span<const Vec3d> corners) {
    Vec3d sum = Vec3d::Zero();
    const Vec3d& origin = corners[outline[0]];
    for (std::size_t i = 1; i + 1 < outline.size(); ++i)
        sum += (corners[outline[i]] - origin).cross(corners[outline[i + 1]] - origin);
    return sum;
}

}  // namespace

SolidShape solidShape(const ConvexHull& hull) {
    SolidShape out;
    out.corners.assign(hull.vertices().begin(), hull.vertices().end());
    out.firstOfSide.assign(1, 0);
    if (hull.dimension() < 2) return out;
    out.flat = hull.dimension() == 2;
    SideFinder finder(hull);
    std::vector<std::uint32_t> side = finder.merged();
    if (!outline(hull, finder, side, out)) {
        std::iota(side.begin(), side.end(), 0U);
        outline(hull, finder, side, out);
    }
    listEdges(out);
    return out;
}

PlacedSolid place(const SolidShape& shape, const Affine3d& world, std::span<Vec3d> corners, std::span<PlacedSide> sides,
                  std::span<PlacedEdge> edges) {
    PlacedSolid out;
    out.shape = &shape;
    out.turn = world.linear().determinant() < 0 ? -1 : 1;
    for (std::size_t i = 0; i < corners.size(); ++i) {
        corners[i] = world * shape.corners[i];
        out.box.extend(corners[i]);
        out.centre += corners[i];
    }
    out.centre /= static_cast<double>(corners.size());
    for (const Vec3d& c : corners) out.radius = std::max(out.radius, (c - out.centre).norm());
    for (std::size_t s = 0; s < sides.size(); ++s) {
        const std::span<const std::uint32_t> outline = shape.outline(s);
        const Vec3d area = out.turn * areaVector(outline, corners);
        const double length = area.norm();
        PlacedSide& side = sides[s];
        side.normal = length > 0 ? Vec3d(area / length) : Vec3d::Zero();
        side.offset = side.normal.dot(corners[outline[0]]);
        for (const std::uint32_t c : outline) side.offset = std::max(side.offset, side.normal.dot(corners[c]));
    }
    out.inner = out.radius;
    for (const PlacedSide& side : sides)
        out.inner = std::max(0.0, std::min(out.inner, side.offset - side.normal.dot(out.centre)));
    std::size_t next = 0;
    for (const SolidShape::Edge& e : shape.edges) {
        PlacedEdge edge{
            corners[e.from], corners[e.to] - corners[e.from], sides[e.left].normal, sides[e.right].normal, {}};
        if (shape.flat) {
            // Its sides look opposite ways: between them lies the direction outwards, in the plane.
            Vec3d outwards = edge.along.cross(edge.first);
            if (outwards.dot(edge.from - out.centre) < 0) outwards = -outwards;
            outwards.normalize();
            edges[next++] = {edge.from, edge.along, edge.first, outwards, edge.first.cross(outwards)};
            edge.first = outwards;
        }
        edge.crossed = edge.first.cross(edge.second);
        edges[next++] = edge;
    }
    out.corners = corners;
    out.sides = sides;
    out.edges = edges.first(next);
    return out;
}

}  // namespace tessera::rigid

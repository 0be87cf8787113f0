#include "server/collision/freeform/FreeformShape.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

namespace tessera {
namespace {

/// Each of them: the largest of three where one is no number is any of the others.
bool isWithin(const Vec3d& p) {
    return (p.array().abs() <= FreeformShape::kMaxCoordinate).all();
}

Expected<void> checkControlPoints(std::span<const Vec3d> points) {
    for (std::size_t i = 0; i < points.size(); ++i)
        if (!isWithin(points[i]))
            return fail(ErrorCode::kBadInput, "control point " + std::to_string(i) + " is not finite, or beyond 1e50");
    return {};
}

Box boxAround(std::span<const Vec3d> points) {
    Box box;
    for (const Vec3d& p : points) box.extend(p);
    return box;
}

}  // namespace

void hullOfNeighbourhood(NeighbourhoodGraph& graph, const NeighbourhoodGraph::Node& node, std::span<const Vec3d> points,
                         int levels, std::vector<Vec3d>& hull) {
    if (node.spline && node.spline->count() == 16) {
        std::array<Vec3d, 16> spline;
        for (std::size_t i = 0; i < 16; ++i) spline[i] = node.spline->apply(i, points);
        const auto bezier = bezierOfSpline(spline);
        hull.insert(hull.end(), bezier.begin(), bezier.end());
    } else if (node.spline) {
        std::array<Vec3d, 12> spline;
        for (std::size_t i = 0; i < 12; ++i) spline[i] = node.spline->apply(i, points);
        const auto bezier = bezierOfBoxSpline(spline);
        hull.insert(hull.end(), bezier.begin(), bezier.end());
    } else if (levels == 0) {
        hull.insert(hull.end(), points.begin(), points.end());
    } else {
        std::vector<Vec3d> finer;
        for (std::uint32_t c = 0; c < 4; ++c) {
            const NeighbourhoodGraph::Child& child = graph.childOf(node, c);
            child.points.apply(points, finer);
            hullOfNeighbourhood(graph, *child.node, finer, levels - 1, hull);
        }
    }
}

Expected<FreeformShape> FreeformShape::ofSubdivision(const ControlMesh& mesh) {
    if (mesh.scheme == SubdivisionScheme::kBilinear)
        return fail(ErrorCode::kBadInput, "a bilinear surface is no smooth one; take its triangles");
    if (const Expected<void> good = checkControlPoints(mesh.positions); !good) return tl::unexpected(good.error());
    Expected<SubdivisionTopology> topology = SubdivisionTopology::build(mesh);
    if (!topology) return tl::unexpected(topology.error());
    FreeformShape shape;
    Subdivision& s = shape.subdivision_.emplace();
    s.topology = std::make_shared<const SubdivisionTopology>(std::move(*topology));
    s.graph = std::make_shared<NeighbourhoodGraph>(*s.topology);
    s.positions = mesh.positions;
    for (std::size_t f = 0; f < s.topology->ptexFaceCount(); ++f)
        if (s.topology->hasSurface(s.topology->ptexFace(f).face)) s.faces.push_back(static_cast<std::uint32_t>(f));
    if (s.faces.empty()) return fail(ErrorCode::kBadInput, "no face has a surface");
    shape.build(s.faces.size());
    return shape;
}

Expected<FreeformShape> FreeformShape::withPositions(std::span<const Vec3d> positions) const {
    if (!subdivision_) return fail(ErrorCode::kBadInput, "only subdivision surfaces share a topology");
    if (positions.size() != subdivision_->positions.size())
        return fail(ErrorCode::kBadInput, "there are not as many positions as control points");
    if (const Expected<void> good = checkControlPoints(positions); !good) return tl::unexpected(good.error());
    FreeformShape shape;
    Subdivision& s = shape.subdivision_.emplace(*subdivision_);
    s.positions.assign(positions.begin(), positions.end());
    shape.build(s.faces.size());
    return shape;
}

Expected<FreeformShape> FreeformShape::ofNurbs(std::vector<NurbsSurface> surfaces) {
    FreeformShape shape;
    Nurbs& n = shape.nurbs_.emplace();
    for (std::size_t s = 0; s < surfaces.size(); ++s)
        for (ParameterPatch& p : bezierPatches(surfaces[s])) {
            const RectangleSide side = surfaces[s].region().side(p.over);
            if (side == RectangleSide::kTrimmedAway) continue;
            NurbsPatch patch{std::move(p.patch), p.over, static_cast<std::uint32_t>(s), true,
                             side == RectangleSide::kCrossed};
            const double weight = patch.patch.points.front().w();
            for (const Vec4d& q : patch.patch.points) {
                if (!isWithin(q.head<3>() / q.w()))
                    return fail(ErrorCode::kBadInput,
                                "surface " + std::to_string(s) + ": a control point is not finite, or beyond 1e50");
                patch.polynomial = patch.polynomial && q.w() == weight;
            }
            n.patches.push_back(std::move(patch));
        }
    if (n.patches.empty()) return fail(ErrorCode::kBadInput, "trimming leaves nothing of the surfaces");
    n.surfaces = std::move(surfaces);
    shape.build(n.patches.size());
    return shape;
}

Expected<FreeformShape> FreeformShape::ofTriangles(TriangleMesh mesh) {
    if (mesh.faceCount() == 0) return fail(ErrorCode::kBadInput, "there are no triangles");
    FreeformShape shape;
    shape.mesh_ = std::move(mesh);
    shape.build(shape.mesh_.faceCount());
    return shape;
}

Expected<FreeformShape> FreeformShape::ofHull(ConvexHull hull) {
    std::vector<double> positions;
    std::vector<std::uint32_t> indices;
    for (const Vec3d& p : hull.vertices()) positions.insert(positions.end(), {p.x(), p.y(), p.z()});
    for (const ConvexHull::Face& f : hull.faces()) indices.insert(indices.end(), f.begin(), f.end());
    Expected<TriangleMesh> mesh = TriangleMesh::make(std::span<const double>(positions), indices);
    if (!mesh) return tl::unexpected(mesh.error());
    if (mesh->faceCount() == 0) return fail(ErrorCode::kBadInput, "the hull is a point or a segment: it has no faces");
    Expected<FreeformShape> shape = ofTriangles(std::move(*mesh));
    if (shape) shape->hull_ = std::move(hull);
    return shape;
}

Box FreeformShape::boxOfFace(std::uint32_t face) const {
    Box box;
    if (nurbs_) return boxOf(nurbs_->patches[face].patch);
    if (!subdivision_) {
        for (unsigned i = 0; i < 3; ++i) box.extend(mesh_.corner(face, i));
        return box;
    }
    const Subdivision& s = *subdivision_;
    const PtexFace ptex = s.topology->ptexFace(s.faces[face]);
    const NeighbourhoodGraph::Face& base = s.graph->faceOf(ptex.face);
    std::vector<Vec3d> points;
    for (const std::uint32_t p : base.points) points.push_back(s.positions[p]);
    std::vector<Vec3d> hull;
    if (ptex.corner == kNoIndex) {
        hullOfNeighbourhood(*s.graph, *base.node, points, kHullLevels, hull);
        return boxAround(hull);
    }
    const NeighbourhoodGraph::Child& child = s.graph->childOf(*base.node, ptex.corner);
    std::vector<Vec3d> finer;
    child.points.apply(points, finer);
    hullOfNeighbourhood(*s.graph, *child.node, finer, kHullLevels, hull);
    return boxAround(hull);
}

void FreeformShape::build(std::size_t faces) {
    std::vector<Box> boxes(faces);
    for (std::size_t f = 0; f < faces; ++f) boxes[f] = boxOfFace(static_cast<std::uint32_t>(f));
    std::vector<std::uint32_t> order(faces);
    std::iota(order.begin(), order.end(), 0U);
    leafOf_.resize(faces);
    nodes_.reserve(2 * faces - 1);
    nodes_.emplace_back();
    parents_.push_back(0);
    divide(order, boxes);
}

void FreeformShape::divide(std::span<std::uint32_t> faces, std::span<const Box> boxes) {
    // At the median of the middles, along the longest side.
    struct Task {
        std::size_t begin, end;
        std::uint32_t node;
    };
    std::vector<Task> tasks{{0, faces.size(), 0}};
    while (!tasks.empty()) {
        const Task task = tasks.back();
        tasks.pop_back();
        Box box, centers;
        for (std::size_t i = task.begin; i < task.end; ++i) {
            box.extend(boxes[faces[i]]);
            centers.extend(boxes[faces[i]].center());
        }
        nodes_[task.node].box = box;
        if (task.end - task.begin == 1) {
            nodes_[task.node].isLeaf = true;
            nodes_[task.node].first = faces[task.begin];
            leafOf_[faces[task.begin]] = task.node;
            continue;
        }
        Eigen::Index axis = 0;
        centers.size().maxCoeff(&axis);
        const std::size_t middle = task.begin + (task.end - task.begin) / 2;
        std::nth_element(faces.begin() + static_cast<std::ptrdiff_t>(task.begin),
                         faces.begin() + static_cast<std::ptrdiff_t>(middle),
                         faces.begin() + static_cast<std::ptrdiff_t>(task.end), [&](std::uint32_t a, std::uint32_t b) {
                             const double ca = boxes[a].center()[axis], cb = boxes[b].center()[axis];
                             return ca < cb || (ca == cb && a < b);
                         });
        const auto child = static_cast<std::uint32_t>(nodes_.size());
        nodes_[task.node].first = child;
        nodes_.resize(nodes_.size() + 2);
        parents_.resize(nodes_.size(), task.node);
        tasks.push_back({task.begin, middle, child});
        tasks.push_back({middle, task.end, child + 1});
    }
}

void FreeformShape::refit() {
    for (std::size_t n = nodes_.size(); n-- > 0;) {
        Node& node = nodes_[n];
        if (node.isLeaf) {
            node.box = boxOfFace(node.first);
        } else {
            node.box = nodes_[node.first].box;
            node.box.extend(nodes_[node.first + 1].box);
        }
    }
}

void FreeformShape::refitAbove(std::vector<std::uint32_t> faces) {
    // Children have larger numbers than their parents: from the largest down every node is reached after all below it.
    std::vector<std::uint32_t> open;
    for (const std::uint32_t f : faces) open.push_back(leafOf_[f]);
    std::make_heap(open.begin(), open.end());
    while (!open.empty()) {
        const std::uint32_t n = open.front();
        while (!open.empty() && open.front() == n) {
            std::pop_heap(open.begin(), open.end());
            open.pop_back();
        }
        Node& node = nodes_[n];
        if (node.isLeaf) {
            node.box = boxOfFace(node.first);
        } else {
            node.box = nodes_[node.first].box;
            node.box.extend(nodes_[node.first + 1].box);
        }
        if (n == 0) continue;
        open.push_back(parents_[n]);
        std::push_heap(open.begin(), open.end());
    }
}

Expected<void> FreeformShape::move(std::span<const Vec3d> positions) {
    if (nurbs_ || hull_) return fail(ErrorCode::kBadInput, "NURBS and hulls are made anew where they change");
    if (const Expected<void> good = checkControlPoints(positions); !good) return good;
    if (subdivision_) {
        if (positions.size() != subdivision_->positions.size())
            return fail(ErrorCode::kBadInput, "there are not as many positions as control points");
        subdivision_->positions.assign(positions.begin(), positions.end());
    } else if (const Expected<void> moved = mesh_.move(positions); !moved) {
        return moved;
    }
    ++moves_;
    refit();
    return {};
}

Expected<void> FreeformShape::move(std::span<const std::uint32_t> points, std::span<const Vec3d> positions) {
    if (!subdivision_) return fail(ErrorCode::kBadInput, "single control points move in subdivision surfaces alone");
    if (points.size() != positions.size())
        return fail(ErrorCode::kBadInput, "there are not as many positions as control points");
    if (const Expected<void> good = checkControlPoints(positions); !good) return good;
    Subdivision& s = *subdivision_;
    for (const std::uint32_t p : points)
        if (p >= s.positions.size())
            return fail(ErrorCode::kBadInput,
                        "control point " + std::to_string(p) + ": there are " + std::to_string(s.positions.size()));
    for (std::size_t i = 0; i < points.size(); ++i) s.positions[points[i]] = positions[i];
    std::vector<std::uint32_t> faces;
    for (const std::uint32_t ptex : s.topology->touchedBy(points)) {
        const auto at = std::lower_bound(s.faces.begin(), s.faces.end(), ptex);
        if (at != s.faces.end() && *at == ptex) faces.push_back(static_cast<std::uint32_t>(at - s.faces.begin()));
    }
    ++moves_;
    refitAbove(std::move(faces));
    return {};
}

std::size_t FreeformShape::memoryBytes() const {
    std::size_t bytes = nodes_.capacity() * sizeof(Node) +
                        (leafOf_.capacity() + parents_.capacity()) * sizeof(std::uint32_t) + mesh_.memoryBytes();
    if (subdivision_)
        bytes +=
            subdivision_->positions.capacity() * sizeof(Vec3d) + subdivision_->faces.capacity() * sizeof(std::uint32_t);
    if (nurbs_) {
        for (const NurbsPatch& p : nurbs_->patches) bytes += sizeof p + p.patch.points.capacity() * sizeof(Vec4d);
        for (const NurbsSurface& s : nurbs_->surfaces)
            bytes += sizeof s + s.definition().points.capacity() * sizeof(Vec4d);
    }
    return bytes + (hull_ ? hull_->memoryBytes() : 0);
}

}  // namespace tessera

#include "common/freeform/subdivision/NeighbourhoodGraph.h"

#include <algorithm>
#include <cmath>

namespace tessera {
namespace {

template <typename T>
void appendBytes(std::string& out, const std::vector<T>& values) {
    const std::uint64_t count = values.size();
    out.append(reinterpret_cast<const char*>(&count), sizeof count);
    if (count > 0) out.append(reinterpret_cast<const char*>(values.data()), count * sizeof(T));
}

/// All that a neighbourhood is.
std::string keyOf(const TaggedMesh& mesh) {
    static_assert(sizeof(TaggedMesh::Edge) == 20);  // without gaps
    std::string key;
    appendBytes(key, mesh.faceBegin);
    appendBytes(key, mesh.faceVertices);
    appendBytes(key, mesh.faceEdges);
    appendBytes(key, mesh.edges);
    appendBytes(key, mesh.vertexSharpness);
    appendBytes(key, mesh.vertexEdgeBegin);
    appendBytes(key, mesh.vertexEdges);
    return key;
}

bool isSettledEverywhere(const TaggedMesh& mesh, SubdivisionScheme scheme) {
    for (std::uint32_t c = 0; c < mesh.faceSize(0); ++c) {
        if (!isSettled(mesh, c, scheme)) return false;
    }
    return true;
}

/// first · second, rows by the points that `second` is by.
SparseRows product(const SparseRows& first, const SparseRows& second, std::size_t columns) {
    SparseRows out;
    RowSum sum(columns);
    for (std::size_t row = 0; row < first.count(); ++row) {
        for (std::uint32_t i = first.begin[row]; i < first.begin[row + 1]; ++i) {
            const std::uint32_t middle = first.columns[i];
            for (std::uint32_t k = second.begin[middle]; k < second.begin[middle + 1]; ++k) sum.add(second.columns[k], first.weights[i] * second.weights[k]);
        }
        sum.moveInto(out);
    }
    return out;
}

}  // namespace

NeighbourhoodGraph::NeighbourhoodGraph(const SubdivisionTopology& topology)
    : topology_(topology), rules_{.scheme = topology.scheme(), .creaseMethod = topology.creaseMethod(), .triangles = topology.triangles()} {}

NeighbourhoodGraph::Node* NeighbourhoodGraph::nodeOf(TaggedMesh mesh) {
    std::string key = keyOf(mesh);
    const auto found = nodes_.find(key);
    if (found != nodes_.end()) return found->second.get();
    auto node = std::make_unique<Node>();
    bytes_ += 3 * key.size() + sizeof(Node);
    node->mesh = std::move(mesh);
    node->spline = regularPatchOf(node->mesh, rules_.scheme);
    node->corners.resize(node->faceSize());
    node->children.resize(node->faceSize() + (rules_.scheme == SubdivisionScheme::kLoop ? 1 : 0));
    return nodes_.emplace(std::move(key), std::move(node)).first->second.get();
}

const NeighbourhoodGraph::Face& NeighbourhoodGraph::faceOf(std::uint32_t face) {
    const auto found = faces_.find(face);
    if (found != faces_.end()) return found->second;
    FaceNeighbourhood here = neighbourhoodOf(topology_.mesh(), face, rules_.creaseMethod);
    bytes_ += here.points.size() * sizeof(std::uint32_t) + 128;
    for (std::uint32_t& p : here.points) p = topology_.controlPointOf(p);
    Node* const node = nodeOf(std::move(here.mesh));
    return faces_.emplace(face, Face{node, std::move(here.points)}).first->second;
}

const NeighbourhoodGraph::Child& NeighbourhoodGraph::childOf(const Node& parent, std::uint32_t which) {
    Node& node = own(parent);
    if (node.children[which]) return *node.children[which];
    const RefinedNeighbourhood finer = refine(node.mesh, rules_);
    // One step tells of all children; of a polygon with many corners only the one that was asked for is kept.
    const std::uint32_t first = node.children.size() > 4 ? which : 0, end = node.children.size() > 4 ? which + 1 : static_cast<std::uint32_t>(node.children.size());
    for (std::uint32_t c = first; c < end; ++c) {
        FaceNeighbourhood here = neighbourhoodOf(finer.mesh, finer.children[c], rules_.creaseMethod);
        Child child;
        for (const std::uint32_t p : here.points) {
            for (std::uint32_t i = finer.points.begin[p]; i < finer.points.begin[p + 1]; ++i) {
                child.points.columns.push_back(finer.points.columns[i]);
                child.points.weights.push_back(finer.points.weights[i]);
            }
            child.points.endRow();
        }
        bytes_ += child.points.columns.size() * 12 + here.points.size() * 4;
        child.node = nodeOf(std::move(here.mesh));
        node.children[c] = std::move(child);
    }
    return *node.children[which];
}

const CornerLimit& NeighbourhoodGraph::limitAt(const Node& parent, std::uint32_t corner) {
    Node& node = own(parent);
    if (node.corners[corner]) return *node.corners[corner];
    CornerLimit limit;
    if (!isSettled(node.mesh, corner, rules_.scheme)) {
        const Child& child = childOf(node, corner);
        const std::uint32_t childCorner = rules_.scheme == SubdivisionScheme::kLoop || node.faceSize() == 4 ? corner : 0;
        limit.rows = product(limitAt(*child.node, childCorner).rows, child.points, node.pointCount());
        // Its tangents are those of a face half as large.
        for (std::uint32_t i = limit.rows.begin[1]; i < limit.rows.columns.size(); ++i) limit.rows.weights[i] *= 2;
    } else if (isDart(node.mesh, corner)) {
        limit = dartLimit(node, corner);
    } else {
        limit = cornerLimitOf(node.mesh, corner, rules_.scheme);
    }
    node.corners[corner] = std::move(limit);
    return *node.corners[corner];
}

CornerLimit NeighbourhoodGraph::dartLimit(const Node& node, std::uint32_t corner) {
    const Child& child = childOf(node, corner);
    if (child.node != &node) {
        CornerLimit limit;
        limit.rows = product(limitAt(*child.node, corner).rows, child.points, node.pointCount());
        for (std::uint32_t i = limit.rows.begin[1]; i < limit.rows.columns.size(); ++i) limit.rows.weights[i] *= 2;
        return limit;
    }
    // Refinement maps the points onto themselves here: powers of its matrix tend to the point's left eigenvector.
    CornerLimit limit = cornerLimitOf(node.mesh, corner, rules_.scheme);
    SparseRows point;
    point.columns.assign(limit.rows.columns.begin(), limit.rows.columns.begin() + limit.rows.begin[1]);
    point.weights.assign(limit.rows.weights.begin(), limit.rows.weights.begin() + limit.rows.begin[1]);
    point.endRow();
    constexpr int kMostSteps = 2000;
    for (int step = 0; step < kMostSteps; ++step) {
        SparseRows next = product(point, child.points, node.pointCount());
        std::vector<double> before(node.pointCount(), 0);
        for (std::size_t i = 0; i < point.columns.size(); ++i) before[point.columns[i]] = point.weights[i];
        double change = 0;
        for (std::size_t i = 0; i < next.columns.size(); ++i) change = std::max(change, std::abs(next.weights[i] - before[next.columns[i]]));
        point = std::move(next);
        if (change < 1e-17) break;
    }
    for (std::size_t row = 1; row < 3; ++row) {
        for (std::uint32_t i = limit.rows.begin[row]; i < limit.rows.begin[row + 1]; ++i) {
            point.columns.push_back(limit.rows.columns[i]);
            point.weights.push_back(limit.rows.weights[i]);
        }
        point.endRow();
    }
    return {std::move(point)};
}

const SparseRows* NeighbourhoodGraph::approximationOf(const Node& parent) {
    Node& node = own(parent);
    if (!node.approximation) {
        std::vector<const CornerLimit*> limits;
        const bool settled = isSettledEverywhere(node.mesh, rules_.scheme);
        for (std::uint32_t c = 0; settled && c < node.faceSize(); ++c) limits.push_back(&limitAt(node, c));
        node.approximation = settled ? approximatePatchOf(node.mesh, rules_.scheme, limits) : std::nullopt;
    }
    return *node.approximation ? &**node.approximation : nullptr;
}

void NeighbourhoodGraph::shrink(std::size_t bytes) {
    if (bytes_ <= bytes) return;
    nodes_.clear();
    faces_.clear();
    bytes_ = 0;
}

}  // namespace tessera

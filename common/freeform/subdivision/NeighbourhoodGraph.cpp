#include "common/freeform/subdivision/NeighbourhoodGraph.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>

#include "common/base/Hash.h"

namespace tessera {
namespace {

template <typename T>
ByteSpan bytesOf(const std::vector<T>& values) {
    return {reinterpret_cast<const std::byte*>(values.data()), values.size() * sizeof(T)};
}

/// Over all that a neighbourhood is.
template <typename F>
void forAllArrays(const TaggedMesh& mesh, const F& use) {
    static_assert(sizeof(TaggedMesh::Edge) == 20);  // without gaps
    use(bytesOf(mesh.faceBegin), 0);
    use(bytesOf(mesh.faceVertices), 1);
    use(bytesOf(mesh.faceEdges), 2);
    use(bytesOf(mesh.edges), 3);
    use(bytesOf(mesh.vertexSharpness), 4);
    use(bytesOf(mesh.vertexEdgeBegin), 5);
    use(bytesOf(mesh.vertexEdges), 6);
}

std::uint64_t hashOf(const TaggedMesh& mesh) {
    std::uint64_t hash = 0;
    forAllArrays(mesh, [&](ByteSpan bytes, std::size_t) { hash = hash64(bytes, hash + bytes.size()); });
    return hash;
}

std::size_t bytesOfMesh(const TaggedMesh& mesh) {
    std::size_t sum = 0;
    forAllArrays(mesh, [&](ByteSpan bytes, std::size_t) { sum += bytes.size(); });
    return sum;
}

bool isSame(const TaggedMesh& a, const TaggedMesh& b) {
    std::array<ByteSpan, 7> all;
    forAllArrays(a, [&](ByteSpan bytes, std::size_t which) { all[which] = bytes; });
    bool same = true;
    forAllArrays(b, [&](ByteSpan bytes, std::size_t which) {
        same = same && bytes.size() == all[which].size() &&
               (bytes.empty() || std::memcmp(bytes.data(), all[which].data(), bytes.size()) == 0);
    });
    return same;
}

void trim(TaggedMesh& mesh) {
    mesh.faceBegin.shrink_to_fit();
    mesh.faceVertices.shrink_to_fit();
    mesh.faceEdges.shrink_to_fit();
    mesh.edges.shrink_to_fit();
    mesh.vertexSharpness.shrink_to_fit();
    mesh.vertexEdgeBegin.shrink_to_fit();
    mesh.vertexEdges.shrink_to_fit();
}

void trim(SparseRows& rows) {
    rows.begin.shrink_to_fit();
    rows.columns.shrink_to_fit();
    rows.weights.shrink_to_fit();
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
            for (std::uint32_t k = second.begin[middle]; k < second.begin[middle + 1]; ++k)
                sum.add(second.columns[k], first.weights[i] * second.weights[k]);
        }
        sum.moveInto(out);
    }
    return out;
}

}  // namespace

NeighbourhoodGraph::NeighbourhoodGraph(const SubdivisionTopology& topology)
    : topology_(topology),
      rules_{.scheme = topology.scheme(), .creaseMethod = topology.creaseMethod(), .triangles = topology.triangles()},
      // Meshes have few kinds of neighbourhoods, or some for each face: lists stay short either way.
      heads_(std::bit_ceil(std::clamp<std::size_t>(topology.mesh().faceCount() / 8, 64, std::size_t{1} << 18))),
      faces_(topology.mesh().faceCount()) {}

NeighbourhoodGraph::~NeighbourhoodGraph() {
    clear();
}

void NeighbourhoodGraph::clear() {
    for (std::atomic<const Node*>& head : heads_)
        for (const Node* node = head.exchange(nullptr, std::memory_order_acq_rel); node != nullptr;) {
            const Node* const next = node->next;
            delete node;
            node = next;
        }
}

const NeighbourhoodGraph::Node* NeighbourhoodGraph::nodeOf(TaggedMesh mesh) {
    const std::uint64_t hash = hashOf(mesh);
    std::atomic<const Node*>& head = heads_[hash & (heads_.size() - 1)];
    const auto find = [&](const Node* from, const Node* end, const TaggedMesh& wanted) {
        while (from != end && !(from->hash == hash && isSame(from->mesh, wanted))) from = from->next;
        return from;
    };
    const Node* first = head.load(std::memory_order_acquire);
    if (const Node* const known = find(first, nullptr, mesh)) return known;
    auto node = std::make_unique<Node>();
    trim(mesh);
    node->hash = hash;
    node->mesh = std::move(mesh);
    node->spline = regularPatchOf(node->mesh, rules_.scheme);
    if (node->spline) trim(*node->spline);
    node->children = std::vector<Once<Child>>(node->faceSize() + (rules_.scheme == SubdivisionScheme::kLoop ? 1 : 0));
    node->corners = std::vector<Once<CornerLimit>>(node->faceSize());
    const std::size_t bytes = bytesOfMesh(node->mesh) + sizeof(Node) +
                              (node->spline ? node->spline->columns.size() * 12 : 0) + 16 * node->children.size();
    for (const Node* seen = first;; seen = first) {
        node->next = first;
        if (head.compare_exchange_strong(first, node.get(), std::memory_order_acq_rel, std::memory_order_acquire))
            break;
        // Somebody else was first: what came since may be this kind.
        if (const Node* const known = find(first, seen, node->mesh); known != seen) return known;
    }
    count(bytes);
    nodeCount_.fetch_add(1, std::memory_order_relaxed);
    return node.release();
}

const NeighbourhoodGraph::Face& NeighbourhoodGraph::faceOf(std::uint32_t face) {
    if (const Face* const known = faces_[face].get()) return *known;
    FaceNeighbourhood here = neighbourhoodOf(topology_.mesh(), face, rules_.creaseMethod);
    for (std::uint32_t& p : here.points) p = topology_.controlPointOf(p);
    here.points.shrink_to_fit();
    count(here.points.size() * sizeof(std::uint32_t) + 64);
    const Node* const node = nodeOf(std::move(here.mesh));
    return faces_[face].offer(std::make_unique<const Face>(Face{node, std::move(here.points)}));
}

const NeighbourhoodGraph::Child& NeighbourhoodGraph::childOf(const Node& node, std::uint32_t which) {
    if (const Child* const known = node.children[which].get()) return *known;
    const RefinedNeighbourhood finer = refine(node.mesh, rules_);
    // One step tells of all children; of a polygon with many corners only the one that was asked for is kept.
    const std::uint32_t first = node.children.size() > 4 ? which : 0,
                        end = node.children.size() > 4 ? which + 1 : static_cast<std::uint32_t>(node.children.size());
    for (std::uint32_t c = first; c < end; ++c) {
        FaceNeighbourhood here = neighbourhoodOf(finer.mesh, finer.children[c], rules_.creaseMethod);
        auto child = std::make_unique<Child>();
        for (const std::uint32_t p : here.points) {
            for (std::uint32_t i = finer.points.begin[p]; i < finer.points.begin[p + 1]; ++i) {
                child->points.columns.push_back(finer.points.columns[i]);
                child->points.weights.push_back(finer.points.weights[i]);
            }
            child->points.endRow();
        }
        trim(child->points);
        count(child->points.columns.size() * 12 + here.points.size() * 4 + sizeof(Child));
        child->node = nodeOf(std::move(here.mesh));
        (void)node.children[c].offer(std::move(child));
    }
    return *node.children[which].get();
}

const CornerLimit& NeighbourhoodGraph::limitAt(const Node& node, std::uint32_t corner) {
    if (const CornerLimit* const known = node.corners[corner].get()) return *known;
    auto limit = std::make_unique<CornerLimit>();
    if (!isSettled(node.mesh, corner, rules_.scheme)) {
        const Child& child = childOf(node, corner);
        const std::uint32_t childCorner =
            rules_.scheme == SubdivisionScheme::kLoop || node.faceSize() == 4 ? corner : 0;
        limit->rows = product(limitAt(*child.node, childCorner).rows, child.points, node.pointCount());
        // Its tangents are those of a face half as large.
        for (std::uint32_t i = limit->rows.begin[1]; i < limit->rows.columns.size(); ++i) limit->rows.weights[i] *= 2;
    } else if (isDart(node.mesh, corner)) {
        *limit = dartLimit(node, corner);
    } else {
        *limit = cornerLimitOf(node.mesh, corner, rules_.scheme);
    }
    trim(limit->rows);
    count(limit->rows.columns.size() * 12 + sizeof(CornerLimit));
    return node.corners[corner].offer(std::move(limit));
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
        for (std::size_t i = 0; i < next.columns.size(); ++i)
            change = std::max(change, std::abs(next.weights[i] - before[next.columns[i]]));
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

const SparseRows* NeighbourhoodGraph::approximationOf(const Node& node) {
    const std::optional<SparseRows>* known = node.approximation.get();
    if (known == nullptr) {
        std::vector<const CornerLimit*> limits;
        const bool settled = isSettledEverywhere(node.mesh, rules_.scheme);
        for (std::uint32_t c = 0; settled && c < node.faceSize(); ++c) limits.push_back(&limitAt(node, c));
        known = &node.approximation.offer(std::make_unique<const std::optional<SparseRows>>(
            settled ? approximatePatchOf(node.mesh, rules_.scheme, limits) : std::nullopt));
    }
    return *known ? &**known : nullptr;
}

void NeighbourhoodGraph::shrink(std::size_t bytes) {
    if (bytes_.load(std::memory_order_relaxed) <= bytes) return;
    clear();
    faces_ = std::vector<Once<Face>>(topology_.mesh().faceCount());
    bytes_ = 0;
    nodeCount_ = 0;
}

}  // namespace tessera

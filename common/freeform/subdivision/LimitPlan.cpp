#include "common/freeform/subdivision/LimitPlan.h"

#include <algorithm>
#include <map>
#include <utility>

#include "common/freeform/subdivision/SampleTables.h"

namespace tessera {

Expected<std::shared_ptr<const LimitPlan>> LimitPlan::build(const ControlMesh& mesh) {
    Expected<SubdivisionTopology> topology = SubdivisionTopology::build(mesh);
    if (!topology) return tl::unexpected(topology.error());
    std::shared_ptr<LimitPlan> made(new LimitPlan(std::move(*topology)));
    made->findKinds();
    return std::shared_ptr<const LimitPlan>(std::move(made));
}

void LimitPlan::findKinds() {
    const TaggedMesh& mesh = topology_.mesh();
    for (std::uint32_t f = 0; f < mesh.faceCount(); ++f)
        hasPolygons_ = hasPolygons_ || mesh.faceSize(f) != (triangular() ? 3U : 4U);
    // It is let grow: what it holds of the kinds of this mesh is let go of here.
    std::optional<NeighbourhoodGraph> graph;
    if (topology_.scheme() != SubdivisionScheme::kBilinear) graph.emplace(topology_);
    std::map<const NeighbourhoodGraph::Node*, const SparseRows*> regular;
    std::map<std::pair<const NeighbourhoodGraph::Node*, std::uint32_t>, std::uint32_t> irregular;
    std::map<std::pair<std::size_t, std::uint32_t>, std::uint32_t> bilinear;
    faces_.resize(topology_.ptexFaceCount());
    for (std::uint32_t p = 0; p < faces_.size(); ++p) {
        const PtexFace face = topology_.ptexFace(p);
        if (!topology_.hasSurface(face.face)) continue;
        Face& here = faces_[p];
        here.isPart = face.corner != kNoIndex;
        here.pointsBegin = static_cast<std::uint32_t>(points_.size());
        lookAround(face, here);
        const auto kindAt = [&](std::uint32_t next, std::size_t columns) {
            if (next == kinds_.size()) {
                Kind& kind = kinds_.emplace_back();
                kind.ptex = p;
                kind.columns = static_cast<std::uint32_t>(columns);
                kind.isPart = here.isPart;
            }
            return next;
        };
        const auto next = static_cast<std::uint32_t>(kinds_.size());
        if (!graph) {
            const auto vertices = mesh.verticesOf(face.face);
            points_.insert(points_.end(), vertices.begin(), vertices.end());
            here.kind =
                kindAt(bilinear.try_emplace({vertices.size(), face.corner}, next).first->second, vertices.size());
        } else {
            const NeighbourhoodGraph::Face& base = graph->faceOf(face.face);
            points_.insert(points_.end(), base.points.begin(), base.points.end());
            if (!here.isPart && base.node->spline) {
                const SparseRows*& spline = regular[base.node];
                if (!spline)
                    spline = splines_.emplace_back(std::make_unique<const SparseRows>(*base.node->spline)).get();
                here.spline = spline;
            } else {
                here.kind =
                    kindAt(irregular.try_emplace({base.node, face.corner}, next).first->second, base.points.size());
            }
        }
        here.pointsEnd = static_cast<std::uint32_t>(points_.size());
    }
}

void LimitPlan::lookAround(const PtexFace& face, Face& here) const {
    const TaggedMesh& mesh = topology_.mesh();
    const auto isRim = [&](std::uint32_t edge) {
        const TaggedMesh::Edge& e = mesh.edges[edge];
        return e.sharpness != 0 || e.faces[0] == kNoIndex || e.faces[1] == kNoIndex ||
               topology_.scheme() == SubdivisionScheme::kBilinear;
    };
    const auto count = [&here](float sharpness) {
        if (!isInfinitelySharp(sharpness)) here.sharpest = std::max(here.sharpest, sharpness);
    };
    for (const std::uint32_t v : mesh.verticesOf(face.face)) {
        count(mesh.vertexSharpness[v]);
        bool rim = false;
        for (const std::uint32_t e : mesh.edgesAt(v)) {
            count(mesh.edges[e].sharpness);
            rim = rim || isRim(e);
        }
        const auto edges = static_cast<std::uint32_t>(mesh.edgesAt(v).size());
        here.most = std::max(here.most, rim ? 2 * (std::max(edges, 2U) - 1) : edges);
    }
    const auto edges = mesh.edgesOf(face.face);
    const auto mark = [&](std::size_t edge, unsigned side) {
        if (isRim(edges[edge])) here.rims |= static_cast<std::uint8_t>(1U << side);
    };
    if (face.corner == kNoIndex) {
        for (unsigned k = 0; k < edges.size(); ++k) mark(k, triangular() && k == 2 ? 3 : k);
    } else {
        mark(face.corner, 0);
        mark((face.corner + edges.size() - 1) % edges.size(), 3);
    }
}

std::size_t LimitPlan::weightsOf(std::uint32_t kind, unsigned log2Segments) const {
    return gridSamples(std::size_t{1} << log2Segments, triangular()) * 3 * kinds_[kind].columns;
}

int LimitPlan::finestLevel(std::size_t mostWeights) const {
    for (int level = kFinestLevel; level >= 0; --level) {
        std::size_t sum = 0;
        for (std::uint32_t k = 0; k < kinds_.size(); ++k)
            sum += weightsOf(k, static_cast<unsigned>(std::max(0, kinds_[k].isPart ? level - 1 : level)));
        if (sum <= mostWeights) return level;
    }
    return -1;
}

std::size_t LimitPlan::bytes() const {
    std::size_t sum = faces_.size() * sizeof(Face) + points_.size() * 4 + kinds_.size() * sizeof(Kind) +
                      tableBytes_.load(std::memory_order_relaxed);
    for (const auto& spline : splines_) sum += spline->weights.size() * 12;
    // Topology: vertices, edges and faces of a mesh are about as many.
    return sum + topology_.mesh().edges.size() * 120;
}

const LimitPlan::Table* LimitPlan::keep(const NeighbourhoodGraph::Once<Table>& place, std::vector<double> weights,
                                        std::size_t columns) const {
    tableBytes_.fetch_add(weights.size() * sizeof(double), std::memory_order_relaxed);
    return &place.offer(std::make_unique<const Table>(Table{.columns = columns, .weights = std::move(weights)}));
}

const LimitPlan::Table* LimitPlan::Tables::of(const Face& face, unsigned log2Segments) {
    const std::size_t segments = std::size_t{1} << log2Segments;
    if (face.spline) {
        if (!plan_.triangular()) return nullptr;
        const auto& place = plan_.box_[log2Segments];
        return place.get() ? place.get() : plan_.keep(place, boxSplineTable(segments), 12);
    }
    const Kind& kind = plan_.kinds_[face.kind];
    const auto& place = kind.tables[log2Segments];
    if (const Table* known = place.get()) return known;
    const PtexFace ptex = plan_.topology_.ptexFace(kind.ptex);
    if (plan_.topology_.scheme() == SubdivisionScheme::kBilinear)
        return plan_.keep(place, bilinearTable(kind.columns, ptex.corner, segments), kind.columns);
    if (!graph_) graph_.emplace(plan_.topology_);
    const NeighbourhoodGraph::Node& node = *graph_->faceOf(ptex.face).node;
    return plan_.keep(place,
                      ptex.corner == kNoIndex ? sampleTable(*graph_, node, segments)
                                              : polygonPartTable(*graph_, node, ptex.corner, segments),
                      kind.columns);
}

}  // namespace tessera

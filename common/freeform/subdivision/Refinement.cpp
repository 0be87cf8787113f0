#include "common/freeform/subdivision/Refinement.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <numbers>
#include <numeric>

#include "common/freeform/subdivision/PortableTrigonometry.h"

namespace tessera {
namespace {

bool isSharp(float sharpness) {
    return sharpness > 0;
}
bool isSemiSharp(float sharpness) {
    return isSharp(sharpness) && !isInfinitelySharp(sharpness);
}

float worn(float sharpness) {
    if (isInfinitelySharp(sharpness)) return sharpness;
    return sharpness > 1 ? sharpness - 1 : 0;
}

/// Faces see the edges at their vertices in another order each; what they make of them has to be the same to the last
/// bit.
float sumInAnyOrder(std::vector<float> values) {
    std::sort(values.begin(), values.end());
    return std::accumulate(values.begin(), values.end(), 0.0F);
}

/// Of the edges at a vertex, after one refinement.
std::vector<float> wornEdges(const std::vector<float>& sharpness, CreaseMethod method) {
    std::vector<float> out, semiSharp;
    std::copy_if(sharpness.begin(), sharpness.end(), std::back_inserter(semiSharp), isSemiSharp);
    const std::size_t count = semiSharp.size();
    const float sum = method == CreaseMethod::kUniform ? 0 : sumInAnyOrder(std::move(semiSharp));
    for (const float s : sharpness) {
        if (method == CreaseMethod::kUniform || count < 2 || !isSemiSharp(s)) {
            out.push_back(worn(s));
        } else {
            const float others = (sum - s) / static_cast<float>(count - 1);
            out.push_back(std::max(0.75F * s + 0.25F * others - 1, 0.0F));
        }
    }
    return out;
}

enum class VertexRule { kSmooth, kCrease, kCorner };
/// A vertex with one sharp edge, a dart, is smooth.
VertexRule ruleOf(float vertexSharpness, const std::vector<float>& edgeSharpness) {
    if (isSharp(vertexSharpness)) return VertexRule::kCorner;
    const auto sharp = std::count_if(edgeSharpness.begin(), edgeSharpness.end(), isSharp);
    return sharp > 2 ? VertexRule::kCorner : sharp == 2 ? VertexRule::kCrease : VertexRule::kSmooth;
}

/// How much the rule before counts where it gives way: by the mean of what runs out.
double blendOf(float vertexSharpness, const std::vector<float>& before, const std::vector<float>& after) {
    std::vector<float> gone;
    if (isSharp(vertexSharpness) && !isSharp(worn(vertexSharpness))) gone.push_back(vertexSharpness);
    for (std::size_t i = 0; i < before.size(); ++i) {
        if (isSharp(before[i]) && !isSharp(after[i])) gone.push_back(before[i]);
    }
    const auto count = static_cast<float>(gone.size());
    return gone.empty() ? 0 : std::min(1.0F, sumInAnyOrder(std::move(gone)) / count);
}

class Refiner {
public:
    Refiner(const TaggedMesh& mesh, const RefinementRules& rules)
        : mesh_(mesh),
          rules_(rules),
          sum_(mesh.vertexCount()),
          corners_(mesh.faceSize(0)),
          edgePoint_(corners_),
          facePoint_(edgePoint_ + static_cast<std::uint32_t>(mesh.edges.size())),
          childEdges_(mesh.edges.size(), {kNoIndex, kNoIndex}) {}

    RefinedNeighbourhood make() {
        for (std::uint32_t c = 0; c < corners_; ++c) sectors_.push_back(sectorOf(mesh_, 0, c));
        addVertexPoints();
        for (std::uint32_t e = 0; e < mesh_.edges.size(); ++e) addEdgePoint(e);
        if (!isLoop()) {
            for (std::uint32_t f = 0; f < mesh_.faceCount(); ++f) {
                addFacePoint(f, 1);
                sum_.moveInto(out_.points);
            }
        }
        out_.mesh.vertexSharpness.resize(out_.points.count(), 0);
        edgesAt_.resize(out_.points.count());
        addEdgesOfCorners();
        addStubsOfOthers();
        addFaces();
        for (const auto& edges : edgesAt_) {
            out_.mesh.vertexEdges.insert(out_.mesh.vertexEdges.end(), edges.begin(), edges.end());
            out_.mesh.vertexEdgeBegin.push_back(static_cast<std::uint32_t>(out_.mesh.vertexEdges.size()));
        }
        return std::move(out_);
    }

private:
    [[nodiscard]] bool isLoop() const { return rules_.scheme == SubdivisionScheme::kLoop; }

    void addFacePoint(std::uint32_t face, double weight) {
        const double each = weight / mesh_.faceSize(face);
        for (const std::uint32_t v : mesh_.verticesOf(face)) sum_.add(v, each);
    }

    void addRule(VertexRule rule, std::uint32_t corner, const std::vector<float>& sharpness, double weight) {
        if (weight == 0) return;
        if (rule == VertexRule::kCorner) return sum_.add(corner, weight);
        if (rule == VertexRule::kCrease) {
            sum_.add(corner, 0.75 * weight);
            const auto edges = mesh_.edgesAt(corner);
            for (std::size_t i = 0; i < edges.size(); ++i) {
                if (isSharp(sharpness[i])) sum_.add(mesh_.otherEnd(edges[i], corner), 0.125 * weight);
            }
            return;
        }
        const Sector& sector = sectors_[corner];
        const auto n = static_cast<double>(sector.faces.size());
        const double each = isLoop() ? loopNeighbourWeight(sector.faces.size()) : 1 / (n * n);
        sum_.add(corner, weight * (isLoop() ? 1 - n * each : (n - 2) / n));
        for (const Sector::Face& f : sector.faces) {
            const auto vertices = mesh_.verticesOf(f.face);
            sum_.add(vertices[(f.at + 1) % vertices.size()], weight * each);
            if (!isLoop()) addFacePoint(f.face, weight * each);
        }
    }

    void addVertexPoints() {
        for (std::uint32_t v = 0; v < mesh_.vertexCount(); ++v) {
            std::vector<float> before;
            for (const std::uint32_t e : mesh_.edgesAt(v)) before.push_back(mesh_.edges[e].sharpness);
            wornAt_.push_back(wornEdges(before, rules_.creaseMethod));
        }
        for (std::uint32_t c = 0; c < corners_; ++c) {
            std::vector<float> before;
            for (const std::uint32_t e : mesh_.edgesAt(c)) before.push_back(mesh_.edges[e].sharpness);
            const std::vector<float>& after = wornAt_[c];
            const float sharpness = mesh_.vertexSharpness[c];
            const VertexRule rule = ruleOf(sharpness, before), next = ruleOf(worn(sharpness), after);
            if (rule == next || rule == VertexRule::kSmooth) {
                addRule(rule, c, before, 1);
            } else {
                const double blend = blendOf(sharpness, before, after);
                addRule(rule, c, before, blend);
                addRule(next, c, after, 1 - blend);
            }
            sum_.moveInto(out_.points);
            out_.mesh.vertexSharpness.push_back(worn(sharpness));
        }
    }

    /// What is left of an edge's sharpness beside one of its ends.
    float wornBeside(std::uint32_t edge, std::uint32_t vertex) const {
        const auto edges = mesh_.edgesAt(vertex);
        const auto found = std::find(edges.begin(), edges.end(), edge);
        return found != edges.end() ? wornAt_[vertex][static_cast<std::size_t>(found - edges.begin())]
                                    : worn(mesh_.edges[edge].sharpness);
    }

    /// How much an edge's middle is that of its ends.
    double creaseWeight(std::uint32_t edge) const {
        const TaggedMesh::Edge& e = mesh_.edges[edge];
        if (!isSharp(e.sharpness)) return 0;
        if (e.sharpness >= 1) return 1;
        if (rules_.creaseMethod == CreaseMethod::kChaikin && isSharp(wornBeside(edge, e.vertices[0])) &&
            isSharp(wornBeside(edge, e.vertices[1])))
            return 1;
        return e.sharpness;
    }

    void addEdgePoint(std::uint32_t edge) {
        const TaggedMesh::Edge& e = mesh_.edges[edge];
        if (e.vertices[1] != kNoIndex) {
            const bool known = e.faces[1] != kNoIndex;
            const double crease = known ? creaseWeight(edge) : 1;
            double ends = 0.5 * crease;
            if (crease < 1) {
                if (isLoop()) {
                    ends += 0.375 * (1 - crease);
                    for (const std::uint32_t f : e.faces) addOpposite(f, e, 0.125 * (1 - crease));
                } else {
                    const double face = 0.5 * (triangleWeight(e.faces[0]) + triangleWeight(e.faces[1]));
                    ends += 0.5 * (1 - 2 * face) * (1 - crease);
                    for (const std::uint32_t f : e.faces) addFacePoint(f, face * (1 - crease));
                }
            }
            for (const std::uint32_t v : e.vertices) sum_.add(v, ends);
        }
        sum_.moveInto(out_.points);
    }

    double triangleWeight(std::uint32_t face) const {
        return rules_.triangles == TriangleRule::kSmooth && mesh_.faceSize(face) == 3 ? 0.47 : 0.25;
    }

    void addOpposite(std::uint32_t face, const TaggedMesh::Edge& e, double weight) {
        for (const std::uint32_t v : mesh_.verticesOf(face)) {
            if (v != e.vertices[0] && v != e.vertices[1]) return sum_.add(v, weight);
        }
    }

    std::uint32_t newEdge(std::uint32_t a, std::uint32_t b, float sharpness) {
        out_.mesh.edges.push_back({.vertices = {a, b}, .sharpness = sharpness});
        return static_cast<std::uint32_t>(out_.mesh.edges.size() - 1);
    }

    /// The halves of edges that begin at corners.
    void addEdgesOfCorners() {
        for (std::uint32_t c = 0; c < corners_; ++c) {
            const auto edges = mesh_.edgesAt(c);
            for (std::size_t i = 0; i < edges.size(); ++i) {
                const std::uint32_t e = edges[i];
                const bool open = mesh_.edges[e].vertices[1] == kNoIndex;
                if (open && !isSharp(wornAt_[c][i])) continue;
                const std::uint32_t half = newEdge(c, open ? kNoIndex : edgePoint_ + e, wornAt_[c][i]);
                edgesAt_[c].push_back(half);
                if (!open) {
                    edgesAt_[edgePoint_ + e].push_back(half);
                    childEdges_[e][mesh_.edges[e].vertices[0] == c ? 0 : 1] = half;
                }
            }
        }
    }
    /// Other vertices are not kept, but with Chaikin's method what remains sharp beside them counts at the middles of
    /// their edges.
    void addStubsOfOthers() {
        for (std::uint32_t v = corners_; v < mesh_.vertexCount(); ++v) {
            const auto edges = mesh_.edgesAt(v);
            for (std::size_t i = 0; i < edges.size(); ++i) {
                if (mesh_.edges[edges[i]].vertices[1] == kNoIndex || !isSharp(wornAt_[v][i])) continue;
                const std::uint32_t middle = edgePoint_ + edges[i];
                edgesAt_[middle].push_back(newEdge(middle, kNoIndex, wornAt_[v][i]));
            }
        }
    }
    std::uint32_t halfAt(std::uint32_t edge, std::uint32_t vertex) const {
        return edge == kNoIndex ? kNoIndex : childEdges_[edge][mesh_.edges[edge].vertices[0] == vertex ? 0 : 1];
    }

    /// From the middle of a face's edge to its centre; in Loop's scheme to the middle of the edge before.
    std::uint32_t innerEdge(std::uint32_t face, std::uint32_t at) {
        const auto [found, isNew] = innerEdges_.try_emplace(std::pair(face, at), kNoIndex);
        if (!isNew) return found->second;
        const auto edges = mesh_.edgesOf(face);
        const std::uint32_t from = edgePoint_ + edges[at];
        const std::uint32_t to =
            isLoop() ? edgePoint_ + edges[(at + edges.size() - 1) % edges.size()] : facePoint_ + face;
        found->second = newEdge(from, to, 0);
        edgesAt_[from].push_back(found->second);
        edgesAt_[to].push_back(found->second);
        return found->second;
    }

    std::uint32_t addFace(std::initializer_list<std::uint32_t> vertices, std::initializer_list<std::uint32_t> edges,
                          std::uint32_t rotation) {
        TaggedMesh& m = out_.mesh;
        const auto face = static_cast<std::uint32_t>(m.faceCount());
        const std::size_t size = vertices.size(), begin = m.faceVertices.size();
        m.faceVertices.resize(begin + size);
        m.faceEdges.resize(begin + size);
        for (std::size_t i = 0; i < size; ++i) {
            m.faceVertices[begin + (i + rotation) % size] = vertices.begin()[i];
            const std::uint32_t e = edges.begin()[i];
            m.faceEdges[begin + (i + rotation) % size] = e;
            if (e != kNoIndex) m.addFaceOf(e, face);
        }
        m.faceBegin.push_back(static_cast<std::uint32_t>(begin + size));
        return face;
    }

    void addFaces() {
        for (std::uint32_t c = 0; c < corners_; ++c) {
            for (const Sector::Face& f : sectors_[c].faces) {
                const std::uint32_t child = addCornerFace(f.face, f.at);
                if (f.face == 0) out_.children.push_back(child);
            }
        }
        if (!isLoop()) return;
        for (std::uint32_t f = 0; f < mesh_.faceCount(); ++f) {
            const auto edges = mesh_.edgesOf(f);
            if (std::find(edges.begin(), edges.end(), kNoIndex) != edges.end()) continue;
            const std::uint32_t child = addFace({edgePoint_ + edges[1], edgePoint_ + edges[2], edgePoint_ + edges[0]},
                                                {innerEdge(f, 2), innerEdge(f, 0), innerEdge(f, 1)}, 0);
            if (f == 0) out_.children.push_back(child);
        }
    }

    std::uint32_t addCornerFace(std::uint32_t face, std::uint32_t at) {
        const auto edges = mesh_.edgesOf(face), vertices = mesh_.verticesOf(face);
        const auto size = static_cast<std::uint32_t>(edges.size());
        const std::uint32_t before = (at + size - 1) % size, vertex = vertices[at];
        const std::uint32_t out = edges[at], in = edges[before];
        if (isLoop()) {
            return addFace({vertex, edgePoint_ + out, edgePoint_ + in},
                           {halfAt(out, vertex), innerEdge(face, at), halfAt(in, vertex)}, at);
        }
        return addFace({vertex, edgePoint_ + out, facePoint_ + face, edgePoint_ + in},
                       {halfAt(out, vertex), innerEdge(face, at), innerEdge(face, before), halfAt(in, vertex)},
                       size == 4 ? at : 0);
    }

    const TaggedMesh& mesh_;
    const RefinementRules& rules_;
    RowSum sum_;
    const std::uint32_t corners_, edgePoint_, facePoint_;
    std::vector<std::array<std::uint32_t, 2>> childEdges_;
    std::vector<Sector> sectors_;
    std::vector<std::vector<float>> wornAt_;
    std::vector<std::vector<std::uint32_t>> edgesAt_;
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> innerEdges_;
    RefinedNeighbourhood out_;
};

}  // namespace

double loopNeighbourWeight(std::size_t valence) {
    const auto n = static_cast<double>(valence);
    const double middle = 0.375 + 0.25 * portableCos(2 * std::numbers::pi / n);
    return (0.625 - middle * middle) / n;
}

RefinedNeighbourhood refine(const TaggedMesh& mesh, const RefinementRules& rules) {
    return Refiner(mesh, rules).make();
}

}  // namespace tessera

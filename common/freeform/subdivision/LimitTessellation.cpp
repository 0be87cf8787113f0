#include "common/freeform/subdivision/LimitTessellation.h"

#include <immintrin.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <string>
#include <utility>

#include "common/freeform/subdivision/SampleTables.h"

namespace tessera {

/// Which corners of faces have one normal: joined across edges that are not infinitely sharp.
class NormalGroups {
public:
    explicit NormalGroups(const SubdivisionTopology& topology) : parent_(topology.mesh().faceVertices.size()) {
        std::iota(parent_.begin(), parent_.end(), 0U);
        if (topology.scheme() == SubdivisionScheme::kBilinear) return;
        const TaggedMesh& mesh = topology.mesh();
        for (std::uint32_t f = 0; f < mesh.faceCount(); ++f) {
            for (std::uint32_t i = 0; i < mesh.faceSize(f); ++i) {
                const std::uint32_t e = mesh.edgesOf(f)[i];
                if (!canCross(mesh, e) || mesh.edges[e].faces[0] != f || !topology.hasSurface(mesh.edges[e].faces[1])) continue;
                const std::uint32_t g = mesh.edges[e].faces[1];
                const auto edges = mesh.edgesOf(g);
                const auto j = static_cast<std::uint32_t>(std::find(edges.begin(), edges.end(), e) - edges.begin());
                joinAt(mesh, f, i, g, (j + 1) % mesh.faceSize(g));
                joinAt(mesh, f, (i + 1) % mesh.faceSize(f), g, j);
            }
        }
    }
    [[nodiscard]] static bool canCross(const TaggedMesh& mesh, std::uint32_t edge) {
        const TaggedMesh::Edge& e = mesh.edges[edge];
        return !isInfinitelySharp(e.sharpness) && e.faces[0] != kNoIndex && e.faces[1] != kNoIndex;
    }
    [[nodiscard]] std::uint32_t of(std::uint32_t corner) {
        while (parent_[corner] != corner) corner = parent_[corner] = parent_[parent_[corner]];
        return corner;
    }

private:
    void joinAt(const TaggedMesh& mesh, std::uint32_t f, std::uint32_t i, std::uint32_t g, std::uint32_t j) {
        // At a fixed corner each face has tangents of its own (CornerLimit.h).
        if (isFixedCorner(mesh, mesh.verticesOf(f)[i])) return;
        const std::uint32_t a = of(mesh.faceBegin[f] + i), b = of(mesh.faceBegin[g] + j);
        parent_[std::max(a, b)] = std::min(a, b);
    }
    std::vector<std::uint32_t> parent_;
};

namespace {

Vec3d pointAt(std::span<const float> points, std::uint32_t i) { return {points[3 * i], points[3 * i + 1], points[3 * i + 2]}; }

void store(std::span<float> to, std::uint32_t vertex, const Vec3d& value) {
    for (int k = 0; k < 3; ++k) to[3 * vertex + static_cast<std::uint32_t>(k)] = static_cast<float>(value[k]);
}

/// Of the triangles of a grid beside a sample.
Vec3d normalOfFan(std::span<const Vec3d> grid, std::size_t i, std::size_t j, std::size_t n, bool triangular) {
    static constexpr std::array<std::array<int, 2>, 8> kAround{{{1, 0}, {1, 1}, {0, 1}, {-1, 1}, {-1, 0}, {-1, -1}, {0, -1}, {1, -1}}};
    static constexpr std::array<std::array<int, 2>, 6> kAroundTriangular{{{1, 0}, {0, 1}, {-1, 1}, {-1, 0}, {0, -1}, {1, -1}}};
    const std::span<const std::array<int, 2>> around = triangular ? std::span<const std::array<int, 2>>(kAroundTriangular) : std::span<const std::array<int, 2>>(kAround);
    const Vec3d& here = grid[gridSample(i, j, n, triangular)];
    const auto spoke = [&](std::size_t k) -> std::optional<Vec3d> {
        const long x = static_cast<long>(i) + around[k][0], y = static_cast<long>(j) + around[k][1], most = static_cast<long>(n);
        if (x < 0 || y < 0 || x > most || y > most || (triangular && x + y > most)) return std::nullopt;
        return Vec3d(grid[gridSample(static_cast<std::size_t>(x), static_cast<std::size_t>(y), n, triangular)] - here);
    };
    Vec3d sum = Vec3d::Zero();
    for (std::size_t k = 0; k < around.size(); ++k) {
        const auto a = spoke(k), b = spoke((k + 1) % around.size());
        if (a && b) sum += a->cross(*b);
    }
    const double length = sum.norm();
    return length > 0 && std::isfinite(1 / length) ? Vec3d(sum / length) : Vec3d::UnitZ();
}

}  // namespace

class LimitTessellation::Builder {
public:
    Builder(LimitTessellation& out, const Limits& limits) : out_(out), limits_(limits), mesh_(out.topology_.mesh()), groups_(out.topology_) {
        if (out.topology_.scheme() != SubdivisionScheme::kBilinear) graph_.emplace(out.topology_);
        corners_.assign(mesh_.faceVertices.size(), kNoIndex);
        sides_.assign(mesh_.faceVertices.size(), kNoIndex);
        spokes_.assign(mesh_.faceVertices.size(), kNoIndex);
        sharedEdges_.assign(mesh_.edges.size(), kNoIndex);
        edgePositions_.assign(mesh_.edges.size(), kNoIndex);
        vertexPositions_.assign(out.topology_.controlPointCount(), kNoIndex);
        middles_.assign(mesh_.faceCount(), kNoIndex);
    }

    Expected<void> run(int level) {
        const SubdivisionTopology& topology = out_.topology_;
        const bool triangular = out_.triangular();
        std::size_t triangles = 0, part = std::size_t{1} << (2 * level);
        bool polygons = false;
        for (std::uint32_t f = 0; f < mesh_.faceCount(); ++f) polygons = polygons || mesh_.faceSize(f) != (triangular ? 3U : 4U);
        if (polygons && level == 0) level = 1, part = 4;
        out_.level_ = level;
        for (std::uint32_t f = 0; f < mesh_.faceCount(); ++f) {
            if (!topology.hasSurface(f)) continue;
            const std::size_t size = mesh_.faceSize(f);
            triangles += triangular ? part : size == 4 ? 2 * part : size * part / 2;
        }
        if (triangles > limits_.mostTriangles)
            return fail(ErrorCode::kLimit, "level " + std::to_string(level) + " makes " + std::to_string(triangles) + " triangles, and " + std::to_string(limits_.mostTriangles) + " may be: take a lower level");
        if (Expected<void> few = countWeights(); !few) return few;
        out_.indices_.reserve(3 * triangles);
        out_.faces_.resize(topology.ptexFaceCount());
        for (std::size_t p = 0; p < topology.ptexFaceCount(); ++p) {
            const PtexFace face = topology.ptexFace(p);
            if (!topology.hasSurface(face.face)) continue;
            Face& here = out_.faces_[p];
            here.segments = 1U << (face.corner == kNoIndex ? level : level - 1);
            lookAround(face, here);
            if (Expected<void> known = findWeights(face, here); !known) return known;
            const std::vector<std::uint32_t> grid = numberGrid(face, here);
            appendTriangles(grid, here.segments);
        }
        out_.vertexCount_ = taken_.size();
        return {};
    }

private:
    void lookAround(const PtexFace& face, Face& here) const {
        const auto count = [&here](float sharpness) {
            if (!isInfinitelySharp(sharpness)) here.sharpest = std::max(here.sharpest, sharpness);
        };
        for (const std::uint32_t v : mesh_.verticesOf(face.face)) {
            count(mesh_.vertexSharpness[v]);
            const auto edges = mesh_.edgesAt(v);
            here.most = std::max(here.most, static_cast<std::uint32_t>(edges.size()));
            for (const std::uint32_t e : edges) count(mesh_.edges[e].sharpness);
        }
        const auto edges = mesh_.edgesOf(face.face);
        const auto mark = [&](std::size_t edge, unsigned side) {
            const TaggedMesh::Edge& e = mesh_.edges[edges[edge]];
            const bool smooth = e.sharpness == 0 && e.faces[0] != kNoIndex && e.faces[1] != kNoIndex && graph_;
            if (!smooth) here.rims |= static_cast<std::uint8_t>(1U << side);
        };
        if (face.corner == kNoIndex) {
            for (unsigned k = 0; k < edges.size(); ++k) mark(k, out_.triangular() && k == 2 ? 3 : k);
        } else {
            mark(face.corner, 0);
            mark((face.corner + edges.size() - 1) % edges.size(), 3);
        }
    }
    /// Before any is worked out: a refusal is to cost little.
    Expected<void> countWeights() {
        if (!graph_) return {};
        std::set<std::pair<const NeighbourhoodGraph::Node*, std::uint32_t>> kinds;
        std::size_t weights = 0;
        for (std::size_t p = 0; p < out_.topology_.ptexFaceCount(); ++p) {
            const PtexFace face = out_.topology_.ptexFace(p);
            if (!out_.topology_.hasSurface(face.face)) continue;
            const NeighbourhoodGraph::Face& base = graph_->faceOf(face.face);
            if ((face.corner == kNoIndex && base.node->spline) || !kinds.insert({base.node, face.corner}).second) continue;
            weights += gridSamples(1U << (face.corner == kNoIndex ? out_.level_ : out_.level_ - 1), out_.triangular()) * 3 * base.points.size();
            if (weights > limits_.mostWeights) return tooMany();
        }
        return {};
    }
    Expected<void> findWeights(const PtexFace& face, Face& here) {
        here.pointsBegin = static_cast<std::uint32_t>(out_.points_.size());
        const SubdivisionTopology& topology = out_.topology_;
        if (!graph_) {
            const auto vertices = mesh_.verticesOf(face.face);
            out_.points_.insert(out_.points_.end(), vertices.begin(), vertices.end());
            here.pointsEnd = static_cast<std::uint32_t>(out_.points_.size());
            const Table*& known = bilinear_[{vertices.size(), face.corner}];
            if (!known) known = keep(bilinearTable(vertices.size(), face.corner, here.segments), vertices.size());
            here.table = known;
            return enough();
        }
        // The graph is let grow: what it holds of the kinds of this mesh is let go of with the builder.
        const NeighbourhoodGraph::Face& base = graph_->faceOf(face.face);
        out_.points_.insert(out_.points_.end(), base.points.begin(), base.points.end());
        here.pointsEnd = static_cast<std::uint32_t>(out_.points_.size());
        if (face.corner == kNoIndex && base.node->spline) {
            const SparseRows*& spline = regular_[base.node];
            if (!spline) {
                out_.splines_.push_back(std::make_unique<const SparseRows>(*base.node->spline));
                spline = out_.splines_.back().get();
            }
            here.spline = spline;
            if (topology.scheme() == SubdivisionScheme::kLoop) {
                if (!box_) box_ = keep(boxSplineTable(here.segments), 12);
                here.table = box_;
            }
            return {};
        }
        const Table*& known = irregular_[{base.node, face.corner}];
        if (!known) {
            known = keep(face.corner == kNoIndex ? sampleTable(*graph_, *base.node, here.segments) : polygonPartTable(*graph_, *base.node, face.corner, here.segments), base.points.size());
        }
        here.table = known;
        return enough();
    }
    const Table* keep(std::vector<double> weights, std::size_t columns) {
        weights_ += weights.size();
        out_.tables_.push_back(std::make_unique<const Table>(Table{.columns = columns, .weights = std::move(weights)}));
        return out_.tables_.back().get();
    }
    [[nodiscard]] Expected<void> enough() const {
        if (weights_ <= limits_.mostWeights) return {};
        return tooMany();
    }
    [[nodiscard]] Expected<void> tooMany() const {
        return fail(ErrorCode::kLimit, "the mesh has so many kinds of irregular faces that level " + std::to_string(out_.level_) + " needs more than " + std::to_string(limits_.mostWeights) + " weights: take a lower level");
    }

    std::uint32_t allocate(std::size_t count) {
        const auto first = static_cast<std::uint32_t>(taken_.size());
        taken_.resize(taken_.size() + count, false);
        return first;
    }
    /// A side's inner vertices: `forward` in the direction of the edge, `k` from 1 on, of `segments` of the whole edge.
    std::uint32_t onSide(std::uint32_t face, std::uint32_t side, std::uint32_t k, std::uint32_t segments) {
        const std::uint32_t corner = mesh_.faceBegin[face] + side, e = mesh_.faceEdges[corner];
        const bool crossable = graph_ && NormalGroups::canCross(mesh_, e);
        std::uint32_t& block = crossable ? sharedEdges_[e] : sides_[corner];
        const bool isNew = block == kNoIndex;
        if (isNew) block = allocate(segments - 1);
        if (isNew && edgePositions_[e] == kNoIndex) edgePositions_[e] = block;
        else if (isNew)
            for (std::uint32_t i = 0; i + 1 < segments; ++i) out_.copies_.push_back({block + i, edgePositions_[e] + i});
        const bool forward = mesh_.edges[e].vertices[0] == mesh_.faceVertices[corner];
        return block + (forward ? k : segments - k) - 1;
    }
    std::uint32_t atCorner(std::uint32_t face, std::uint32_t i) {
        const std::uint32_t corner = mesh_.faceBegin[face] + i;
        std::uint32_t& vertex = corners_[groups_.of(corner)];
        if (vertex != kNoIndex) return vertex;
        vertex = allocate(1);
        std::uint32_t& first = vertexPositions_[out_.topology_.controlPointOf(mesh_.faceVertices[corner])];
        if (first == kNoIndex) first = vertex;
        else out_.copies_.push_back({vertex, first});
        return vertex;
    }
    static std::uint32_t inBlock(std::uint32_t& block, std::uint32_t k, std::uint32_t count, Builder& builder) {
        if (block == kNoIndex) block = builder.allocate(count);
        return block + k;
    }

    /// The vertices of a face's grid; what nobody has evaluated yet is its own.
    std::vector<std::uint32_t> numberGrid(const PtexFace& face, Face& here) {
        const std::uint32_t n = here.segments;
        const bool triangular = out_.triangular();
        std::vector<std::uint32_t> grid;
        here.ownedBegin = static_cast<std::uint32_t>(out_.owned_.size());
        for (std::uint32_t j = 0; j <= n; ++j) {
            for (std::uint32_t i = 0; i <= (triangular ? n - j : n); ++i) {
                const std::uint32_t vertex = triangular ? ofTriangle(face.face, i, j, n) : face.corner == kNoIndex ? ofQuadrilateral(face.face, i, j, n) : ofPart(face, i, j, n);
                if (!taken_[vertex]) {
                    taken_[vertex] = true;
                    out_.owned_.push_back({static_cast<std::uint32_t>(grid.size()), vertex});
                }
                grid.push_back(vertex);
            }
        }
        here.ownedEnd = static_cast<std::uint32_t>(out_.owned_.size());
        return grid;
    }
    std::uint32_t ofTriangle(std::uint32_t face, std::uint32_t i, std::uint32_t j, std::uint32_t n) {
        if (j == 0) return i == 0 ? atCorner(face, 0) : i == n ? atCorner(face, 1) : onSide(face, 0, i, n);
        if (j == n) return atCorner(face, 2);
        if (i == 0) return onSide(face, 2, n - j, n);
        if (i + j == n) return onSide(face, 1, j, n);
        return allocate(1);
    }
    std::uint32_t ofQuadrilateral(std::uint32_t face, std::uint32_t i, std::uint32_t j, std::uint32_t n) {
        if (j == 0) return i == 0 ? atCorner(face, 0) : i == n ? atCorner(face, 1) : onSide(face, 0, i, n);
        if (j == n) return i == 0 ? atCorner(face, 3) : i == n ? atCorner(face, 2) : onSide(face, 2, n - i, n);
        if (i == 0) return onSide(face, 3, n - j, n);
        if (i == n) return onSide(face, 1, j, n);
        return allocate(1);
    }
    /// Of the part around a polygon's corner: its far corner is the polygon's middle, spokes lead there from the edges' middles.
    std::uint32_t ofPart(const PtexFace& at, std::uint32_t i, std::uint32_t j, std::uint32_t n) {
        const std::uint32_t size = mesh_.faceSize(at.face), before = (at.corner + size - 1) % size, begin = mesh_.faceBegin[at.face];
        if (i == n && j == n) return inBlock(middles_[at.face], 0, 1, *this);
        if (j == 0) return i == 0 ? atCorner(at.face, at.corner) : onSide(at.face, at.corner, i, 2 * n);
        if (i == 0) return onSide(at.face, before, 2 * n - j, 2 * n);
        if (i == n) return inBlock(spokes_[begin + at.corner], j - 1, n - 1, *this);
        if (j == n) return inBlock(spokes_[begin + before], i - 1, n - 1, *this);
        return allocate(1);
    }

    void appendTriangles(const std::vector<std::uint32_t>& grid, std::uint32_t n) {
        const bool triangular = out_.triangular();
        const auto at = [&](std::uint32_t i, std::uint32_t j) { return grid[gridSample(i, j, n, triangular)]; };
        const auto append = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) { out_.indices_.insert(out_.indices_.end(), {a, b, c}); };
        for (std::uint32_t j = 0; j < n; ++j) {
            for (std::uint32_t i = 0; i < (triangular ? n - j : n); ++i) {
                if (triangular) {
                    append(at(i, j), at(i + 1, j), at(i, j + 1));
                    if (i + j + 2 <= n) append(at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
                } else {
                    append(at(i, j), at(i + 1, j), at(i + 1, j + 1));
                    append(at(i, j), at(i + 1, j + 1), at(i, j + 1));
                }
            }
        }
    }

    LimitTessellation& out_;
    const Limits& limits_;
    const TaggedMesh& mesh_;
    NormalGroups groups_;
    std::optional<NeighbourhoodGraph> graph_;  ///< not of the bilinear scheme
    std::vector<std::uint32_t> corners_, sides_, spokes_, sharedEdges_, edgePositions_, vertexPositions_, middles_;
    std::vector<bool> taken_;  ///< by vertex: a face evaluates it
    std::size_t weights_ = 0;
    const Table* box_ = nullptr;
    std::map<const NeighbourhoodGraph::Node*, const SparseRows*> regular_;
    std::map<std::pair<const NeighbourhoodGraph::Node*, std::uint32_t>, const Table*> irregular_;
    std::map<std::pair<std::size_t, std::uint32_t>, const Table*> bilinear_;
};

Expected<std::shared_ptr<const LimitTessellation>> LimitTessellation::build(const ControlMesh& mesh, int level, const Limits& limits) {
    if (level < 0 || level > kFinestLevel) return fail(ErrorCode::kBadInput, "a level is from 0 to " + std::to_string(kFinestLevel));
    Expected<SubdivisionTopology> topology = SubdivisionTopology::build(mesh);
    if (!topology) return tl::unexpected(topology.error());
    std::shared_ptr<LimitTessellation> made(new LimitTessellation(std::move(*topology)));
    if (Expected<void> built = Builder(*made, limits).run(level); !built) return tl::unexpected(built.error());
    return std::shared_ptr<const LimitTessellation>(std::move(made));
}

std::size_t LimitTessellation::bytes() const {
    std::size_t sum = indices_.size() * 4 + faces_.size() * sizeof(Face) + points_.size() * 4 + owned_.size() * sizeof(Owned) + copies_.size() * sizeof(Copy);
    for (const auto& table : tables_) sum += table->weights.size() * sizeof(double);
    for (const auto& spline : splines_) sum += spline->weights.size() * 12;
    // Topology: vertices, edges and faces of a mesh are about as many.
    return sum + topology_.mesh().edges.size() * 120;
}

void LimitTessellation::evaluate(std::span<const float> points, std::span<float> positions, std::span<float> normals) const {
    TESSERA_CHECK(points.size() == 3 * topology_.controlPointCount() && positions.size() == 3 * vertexCount_ && normals.size() == positions.size(), "arrays of a tessellation have its sizes");
    Scratch scratch;
    for (const Face& face : faces_) evaluateFace(face, points, scratch, positions, normals);
    copyPositions(positions);
}

LimitTessellation::Range LimitTessellation::update(std::span<const std::uint32_t> moved, std::span<const float> points, std::span<float> positions, std::span<float> normals) const {
    TESSERA_CHECK(points.size() == 3 * topology_.controlPointCount() && positions.size() == 3 * vertexCount_ && normals.size() == positions.size(), "arrays of a tessellation have its sizes");
    Scratch scratch;
    Range range{vertexCount_, 0};
    const auto include = [&range](std::size_t vertex) {
        range.begin = std::min(range.begin, vertex);
        range.end = std::max(range.end, vertex + 1);
    };
    for (const std::uint32_t p : topology_.touchedBy(moved)) {
        const Face& face = faces_[p];
        evaluateFace(face, points, scratch, positions, normals);
        for (std::uint32_t i = face.ownedBegin; i < face.ownedEnd; ++i) include(owned_[i].vertex);
    }
    for (const Copy& copy : copies_) {
        if (std::equal(&positions[3 * copy.to], &positions[3 * copy.to] + 3, &positions[3 * copy.from])) continue;
        include(copy.to);
        std::copy_n(&positions[3 * copy.from], 3, &positions[3 * copy.to]);
    }
    return range.begin < range.end ? range : Range{};
}

void LimitTessellation::copyPositions(std::span<float> positions) const {
    for (const Copy& copy : copies_) std::copy_n(&positions[3 * copy.from], 3, &positions[3 * copy.to]);
}

namespace {

/// Three rows of weights by points: x and y side by side, which SSE2 has and so every x86-64. The same sums in the same order as one by one.
std::array<Vec3d, 3> threeSums(const double* weights, std::span<const Vec3d> points) {
    const std::size_t count = points.size();
    __m128d xy[3] = {_mm_setzero_pd(), _mm_setzero_pd(), _mm_setzero_pd()}, z[3] = {_mm_setzero_pd(), _mm_setzero_pd(), _mm_setzero_pd()};
    for (std::size_t i = 0; i < count; ++i) {
        const __m128d pxy = _mm_loadu_pd(points[i].data()), pz = _mm_load_sd(points[i].data() + 2);
        for (std::size_t row = 0; row < 3; ++row) {
            const __m128d weight = _mm_set1_pd(weights[row * count + i]);
            xy[row] = _mm_add_pd(xy[row], _mm_mul_pd(weight, pxy));
            z[row] = _mm_add_sd(z[row], _mm_mul_sd(weight, pz));
        }
    }
    std::array<Vec3d, 3> sums;
    for (std::size_t row = 0; row < 3; ++row) {
        _mm_storeu_pd(sums[row].data(), xy[row]);
        _mm_store_sd(sums[row].data() + 2, z[row]);
    }
    return sums;
}

}  // namespace

void LimitTessellation::evaluateFace(const Face& face, std::span<const float> points, Scratch& scratch, std::span<float> positions, std::span<float> normals) const {
    if (face.ownedBegin == face.ownedEnd) return;
    const std::size_t n = face.segments, samples = gridSamples(n, triangular());
    scratch.points.resize(face.pointsEnd - face.pointsBegin);
    for (std::size_t i = 0; i < scratch.points.size(); ++i) scratch.points[i] = pointAt(points, points_[face.pointsBegin + i]);
    // Sums are taken about a point of the face: so what is far from the origin loses nothing.
    const Vec3d origin = scratch.points[0];
    for (Vec3d& p : scratch.points) p -= origin;
    std::span<const Vec3d> base = scratch.points;
    if (face.spline) {
        face.spline->apply(scratch.points, scratch.spline);
        base = scratch.spline;
    }
    scratch.grid.resize(samples);
    scratch.normals.resize(samples);
    const auto keep = [&](std::size_t sample, const Vec3d& point, const Vec3d& du, const Vec3d& dv) {
        scratch.grid[sample] = point;
        const Vec3d across = du.cross(dv);
        const double area = across.squaredNorm();
        // As LimitEvaluator has it: below this there is no tangent plane.
        scratch.normals[sample] = area > 1e-24 * du.squaredNorm() * dv.squaredNorm() ? Vec3d(across / std::sqrt(area)) : Vec3d::Zero();
    };
    std::vector<CubicSplineBasis> bases;
    if (!face.table) {
        bases.reserve(n + 1);
        for (std::size_t i = 0; i <= n; ++i) bases.emplace_back(static_cast<double>(i) / static_cast<double>(n));
    }
    std::size_t row = samples;  // that `across` and `slope` are of
    std::array<Vec3d, 4> across, slope;
    const auto evaluateSample = [&](std::size_t sample) {
        if (face.table) {
            const std::array<Vec3d, 3> sums = threeSums(face.table->weights.data() + sample * 3 * base.size(), base);
            keep(sample, sums[0], sums[1], sums[2]);
            return;
        }
        const std::size_t i = sample % (n + 1), j = sample / (n + 1);
        if (j != row) {
            row = j;
            const CubicSplineBasis& v = bases[j];
            for (std::size_t x = 0; x < 4; ++x) {
                across[x] = v.value[0] * base[x] + v.value[1] * base[4 + x] + v.value[2] * base[8 + x] + v.value[3] * base[12 + x];
                slope[x] = v.slope[0] * base[x] + v.slope[1] * base[4 + x] + v.slope[2] * base[8 + x] + v.slope[3] * base[12 + x];
            }
        }
        const CubicSplineBasis& u = bases[i];
        keep(sample, u.value[0] * across[0] + u.value[1] * across[1] + u.value[2] * across[2] + u.value[3] * across[3],
             u.slope[0] * across[0] + u.slope[1] * across[1] + u.slope[2] * across[2] + u.slope[3] * across[3],
             u.value[0] * slope[0] + u.value[1] * slope[1] + u.value[2] * slope[2] + u.value[3] * slope[3]);
    };
    // What neighbours own they evaluate; but a normal that is missing is made of all that is around it.
    bool lacksNormals = false;
    for (std::uint32_t o = face.ownedBegin; o < face.ownedEnd; ++o) {
        evaluateSample(owned_[o].sample);
        lacksNormals = lacksNormals || scratch.normals[owned_[o].sample].isZero(0);
    }
    if (lacksNormals)
        for (std::size_t sample = 0; sample < samples; ++sample) evaluateSample(sample);
    for (std::uint32_t o = face.ownedBegin; o < face.ownedEnd; ++o) {
        const Owned& owned = owned_[o];
        Vec3d normal = scratch.normals[owned.sample];
        if (normal.isZero(0)) {
            std::size_t i = owned.sample, j = 0;
            for (std::size_t width = n + 1; i >= width; ++j, width -= triangular() ? 1 : 0) i -= width;
            normal = normalOfFan(scratch.grid, i, j, n, triangular());
        }
        store(positions, owned.vertex, scratch.grid[owned.sample] + origin);
        store(normals, owned.vertex, normal);
    }
}

}  // namespace tessera

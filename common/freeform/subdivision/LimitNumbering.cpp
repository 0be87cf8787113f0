// Which vertices the faces' grids share, and who evaluates each; and the triangles between them.
#include <algorithm>
#include <array>
#include <numeric>
#include <set>
#include <string>
#include <utility>

#include "common/freeform/subdivision/LimitTessellation.h"
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
                if (!canCross(mesh, e) || mesh.edges[e].faces[0] != f || !topology.hasSurface(mesh.edges[e].faces[1]))
                    continue;
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

class LimitTessellation::Builder {
public:
    Builder(LimitTessellation& out, const Limits& limits)
        : out_(out), limits_(limits), mesh_(out.topology().mesh()), groups_(out.topology()), tables_(*out.plan_) {
        corners_.assign(mesh_.faceVertices.size(), kNoIndex);
        sides_.assign(mesh_.faceVertices.size(), kNoIndex);
        spokes_.assign(mesh_.faceVertices.size(), kNoIndex);
        sharedEdges_.assign(mesh_.edges.size(), kNoIndex);
        edgePositions_.assign(mesh_.edges.size(), kNoIndex);
        vertexPositions_.assign(out.topology().controlPointCount(), kNoIndex);
        middles_.assign(mesh_.faceCount(), kNoIndex);
    }

    Expected<void> run(std::span<const std::uint8_t> levels) {
        const SubdivisionTopology& topology = out_.topology();
        levels_.assign(levels.begin(), levels.end());
        edgeLevels_.assign(mesh_.edges.size(), 0);
        std::size_t triangles = 0;
        for (std::uint32_t f = 0; f < mesh_.faceCount(); ++f) {
            if (!topology.hasSurface(f)) continue;
            if (out_.plan_->hasPolygons()) levels_[f] = std::max<std::uint8_t>(levels_[f], 1);
            out_.level_ = std::max<int>(out_.level_, levels_[f]);
            for (const std::uint32_t e : mesh_.edgesOf(f)) edgeLevels_[e] = std::max(edgeLevels_[e], levels_[f]);
            const std::size_t size = mesh_.faceSize(f), part = std::size_t{1} << (2 * levels_[f]);
            triangles += triangular() ? part : size == 4 ? 2 * part : size * part / 2;
        }
        for (std::uint32_t f = 0; f < mesh_.faceCount(); ++f) {
            if (!topology.hasSurface(f)) continue;
            for (const std::uint32_t e : mesh_.edgesOf(f))
                triangles += (std::size_t{1} << edgeLevels_[e]) - (std::size_t{1} << levels_[f]);
        }
        if (triangles > limits_.mostTriangles)
            return fail(ErrorCode::kLimit, "level " + std::to_string(out_.level_) + " makes " +
                                               std::to_string(triangles) + " triangles, and " +
                                               std::to_string(limits_.mostTriangles) + " may be: take a lower level");
        if (Expected<void> few = countWeights(); !few) return few;
        out_.indices_.reserve(3 * triangles);
        out_.faces_.resize(topology.ptexFaceCount());
        for (std::size_t p = 0; p < topology.ptexFaceCount(); ++p) {
            const PtexFace face = topology.ptexFace(p);
            if (!topology.hasSurface(face.face)) continue;
            Face& here = out_.faces_[p];
            const unsigned log2 = levels_[face.face] - (face.corner == kNoIndex ? 0U : 1U);
            here.segments = 1U << log2;
            here.table = tables_.of(out_.plan_->faces()[p], log2);
            const std::vector<std::uint32_t> grid = numberGrid(face, here);
            const Sides sides = stitch(face, out_.plan_->faces()[p], here);
            appendTriangles(grid, sides, here.segments);
        }
        out_.vertexCount_ = taken_.size();
        return {};
    }

private:
    /// By side of a grid (j = 0; i = n or i + j = n; j = n; i = 0): the vertices along it in the direction of i, of j
    /// where i is fixed, where a neighbour has more than the grid; else none.
    using Sides = std::array<std::vector<std::uint32_t>, 4>;

    [[nodiscard]] bool triangular() const { return out_.plan_->triangular(); }
    /// Before any is worked out: a refusal is to cost little.
    Expected<void> countWeights() {
        std::set<std::pair<std::uint32_t, unsigned>> known;
        std::size_t weights = 0;
        const bool smooth = out_.topology().scheme() != SubdivisionScheme::kBilinear;
        for (std::size_t p = 0; p < out_.plan_->faces().size() && smooth; ++p) {
            const LimitPlan::Face& face = out_.plan_->faces()[p];
            if (face.kind == kNoIndex) continue;
            const std::uint32_t whole = out_.topology().ptexFace(p).face;
            std::set<unsigned> levels{levels_[whole]};
            for (const std::uint32_t e : mesh_.edgesOf(whole))
                if (!isShared(e)) levels.insert(edgeLevels_[e]);
            for (const unsigned level : levels) {
                const unsigned log2 = level - (face.isPart ? 1U : 0U);
                if (known.insert({face.kind, log2}).second) weights += out_.plan_->weightsOf(face.kind, log2);
            }
            if (weights > limits_.mostWeights)
                return fail(ErrorCode::kLimit, "the mesh has so many kinds of irregular faces that level " +
                                                   std::to_string(out_.level_) + " needs more than " +
                                                   std::to_string(limits_.mostWeights) +
                                                   " weights: take a lower level");
        }
        return {};
    }

    std::uint32_t allocate(std::size_t count, bool taken = false) {
        const auto first = static_cast<std::uint32_t>(taken_.size());
        taken_.resize(taken_.size() + count, taken);
        return first;
    }
    [[nodiscard]] bool isShared(std::uint32_t edge) const {
        return out_.topology().scheme() != SubdivisionScheme::kBilinear && NormalGroups::canCross(mesh_, edge);
    }
    /// A side's inner vertices: `k` from 1 on, of the face's own `mine` segments of the whole edge.
    std::uint32_t onSide(std::uint32_t face, std::uint32_t side, std::uint32_t k, std::uint32_t mine) {
        const std::uint32_t corner = mesh_.faceBegin[face] + side, e = mesh_.faceEdges[corner],
                            segments = 1U << edgeLevels_[e];
        k *= segments / mine;
        const bool crossable = isShared(e);
        std::uint32_t& block = crossable ? sharedEdges_[e] : sides_[corner];
        const bool isNew = block == kNoIndex;
        if (isNew) block = allocate(segments - 1);
        if (isNew && edgePositions_[e] == kNoIndex)
            edgePositions_[e] = block;
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
        std::uint32_t& first = vertexPositions_[out_.topology().controlPointOf(mesh_.faceVertices[corner])];
        if (first == kNoIndex)
            first = vertex;
        else
            out_.copies_.push_back({vertex, first});
        return vertex;
    }
    static std::uint32_t inBlock(std::uint32_t& block, std::uint32_t k, std::uint32_t count, Builder& builder) {
        if (block == kNoIndex) block = builder.allocate(count);
        return block + k;
    }

    /// The vertices of a face's grid; what nobody has evaluated yet is its own.
    std::vector<std::uint32_t> numberGrid(const PtexFace& face, Face& here) {
        const std::uint32_t n = here.segments;
        std::vector<std::uint32_t> grid;
        here.ownedBegin = static_cast<std::uint32_t>(out_.owned_.size());
        grid.reserve(gridSamples(n, triangular()));
        for (std::uint32_t j = 0; j <= n; ++j) {
            const std::uint32_t last = triangular() ? n - j : n;
            for (std::uint32_t i = 0; i <= last; ++i) {
                if (j > 0 && j < n && i == 1 && last > 1) {
                    // Inside vertices are nobody else's.
                    const std::uint32_t inside = last - 1, vertex = allocate(inside, true);
                    for (std::uint32_t k = 0; k < inside; ++k) {
                        out_.owned_.push_back({static_cast<std::uint32_t>(grid.size()), vertex + k});
                        grid.push_back(vertex + k);
                    }
                    i = last;
                }
                const std::uint32_t vertex = triangular()              ? ofTriangle(face.face, i, j, n)
                                             : face.corner == kNoIndex ? ofQuadrilateral(face.face, i, j, n)
                                                                       : ofPart(face, i, j, n);
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
    // What is on a face's rim.
    std::uint32_t ofTriangle(std::uint32_t face, std::uint32_t i, std::uint32_t j, std::uint32_t n) {
        if (j == 0) return i == 0 ? atCorner(face, 0) : i == n ? atCorner(face, 1) : onSide(face, 0, i, n);
        if (j == n) return atCorner(face, 2);
        return i == 0 ? onSide(face, 2, n - j, n) : onSide(face, 1, j, n);
    }
    std::uint32_t ofQuadrilateral(std::uint32_t face, std::uint32_t i, std::uint32_t j, std::uint32_t n) {
        if (j == 0) return i == 0 ? atCorner(face, 0) : i == n ? atCorner(face, 1) : onSide(face, 0, i, n);
        if (j == n) return i == 0 ? atCorner(face, 3) : i == n ? atCorner(face, 2) : onSide(face, 2, n - i, n);
        return i == 0 ? onSide(face, 3, n - j, n) : onSide(face, 1, j, n);
    }
    /// Of the part around a polygon's corner: its far corner is the polygon's middle, spokes lead there from the edges'
    /// middles.
    std::uint32_t ofPart(const PtexFace& at, std::uint32_t i, std::uint32_t j, std::uint32_t n) {
        const std::uint32_t size = mesh_.faceSize(at.face), before = (at.corner + size - 1) % size,
                            begin = mesh_.faceBegin[at.face];
        if (i == n && j == n) return inBlock(middles_[at.face], 0, 1, *this);
        if (j == 0) return i == 0 ? atCorner(at.face, at.corner) : onSide(at.face, at.corner, i, 2 * n);
        if (i == 0) return onSide(at.face, before, 2 * n - j, 2 * n);
        return i == n ? inBlock(spokes_[begin + at.corner], j - 1, n - 1, *this)
                      : inBlock(spokes_[begin + before], i - 1, n - 1, *this);
    }

    /// The finer neighbours' vertices on a face's sides. These evaluate them, but where normals part: what is this
    /// side's is evaluated from here.
    Sides stitch(const PtexFace& at, const LimitPlan::Face& planned, Face& here) {
        Sides sides;
        here.extrasBegin = static_cast<std::uint32_t>(out_.extras_.size());
        const std::uint32_t n = here.segments, size = mesh_.faceSize(at.face);
        const auto add = [&](unsigned gridSide, std::uint32_t faceSide, bool half, bool backward) {
            const std::uint32_t e = mesh_.edgesOf(at.face)[faceSide], whole = 1U << edgeLevels_[e],
                                m = half ? whole / 2 : whole;
            if (m == n) return;
            for (std::uint32_t k = 0; k <= m; ++k) {
                // Of a polygon's part the half at its corner.
                const std::uint32_t along = backward ? whole - k : k;
                const bool begins = along == 0, ends = along == whole;
                const std::uint32_t vertex = begins ? atCorner(at.face, faceSide)
                                             : ends ? atCorner(at.face, (faceSide + 1) % size)
                                                    : onSide(at.face, faceSide, along, whole);
                sides[gridSide].push_back(vertex);
                if (begins || ends || isShared(e) || taken_[vertex]) continue;
                taken_[vertex] = true;
                const auto log2 = static_cast<std::uint8_t>(half ? edgeLevels_[e] - 1 : edgeLevels_[e]);
                const std::uint32_t last = m;
                const auto i = static_cast<std::uint8_t>(gridSide == 3   ? 0
                                                         : gridSide == 1 ? (triangular() ? last - k : last)
                                                                         : k);
                const auto j = static_cast<std::uint8_t>(gridSide == 0 ? 0 : gridSide == 2 ? last : k);
                out_.extras_.push_back({tables_.of(planned, log2), vertex, log2, i, j});
            }
        };
        if (at.corner != kNoIndex) {
            add(0, at.corner, true, false);
            add(3, (at.corner + size - 1) % size, true, true);
        } else if (triangular()) {
            add(0, 0, false, false);
            add(1, 1, false, false);
            add(3, 2, false, true);
        } else {
            add(0, 0, false, false);
            add(1, 1, false, false);
            add(2, 2, false, true);
            add(3, 3, false, true);
        }
        here.extrasEnd = static_cast<std::uint32_t>(out_.extras_.size());
        return sides;
    }

    void appendTriangles(const std::vector<std::uint32_t>& grid, const Sides& sides, std::uint32_t n) {
        const auto at = [&](std::uint32_t i, std::uint32_t j) { return grid[gridSample(i, j, n, triangular())]; };
        // What a neighbour has between two vertices that follow each other on a side.
        const auto between = [&](unsigned side, std::uint32_t k, bool onIt,
                                 bool backward) -> std::vector<std::uint32_t> {
            if (!onIt || sides[side].empty()) return {};
            const std::size_t step = (sides[side].size() - 1) / n;
            std::vector<std::uint32_t> found(sides[side].begin() + static_cast<std::ptrdiff_t>(k * step + 1),
                                             sides[side].begin() + static_cast<std::ptrdiff_t>((k + 1) * step));
            if (backward) std::reverse(found.begin(), found.end());
            return found;
        };
        for (std::uint32_t j = 0; j < n; ++j) {
            for (std::uint32_t i = 0; i < (triangular() ? n - j : n); ++i) {
                // Inside, where nobody else has a say.
                if (!triangular() && i > 0 && j > 0 && i + 1 < n && j + 1 < n) {
                    append(at(i, j), at(i + 1, j), at(i + 1, j + 1));
                    append(at(i, j), at(i + 1, j + 1), at(i, j + 1));
                } else if (triangular()) {
                    appendStitched({at(i, j), at(i + 1, j), at(i, j + 1)},
                                   {between(0, i, j == 0, false), between(1, j, i + j + 1 == n, false),
                                    between(3, j, i == 0, true)});
                    if (i + j + 2 <= n) append(at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
                } else {
                    appendStitched({at(i, j), at(i + 1, j), at(i + 1, j + 1)},
                                   {between(0, i, j == 0, false), between(1, j, i + 1 == n, false), {}});
                    appendStitched(
                        {at(i, j), at(i + 1, j + 1), at(i, j + 1)},
                        {std::vector<std::uint32_t>(), between(2, i, j + 1 == n, true), between(3, j, i == 0, true)});
                }
            }
        }
    }
    void append(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        out_.indices_.push_back(a);
        out_.indices_.push_back(b);
        out_.indices_.push_back(c);
    }
    /// A triangle with further vertices on its edges: `on` those from each corner to the next. No triangle has all its
    /// corners on one edge.
    void appendStitched(std::array<std::uint32_t, 3> corners, std::array<std::vector<std::uint32_t>, 3> on) {
        if (on[0].empty() && on[1].empty() && on[2].empty()) return append(corners[0], corners[1], corners[2]);
        // So that, unless all three have some, the last edge has none, and where one alone has, it is the first.
        while (on[0].empty() || (!on[2].empty() && on[1].empty())) {
            std::rotate(corners.begin(), corners.begin() + 1, corners.end());
            std::rotate(on.begin(), on.begin() + 1, on.end());
        }
        // A strip around the corner between the first two edges: outwards on both, whichever is behind.
        std::vector<std::uint32_t> back(on[0].rbegin(), on[0].rend()), ahead = on[1];
        back.push_back(corners[0]);
        ahead.push_back(corners[2]);
        std::uint32_t left = back[0], right = ahead[0];
        std::size_t l = 1, r = 1;
        append(left, corners[1], right);
        while (l + r + 1 < back.size() + ahead.size()) {
            const bool stepLeft =
                r == ahead.size() || (l < back.size() && (l + 1) * ahead.size() <= (r + 1) * back.size());
            const std::uint32_t next = stepLeft ? back[l++] : ahead[r++];
            append(next, left, right);
            (stepLeft ? left : right) = next;
        }
        // What is left has the third edge.
        const bool stepLeft = l < back.size();
        const std::uint32_t apex = stepLeft ? left : right;
        std::uint32_t from = corners[2];
        for (const std::uint32_t to : on[2]) {
            append(from, to, apex);
            from = to;
        }
        append(from, corners[0], apex);
    }

    LimitTessellation& out_;
    const Limits& limits_;
    const TaggedMesh& mesh_;
    NormalGroups groups_;
    LimitPlan::Tables tables_;
    std::vector<std::uint8_t> levels_, edgeLevels_;
    std::vector<std::uint32_t> corners_, sides_, spokes_, sharedEdges_, edgePositions_, vertexPositions_, middles_;
    std::vector<bool> taken_;  ///< by vertex: a face evaluates it
};

Expected<std::shared_ptr<const LimitTessellation>> LimitTessellation::build(std::shared_ptr<const LimitPlan> plan,
                                                                            std::span<const std::uint8_t> levels,
                                                                            const Limits& limits) {
    TESSERA_CHECK(levels.size() == plan->topology().mesh().faceCount(), "each control face has a level");
    for (const std::uint8_t level : levels)
        if (level > kFinestLevel)
            return fail(ErrorCode::kBadInput, "a level is from 0 to " + std::to_string(kFinestLevel));
    std::shared_ptr<LimitTessellation> made(new LimitTessellation(std::move(plan)));
    if (Expected<void> built = Builder(*made, limits).run(levels); !built) return tl::unexpected(built.error());
    return std::shared_ptr<const LimitTessellation>(std::move(made));
}

Expected<std::shared_ptr<const LimitTessellation>> LimitTessellation::build(const ControlMesh& mesh, int level,
                                                                            const Limits& limits) {
    if (level < 0 || level > kFinestLevel)
        return fail(ErrorCode::kBadInput, "a level is from 0 to " + std::to_string(kFinestLevel));
    Expected<std::shared_ptr<const LimitPlan>> plan = LimitPlan::build(mesh);
    if (!plan) return tl::unexpected(plan.error());
    const std::vector<std::uint8_t> levels((*plan)->topology().mesh().faceCount(), static_cast<std::uint8_t>(level));
    return build(std::move(*plan), levels, limits);
}

}  // namespace tessera

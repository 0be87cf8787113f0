#include "common/freeform/subdivision/SubdivisionTopology.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <unordered_map>

#include "common/freeform/subdivision/CollapsedEdges.h"

namespace tessera {
namespace {

std::string numbered(const char* what, std::size_t index) {
    return std::string(what) + " " + std::to_string(index);
}

Expected<void> checkPositions(const ControlMesh& mesh) {
    // So that sums of thousands of points with weights below 1, and their squares, stay finite.
    constexpr double kLargest = 1e100;
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
        if (!(mesh.positions[i].array().abs() <= kLargest).all()) {
            return fail(ErrorCode::kBadInput,
                        numbered("vertex", i) + " has a coordinate that is not a number within 1e100");
        }
    }
    return {};
}

Expected<void> checkFaces(const ControlMesh& mesh) {
    if (mesh.faceSizes.empty()) return fail(ErrorCode::kBadInput, "there are no faces");
    if (mesh.positions.size() > std::numeric_limits<std::int32_t>::max() ||
        mesh.faceVertices.size() > std::numeric_limits<std::int32_t>::max()) {
        return fail(ErrorCode::kLimit, "there are more than 2147483647 vertices or corners of faces");
    }
    std::size_t next = 0;
    std::vector<std::uint32_t> sorted;  // a face's vertices, but for repeats in a row
    for (std::size_t f = 0; f < mesh.faceSizes.size(); ++f) {
        const std::uint32_t size = mesh.faceSizes[f];
        if (size < 3) return fail(ErrorCode::kBadInput, numbered("face", f) + " has fewer than three vertices");
        if (size > SubdivisionTopology::kMostValence)
            return fail(ErrorCode::kLimit, numbered("face", f) + " has more than 4096 vertices");
        if (mesh.scheme == SubdivisionScheme::kLoop && size != 3) {
            return fail(ErrorCode::kBadInput,
                        numbered("face", f) + " is no triangle, and Loop's scheme takes nothing else");
        }
        if (mesh.faceVertices.size() - next < size)
            return fail(ErrorCode::kBadInput, numbered("face", f) + " has more vertices than are listed");
        sorted.assign(mesh.faceVertices.begin() + static_cast<std::ptrdiff_t>(next),
                      mesh.faceVertices.begin() + static_cast<std::ptrdiff_t>(next + size));
        next += size;
        const std::uint32_t last = *std::max_element(sorted.begin(), sorted.end());
        if (last >= mesh.positions.size()) {
            return fail(ErrorCode::kBadInput, numbered("face", f) + " names " + numbered("vertex", last) +
                                                  ", and there are " + std::to_string(mesh.positions.size()));
        }
        sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
        if (sorted.size() > 1 && sorted.front() == sorted.back()) sorted.pop_back();
        if (sorted.size() < 3)
            return fail(ErrorCode::kBadInput, numbered("face", f) + " has fewer than three different vertices");
        std::sort(sorted.begin(), sorted.end());
        const auto twice = std::adjacent_find(sorted.begin(), sorted.end());
        if (twice != sorted.end())
            return fail(ErrorCode::kBadInput, numbered("face", f) + " has " + numbered("vertex", *twice) + " twice");
    }
    if (next != mesh.faceVertices.size())
        return fail(ErrorCode::kBadInput, std::to_string(mesh.faceVertices.size()) +
                                              " corners of faces are listed, and the faces have " +
                                              std::to_string(next));
    return {};
}

/// The number of an edge by its ends, whichever comes first.
class EdgeFinder {
public:
    static std::uint64_t key(std::uint32_t a, std::uint32_t b) {
        return std::uint64_t{std::min(a, b)} << 32 | std::max(a, b);
    }
    std::unordered_map<std::uint64_t, std::uint32_t> edges;
    [[nodiscard]] std::uint32_t find(std::uint32_t a, std::uint32_t b) const {
        const auto found = edges.find(key(a, b));
        return found == edges.end() ? kNoIndex : found->second;
    }
};

/// Above 0 and in range; infinitely sharp is one number.
Expected<float> usableSharpness(float sharpness, const std::string& whose) {
    if (std::isnan(sharpness)) return fail(ErrorCode::kBadInput, whose + " has a sharpness that is not a number");
    return std::clamp(sharpness, 0.0F, kInfiniteSharpness);
}

}  // namespace

Expected<SubdivisionTopology> SubdivisionTopology::build(const ControlMesh& mesh) {
    if (const auto good = checkPositions(mesh); !good) return tl::unexpected(good.error());
    if (const auto good = checkFaces(mesh); !good) return tl::unexpected(good.error());
    if (mesh.scheme == SubdivisionScheme::kBilinear || !hasCollapsedEdges(mesh)) return buildPlain(mesh);
    Expected<UnrolledMesh> unrolled = unrollCollapsedEdges(mesh);
    if (!unrolled) return tl::unexpected(unrolled.error());
    Expected<SubdivisionTopology> topology = buildPlain(unrolled->mesh);
    if (topology) {
        topology->controlPoints_ = mesh.positions.size();
        for (auto v = static_cast<std::uint32_t>(mesh.positions.size()); v < unrolled->sources.size(); ++v)
            topology->copies_.emplace(unrolled->sources[v], v);
        topology->sources_ = std::move(unrolled->sources);
    }
    return topology;
}

Expected<SubdivisionTopology> SubdivisionTopology::buildPlain(const ControlMesh& mesh) {
    SubdivisionTopology t;
    t.controlPoints_ = mesh.positions.size();
    t.scheme_ = mesh.scheme;
    t.creaseMethod_ = mesh.creaseMethod;
    t.triangles_ = mesh.triangles;
    TaggedMesh& m = t.mesh_;
    m.faceVertices = mesh.faceVertices;
    m.vertexSharpness.assign(mesh.positions.size(), 0);

    EdgeFinder finder;
    finder.edges.reserve(mesh.faceVertices.size());
    t.firstPtex_.push_back(0);
    const std::uint32_t whole = mesh.scheme == SubdivisionScheme::kLoop ? 3 : 4;
    for (const std::uint32_t size : mesh.faceSizes) {
        const auto face = static_cast<std::uint32_t>(m.faceCount());
        const std::uint32_t begin = m.faceBegin.back();
        for (std::uint32_t i = 0; i < size; ++i) {
            const std::uint32_t a = m.faceVertices[begin + i], b = m.faceVertices[begin + (i + 1) % size];
            const auto [found, isNew] =
                finder.edges.try_emplace(EdgeFinder::key(a, b), static_cast<std::uint32_t>(m.edges.size()));
            const std::uint32_t e = found->second;
            if (isNew) {
                m.edges.push_back({.vertices = {a, b}});
                t.edgeFaceCount_.push_back(0);
                t.edgeIsNonManifold_.push_back(false);
            } else if (++t.edgeFaceCount_[e], m.edges[e].vertices[0] == a || t.edgeFaceCount_[e] > 1) {
                t.edgeIsNonManifold_[e] = true;
            }
            m.addFaceOf(e, face);
            m.faceEdges.push_back(e);
        }
        m.faceBegin.push_back(begin + size);
        t.firstPtex_.push_back(t.firstPtex_.back() + (size == whole ? 1 : size));
    }
    for (std::uint32_t& count : t.edgeFaceCount_) ++count;

    for (std::size_t i = 0; i < mesh.creases.size(); ++i) {
        const auto& crease = mesh.creases[i];
        const std::string name = "the crease " + std::to_string(crease.from) + " " + std::to_string(crease.to);
        const std::uint32_t e = finder.find(crease.from, crease.to);
        if (e == kNoIndex) return fail(ErrorCode::kBadInput, name + " is along no edge of any face");
        const Expected<float> sharpness = usableSharpness(crease.sharpness, name);
        if (!sharpness) return tl::unexpected(sharpness.error());
        m.edges[e].sharpness = *sharpness;
    }
    for (const ControlMesh::Corner& corner : mesh.corners) {
        const std::string name = numbered("the corner at vertex", corner.vertex);
        if (corner.vertex >= mesh.positions.size()) {
            return fail(ErrorCode::kBadInput,
                        name + ": there are " + std::to_string(mesh.positions.size()) + " vertices");
        }
        const Expected<float> sharpness = usableSharpness(corner.sharpness, name);
        if (!sharpness) return tl::unexpected(sharpness.error());
        m.vertexSharpness[corner.vertex] = *sharpness;
    }
    t.isHole_.assign(m.faceCount(), false);
    for (const std::uint32_t hole : mesh.holes) {
        if (hole >= m.faceCount()) {
            return fail(ErrorCode::kBadInput,
                        numbered("the hole", hole) + ": there are " + std::to_string(m.faceCount()) + " faces");
        }
        t.isHole_[hole] = true;
    }
    t.linkVertices();
    for (std::uint32_t v = 0; v < m.vertexCount(); ++v) {
        if (m.edgesAt(v).size() > kMostValence)
            return fail(ErrorCode::kLimit, numbered("vertex", v) + " has more than 4096 edges");
    }
    if (t.scheme_ != SubdivisionScheme::kBilinear) t.sharpen(mesh.boundary);  // there sharpness changes nothing
    return t;
}

void SubdivisionTopology::linkVertices() {
    const std::size_t count = mesh_.vertexCount();
    mesh_.vertexEdgeBegin.assign(count + 1, 0);
    for (const auto& e : mesh_.edges) {
        for (const std::uint32_t v : e.vertices) ++mesh_.vertexEdgeBegin[v + 1];
    }
    vertexFaceBegin_.assign(count + 1, 0);
    for (const std::uint32_t v : mesh_.faceVertices) ++vertexFaceBegin_[v + 1];
    for (std::size_t v = 0; v < count; ++v) {
        mesh_.vertexEdgeBegin[v + 1] += mesh_.vertexEdgeBegin[v];
        vertexFaceBegin_[v + 1] += vertexFaceBegin_[v];
    }
    std::vector<std::uint32_t> nextEdge = mesh_.vertexEdgeBegin, nextFace = vertexFaceBegin_;
    mesh_.vertexEdges.resize(mesh_.vertexEdgeBegin.back());
    vertexFaces_.resize(vertexFaceBegin_.back());
    for (std::uint32_t e = 0; e < mesh_.edges.size(); ++e) {
        for (const std::uint32_t v : mesh_.edges[e].vertices) mesh_.vertexEdges[nextEdge[v]++] = e;
    }
    for (std::uint32_t f = 0; f < mesh_.faceCount(); ++f) {
        for (const std::uint32_t v : mesh_.verticesOf(f)) vertexFaces_[nextFace[v]++] = f;
    }
}

void SubdivisionTopology::sharpen(BoundaryInterpolation boundary) {
    // Whether faces form one fan is asked of the topology alone: a single step from face to face may not stop at
    // creases.
    TaggedMesh plain = mesh_;
    std::fill(plain.vertexSharpness.begin(), plain.vertexSharpness.end(), 0.0F);
    for (std::uint32_t e = 0; e < plain.edges.size(); ++e) {
        plain.edges[e].sharpness = edgeIsNonManifold_[e] || edgeFaceCount_[e] != 2 ? kInfiniteSharpness : 0;
    }
    std::vector<bool> isOpenEnd(mesh_.edges.size());  // a boundary that nobody sharpened
    for (std::uint32_t e = 0; e < mesh_.edges.size(); ++e) {
        isOpenEnd[e] = edgeFaceCount_[e] < 2 && !isInfinitelySharp(mesh_.edges[e].sharpness);
        if (plain.edges[e].sharpness > 0) mesh_.edges[e].sharpness = kInfiniteSharpness;
    }
    for (std::uint32_t v = 0; v < mesh_.vertexCount(); ++v) {
        const std::size_t faces = vertexFaceBegin_[v + 1] - vertexFaceBegin_[v], edges = mesh_.edgesAt(v).size();
        if (faces == 0) continue;
        std::size_t boundaryEdges = 0, nonManifoldEdges = 0;
        for (const std::uint32_t e : mesh_.edgesAt(v)) {
            boundaryEdges += edgeFaceCount_[e] < 2 ? 1 : 0;
            nonManifoldEdges += edgeIsNonManifold_[e] ? 1 : 0;
        }
        bool nonManifold = nonManifoldEdges > 0;
        if (!nonManifold) {
            const std::uint32_t face = vertexFaces_[vertexFaceBegin_[v]];
            const auto vertices = mesh_.verticesOf(face);
            const auto at =
                static_cast<std::uint32_t>(std::find(vertices.begin(), vertices.end(), v) - vertices.begin());
            nonManifold = sectorOf(plain, face, at).faces.size() != faces;
        }
        if (faces == 1 && edges == 2) {
            if (boundary == BoundaryInterpolation::kEdgeAndCorner)
                mesh_.vertexSharpness[v] = kInfiniteSharpness;
            else if (nonManifold)
                mesh_.vertexSharpness[v] = kInfiniteSharpness;
        } else if (nonManifold && !(nonManifoldEdges == 2 && boundaryEdges == 0 && faces > edges)) {
            mesh_.vertexSharpness[v] = kInfiniteSharpness;
        }
        const auto edgesHere = mesh_.edgesAt(v);
        if (boundary == BoundaryInterpolation::kNone &&
            std::any_of(edgesHere.begin(), edgesHere.end(), [&](std::uint32_t e) { return isOpenEnd[e]; })) {
            for (std::uint32_t i = vertexFaceBegin_[v]; i < vertexFaceBegin_[v + 1]; ++i)
                isHole_[vertexFaces_[i]] = true;
        }
    }
}

PtexFace SubdivisionTopology::ptexFace(std::size_t ptex) const {
    const auto next = std::upper_bound(firstPtex_.begin(), firstPtex_.end(), static_cast<std::uint32_t>(ptex));
    const auto face = static_cast<std::uint32_t>(next - firstPtex_.begin() - 1);
    const bool whole = firstPtex_[face + 1] - firstPtex_[face] == 1;
    return {face, whole ? kNoIndex : static_cast<std::uint32_t>(ptex) - firstPtex_[face]};
}

std::vector<std::uint32_t> SubdivisionTopology::touchedBy(std::span<const std::uint32_t> vertices) const {
    std::vector<std::uint32_t> faces, ring;
    const auto facesAt = [&](std::uint32_t v, std::vector<std::uint32_t>& out) {
        out.insert(out.end(), vertexFaces_.begin() + vertexFaceBegin_[v],
                   vertexFaces_.begin() + vertexFaceBegin_[v + 1]);
    };
    const auto sortUnique = [](std::vector<std::uint32_t>& list) {
        std::sort(list.begin(), list.end());
        list.erase(std::unique(list.begin(), list.end()), list.end());
    };
    for (const std::uint32_t v : vertices) {
        facesAt(v, faces);
        const auto [first, last] = copies_.equal_range(v);
        for (auto copy = first; copy != last; ++copy) facesAt(copy->second, faces);
    }
    sortUnique(faces);
    for (const std::uint32_t f : faces) {
        const auto around = mesh_.verticesOf(f);
        ring.insert(ring.end(), around.begin(), around.end());
    }
    sortUnique(ring);
    faces.clear();
    for (const std::uint32_t v : ring) facesAt(v, faces);
    sortUnique(faces);
    std::vector<std::uint32_t> ptex;
    for (const std::uint32_t f : faces) {
        for (std::uint32_t p = firstPtex_[f]; p < firstPtex_[f + 1]; ++p) ptex.push_back(p);
    }
    return ptex;
}

}  // namespace tessera

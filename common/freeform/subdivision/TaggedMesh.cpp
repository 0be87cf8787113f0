#include "common/freeform/subdivision/TaggedMesh.h"

#include <algorithm>
#include <array>
#include <unordered_map>

namespace tessera {
namespace {

int infiniteEdgesAt(const TaggedMesh& mesh, std::uint32_t vertex) {
    int count = 0;
    for (const std::uint32_t e : mesh.edgesAt(vertex)) count += isInfinitelySharp(mesh.edges[e].sharpness) ? 1 : 0;
    return count;
}

/// A single infinitely sharp edge ends here (a dart): the surface goes on around it.
bool endsSectors(const TaggedMesh& mesh, std::uint32_t edge, bool dart) {
    return isInfinitelySharp(mesh.edges[edge].sharpness) && !dart;
}

/// Across one of a face's edges at its vertex `at`, or nothing.
bool stepAcross(const TaggedMesh& mesh, Sector::Face& here, bool counterClockwise, bool dart) {
    const std::span<const std::uint32_t> edges = mesh.edgesOf(here.face);
    const auto size = static_cast<std::uint32_t>(edges.size());
    const std::uint32_t vertex = mesh.verticesOf(here.face)[here.at];
    const std::uint32_t edge = edges[counterClockwise ? (here.at + size - 1) % size : here.at];
    if (edge == kNoIndex || endsSectors(mesh, edge, dart)) return false;
    const auto& faces = mesh.edges[edge].faces;
    const std::uint32_t next = faces[0] == here.face ? faces[1] : faces[0];
    if (next == kNoIndex) return false;
    const std::span<const std::uint32_t> nextEdges = mesh.edgesOf(next), nextVertices = mesh.verticesOf(next);
    const auto nextSize = static_cast<std::uint32_t>(nextEdges.size());
    for (std::uint32_t i = 0; i < nextSize; ++i) {
        if (nextEdges[i] != edge) continue;
        const std::uint32_t at = counterClockwise ? i : (i + 1) % nextSize;
        if (nextVertices[at] != vertex) return false;
        here = {next, at};
        return true;
    }
    return false;
}

/// Vertices, faces and edges in the order in which they are met.
class NeighbourhoodMaker {
public:
    NeighbourhoodMaker(const TaggedMesh& from, std::uint32_t center, CreaseMethod method)
        : from_(from), center_(center), method_(method) {}

    FaceNeighbourhood make() {
        const std::uint32_t size = from_.faceSize(center_);
        for (const std::uint32_t v : from_.verticesOf(center_)) point(v);
        addFace(center_);
        std::vector<std::vector<std::uint32_t>> edgesAt(size);
        for (std::uint32_t i = 0; i < size; ++i) addSector(i, edgesAt[i]);
        fillFaces();
        TaggedMesh& mesh = out_.mesh;
        mesh.vertexSharpness.resize(out_.points.size(), 0);
        if (method_ == CreaseMethod::kChaikin) {
            for (std::size_t p = size; p < out_.points.size(); ++p)
                edgesAt.push_back(semiSharpAt(out_.points[p], static_cast<std::uint32_t>(p)));
        }
        for (const auto& edges : edgesAt) {
            mesh.vertexEdges.insert(mesh.vertexEdges.end(), edges.begin(), edges.end());
            mesh.vertexEdgeBegin.push_back(static_cast<std::uint32_t>(mesh.vertexEdges.size()));
        }
        mesh.vertexEdgeBegin.resize(out_.points.size() + 1, static_cast<std::uint32_t>(mesh.vertexEdges.size()));
        return std::move(out_);
    }

private:
    std::uint32_t point(std::uint32_t vertex) {
        const auto [found, isNew] = points_.try_emplace(vertex, static_cast<std::uint32_t>(out_.points.size()));
        if (isNew) out_.points.push_back(vertex);
        return found->second;
    }
    void addFace(std::uint32_t face) {
        if (faces_.try_emplace(face, static_cast<std::uint32_t>(faceOrder_.size())).second) faceOrder_.push_back(face);
    }
    std::uint32_t edge(std::uint32_t old) {
        const auto [found, isNew] = edges_.try_emplace(old, static_cast<std::uint32_t>(out_.mesh.edges.size()));
        if (isNew) {
            const TaggedMesh::Edge& e = from_.edges[old];
            std::array<std::uint32_t, 2> ends{point(e.vertices[0]), point(e.vertices[1])};
            std::sort(ends.begin(), ends.end());  // whichever way the mesh has it
            out_.mesh.edges.push_back({.vertices = ends, .sharpness = e.sharpness});
        }
        return found->second;
    }

    void addSector(std::uint32_t corner, std::vector<std::uint32_t>& edgesHere) {
        const std::uint32_t vertex = from_.verticesOf(center_)[corner];
        const Sector sector = sectorOf(from_, center_, corner);
        // Rotated so that a closed one begins with the face in the middle wherever it was found: sectorOf does so.
        std::vector<std::uint32_t> oldEdges;
        for (const Sector::Face& f : sector.faces) {
            addFace(f.face);
            const auto edges = from_.edgesOf(f.face), vertices = from_.verticesOf(f.face);
            const auto size = static_cast<std::uint32_t>(edges.size());
            for (std::uint32_t i = 0; i < size; ++i) point(vertices[(f.at + i) % size]);
            for (const std::uint32_t e : {edges[f.at], edges[(f.at + size - 1) % size]}) {
                if (std::find(oldEdges.begin(), oldEdges.end(), e) == oldEdges.end()) oldEdges.push_back(e);
            }
        }
        for (const std::uint32_t e : oldEdges) edgesHere.push_back(edge(e));
        const bool fixed = isFixedCorner(from_, vertex);
        if (out_.mesh.vertexSharpness.size() < out_.points.size())
            out_.mesh.vertexSharpness.resize(out_.points.size(), 0);
        out_.mesh.vertexSharpness[corner] = fixed ? kInfiniteSharpness : from_.vertexSharpness[vertex];
        // Sharp edges of other sectors decide which rule holds here, and with Chaikin how sharpness evens out.
        std::vector<std::uint32_t> sorted = oldEdges;
        std::sort(sorted.begin(), sorted.end());
        std::vector<TaggedMesh::Edge> elsewhere;
        for (const std::uint32_t e : from_.edgesAt(vertex)) {
            const float sharpness = from_.edges[e].sharpness;
            if (sharpness <= 0 || std::binary_search(sorted.begin(), sorted.end(), e)) continue;
            const bool infinite = isInfinitelySharp(sharpness);
            if (fixed && (infinite || method_ == CreaseMethod::kUniform)) continue;
            const std::uint32_t end = infinite ? point(from_.otherEnd(e, vertex)) : kNoIndex;
            elsewhere.push_back({.vertices = {corner, end}, .sharpness = sharpness});
        }
        std::sort(elsewhere.begin(), elsewhere.end(),
                  [](const auto& a, const auto& b) { return a.sharpness < b.sharpness; });
        for (const TaggedMesh::Edge& e : elsewhere) {
            edgesHere.push_back(static_cast<std::uint32_t>(out_.mesh.edges.size()));
            out_.mesh.edges.push_back(e);
        }
    }

    /// Of a vertex that is not the face's: what the sharpness of its edges is evened out with.
    std::vector<std::uint32_t> semiSharpAt(std::uint32_t vertex, std::uint32_t here) {
        std::vector<std::uint32_t> known;
        std::vector<float> others;
        for (const std::uint32_t e : from_.edgesAt(vertex)) {
            const float sharpness = from_.edges[e].sharpness;
            if (sharpness <= 0 || isInfinitelySharp(sharpness)) continue;
            const auto found = edges_.find(e);
            if (found != edges_.end())
                known.push_back(found->second);
            else
                others.push_back(sharpness);
        }
        std::sort(known.begin(), known.end());
        std::sort(others.begin(), others.end());
        for (const float sharpness : others) {
            known.push_back(static_cast<std::uint32_t>(out_.mesh.edges.size()));
            out_.mesh.edges.push_back({.vertices = {here, kNoIndex}, .sharpness = sharpness});
        }
        return known;
    }

    void fillFaces() {
        TaggedMesh& mesh = out_.mesh;
        for (const std::uint32_t old : faceOrder_) {
            const auto face = static_cast<std::uint32_t>(mesh.faceCount());
            const auto vertices = from_.verticesOf(old), edges = from_.edgesOf(old);
            // From its lowest vertex on, wherever the mesh begins.
            std::size_t first = 0;
            for (std::size_t i = 1; i < vertices.size(); ++i)
                if (points_.at(vertices[i]) < points_.at(vertices[first])) first = i;
            for (std::size_t k = 0; k < vertices.size(); ++k) {
                const std::size_t i = (first + k) % vertices.size();
                mesh.faceVertices.push_back(points_.at(vertices[i]));
                const auto known = edges_.find(edges[i]);
                const std::uint32_t e = edges[i] == kNoIndex || known == edges_.end() ? kNoIndex : known->second;
                mesh.faceEdges.push_back(e);
                if (e != kNoIndex) mesh.addFaceOf(e, face);
            }
            mesh.faceBegin.push_back(static_cast<std::uint32_t>(mesh.faceVertices.size()));
        }
    }

    const TaggedMesh& from_;
    const std::uint32_t center_;
    const CreaseMethod method_;
    FaceNeighbourhood out_;
    std::vector<std::uint32_t> faceOrder_;
    std::unordered_map<std::uint32_t, std::uint32_t> points_, faces_, edges_;
};

}  // namespace

bool isFixedCorner(const TaggedMesh& mesh, std::uint32_t vertex) {
    return isInfinitelySharp(mesh.vertexSharpness[vertex]) || infiniteEdgesAt(mesh, vertex) > 2;
}

Sector sectorOf(const TaggedMesh& mesh, std::uint32_t face, std::uint32_t at) {
    const std::uint32_t vertex = mesh.verticesOf(face)[at];
    const bool dart = !isInfinitelySharp(mesh.vertexSharpness[vertex]) && infiniteEdgesAt(mesh, vertex) == 1;
    Sector sector;
    sector.faces.push_back({face, at});
    Sector::Face here{face, at};
    while (stepAcross(mesh, here, true, dart)) {
        if (here.face == face && here.at == at) {
            sector.closed = true;
            return sector;
        }
        sector.faces.push_back(here);
    }
    std::vector<Sector::Face> before;
    here = {face, at};
    while (stepAcross(mesh, here, false, dart)) before.push_back(here);
    sector.center = before.size();
    sector.faces.insert(sector.faces.begin(), before.rbegin(), before.rend());
    return sector;
}

FaceNeighbourhood neighbourhoodOf(const TaggedMesh& mesh, std::uint32_t face, CreaseMethod method) {
    return NeighbourhoodMaker(mesh, face, method).make();
}

}  // namespace tessera

/// Polygons with their edges and how sharp each is: the whole control mesh, or what one face's surface depends on.
///
/// A face's surface depends on the faces around its vertices. Where infinitely sharp edges part these into sectors,
/// only the face's own sector counts: `neighbourhoodOf` takes it out, numbered in an order that depends on nothing but
/// the topology. So equal neighbourhoods are equal number by number, and the neighbourhood of what refinement leaves at
/// a vertex is in the end itself. Values only; any thread.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/freeform/subdivision/ControlMesh.h"

namespace tessera {

inline constexpr std::uint32_t kNoIndex = ~std::uint32_t{0};

[[nodiscard]] inline bool isInfinitelySharp(float sharpness) {
    return sharpness >= kInfiniteSharpness;
}

struct TaggedMesh {
    struct Edge {
        std::array<std::uint32_t, 2> vertices{kNoIndex,
                                              kNoIndex};  ///< the second may be kNoIndex: its sharpness alone counts
        std::array<std::uint32_t, 2> faces{kNoIndex,
                                           kNoIndex};  ///< both where it can be crossed; of three or more, any two
        float sharpness = 0;
    };

    std::vector<std::uint32_t> faceBegin{0};  ///< faces + 1: where each face's vertices and edges begin
    std::vector<std::uint32_t> faceVertices,
        faceEdges;  ///< edge i of a face leads from its vertex i to the next; kNoIndex: unknown
    std::vector<Edge> edges;
    std::vector<float> vertexSharpness;
    std::vector<std::uint32_t> vertexEdgeBegin{0}, vertexEdges;  ///< what edges count at each vertex

    [[nodiscard]] std::size_t faceCount() const { return faceBegin.size() - 1; }
    [[nodiscard]] std::size_t vertexCount() const { return vertexSharpness.size(); }
    [[nodiscard]] std::uint32_t faceSize(std::uint32_t face) const { return faceBegin[face + 1] - faceBegin[face]; }
    [[nodiscard]] std::span<const std::uint32_t> verticesOf(std::uint32_t face) const {
        return std::span(faceVertices).subspan(faceBegin[face], faceSize(face));
    }
    [[nodiscard]] std::span<const std::uint32_t> edgesOf(std::uint32_t face) const {
        return std::span(faceEdges).subspan(faceBegin[face], faceSize(face));
    }
    [[nodiscard]] std::span<const std::uint32_t> edgesAt(std::uint32_t vertex) const {
        return std::span(vertexEdges)
            .subspan(vertexEdgeBegin[vertex], vertexEdgeBegin[vertex + 1] - vertexEdgeBegin[vertex]);
    }
    [[nodiscard]] std::uint32_t otherEnd(std::uint32_t edge, std::uint32_t vertex) const {
        const Edge& e = edges[edge];
        return e.vertices[0] == vertex ? e.vertices[1] : e.vertices[0];
    }
    /// Says that a face has this edge. Of an edge of more faces than two, which nothing crosses, the others are not
    /// kept.
    void addFaceOf(std::uint32_t edge, std::uint32_t face) {
        Edge& e = edges[edge];
        if (e.faces[0] == kNoIndex)
            e.faces[0] = face;
        else if (e.faces[1] == kNoIndex)
            e.faces[1] = face;
    }
};

/// The faces around a vertex that belong together, counter-clockwise, from one infinitely sharp edge to the next; all
/// of them, beginning with the one that was asked for, where fewer than two are.
struct Sector {
    struct Face {
        std::uint32_t face = 0, at = 0;  ///< `at`: which of the face's vertices it is
    };
    std::vector<Face> faces;
    std::size_t center = 0;  ///< which of them was asked for
    bool closed = false;     ///< goes all around
};
[[nodiscard]] Sector sectorOf(const TaggedMesh& mesh, std::uint32_t face, std::uint32_t at);

/// No vertex beyond is moved by what is around it: infinitely sharp, or three edges there are.
[[nodiscard]] bool isFixedCorner(const TaggedMesh& mesh, std::uint32_t vertex);

struct FaceNeighbourhood {
    TaggedMesh mesh;                    ///< face 0 is the one that was asked for, its vertices the first
    std::vector<std::uint32_t> points;  ///< which vertices of the mesh its vertices were
};
[[nodiscard]] FaceNeighbourhood neighbourhoodOf(const TaggedMesh& mesh, std::uint32_t face, CreaseMethod method);

}  // namespace tessera

/// Which triangles of a mesh share edges, and does it enclose a volume?
#pragma once

#include <cstdint>
#include <vector>

#include "server/collision/mesh/TriangleMesh.h"

namespace tessera {

/// Made once per mesh; a deformation that leaves equal vertices equal, and others apart, leaves it valid. Vertices in
/// one place are one vertex (meshes with seams repeat them). Immutable: any number of threads.
class SurfaceTopology {
public:
    static constexpr std::uint32_t kNone = 0xffffffffU;

    explicit SurfaceTopology(const TriangleMesh& mesh);

    /// Is it still that of its mesh, whose vertices have moved? One pass over all vertices.
    [[nodiscard]] bool holds(const TriangleMesh& mesh) const;

    /// Every edge belongs to two triangles that run along it in opposite ways: there is an inside, and winding tells
    /// which side it is on. (Not asked: is it the side of finite volume, and does the surface cut itself?) No for an
    /// empty mesh.
    [[nodiscard]] bool closed() const { return closed_; }
    /// The triangle across the edge from corner i to the next; kNone where there is none or more than one.
    [[nodiscard]] std::uint32_t across(std::uint32_t face, unsigned i) const {
        return across_[std::size_t{3} * face + i];
    }
    /// Equal for vertices in one place.
    [[nodiscard]] std::uint32_t place(std::uint32_t vertex) const { return place_[vertex]; }

private:
    std::vector<std::uint32_t> across_, place_;
    bool closed_ = false;
};

}  // namespace tessera

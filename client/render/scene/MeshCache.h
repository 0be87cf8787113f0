/// What culling needs to know of meshes: bounds, triangle counts, whether they can hide things. By content, not by id.
#pragma once

#include <cstdint>
#include <memory>
#include <unordered_map>
#include <vector>

#include "client/render/DrawMesh.h"
#include "client/render/scene/OccluderMesh.h"
#include "common/math/Box.h"

namespace tessera {

struct RenderMesh {
    Box bounds;  ///< in the mesh's own coordinates; empty when the mesh cannot be drawn
    std::uint64_t triangles = 0;
    std::uint64_t lines = 0;
    bool refused = false;                   ///< by checkMesh
    bool opaque = true;                     ///< no vertex colour with alpha below 1
    std::shared_ptr<const DrawMesh> drawn;  ///< what lists name of it
    double shownRadius = 0;                 ///< of points: as they are shown; else 0

    [[nodiscard]] const MeshArrays& arrays() const { return drawn->arrays; }
    [[nodiscard]] MeshKind kind() const { return drawn->arrays.kind; }
    [[nodiscard]] const std::vector<MeshCluster>& clusters() const { return drawn->clusters; }
    [[nodiscard]] bool drawable() const { return triangles + lines > 0 && !bounds.empty(); }
    /// Prepared on first use. Null where the mesh is of no use as an occluder (too many triangles, points, lines).
    [[nodiscard]] const OccluderMesh* occluder() const;
    /// True when `occluder()` costs nothing any more.
    [[nodiscard]] bool occluderReady() const { return occluderBuilt_; }

private:
    friend class MeshCache;
    /// Of this many vertices each: where some have moved, the boxes of the others stand.
    static constexpr std::size_t kVerticesPerBox = 1024;
    void boundVertices(const ByteRange& vertices);

    std::vector<Box> boxes_;
    std::uint32_t users_ = 0;
    mutable bool occluderBuilt_ = false;
    mutable std::unique_ptr<OccluderMesh> occluder_;
};

/// Meshes in use, each once however many drawables have its content. Not thread-safe.
class MeshCache {
public:
    /// To be released as often as acquired. Null where bytes are absent: nothing is known of them then, and other
    /// handles on them may be no better. A mesh that is not whole (see checkMesh) is not drawable.
    [[nodiscard]] const RenderMesh* acquire(const Drawable& drawable);
    /// The mesh stays where it is until `dropUnused`. Null is allowed.
    void release(const RenderMesh* mesh);
    void dropUnused();

    [[nodiscard]] std::size_t size() const { return meshes_.size(); }

private:
    /// Also what the mesh itself says of its arrays.
    void prepare(RenderMesh& mesh, DrawMesh& drawn);
    /// From a mesh that is known and that this one came from by edits of ranges. False: there is none.
    [[nodiscard]] bool prepareFromOrigin(RenderMesh& mesh, const MeshArrays& arrays);

    std::unordered_map<MeshKey, RenderMesh, MeshKeyHash> meshes_;
    std::vector<MeshKey> unused_;  ///< released by their last user at least once since the last drop
};

/// Whether every pixel, or vertex, has alpha 1: RGBA bytes.
[[nodiscard]] bool allOpaque(ByteSpan rgba);

}  // namespace tessera

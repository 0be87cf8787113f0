/// What culling needs to know of meshes: bounds, triangle counts, whether they can hide things. By content, not by id.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <unordered_map>

#include "client/render/OccluderMesh.h"
#include "common/base/Blob.h"
#include "common/math/Box.h"
#include "common/scene/Cores.h"

namespace tessera {

struct RenderMesh {
    Box bounds;  ///< in the mesh's own coordinates; empty when the mesh cannot be drawn
    std::uint64_t triangles = 0;
    bool opaque = true;  ///< no vertex colour with alpha below 1
    Blob positions, indices;

    [[nodiscard]] bool drawable() const { return triangles > 0 && !bounds.empty(); }
    /// Prepared on first use. Null where the mesh is of no use as an occluder (too many triangles).
    [[nodiscard]] const OccluderMesh* occluder() const;
    /// True when `occluder()` costs nothing any more.
    [[nodiscard]] bool occluderReady() const { return occluderBuilt_; }

private:
    mutable bool occluderBuilt_ = false;
    mutable std::unique_ptr<OccluderMesh> occluder_;
};

/// Not thread-safe. Keeps what was asked for since the last `beginSweep`; `endSweep` drops the rest.
class MeshCache {
public:
    void beginSweep() { ++sweep_; }
    void endSweep();

    /// Never null; the pointer holds until the sweep that drops it. A mesh that is not whole (see checkMesh) is not
    /// drawable.
    [[nodiscard]] const RenderMesh* of(const Geometry& geometry);
    /// Whether every pixel has alpha 1.
    [[nodiscard]] bool opaque(const Image& image);

private:
    using Key = std::array<BlobId, 5>;
    struct KeyHash {
        std::size_t operator()(const Key& key) const;
    };
    struct Entry {
        std::unique_ptr<RenderMesh> mesh;
        bool complete = false;  ///< all its bytes were here when it was looked at
        std::uint64_t usedIn = 0;
    };
    struct ImageEntry {
        bool opaque = false;
        std::uint64_t usedIn = 0;
    };

    std::unordered_map<Key, Entry, KeyHash> meshes_;
    std::unordered_map<BlobId, ImageEntry> images_;
    std::uint64_t sweep_ = 0;
};

}  // namespace tessera

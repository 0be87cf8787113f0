/// What is worked out once per surface and kept: moments, solid shape, neighbours across edges.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <unordered_map>
#include <vector>

#include "server/collision/convex/ConvexHull.h"
#include "server/collision/query/SurfaceTopology.h"
#include "server/collision/rigid_bodies/MassProperties.h"
#include "server/collision/rigid_bodies/Solid.h"
#include "server/collision/tree/TriangleTree.h"

namespace tessera::rigid {

struct SurfaceData {
    VolumeMoments moments;  ///< of what it encloses; of its box where it encloses nothing
    std::optional<SolidShape> solid;
    std::unique_ptr<SurfaceTopology> topology;  ///< of surfaces without a hull

    /// Which surface it was made of. Another one may come to live at the same address, and a surface may be deformed.
    std::size_t vertices = 0, faces = 0;
    std::uint64_t moves = 0;
    Box bounds;
    std::uint64_t usedInFrame = 0;
    std::uint32_t holders = 0;  ///< sleepers that may want it again
    bool listed = false;        ///< as one that may be forgotten
};

/// Looked up by address, never walked in that order.
class ShapeMemory {
public:
    /// Stays where it is until `forget`.
    const SurfaceData& of(const TriangleTree& tree, const ConvexHull* hull, std::uint64_t frame);
    /// It stays also while nobody asks for it, until it has been released as often.
    void hold(const TriangleTree& tree);
    void release(const TriangleTree* tree);
    /// Those not asked for since, and not held.
    void forget(std::uint64_t before);

private:
    void list(const TriangleTree* tree, SurfaceData& data);

    std::unordered_map<const TriangleTree*, std::unique_ptr<SurfaceData>> surfaces_;
    std::vector<const TriangleTree*> listed_;
};

}  // namespace tessera::rigid

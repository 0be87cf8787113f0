/// Which cores can be drawn, and what of them: the one place of the client that names such types.
#pragma once

#include <array>
#include <cstdint>

#include "common/base/Blob.h"
#include "common/geometry/Mesh.h"
#include "common/scene/Aspect.h"

namespace tessera {

/// Names a mesh by its content: cores with equal keys look alike, but for their material.
using MeshKey = std::array<BlobId, 5>;
struct MeshKeyHash {
    std::size_t operator()(const MeshKey& key) const {
        std::size_t h = 0;
        for (const BlobId& id : key) h = h * 0x9E3779B97F4A7C15ull + std::hash<BlobId>{}(id);
        return h;
    }
};

/// A drawable core as renderer and culler see it. Points into the aspect: holds until its next apply.
class Drawable {
public:
    [[nodiscard]] explicit operator bool() const { return core_ != nullptr; }
    [[nodiscard]] MeshKey key() const;
    /// Whether all its bytes are here.
    [[nodiscard]] bool resident() const;
    /// Handles on the arrays, not yet checked (see checkMesh).
    [[nodiscard]] MeshArrays arrays() const;
    /// A Material, or none.
    [[nodiscard]] ObjectId material() const;

private:
    friend Drawable drawableOf(const Aspect& aspect, ObjectId core);
    const Geometry* core_ = nullptr;
};

[[nodiscard]] bool isDrawable(ObjectType type);
/// False for an object that is not there or is nothing to be drawn.
[[nodiscard]] Drawable drawableOf(const Aspect& aspect, ObjectId core);

}  // namespace tessera

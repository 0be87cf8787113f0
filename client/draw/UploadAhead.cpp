#include "client/draw/UploadAhead.h"

#include <algorithm>
#include <unordered_set>

#include "common/drawable/Drawable.h"

namespace tessera {

Expected<bool> UploadAhead::step(Renderer& renderer, const Aspect& aspect, const RenderScene& scene, const Vec3d& eyeWorld,
                                 std::size_t bytes) {
    const std::uint64_t version = scene.version().contents;
    const Box bounds = scene.bounds();
    const double far = bounds.empty() ? 0 : kElsewhere * bounds.size().norm();
    if (scene_ != &scene || version != version_ || !((eyeWorld - eyeWorld_).norm() <= far)) {
        scene_ = &scene;
        version_ = version;
        eyeWorld_ = eyeWorld;
        contents_ = contentsOf(scene, eyeWorld);
        std::reverse(contents_.begin(), contents_.end());
        if (contents_.empty()) return false;
        std::uint64_t vertices = 0, indices = 0;
        std::unordered_set<BlobId> counted;
        for (const SceneContent& content : contents_) {
            const Drawable drawable = drawableOf(aspect, content.geometry);
            if (!drawable) continue;
            const MeshArrays arrays = drawable.arrays();
            if (arrays.primitive != Primitive::kTriangles || !counted.insert(arrays.positions.id()).second) continue;
            vertices += arrays.positions.sizeBytes() / (3 * sizeof(float));
            indices += arrays.indices.sizeBytes() / sizeof(std::uint32_t);
        }
        if (auto room = renderer.expectMeshes(vertices, indices); !room) return tl::unexpected(room.error());
        return true;
    }
    while (!contents_.empty()) {
        const SceneContent& next = contents_.back();
        const auto prepared = renderer.prepare(aspect, next.geometry, next.material, bytes);
        if (!prepared) return tl::unexpected(prepared.error());
        if (prepared->full) {
            contents_.clear();
            return false;
        }
        if (prepared->bytes == 0) {
            contents_.pop_back();
            continue;
        }
        if (prepared->bytes >= bytes) return true;
        bytes -= prepared->bytes;
    }
    return false;
}

}  // namespace tessera

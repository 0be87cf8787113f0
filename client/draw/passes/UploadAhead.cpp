#include "client/draw/passes/UploadAhead.h"

#include <algorithm>
#include <unordered_set>

#include "client/draw/passes/LookTable.h"
#include "client/draw/store/DrawForms.h"

namespace tessera {

Expected<bool> UploadAhead::step(Renderer& renderer, const Aspect& aspect, const RenderScene& scene,
                                 const Vec3d& eyeWorld, std::size_t bytes) {
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
        MeshSize size;
        std::unordered_set<MeshKey, MeshKeyHash> counted;
        for (const SceneContent& content : contents_) {
            MeshArrays arrays = content.mesh->arrays;
            // As large as with tangents, which are made when it is its turn.
            const bool mapped = !arrays.normals.empty() && normalMapOf(aspect, content.material);
            arrays.tangents = mapped ? arrays.positions : Blob();
            if (counted.insert(content.mesh->key).second) size += sizeOf(arrays);
        }
        if (auto room = renderer.expectMeshes(size); !room) return tl::unexpected(room.error());
        return true;
    }
    while (!contents_.empty()) {
        const SceneContent& next = contents_.back();
        const auto prepared = renderer.prepare(aspect, next, bytes);
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

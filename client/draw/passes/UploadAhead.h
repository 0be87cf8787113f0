/// What a scene has and GL has not yet, brought there in the time when a host waits.
#pragma once

#include <vector>

#include "client/draw/passes/Renderer.h"
#include "client/render/scene/SceneContents.h"

namespace tessera {

/// A slice at a time, what is nearest to the eye first, hidden or beside the picture as it may be, until a budget is
/// full. So turning around uploads little. Pictures do not depend on it. Belongs to the renderer's thread.
class UploadAhead {
public:
    /// Of a mesh; an image is a slice by itself, however large it is.
    static constexpr std::size_t kSliceBytes = std::size_t{1} << 20;

    /// One slice. False: nothing is left to do, as long as the scene has the same contents and the eye is about where
    /// it was.
    [[nodiscard]] Expected<bool> step(Renderer& renderer, const Aspect& aspect, const RenderScene& scene,
                                      const Vec3d& eyeWorld, std::size_t bytes = kSliceBytes);

private:
    /// Farther from where the contents were ordered, as a share of the scene's diagonal, they are ordered anew.
    static constexpr double kElsewhere = 0.05;

    std::vector<SceneContent> contents_;  ///< the nearest last
    const RenderScene* scene_ = nullptr;
    std::uint64_t version_ = 0;
    Vec3d eyeWorld_ = Vec3d::Zero();
};

}  // namespace tessera

/// Where the wall stands in the world, frame by frame.
#pragma once

#include <optional>
#include <string>

#include "common/codec/ApplicationCodec.h"
#include "common/scene/Aspect.h"
#include "common/wall/View.h"

namespace tessera {

/// The view is, in this order: what `tessera-ctl view` set; the scene's camera (the named one, else the first enabled
/// one in document order); the default camera, which frames the scene as it is when the first view is asked for.
class ViewSource {
public:
    /// `cameraPath`: a node as findNode takes it; empty: the first enabled camera.
    ViewSource(const Wall& wall, std::string cameraPath);

    /// Fails when the named camera is not there or is none.
    [[nodiscard]] Expected<View> view(const Aspect& scene);
    [[nodiscard]] Expected<void> set(const Aspect& scene, const request::SetView& wish);

private:
    [[nodiscard]] Expected<std::optional<View>> cameraView(const Aspect& scene) const;

    Wall wall_;
    std::string cameraPath_;
    std::vector<User> users_;
    std::optional<View> override_;
    std::optional<View> default_;
};

/// World bounds of all geometry that switches show. Blobs must be resident; absent ones count as nothing.
[[nodiscard]] Box sceneBounds(const Aspect& scene);

}  // namespace tessera

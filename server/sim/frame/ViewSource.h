/// Where the wall stands in the world, frame by frame.
#pragma once

#include <optional>
#include <string>

#include "common/codec/ApplicationCodec.h"
#include "common/scene/Aspect.h"
#include "common/wall/View.h"
#include "server/sim/frame/FirstCamera.h"
#include "server/sim/frame/NamedNode.h"

namespace tessera {

/// What a ViewSource knows and the scene does not.
struct ViewState {
    std::optional<View> byHand;    ///< what `tessera-ctl view` set
    std::optional<View> standing;  ///< the default camera, as the scene was when it was asked for
    std::vector<User> users;
};

/// The view is, in this order: what `tessera-ctl view` set; the scene's camera (the named one, else the first enabled
/// one in document order); the default camera, which frames the scene as it is when the first view is asked for.
///
/// Follows the scene: a frame in which nothing changed costs nothing, one in which something did a look-up per entry of
/// its list and the way from the camera up to the root. Not thread-safe.
class ViewSource {
public:
    /// `cameraPath`: a node as findNode takes it; empty: the first enabled camera.
    ViewSource(const Wall& wall, const std::string& cameraPath);

    /// After each list applied to the scene (or several compacted into one), with that list; null: anything may have
    /// changed. An empty scene needs no call.
    void update(const Aspect& scene, const ChangeList* list);

    /// `scene`: as of the last update. Fails when the named camera is not there or is none.
    [[nodiscard]] Expected<View> view(const Aspect& scene);
    [[nodiscard]] Expected<void> set(const Aspect& scene, const request::SetView& wish);

    [[nodiscard]] ViewState state() const;
    /// Another one whenever `state` may have changed.
    [[nodiscard]] std::uint64_t version() const { return version_; }
    /// Goes on from another's state: users that this wall has, and what makes sense.
    void goOnFrom(const ViewState& state);

    [[nodiscard]] const FirstCamera& firstCamera() const { return first_; }

private:
    [[nodiscard]] Expected<std::optional<View>> cameraView(const Aspect& scene) const;

    Wall wall_;
    std::vector<User> users_;
    std::optional<NamedNode> named_;  ///< none: the first camera counts
    FirstCamera first_;
    Expected<std::optional<View>> camera_ = std::optional<View>();
    std::optional<View> override_;
    std::optional<View> default_;
    std::uint64_t version_ = 0;
};

/// World bounds of all geometry that switches show. Blobs must be resident; absent ones count as nothing.
[[nodiscard]] Box sceneBounds(const Aspect& scene);

}  // namespace tessera

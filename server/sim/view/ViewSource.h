/// Where the wall stands in the world, frame by frame.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/request/ViewRequests.h"
#include "common/scene/Aspect.h"
#include "common/wall/View.h"
#include "server/sim/view/AnimatedBounds.h"
#include "server/sim/view/FirstCamera.h"
#include "server/sim/view/NamedNode.h"
#include "server/sim/view/TrackedHead.h"

namespace tessera {

/// Places that people keep, 1 to 9. Their users do not count. Where nobody has kept one, the scene's camera of that
/// number in document order stands for it, enabled or not.
using Bookmarks = std::array<std::optional<View>, 9>;

/// Where a wall stands that nobody has moved and no camera leads. kOfScene: where all of the scene is seen; kOfWall:
/// the world's coordinates are the wall's own, a unit a metre, as things stand in metres of it.
enum class FirstView : std::uint8_t { kOfScene, kOfWall };
/// Whether what stands for want of a camera stands in a studio (common/wall/Studio.h).
enum class Stage : std::uint8_t { kPlain, kStudio };

/// What a ViewSource knows and the scene does not.
struct ViewState {
    std::optional<View> byHand;    ///< what `tessera-ctl view` set, or who flies
    std::optional<View> standing;  ///< the default camera, as the scene was when it was asked for
    std::vector<User> users;
    Bookmarks bookmarks = {};
};

/// Heads stand where trackers see them, else where `tessera-ctl view` has put them, else where the wall's file says.
/// The view is, in this order: what `tessera-ctl view` set; the scene's camera (the named one, else the first enabled
/// one in document order); the default camera, which frames the scene as it is when the first view is asked for, and
/// wherever its animations take it (AnimatedBounds.h), or stands as FirstView says.
///
/// Follows the scene: a frame in which nothing changed costs nothing, one in which something did a look-up per entry of
/// its list and the way from the camera up to the root. Not thread-safe.
class ViewSource {
public:
    /// `cameraPath`: a node as findNode takes it; empty: the first enabled camera.
    ViewSource(const Wall& wall, const std::string& cameraPath, FirstView firstView = FirstView::kOfScene,
               Stage stage = Stage::kPlain);

    /// After each list applied to the scene (or several compacted into one), with that list; null: anything may have
    /// changed. An empty scene needs no call.
    void update(const Aspect& scene, const ChangeList* list);

    /// `scene`: as of the last update. Fails when the named camera is not there or is none.
    [[nodiscard]] Expected<View> view(const Aspect& scene);
    /// `bounds`: of the scene as its animations take it (AnimatedBounds), for who goes back to the default camera;
    /// null: it is found when the next view is.
    [[nodiscard]] Expected<void> set(const Aspect& scene, const ViewWish& wish, const AnimatedBounds* bounds = nullptr);
    /// The scene's camera counts unless somebody has moved the wall: no default one is needed.
    /// Without a camera all of the scene is to be seen: else the wall stands in its own place.
    [[nodiscard]] bool framesScene() const { return firstView_ == FirstView::kOfScene; }
    [[nodiscard]] bool hasCamera() const { return !camera_ || camera_->has_value(); }

    /// From now on the bounds of the scene are found elsewhere where a view needs them after the first one: `order` is
    /// called, and the wall stands where it stood until `surveyed` is told them. Not more than one order is open.
    /// `order` says how far the scene has come: a survey of an older one does not serve, and another is ordered.
    void surveyElsewhere(std::function<Sequence()> order) { order_ = std::move(order); }
    void surveyed(const AnimatedBounds& bounds, Sequence at);
    /// False: `home` is where the wall stands, until bounds that are found elsewhere are known.
    [[nodiscard]] bool homeKnown() const {
        return !camera_ || *camera_ || default_ || firstView_ != FirstView::kOfScene || !order_ || !last_;
    }
    /// How often `set` has moved the wall, or has let it go: who steers sees that somebody else does.
    [[nodiscard]] std::uint64_t setByHand() const { return setByHand_; }

    /// Where the wall stood if nobody had moved it. As `view` it fails where the named camera is not there.
    [[nodiscard]] Expected<View> home(const Aspect& scene);
    /// Where who flies has come to: as if set by hand. Users do not count. What checkStand refuses is not taken.
    void steer(const View& stand);
    /// The scene's camera counts again.
    void letGo();

    /// `number` from 0. Fails where nobody has kept one, and the scene has fewer cameras or none that stands soundly.
    [[nodiscard]] Expected<View> bookmark(const Aspect& scene, std::size_t number) const;
    /// `number` from 0. What checkStand refuses is not kept.
    void keepBookmark(std::size_t number, const View& stand);

    /// From now on these heads are where trackers see them; a head of half a share stands half way to where it would be
    /// without. Nothing of it is a part of `state`: a journal does not grow by it, and what goes on from one begins
    /// without trackers.
    void follow(std::span<const TrackedHead> heads) { tracked_.assign(heads.begin(), heads.end()); }

    [[nodiscard]] ViewState state() const;
    /// Another one whenever `state` may have changed.
    [[nodiscard]] std::uint64_t version() const { return version_; }
    /// Goes on from another's state: users that this wall has, and what makes sense.
    void goOnFrom(const ViewState& state);

    [[nodiscard]] const FirstCamera& firstCamera() const { return first_; }

private:
    void stand(const AnimatedBounds& bounds);
    [[nodiscard]] std::vector<User> usersNow() const;
    [[nodiscard]] Expected<std::optional<View>> cameraView(const Aspect& scene) const;

    Wall wall_;
    FirstView firstView_;
    Stage stage_;
    std::vector<User> users_;
    std::vector<TrackedHead> tracked_;
    std::optional<NamedNode> named_;  ///< none: the first camera counts
    FirstCamera first_;
    Expected<std::optional<View>> camera_ = std::optional<View>();
    std::optional<View> override_;
    std::optional<View> default_;  ///< its studio is that of all views
    std::optional<View> last_;     ///< that was told
    std::function<Sequence()> order_;
    std::optional<Sequence> ordered_;  ///< how far the scene had come then
    Bookmarks bookmarks_;
    std::uint64_t version_ = 0, setByHand_ = 0;
};

}  // namespace tessera

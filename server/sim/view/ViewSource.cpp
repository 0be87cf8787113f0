#include "server/sim/view/ViewSource.h"

#include <algorithm>

#include <fmt/format.h>

#include "common/cores/Camera.h"
#include "common/math/Decompositions.h"
#include "common/scene/Action.h"

namespace tessera {
namespace {

/// The rigid part of a camera node's pose; scale on the way to the camera is not the camera's.
Expected<View> viewOf(const Aspect& scene, ObjectId node, const Camera& camera) {
    const Affine3d world_T_camera = worldTransform(scene, node);
    if (!world_T_camera.matrix().allFinite())
        return fail(ErrorCode::kBadInput,
                    fmt::format("camera {}: its place in the world is not finite", pathOf(scene, node)));
    View view;
    view.position = world_T_camera.translation();
    view.orientation = Quatd(rotationOf(world_T_camera)).normalized();
    view.worldUnitsPerMetre = camera.worldUnitsPerMetre;
    if (const Expected<void> sound = checkStand(view); !sound)
        return failWith(fmt::format("camera {}", pathOf(scene, node)), sound.error());
    return view;
}

}  // namespace

ViewSource::ViewSource(const Wall& wall, const std::string& cameraPath, FirstView firstView, Stage stage)
    : wall_(wall), firstView_(firstView), stage_(stage), users_(wall.users) {
    if (cameraPath.empty()) return;
    named_.emplace(cameraPath);
    update(Aspect(), nullptr);
}

void ViewSource::update(const Aspect& scene, const ChangeList* list) {
    if (named_) named_->update(scene, list);
    first_.update(scene, list);
    camera_ = cameraView(scene);
}

Expected<std::optional<View>> ViewSource::cameraView(const Aspect& scene) const {
    if (!named_) {
        if (!first_.node()) return std::optional<View>();
        return viewOf(scene, first_.node(), *scene.coreOf<Camera>(*scene.get<Node>(first_.node())));
    }
    if (!named_->node()) return failWith("camera", named_->node().error());
    const ObjectId node = *named_->node();
    const Camera* camera = scene.coreOf<Camera>(*scene.get<Node>(node));
    if (!camera) return fail(ErrorCode::kBadInput, fmt::format("camera: {} holds no Camera", named_->path()));
    return viewOf(scene, node, *camera);
}

Expected<View> ViewSource::view(const Aspect& scene) {
    Expected<View> result = override_ ? Expected<View>(*override_) : home(scene);
    if (!result) return result;
    result->users = usersNow();
    // While a new place is looked for, the old one stays.
    const std::optional<View>& known = default_ || !ordered_ ? default_ : last_;
    result->studio = stage_ == Stage::kStudio && known ? known->studio : std::nullopt;
    last_ = *result;
    return result;
}

Expected<View> ViewSource::home(const Aspect& scene) {
    if (!camera_) return tl::unexpected(camera_.error());
    View result;
    if (*camera_) {
        result = **camera_;
    } else {
        const bool surveys = firstView_ == FirstView::kOfScene;
        if (!homeKnown()) {
            if (!ordered_) ordered_ = order_();
            result = *last_;
        } else {
            if (!default_) stand(surveys || stage_ == Stage::kStudio ? animatedBounds(scene) : AnimatedBounds());
            // A scene of no finite size has no place from where all of it is seen.
            result = checkStand(*default_) ? *default_ : View();
        }
    }
    result.users = usersNow();
    return result;
}

void ViewSource::stand(const AnimatedBounds& bounds) {
    const bool inStudio = stage_ == Stage::kStudio;
    default_ = firstView_ == FirstView::kOfWall ? View()
               : inStudio                       ? studioView(wall_, bounds.box, bounds.samples)
                                                : defaultView(wall_, bounds.box);
    if (inStudio) default_->studio = studioBelow(bounds.box, bounds.now);
    ++version_;
}

void ViewSource::surveyed(const AnimatedBounds& bounds, Sequence at) {
    if (!ordered_) return;
    // Somebody else's, which began before.
    if (!default_ && at < *ordered_) return static_cast<void>(order_());
    ordered_.reset();
    if (!default_) stand(bounds);
}

std::vector<User> ViewSource::usersNow() const {
    std::vector<User> users = users_;
    for (const TrackedHead& head : tracked_) {
        const auto user = std::ranges::find(users, head.user, &User::name);
        // A sensor that says it is on the moon moves nobody; where an eye comes behind a screen, screenCamera keeps it
        // in front.
        if (user == users.end() || !(head.share > 0) ||
            !(head.position.cwiseAbs().maxCoeff() <= WallLimits().maxMetres))
            continue;
        user->position += std::min(head.share, 1.0) * (head.position - user->position);
        user->orientation = user->orientation.normalized().slerp(std::min(head.share, 1.0), head.orientation);
    }
    return users;
}

void ViewSource::steer(const View& stand) {
    if (!checkStand(stand)) return;
    override_ = stand;
    override_->orientation.normalize();
    ++version_;
}

void ViewSource::letGo() {
    if (!override_) return;
    override_.reset();
    ++version_;
}

Expected<View> ViewSource::bookmark(const Aspect& scene, std::size_t number) const {
    if (number < bookmarks_.size() && bookmarks_[number]) return *bookmarks_[number];
    const ObjectId node = number < bookmarks_.size() ? first_.numbered(scene, number) : ObjectId();
    if (!node)
        return fail(ErrorCode::kNotFound,
                    fmt::format("nobody has kept a bookmark {0}, and the scene has no camera {0}", number + 1));
    return viewOf(scene, node, *scene.coreOf<Camera>(*scene.get<Node>(node)));
}

void ViewSource::keepBookmark(std::size_t number, const View& stand) {
    if (number >= bookmarks_.size() || !checkStand(stand)) return;
    bookmarks_[number] = stand;
    bookmarks_[number]->users.clear();
    ++version_;
}

ViewState ViewSource::state() const {
    ViewState state{.byHand = override_, .standing = {}, .users = users_, .bookmarks = bookmarks_};
    // That of a scene of no finite size is found anew.
    if (default_ && checkStand(*default_)) state.standing = default_;
    return state;
}

void ViewSource::goOnFrom(const ViewState& state) {
    if (state.byHand && checkStand(*state.byHand)) override_ = state.byHand;
    if (state.standing && checkStand(*state.standing)) default_ = state.standing;
    for (std::size_t i = 0; i < bookmarks_.size(); ++i)
        if (state.bookmarks[i]) keepBookmark(i, *state.bookmarks[i]);
    Wall moved = wall_;
    moved.users = users_;
    for (User& user : moved.users) {
        const auto known = std::ranges::find(state.users, user.name, &User::name);
        if (known != state.users.end()) user = *known;
    }
    if (checkWall(moved)) users_ = std::move(moved.users);
}

Expected<void> ViewSource::set(const Aspect& scene, const ViewWish& wish, const AnimatedBounds* bounds) {
    if (wish.reset) {
        override_.reset();
        // The wall's own place is always the same, and so is its studio.
        if (firstView_ == FirstView::kOfScene) default_.reset();
        ordered_.reset();
        if (bounds) stand(*bounds);
        users_ = wall_.users;
    }
    const bool moves = wish.position || wish.orientation || wish.worldUnitsPerMetre;
    View next;
    if (moves) {
        const Expected<View> now = view(scene);
        if (!now) return tl::unexpected(now.error());
        next = *now;
        if (wish.position) next.position = *wish.position;
        if (wish.orientation) next.orientation = *wish.orientation;
        if (wish.worldUnitsPerMetre) next.worldUnitsPerMetre = *wish.worldUnitsPerMetre;
        if (const Expected<void> sound = checkStand(next); !sound) return failWith("view", sound.error());
        next.orientation.normalize();
    }
    if (wish.head) {
        if (!wish.head->allFinite()) return fail(ErrorCode::kBadInput, "the head's position is not finite");
        Wall moved = wall_;
        moved.users = users_;
        bool known = false;
        for (User& user : moved.users) {
            if (user.name != wish.user && !(wish.user.empty() && moved.users.size() == 1)) continue;
            user.position = *wish.head;
            known = true;
        }
        if (!known) {
            std::string names;
            for (const User& user : users_) names += (names.empty() ? "" : ", ") + user.name;
            return fail(ErrorCode::kNotFound,
                        fmt::format("no user is called '{}'; the wall has: {}", wish.user, names));
        }
        // An eye on or behind a screen has no picture: the wall's own rules decide.
        if (const Expected<void> sound = checkWall(moved); !sound) return failWith("head", sound.error());
        users_ = moved.users;
    }
    if (moves) override_ = next;
    if (moves || wish.reset) ++setByHand_;
    ++version_;
    return {};
}

}  // namespace tessera

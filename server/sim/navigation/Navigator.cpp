#include "server/sim/navigation/Navigator.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tessera {
namespace {

/// Slower counts as rest: m/s, rad/s, and what is left of a logarithm or an angle.
constexpr double kRest = 1e-4;

/// A quantity that follows `target` with the time constant of the navigator: its way in `seconds`, exactly.
double glide(double& speed, double target, double seconds) {
    const double fades = std::exp(-seconds / Navigator::kTau), off = speed - target;
    const double way = target * seconds + off * Navigator::kTau * (1 - fades);
    speed = target + off * fades;
    if (target == 0 && std::abs(speed) < kRest) speed = 0;
    return way;
}

constexpr auto isGrab = [](const auto& wait) { return wait.action == InputAction::kGrab; };

/// What goes now of something that is left to do.
double drain(double& left, double seconds) {
    const double rest = left * std::exp(-seconds / (Navigator::kTau / 2));
    const double way = std::abs(rest) < kRest ? left : left - rest;
    left -= way;
    return way;
}

double within(double value) {
    return std::clamp(value, -1.0, 1.0);
}

bool isFinite(const NavigationInput& input) {
    return input.move.allFinite() && input.turn.allFinite() && std::isfinite(input.roll) && input.look.allFinite() &&
           input.pan.allFinite() && std::isfinite(input.wheel);
}

double radians(double degrees) {
    return degrees * std::numbers::pi / 180;
}

}  // namespace

Heading headingOf(const Quatd& orientation) {
    const Quatd q = orientation.normalized();
    const Vec3d ahead = q * -Vec3d::UnitZ(), right = q * Vec3d::UnitX(), up = q * Vec3d::UnitY();
    Heading heading{.pitch = std::asin(within(ahead.y()))};
    if (std::hypot(ahead.x(), ahead.z()) < 1e-9) {
        // Straight up or down: what is roll there and what is yaw nobody can tell.
        heading.yaw = std::atan2(-right.z(), right.x());
        return heading;
    }
    heading.yaw = std::atan2(-ahead.x(), -ahead.z());
    heading.roll = std::atan2(right.y(), up.y());
    if (std::abs(heading.roll) < 1e-12) heading.roll = 0;  // rounding does not tilt anybody in the course of hours
    return heading;
}

Quatd orientationOf(const Heading& h) {
    using Turn = Eigen::AngleAxisd;
    return Quatd(Turn(h.yaw, Vec3d::UnitY()) * Turn(h.pitch, Vec3d::UnitX()) * Turn(h.roll, Vec3d::UnitZ()))
        .normalized();
}

Navigator::Navigator(const Wall& wall) : wall_(wall), mode_(wall.navigation.mode) {}

void Navigator::setMode(NavigationMode mode) {
    if (mode == mode_) return;
    mode_ = mode;
    velocity_ = turning_ = Vec3d::Zero();
    near_ = 0;
    centre_.reset();
    std::erase_if(waits_, isGrab);
    walker_.reset();
}

void Navigator::goTo(const View& place) {
    toPlace_ = place;
}

void Navigator::placed() {
    velocity_ = turning_ = Vec3d::Zero();
    near_ = 0;
    levelling_ = false;
    centre_.reset();
    path_.reset();
    waits_.clear();
    walker_.reset();
}

bool Navigator::still() const {
    return velocity_.isZero(0) && turning_.isZero(0) && near_ == 0 && !levelling_ && mode_ != NavigationMode::kWalk;
}

/// The user who looks at the first tile.
Vec3d Navigator::headOf(const View& view) const {
    const std::string name =
        wall_.hosts.empty() || wall_.hosts.front().tiles.empty() ? "" : wall_.hosts.front().tiles.front().user;
    if (const User* user = view.findUser(name)) return user->position;
    if (const User* user = wall_.findUser(name)) return user->position;
    return Vec3d::Zero();
}

std::optional<View> Navigator::fitted(const View& now, const Box& box) const {
    if (box.empty() || !box.lower.allFinite() || !box.upper.allFinite()) return std::nullopt;
    const View upright = uprightView(wall_, box);
    View view = now;
    if (box.size().norm() > 0) view.worldUnitsPerMetre = upright.worldUnitsPerMetre;
    // The middle of the screen, from the wall's origin, in the world of a wall that stands upright.
    const Vec3d middle = (box.center() - upright.position) / upright.worldUnitsPerMetre;
    view.position = box.center() - view.worldUnitsPerMetre * (now.orientation.normalized() * middle);
    return view;
}

void Navigator::begin(const View& now, const View& end, bool home) {
    if (!checkStand(end)) return;
    placed();
    const Vec3d head = headOf(now);
    path_ = Path{.fromEye = now.world_T_wall() * head,
                 .toEye = end.world_T_wall() * head,
                 .from = now.orientation.normalized(),
                 .to = end.orientation.normalized(),
                 .fromScale = now.worldUnitsPerMetre,
                 .toScale = end.worldUnitsPerMetre,
                 .end = end,
                 .home = home};
}

/// A way to where the wall stands anyway would end before that is known.
bool Navigator::beginHome(const View& now, const NavigationScene& scene) {
    const bool known = !scene.homeKnown || scene.homeKnown();
    const std::optional<View> home = scene.home();
    if (known && home) begin(now, *home, true);
    return known;
}

bool Navigator::beginFit(const Wait& wish, const View& now, const NavigationScene& scene) {
    std::optional<Box> box = wish.action == InputAction::kFit && wish.pointing ? scene.boundsAt(*wish.pointing) : Box();
    if (box && box->empty()) box = scene.bounds();
    if (!box) return false;
    if (const std::optional<View> view = fitted(now, *box)) begin(now, *view, false);
    return true;
}

bool Navigator::centreOn(const Ray& pointing, const NavigationScene& scene) {
    const std::optional<double> t = scene.hit(pointing);
    if (t && std::isfinite(*t)) centre_ = pointing.origin + *t * pointing.direction;
    return t.has_value();
}

bool Navigator::begins(const Wait& wish, const View& now, const NavigationScene& scene) {
    if (wish.action == InputAction::kHome) return beginHome(now, scene);
    if (wish.action == InputAction::kGrab) return !wish.pointing || centreOn(*wish.pointing, scene);
    return beginFit(wish, now, scene);
}

/// The newer of two ways, and of two grabs, counts.
void Navigator::beginOrWait(const Wait& wish, const View& now, const NavigationScene& scene) {
    std::erase_if(waits_, [&](const Wait& other) { return isGrab(other) == isGrab(wish); });
    if (!begins(wish, now, scene)) waits_.push_back(wish);
}

void Navigator::take(const NavigationInput& input, const View& now, const NavigationScene& scene) {
    // What is asked for by name, as if by a key.
    for (const Wait& wait : std::vector<Wait>(waits_)) beginOrWait(wait, now, scene);
    if (std::exchange(toHome_, false)) beginOrWait({.action = InputAction::kHome}, now, scene);
    if (const std::optional<Box> box = std::exchange(toFit_, std::nullopt))
        if (const std::optional<View> view = fitted(now, *box)) begin(now, *view, false);
    if (const std::optional<View> place = std::exchange(toPlace_, std::nullopt)) begin(now, *place, false);

    const std::optional<Ray> pointing = [&]() -> std::optional<Ray> {
        if (!input.pointing) return std::nullopt;
        const Affine3d world_T_wall = now.world_T_wall();
        return Ray{.origin = world_T_wall * input.pointing->origin,
                   .direction = world_T_wall.linear() * input.pointing->direction};
    }();
    for (const InputAction action : input.actions) {
        const auto number = static_cast<std::size_t>(action);
        switch (action) {
            case InputAction::kHome:
            case InputAction::kFit:
            case InputAction::kFitAll:
                beginOrWait({.action = action, .pointing = pointing}, now, scene);
                break;
            case InputAction::kFly:
                setMode(NavigationMode::kFly);
                break;
            case InputAction::kOrbit:
                setMode(NavigationMode::kOrbit);
                break;
            case InputAction::kWalk:
                setMode(NavigationMode::kWalk);
                break;
            case InputAction::kNextMode:
                setMode(mode_ == kLastNavigationMode ? NavigationMode::kFly
                                                     : static_cast<NavigationMode>(static_cast<int>(mode_) + 1));
                break;
            case InputAction::kLevel:
                levelling_ = true;
                break;
            case InputAction::kGrab:
                if (mode_ == NavigationMode::kOrbit) beginOrWait({.action = action, .pointing = pointing}, now, scene);
                break;
            default:
                if (number >= static_cast<std::size_t>(InputAction::kKeep1)) {
                    scene.keepBookmark(number - static_cast<std::size_t>(InputAction::kKeep1), now);
                } else if (const auto view = scene.bookmark(number - static_cast<std::size_t>(InputAction::kGoTo1))) {
                    begin(now, *view, false);
                }
        }
    }
}

Navigator::Step Navigator::alongPath(const View& now, double seconds) {
    Path& path = *path_;
    path.seconds += seconds;
    const double t = std::min(1.0, path.seconds / kEased);
    View view = now;
    if (t >= 1 - 1e-9) {
        Step last{.view = path.end, .home = path.home};
        path_.reset();
        return last;
    }
    // Speed and acceleration are 0 at both ends.
    const double s = t * t * t * (10 - 15 * t + 6 * t * t);
    view.orientation = path.from.slerp(s, path.to);
    view.worldUnitsPerMetre = path.fromScale * std::pow(path.toScale / path.fromScale, s);
    const Vec3d eye = path.fromEye + s * (path.toEye - path.fromEye);
    view.position = eye - view.worldUnitsPerMetre * (view.orientation * headOf(now));
    return {.view = view};
}

Heading Navigator::turned(const Heading& heading, const NavigationInput& input, double drag, double seconds) {
    const double rate = radians(wall_.navigation.turnDegrees);
    Heading next = heading;
    next.yaw -= glide(turning_.x(), within(input.turn.x()) * rate, seconds) + input.look.x() * drag;
    const double up = glide(turning_.y(), within(input.turn.y()) * rate, seconds) - input.look.y() * drag;
    // Who was put steeper than that by hand stays so until he looks back.
    next.pitch =
        std::clamp(heading.pitch + up, std::min(heading.pitch, -kSteepestLook), std::max(heading.pitch, kSteepestLook));
    if (input.roll != 0) levelling_ = false;
    next.roll -= glide(turning_.z(), within(input.roll) * rate, seconds);
    if (levelling_ || mode_ == NavigationMode::kWalk) {
        double left = next.roll;
        (void)drain(left, seconds);
        next.roll = left;
        if (left == 0) levelling_ = false;
    }
    return next;
}

void Navigator::fly(Stand& stand, const NavigationInput& input, double seconds) {
    pace_ = paceAfter(pace_, input.wheel);
    const Heading before = headingOf(stand.orientation), after = turned(before, input, kLookRadians, seconds);
    if (after.yaw != before.yaw || after.pitch != before.pitch || after.roll != before.roll)
        stand.orientation = orientationOf(after);
    const double speed = wall_.navigation.speed * pace_ * (input.faster ? wall_.navigation.fasterFactor : 1);
    Vec3d way;
    for (int i = 0; i < 3; ++i) way[i] = glide(velocity_[i], within(input.move[i]) * speed, seconds);
    // A drag that shifts does as if there were something two metres away.
    const Vec3d sight(way.x() - 2 * input.pan.x(), 2 * input.pan.y(), way.z());
    stand.eye += stand.scale * (stand.orientation * sight + way.y() * Vec3d::UnitY());
}

void Navigator::orbit(Stand& stand, const NavigationInput& input, const NavigationScene& scene, double seconds) {
    if (!centre_) {
        const std::optional<Box> known = scene.bounds();
        if (!known) return static_cast<void>(near_ += input.wheel * std::log(kNearStep));  // nobody goes around it yet
        const Box& box = *known;
        const bool there = !box.empty() && box.lower.allFinite() && box.upper.allFinite();
        centre_ = there ? box.center() : Vec3d(stand.eye - 2 * stand.scale * (stand.orientation * Vec3d::UnitZ()));
    }
    // Keys and sticks that move go around, too; forward nears.
    NavigationInput around = input;
    around.turn += Vec2d(input.move.x(), -input.move.y());
    const Quatd from = stand.orientation;
    const Heading before = headingOf(from), after = turned(before, around, kOrbitRadians, seconds);
    Vec3d away = stand.eye - *centre_;
    if (after.yaw != before.yaw || after.pitch != before.pitch || after.roll != before.roll) {
        stand.orientation = orientationOf(after);
        away = stand.orientation * (from.conjugate() * away);
    }
    near_ += input.wheel * std::log(kNearStep);
    const double distance = away.norm(), least = kNearest * stand.scale;
    const double change =
        drain(near_, seconds) + glide(velocity_.z(), within(input.move.z()) * (input.faster ? 4 : 1), seconds);
    if (change != 0 && distance > 0) away *= std::max(std::exp(change), std::min(1.0, least / distance));
    if (!input.pan.isZero(0))
        *centre_ += std::max(distance, least) * (stand.orientation * Vec3d(-input.pan.x(), input.pan.y(), 0));
    stand.eye = *centre_ + away;
}

void Navigator::walk(Stand& stand, const Vec3d& head, const NavigationInput& input, const NavigationScene& scene,
                     double seconds) {
    pace_ = paceAfter(pace_, input.wheel);
    if (!walker_ || walker_->scale() != stand.scale) {
        walker_.emplace(wall_.navigation);
        if (!walker_->standAt(stand.eye, head.y(), stand.scale, scene)) walker_.reset();
        walkedHead_ = head;
    }
    const Heading before = headingOf(stand.orientation), after = turned(before, input, kLookRadians, seconds);
    const Quatd facing = orientationOf({.yaw = after.yaw});
    if (after.yaw != before.yaw || after.pitch != before.pitch || after.roll != before.roll)
        stand.orientation = orientationOf(after);
    if (!walker_) {
        velocity_ = Vec3d::Zero();
        return;
    }
    const double speed =
        std::min(kFastestWalk, wall_.navigation.speed * pace_ * (input.faster ? wall_.navigation.fasterFactor : 1));
    Vec3d way = Vec3d::Zero();
    for (const int i : {0, 2}) way[i] = glide(velocity_[i], within(input.move[i]) * speed, seconds);
    velocity_.y() = 0;
    // Who steps aside in the room steps aside in the scene, and stops at its walls.
    const Vec3d aside = std::exchange(walkedHead_, head) - head;
    const Vec3d whole = facing * (way - Vec3d(aside.x(), 0, aside.z()));
    // Each finds its own ground: one that is as long as the frame would leap stairs and take slopes for walls.
    const int strides = std::max(1, static_cast<int>(std::ceil(seconds / kLongestStride - 1e-9)));
    for (int i = 0; i < strides; ++i) stand.eye = walker_->step(whole / strides, head.y(), seconds / strides, scene);
}

Navigator::Step Navigator::step(const View& now, const NavigationInput& wanted, const NavigationScene& scene,
                                double seconds) {
    // A source that says what is no number says nothing.
    const NavigationInput input = isFinite(wanted) ? wanted : NavigationInput{};
    take(input, now, scene);
    if (input.steers()) {
        path_.reset();
        std::erase_if(waits_, [](const Wait& wait) { return !isGrab(wait); });
    }
    if (path_) return alongPath(now, seconds);
    if (still() && !input.steers()) return {};

    const Vec3d head = headOf(now);
    const Stand before{now.world_T_wall() * head, now.orientation.normalized(), now.worldUnitsPerMetre};
    Stand stand = before;
    if (mode_ == NavigationMode::kWalk && walker_ && walker_->scale() == stand.scale) stand.eye = walker_->eye();
    const Stand from = stand;
    const bool stoodAsNow = walker_ && head == walkedHead_;
    switch (mode_) {
        case NavigationMode::kFly:
            fly(stand, input, seconds);
            break;
        case NavigationMode::kOrbit:
            orbit(stand, input, scene, seconds);
            break;
        case NavigationMode::kWalk:
            walk(stand, head, input, scene, seconds);
            break;
    }
    const bool headMoved = mode_ == NavigationMode::kWalk && walker_ && !stoodAsNow;
    if (stand == from && !headMoved) return {};
    View view = now;
    view.orientation = stand.orientation;
    view.position = stand.eye - stand.scale * (stand.orientation * head);
    if (!checkStand(view)) {
        // At the end of the world nobody goes on.
        placed();
        return {};
    }
    return {.view = view};
}

}  // namespace tessera

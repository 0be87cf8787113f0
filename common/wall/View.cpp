#include "common/wall/View.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/math/Compose.h"

namespace tessera {

namespace {

constexpr double kNearestEyeMetres = 0.01;

/// Unit axes of a screen in the wall's frame: right, up and towards the viewer.
struct ScreenAxes {
    Vec3d right, up, normal;
};

ScreenAxes axesOf(const Screen& screen) {
    ScreenAxes axes;
    axes.right = (screen.lowerRight - screen.lowerLeft).normalized();
    axes.up = (screen.upperLeft - screen.lowerLeft).normalized();
    axes.normal = axes.right.cross(axes.up).normalized();
    return axes;
}

/// In the wall's frame; kept in front of the screen.
Vec3d eyeInFrontOf(const Screen& screen, const ScreenAxes& axes, const User& user, Eye eye) {
    const Vec3d position = user.eye(eye);
    const double distance = axes.normal.dot(position - screen.lowerLeft);
    return distance >= kNearestEyeMetres ? position : Vec3d(position + (kNearestEyeMetres - distance) * axes.normal);
}

const User& userOf(const Wall& wall, const View& view, std::string_view name) {
    if (const User* user = view.findUser(name)) return *user;
    const User* user = wall.findUser(name);
    TESSERA_CHECK(user != nullptr, "a tile names a user that its wall does not have: checkWall was not called");
    return *user;
}

/// For whom the first screen is drawn.
const User& firstUserOf(const Wall& wall, const View& view) {
    for (const Tile& tile : layoutTiles(wall))
        if (tile.screen == wall.screens.front().name) return userOf(wall, view, tile.user);
    return wall.users.front();
}

const Screen& screenOf(const Wall& wall, const Tile& tile) {
    const Screen* screen = wall.findScreen(tile.screen);
    TESSERA_CHECK(screen != nullptr, "a tile names a screen that its wall does not have: checkWall was not called");
    return *screen;
}

}  // namespace

Affine3d View::world_T_wall() const {
    return composeTransform(position, orientation, Vec3d::Constant(worldUnitsPerMetre));
}

const User* View::findUser(std::string_view name) const {
    const auto it = std::find_if(users.begin(), users.end(), [&](const User& user) { return user.name == name; });
    return it == users.end() ? nullptr : &*it;
}

// Kooima, "Generalized Perspective Projection", 2008. The corners describe the whole physical screen, so the picture of
// `pixels` includes what lies behind bezels; nothing in here depends on how the screen is cut into tiles.
ScreenCamera screenCamera(const Screen& screen, const User& user, Eye eye, const View& view, double nearMetres) {
    const ScreenAxes axes = axesOf(screen);
    const Vec3d eyeWall = eyeInFrontOf(screen, axes, user, eye);

    ScreenCamera camera;
    camera.pixels = screenPixels(screen);
    const Affine3d world_T_wall = view.world_T_wall();
    camera.eyeWorld = world_T_wall * eyeWall;
    camera.headWorld = world_T_wall * user.eye(Eye::kCenter);
    camera.detail = view.detail;
    camera.studio = view.studio;
    camera.exposure = view.exposure;

    // wall_T_world = scale^-1 · rotation^T · (p - position); then onto the screen's axes from the eye.
    Mat3d screen_R_wall;
    screen_R_wall.row(0) = axes.right.transpose();
    screen_R_wall.row(1) = axes.up.transpose();
    screen_R_wall.row(2) = axes.normal.transpose();
    const Mat3d wall_R_world = view.orientation.normalized().toRotationMatrix().transpose();
    camera.eye_T_world = Affine3d::Identity();
    camera.eye_T_world.linear() = (screen_R_wall * wall_R_world) / view.worldUnitsPerMetre;
    camera.eye_T_world.translation() = -(camera.eye_T_world.linear() * camera.eyeWorld);

    const Vec3d toLowerLeft = screen.lowerLeft - eyeWall;
    const double distance = -axes.normal.dot(toLowerLeft);
    const double near = nearMetres;
    const double atNear = near / distance;
    const double left = axes.right.dot(toLowerLeft) * atNear;
    const double right = axes.right.dot(screen.lowerRight - eyeWall) * atNear;
    const double bottom = axes.up.dot(toLowerLeft) * atNear;
    const double top = axes.up.dot(screen.upperLeft - eyeWall) * atNear;

    Mat4d& m = camera.clip_T_eye;
    m.setZero();
    m(0, 0) = 2 * near / (right - left);
    m(0, 2) = (right + left) / (right - left);
    m(1, 1) = 2 * near / (top - bottom);
    m(1, 2) = (top + bottom) / (top - bottom);
    // The limit of a far plane that goes away without an end: a reversed depth in floats resolves as well (Upchurch and
    // Desbrun 2012).
    m(2, 2) = -1;
    m(2, 3) = -2 * near;
    m(3, 2) = -1;
    return camera;
}

ScreenCamera tileCamera(const Wall& wall, const Tile& tile, const View& view) {
    ScreenCamera camera =
        screenCamera(screenOf(wall, tile), userOf(wall, view, tile.user), tile.eye, view, wall.nearMetres);
    const auto user =
        std::find_if(wall.users.begin(), wall.users.end(), [&](const User& u) { return u.name == tile.user; });
    camera.user = static_cast<unsigned>(user - wall.users.begin());
    return camera;
}

Frustum tileFrustum(const ScreenCamera& camera, const PixelRect& rect, double marginPx) {
    // The rectangle's edges in the whole screen's normalised coordinates become the edges of a clip space of its own.
    const auto ndc = [](double pixel, int pixels) { return 2 * pixel / pixels - 1; };
    const double x0 = ndc(rect.x - marginPx, camera.pixels.width);
    const double x1 = ndc(rect.x + rect.width + marginPx, camera.pixels.width);
    const double y0 = ndc(rect.y - marginPx, camera.pixels.height);
    const double y1 = ndc(rect.y + rect.height + marginPx, camera.pixels.height);
    Mat4d tile_T_clip = Mat4d::Identity();
    tile_T_clip(0, 0) = 2 / (x1 - x0);
    tile_T_clip(0, 3) = -(x1 + x0) / (x1 - x0);
    tile_T_clip(1, 1) = 2 / (y1 - y0);
    tile_T_clip(1, 3) = -(y1 + y0) / (y1 - y0);
    const Mat4d tile_T_world = tile_T_clip * camera.clip_T_eye * camera.eye_T_world.matrix();
    return Frustum::fromClipMatrix(tile_T_world);
}

Expected<Ray> pickRay(const Wall& wall, const View& view, double xPx, double yPx) {
    TESSERA_CHECK(!wall.screens.empty(), "a wall without screens: checkWall was not called");
    const Screen& screen = wall.screens.front();
    const ScreenPixels mosaic = mosaicPixels(screen);
    if (!(xPx >= 0 && yPx >= 0 && xPx < mosaic.width && yPx < mosaic.height)) {
        return fail(ErrorCode::kBadInput,
                    fmt::format("pixel ({}, {}) lies outside the picture of {} x {} pixels of screen \"{}\"", xPx, yPx,
                                mosaic.width, mosaic.height, screen.name));
    }
    const int column = static_cast<int>(xPx);
    const int row = mosaic.height - 1 - static_cast<int>(yPx);
    for (const Tile& tile : layoutTiles(wall)) {
        const PixelRect& r = tile.mosaicRect;
        if (tile.screen != screen.name || column < r.x || column >= r.x + r.width || row < r.y || row >= r.y + r.height)
            continue;
        const ScreenPixels whole = screenPixels(screen);
        const double u = (tile.rect.x + (column - r.x) + 0.5) / whole.width;
        const double v = (tile.rect.y + (row - r.y) + 0.5) / whole.height;
        const Vec3d onScreen =
            screen.lowerLeft + u * (screen.lowerRight - screen.lowerLeft) + v * (screen.upperLeft - screen.lowerLeft);
        const Vec3d eye = eyeInFrontOf(screen, axesOf(screen), userOf(wall, view, tile.user), tile.eye);
        const Affine3d world_T_wall = view.world_T_wall();
        return Ray{.origin = world_T_wall * eye, .direction = (world_T_wall.linear() * (onScreen - eye)).normalized()};
    }
    return fail(ErrorCode::kNotFound,
                fmt::format("no tile of screen \"{}\" shows pixel ({}, {})", screen.name, xPx, yPx));
}

View uprightView(const Wall& wall, const Box& sceneBounds) {
    View view;
    view.users = wall.users;
    if (wall.screens.empty() || wall.users.empty() || sceneBounds.empty()) return view;
    if (!sceneBounds.lower.allFinite() || !sceneBounds.upper.allFinite()) return view;

    const Screen& screen = wall.screens.front();
    const ScreenAxes axes = axesOf(screen);
    const Vec3d eye = eyeInFrontOf(screen, axes, firstUserOf(wall, view), Eye::kCenter);
    const Vec3d upperRight = screen.lowerRight + screen.upperLeft - screen.lowerLeft;
    const Vec3d corners[4] = {screen.lowerLeft, screen.lowerRight, upperRight, screen.upperLeft};
    const Vec3d center = 0.5 * (screen.lowerLeft + upperRight);

    // The largest sphere around the screen's middle inside the pyramid from the eye through the screen's edges.
    double radiusMetres = (center - eye).norm();
    for (int edge = 0; edge < 4; ++edge) {
        const Vec3d normal = (corners[edge] - eye).cross(corners[(edge + 1) % 4] - eye).normalized();
        radiusMetres = std::min(radiusMetres, std::abs(normal.dot(center - eye)));
    }
    const double radiusWorld = 0.5 * sceneBounds.size().norm();
    if (radiusWorld > 0 && radiusMetres > 0) view.worldUnitsPerMetre = radiusWorld / radiusMetres;
    view.position = sceneBounds.center() - view.worldUnitsPerMetre * center;
    return view;
}

View defaultView(const Wall& wall, const Box& sceneBounds) {
    View view = uprightView(wall, sceneBounds);
    if (wall.screens.empty() || wall.users.empty() || sceneBounds.empty() || !view.position.allFinite()) return view;
    // A sphere fits however the wall is turned about its middle.
    constexpr double kDegree = std::numbers::pi / 180;
    view.orientation =
        Quatd(Eigen::AngleAxisd(30 * kDegree, Vec3d::UnitY()) * Eigen::AngleAxisd(-25 * kDegree, Vec3d::UnitX()));
    const Vec3d middle = sceneBounds.center();
    view.position = middle + view.orientation * (view.position - middle);
    return view;
}

namespace {

/// What a screen shows of points along one of its axes: the outermost two, in shares of it from its middle, and how far
/// before the eye they are, in shares of its distance to the screen.
struct Extent {
    double lower = 1e300, upper = -1e300, lowerDepth = 1, upperDepth = 1;

    void add(double share, double depth) {
        if (share < lower) lower = share, lowerDepth = depth;
        if (share > upper) upper = share, upperDepth = depth;
    }
    /// So far aside at the screen, in shares of it, brings these two to the same distance from its middle.
    [[nodiscard]] double aside() const { return (lower + upper) * lowerDepth * upperDepth / (lowerDepth + upperDepth); }
    /// Between the two once they are in the middle, and so much farther away, in distances to the screen.
    [[nodiscard]] double span(double farther) const {
        return (upper * upperDepth - aside()) / (upperDepth + farther) -
               (lower * lowerDepth - aside()) / (lowerDepth + farther);
    }
};

struct Shown {
    Extent across, upwards;
    double nearest = 1e300;

    [[nodiscard]] double filled(double farther) const { return std::max(across.span(farther), upwards.span(farther)); }
};

}  // namespace

View studioView(const Wall& wall, const Box& sceneBounds, std::span<const Vec3d> points) {
    View view = defaultView(wall, sceneBounds);
    if (points.empty() || wall.screens.empty() || wall.users.empty() || !checkStand(view)) return view;
    const Screen& screen = wall.screens.front();
    const ScreenAxes axes = axesOf(screen);
    const Vec3d eye = eyeInFrontOf(screen, axes, firstUserOf(wall, view), Eye::kCenter);
    const Vec3d across = screen.lowerRight - screen.lowerLeft, upwards = screen.upperLeft - screen.lowerLeft;
    const Vec3d middle = screen.lowerLeft + 0.5 * (across + upwards);
    const double distance = axes.normal.dot(eye - screen.lowerLeft);
    const auto shownBy = [&](const View& by) {
        const Affine3d wall_T_world = by.world_T_wall().inverse();
        Shown shown;
        for (const Vec3d& point : points) {
            const Vec3d way = wall_T_world * point - eye;
            const double depth = -axes.normal.dot(way) / distance;
            shown.nearest = std::min(shown.nearest, depth);
            if (!(depth > 0)) continue;
            const Vec3d at = eye + way / depth - middle;
            shown.across.add(at.dot(axes.right) / across.norm(), depth);
            shown.upwards.add(at.dot(axes.up) / upwards.norm(), depth);
        }
        return shown;
    };
    // Each step is right for the points that are outermost now; others may be afterwards.
    constexpr double kFilled = 0.75, kNearest = 0.2;
    constexpr int kSteps = 12, kHalvings = 40;
    for (int step = 0; step < kSteps; ++step) {
        const Shown shown = shownBy(view);
        if (!(shown.nearest > 0) || !(shown.filled(0) > 1e-9)) return defaultView(wall, sceneBounds);
        double nearer = std::max(-0.5, (1 - shown.nearest) / (1 - kNearest) - 1), farther = std::max(nearer, 1.0);
        for (int halving = 0; halving < kHalvings; ++halving) {
            const double between = 0.5 * (nearer + farther);
            (shown.filled(between) > kFilled ? nearer : farther) = between;
        }
        View next = view;
        // Larger about the middle of the screen, where the model is.
        next.position += next.worldUnitsPerMetre *
                         (next.orientation *
                          Vec3d(shown.across.aside() * across + shown.upwards.aside() * upwards - farther * middle));
        next.worldUnitsPerMetre *= 1 + farther;
        if (!checkStand(next)) return view;
        view = next;
    }
    return view;
}

Expected<void> checkStand(const View& view) {
    if (!view.position.allFinite() || !tellsRotation(view.orientation.squaredNorm()))
        return fail(ErrorCode::kBadInput,
                    "the wall's pose is not made of finite numbers, or its orientation cannot be normalised");
    if (view.position.cwiseAbs().maxCoeff() > kMaxViewCoordinate)
        return fail(
            ErrorCode::kBadInput,
            fmt::format("the wall would stand farther than {} world units from the origin", kMaxViewCoordinate));
    if (!(view.worldUnitsPerMetre >= kMinWorldUnitsPerMetre && view.worldUnitsPerMetre <= kMaxWorldUnitsPerMetre))
        return fail(ErrorCode::kBadInput,
                    fmt::format("a scale of {} world units per metre: it has to be between {} and {}",
                                view.worldUnitsPerMetre, kMinWorldUnitsPerMetre, kMaxWorldUnitsPerMetre));
    return {};
}

}  // namespace tessera

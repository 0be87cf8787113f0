/// From eyes and screens to matrices.
#pragma once

#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "common/math/Box.h"
#include "common/math/Frustum.h"
#include "common/math/Ray.h"
#include "common/wall/Exposure.h"
#include "common/wall/Studio.h"
#include "common/wall/Wall.h"

namespace tessera {

/// Where the wall stands in the world and where its users' heads are: the part of a frame that is not the scene.
struct View {
    Vec3d position = Vec3d::Zero();  ///< of the wall's origin, world units
    Quatd orientation = Quatd::Identity();
    double worldUnitsPerMetre = 1.0;
    std::vector<User> users;  ///< as in the wall, moved by head tracking or `tessera-ctl view`
    unsigned detail = 0;      ///< of kDetailSteps (Detail.h)
    std::optional<Studio> studio = {};
    Exposure exposure = {};

    [[nodiscard]] Affine3d world_T_wall() const;
    [[nodiscard]] const User* findUser(std::string_view name) const;
};

/// The camera of one *whole* screen for one eye. All tiles of the screen share these very matrices: that makes seams
/// exact (see client/draw/README.md).
struct ScreenCamera {
    Vec3d eyeWorld;        ///< world units
    Affine3d eye_T_world;  ///< metres in eye space, axes along the screen: x right, y up, -z into the screen
    Mat4d clip_T_eye;      ///< off-axis projection of the whole screen, OpenGL clip space (Kooima 2008); without an end
    ScreenPixels pixels;
    // Who looks: the same for all screens and both eyes of a user. Matters where a scene shows users different things.
    unsigned user = 0;                  ///< their place among the wall's users
    Vec3d headWorld = Vec3d::Zero();    ///< between the eyes, where it is, in front of the screen or not; world units
    unsigned detail = 0;                ///< the view's
    std::optional<Studio> studio = {};  ///< the view's
    Exposure exposure = {};             ///< the view's
};

/// Eyes are held in front of their screen: one that is nearer than a centimetre, or behind, is moved to a centimetre,
/// so that there is always a picture.
[[nodiscard]] ScreenCamera screenCamera(const Screen& screen, const User& user, Eye eye, const View& view,
                                        double nearMetres = kNearPlaneMetres);
/// The camera of the screen that `tile` is part of, for the tile's eye. The view's user of that name, else the wall's.
/// Nothing is nearer than the wall says.
[[nodiscard]] ScreenCamera tileCamera(const Wall& wall, const Tile& tile, const View& view);

/// Frustum of one tile in world coordinates, grown by `marginPx` on each side.
inline constexpr double kFrustumMarginPx = 1;
[[nodiscard]] Frustum tileFrustum(const ScreenCamera& camera, const PixelRect& rect,
                                  double marginPx = kFrustumMarginPx);

/// World-space ray of unit direction from the eye through the centre of a pixel of the mosaic of the wall's first
/// screen, x from the left, y from the *top*, as in a picture: (0, 0) is the upper left pixel. Fails when no tile shows
/// that pixel.
[[nodiscard]] Expected<Ray> pickRay(const Wall& wall, const View& view, double xPx, double yPx);

/// The scene's bounding sphere fills the first screen, seen from its user: the sphere's centre lies in the middle of
/// the screen and its silhouette touches the nearest edges. The wall stands upright in the world (its axes are the
/// world's). Empty bounds: the identity.
[[nodiscard]] View uprightView(const Wall& wall, const Box& sceneBounds);
/// The same from three quarters above: 30 degrees to the right of the scene's front, +Z, and 25 above. The camera of a
/// scene that has none.
[[nodiscard]] View defaultView(const Wall& wall, const Box& sceneBounds);

/// From the same direction, and nearer: what `points` say of a model fills three quarters of the first screen, across
/// or upwards, whichever comes first. Nothing comes nearer than a fifth of the eye's way to the screen: a rod towards
/// the eye fills less. None of them: the same as above.
[[nodiscard]] View studioView(const Wall& wall, const Box& sceneBounds, std::span<const Vec3d> points);

/// Where a wall may stand: beyond, the numbers of what it shows are none any more.
inline constexpr double kMaxViewCoordinate = 1e15, kMinWorldUnitsPerMetre = 1e-9, kMaxWorldUnitsPerMetre = 1e9;
/// Says what is wrong with where the wall stands in the world: position, orientation, scale. Users are not looked at.
[[nodiscard]] Expected<void> checkStand(const View& view);

}  // namespace tessera

/// A person who walks: stands on what is drawn, goes up steps and slopes, slides along walls and falls where there is
/// no ground, and never comes to the other side of a face, however fast.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "common/math/Box.h"
#include "common/math/Ray.h"
#include "common/wall/Navigation.h"
#include "server/collision/mesh/TriangleTriangle.h"

namespace tessera {

/// What somebody who moves asks of the scene. World coordinates.
struct Surroundings {
    /// Appends the drawn faces whose boxes overlap a box; false: too many to be looked at, or not yet.
    std::function<bool(const Box&, std::vector<Triangle>&)> facesIn;
    /// Where a ray hits what is drawn first, in lengths of its direction; infinity: nowhere. Nothing: not yet, and
    /// whoever wants to know asks again in the next frame.
    std::function<std::optional<double>(const Ray&)> hit;
};

/// One body. Its head is where the eyes are; below it a capsule ends as high above the feet as a step may be, and below
/// that there is nothing: the feet find the ground. World up is +Y. All lengths of the body are metres, `scale` world
/// units each.
///
/// Every move of the capsule is swept against all faces near it (sweepCapsule), so that its axis passes through none; a
/// face that it is in already (a thing that was moved into it, a place where it was set down) holds it from no way out.
/// The same calls give the same places, bit for bit. Not thread-safe.
class Walker {
public:
    explicit Walker(const Navigation& terms) : terms_(terms) {}

    /// Somebody stands up here: eyes at `eye`, `height` above the feet where there is room for that, and lower down
    /// where the ground is nearer; the body rises to its height then. What was before counts no more. False: what is
    /// there cannot be seen, or not yet; then nobody stands here.
    [[nodiscard]] bool standAt(const Vec3d& eye, double height, double scale, const Surroundings& around);

    /// One frame of `seconds`. `wish`: how far to go on the level, metres (its y is not looked at); no farther than
    /// kFastestWalk allows. `height`: of the eyes above the floor of the room; who ducks there ducks here. Returns
    /// where the eyes are: the very same numbers while nothing moves.
    [[nodiscard]] Vec3d step(const Vec3d& wish, double height, double seconds, const Surroundings& around);

    [[nodiscard]] const Vec3d& eye() const { return eye_; }
    [[nodiscard]] double scale() const { return scale_; }
    /// Of the eyes above the feet, m: less than was asked for below a low ceiling.
    [[nodiscard]] double height() const { return height_; }

private:
    class Frame;

    Navigation terms_;
    Vec3d eye_ = Vec3d::Zero();  ///< world
    double scale_ = 1;
    double height_ = 0;  ///< m
    double fall_ = 0;    ///< downwards, m/s
    bool onGround_ = false;
};

}  // namespace tessera

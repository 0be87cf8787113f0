/// From what is wanted to where the wall stands, frame by frame: flying, orbiting, walking, and eased ways to a place.
#pragma once

#include <functional>
#include <optional>

#include "common/wall/View.h"
#include "server/sim/navigation/NavigationInput.h"
#include "server/sim/navigation/Walker.h"

namespace tessera {

/// The rotation of a view as people speak of it: to the left about the world's up, upwards, and to the left about the
/// line of sight; radians. orientation = turn about Y · about X · about Z.
struct Heading {
    double yaw = 0, pitch = 0, roll = 0;
};
[[nodiscard]] Heading headingOf(const Quatd& orientation);
[[nodiscard]] Quatd orientationOf(const Heading& heading);

/// What the navigator asks of the scene. No box: not yet, and it will be asked again in the next frame.
struct NavigationScene : Surroundings {
    std::function<std::optional<Box>()> bounds;              ///< of all that is drawn
    std::function<std::optional<Box>(const Ray&)> boundsAt;  ///< of the thing that a ray hits first; an empty one: none
    std::function<std::optional<View>()> home;               ///< where the wall would stand if nobody had moved it
    std::function<bool()> homeKnown;  ///< false: not yet, and it will be once `home` has been asked for; empty: it is
    std::function<std::optional<View>(std::size_t)> bookmark;
    std::function<void(std::size_t, const View&)> keepBookmark;
};

/// A pure function of what went before: the same views, inputs and scenes give the same views, bit for bit. It turns
/// about the eye of the first tile's user, moves in metres of the room times the view's scale, and knows world up as
/// +Y. Accelerates and comes to rest along exponentials that are followed exactly, whatever the length of a frame. Not
/// thread-safe.
class Navigator {
public:
    explicit Navigator(const Wall& wall);

    static constexpr double kTau = 0.15;                         ///< s: of speeds and turns
    static constexpr double kEased = 1.2;                        ///< s: of a way to a place
    static constexpr double kLookRadians = 1.0471975511965976;   ///< a drag over a window's height turns so far
    static constexpr double kOrbitRadians = 3.141592653589793;   ///< and around something so far
    static constexpr double kSteepestLook = 1.5533430342749532;  ///< 89 degrees up and down
    static constexpr double kNearest = 0.1;                      ///< m: of the eye to what it orbits around
    static constexpr double kLongestStride =
        1.0 / 40;                              ///< s: a walk over a longer frame is several steps, as people make them
    static constexpr double kNearStep = 0.85;  ///< a click of the wheel

    [[nodiscard]] NavigationMode mode() const { return mode_; }
    void setMode(NavigationMode mode);
    /// Along an eased way that ends where somebody steers.
    void goTo(const View& place);
    /// From where it then stands, so that the box's sphere fills the first screen as a default camera's does; the scale
    /// with it. Boxes without a place are not gone to.
    void fit(const Box& box) { toFit_ = box; }
    void goHome() { toHome_ = true; }
    /// Somebody else has placed the wall: whatever moved it ends, and the navigator goes on from there.
    void placed();

    /// Without input the next step does nothing.
    [[nodiscard]] bool idle() const { return still() && !path_ && !toFit_ && !toHome_ && waits_.empty() && !toPlace_; }

    struct Step {
        std::optional<View> view;  ///< where the wall is to stand (its users do not count); none: it stays
        bool home = false;         ///< it has arrived at the first view, and may be let go
    };
    /// One frame of `seconds`. `now`: as the wall stands, with its users' heads as they are.
    [[nodiscard]] Step step(const View& now, const NavigationInput& input, const NavigationScene& scene,
                            double seconds);

private:
    struct Path {
        Vec3d fromEye, toEye;  ///< world
        Quatd from, to;
        double fromScale = 1, toScale = 1, seconds = 0;
        View end;
        bool home = false;
    };
    /// Where the eye is, which way it looks, how large the world is: what all modes move.
    struct Stand {
        Vec3d eye;
        Quatd orientation;
        double scale;
        bool operator==(const Stand& other) const {
            return eye == other.eye && orientation.coeffs() == other.orientation.coeffs() && scale == other.scale;
        }
    };

    /// Asked for, and waiting for what the scene will say.
    struct Wait {
        InputAction action;
        std::optional<Ray> pointing = {};  ///< world
    };

    [[nodiscard]] Vec3d headOf(const View& view) const;
    void take(const NavigationInput& input, const View& now, const NavigationScene& scene);
    void begin(const View& now, const View& end, bool home);
    /// False: not yet.
    [[nodiscard]] bool beginHome(const View& now, const NavigationScene& scene);
    [[nodiscard]] bool beginFit(const Wait& wish, const View& now, const NavigationScene& scene);
    [[nodiscard]] bool centreOn(const Ray& pointing, const NavigationScene& scene);
    [[nodiscard]] bool begins(const Wait& wish, const View& now, const NavigationScene& scene);
    void beginOrWait(const Wait& wish, const View& now, const NavigationScene& scene);
    [[nodiscard]] std::optional<View> fitted(const View& now, const Box& box) const;
    [[nodiscard]] Step alongPath(const View& now, double seconds);
    [[nodiscard]] Heading turned(const Heading& heading, const NavigationInput& input, double radians, double seconds);
    void fly(Stand& stand, const NavigationInput& input, double seconds);
    void orbit(Stand& stand, const NavigationInput& input, const NavigationScene& scene, double seconds);
    void walk(Stand& stand, const Vec3d& head, const NavigationInput& input, const NavigationScene& scene,
              double seconds);
    [[nodiscard]] bool still() const;

    Wall wall_;
    NavigationMode mode_;
    double pace_ = 1;
    Vec3d velocity_ = Vec3d::Zero();  ///< right, up, back; m/s in the room
    Vec3d turning_ = Vec3d::Zero();   ///< to the right, upwards, roll to the right; rad/s
    double near_ = 0;                 ///< of the wheel in orbit: what is left to near, as a logarithm
    bool levelling_ = false;
    std::optional<Vec3d> centre_;  ///< world: what orbits turn around
    std::optional<Path> path_;
    std::optional<Box> toFit_;
    bool toHome_ = false;
    std::vector<Wait> waits_;  ///< at most a way and a grab
    std::optional<View> toPlace_;
    std::optional<Walker> walker_;
    Vec3d walkedHead_ = Vec3d::Zero();  ///< as the walker's last frame had it; m
};

}  // namespace tessera

/// What a handle that is held makes of a ray: pure functions of where it was grabbed and where the ray is now.
///
/// Always from the pose at the grab, never step by step, so the way of the hand between does not count and nothing adds
/// up. Where a ray says nothing (along the axis, beside the plane, behind the eye, not finite, out of all proportion)
/// there is no answer, and all stays as it is.
///
/// Sources. Axes: the nearest points of two lines (Ericson, Real-Time Collision Detection, 2005, 5.1.8). Balls: Bell's
/// trackball, as Henriksen, Sporring and Hornbæk describe it (Virtual trackballs revisited, IEEE TVCG 10 (2), 2004): a
/// sphere, and beyond 1/√2 of its radius the sheet r²/(2 d) that joins it smoothly. The turn is the shortest from where
/// the ball was grabbed, so that what was grabbed stays below the ray (Chen, Mountford and Sellen, SIGGRAPH 1988).
/// Which handles there are and what scaling leaves in place: Open Inventor (Wernecke, The Inventor Mentor, 1994,
/// chapter 15).
#pragma once

#include <optional>

#include "common/math/Ray.h"
#include "server/manipulators/HandleFrame.h"
#include "server/manipulators/Handles.h"

namespace tessera {

/// Where a ray from outside meets a manipulator's piece first; t in lengths of the ray's direction. Both sides of a
/// face count. Handles that move within a plane are not met by rays that see it from its side.
struct HandleHit {
    std::int64_t handle = 0;
    double t = 0;
};
[[nodiscard]] std::optional<HandleHit> hitOf(const Handles& handles, const Affine3d& world_T_frame, const Ray& ray);

/// All that a drag needs of the moment when it began.
struct Grab {
    Handle handle;
    HandleFrame frame;
    MovedCore moved;
    Ray ray;                        ///< that grabbed it, in the world
    Vec3d at = Vec3d::Zero();       ///< what was grabbed, in the frame
    Vec3d towards = Vec3d::Zero();  ///< the ray's direction there, of length 1
    double snap = 0;
    double outerAngle = 0;
    bool edgeOn = false;   ///< of rings: the plane says too little, and the hand goes along the tangent
    bool farSide = false;  ///< of balls: grabbed where the ray leaves
};
/// `t`: as in HandleHit. Nothing where the ray cannot be said in the frame.
[[nodiscard]] std::optional<Grab> grabAt(const Handle& handle, const HandleFrame& frame, const MovedCore& moved,
                                         const Ray& ray, double t, double snap, double outerAngle = 0);

struct Dragged {
    Pose pose;                    ///< of MovedCore
    std::optional<Vec3d> center;  ///< of a ComponentTransform
    std::optional<double> outerAngle;
};
[[nodiscard]] std::optional<Dragged> dragged(const Grab& grab, const Ray& ray);

}  // namespace tessera

/// What a manipulator moves, as translation, rotation and scale, and the frame in which its handles stand.
#pragma once

#include <optional>

#include "common/change/ChangeList.h"
#include "common/math/Box.h"
#include "common/math/Pose.h"
#include "common/scene/Aspect.h"
#include "server/manipulators/Handles.h"

namespace tessera {

/// What is dragged: a Transform or a ComponentTransform, seen alike. With y such that what is below the node stands at
/// `center + axes · y`, the parent sees it at `pose · y`; of a Transform y is what is below itself.
struct MovedCore {
    ObjectId node;  ///< that bears it
    ObjectId core;
    bool component = false;  ///< a ComponentTransform
    Affine3d world_T_parent = Affine3d::Identity();
    Pose pose;                       ///< rotation of length 1
    Vec3d center = Vec3d::Zero();    ///< of a ComponentTransform
    Quatd axes = Quatd::Identity();  ///< of its scale; of length 1
};

/// The core that the manipulator moves: its target's own, or, of a light, the nearest one at or above the place where
/// it stands (its beacon, else the target). Nothing: the target is not there, is of another kind, hangs nowhere, stands
/// where no matrix can be inverted or is not finite.
[[nodiscard]] std::optional<MovedCore> movedBy(const Aspect& scene, const Manipulator& manipulator);

/// Writes what leads from `moved` to `pose`, and to a `center` where there is one; nothing that stays.
void writePose(ChangeListBuilder& list, const MovedCore& moved, const Pose& pose,
               const std::optional<Vec3d>& center = std::nullopt);

/// Handles stand in a frame without scale in the parent's coordinates, so that a circle of it is one for whoever turns
/// there, however uneven the scales above are; or in the world's, where a manipulator says so.
struct HandleFrame {
    Affine3d world_T_frame = Affine3d::Identity();
    Quatd parent_R_frame = Quatd::Identity();
    Vec3d pivot = Vec3d::Zero();  ///< in the parent's coordinates: the frame's origin
    Vec3d extent = Vec3d::Ones();
    double knob = 0;       ///< as handlesOf wants it
    bool ofWorld = false;  ///< its axes are the world's
};

/// What is drawn below the moved core, in y of MovedCore, manipulators left out. Empty: nothing. Costs what is below,
/// each mesh once.
[[nodiscard]] Box contentBox(const Aspect& scene, const MovedCore& moved);

/// Into how many users' sizes handles of a size on the screen are told apart; 1 of others. The i-th user of a wall sees
/// the one at i modulo that.
[[nodiscard]] std::size_t sightsOf(const Manipulator& manipulator);

/// `content`: as contentBox says. `sight`: of sightsOf. It says how large the handles are; where they stand is the same
/// for all.
[[nodiscard]] HandleFrame frameOf(const Manipulator& manipulator, const MovedCore& moved, const Box& content,
                                  std::size_t sight = 0);

/// Of the spot light that a manipulator holds; 0 of others.
[[nodiscard]] double outerAngleOf(const Aspect& scene, const Manipulator& manipulator);

}  // namespace tessera

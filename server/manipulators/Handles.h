/// What each kind of manipulator shows, and what each of its handles does.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/cores/Manipulator.h"
#include "common/geometry/Mesh.h"
#include "common/math/Pose.h"

namespace tessera {

/// Fixed shapes, at the centre of their own coordinates and one unit large in every direction (radius, half an edge):
/// rods and cones stand along Z from 0 to 1; a ring goes around Z, and its tube is kRingTube thick.
enum class HandleShape : std::uint8_t { kRod, kCone, kCube, kBall, kRing };
inline constexpr std::size_t kHandleShapes = 5;
inline constexpr double kRingTube = 0.035;
[[nodiscard]] const MeshArrays& handleShape(HandleShape shape);

enum class HandleColor : std::uint8_t { kRed, kGreen, kBlue, kWhite, kHeld };
inline constexpr std::size_t kHandleColors = 5;

/// What dragging a handle does. `axis` of a handle: 0, 1, 2.
enum class HandleDeed : std::uint8_t {
    kMoveAxis,    ///< along the axis
    kMovePlane,   ///< in the plane across the axis
    kMoveFacing,  ///< in the plane that faced who took hold
    kTurnRing,    ///< around the axis
    kTurnBall,    ///< about the centre, freely
    kScaleAxis,   ///< along the axis, away from `fixed`
    kScaleAll,    ///< by one factor, away from `fixed`
    kMoveCenter,  ///< of a ComponentTransform, along the axis; what it shows stays
    kOpenCone,    ///< a spot light's outer angle
};

/// A part of a manipulator, in its frame (HandleFrame.h).
struct HandlePiece {
    std::int64_t handle = 1;  ///< from 1 up
    HandleShape shape = HandleShape::kCube;
    HandleColor color = HandleColor::kWhite;
    Pose pose;
    bool shown = true;  ///< false: it is there for rays alone
};
struct Handle {
    HandleDeed deed = HandleDeed::kMoveAxis;
    int axis = 0;
    Vec3d fixed = Vec3d::Zero();  ///< what scaling leaves where it is
};
struct Handles {
    std::vector<HandlePiece> pieces;
    std::vector<Handle> of;  ///< handle h is of[h - 1]
};

/// `extent`: half of the size of the handles, or of the box, along each axis of the frame; above 0. `outerAngle`: of
/// spot lights. `knob`: of a box, half of the size whose knobs and edges it has; 0: its own. Whatever these are, a kind
/// has the same pieces in the same order.
[[nodiscard]] Handles handlesOf(std::int64_t kind, const Vec3d& extent, double outerAngle = 0, double knob = 0);

/// Whether its frame is the box of its target.
[[nodiscard]] constexpr bool isBoxKind(std::int64_t kind) {
    return kind == Manipulator::kTabBox || kind == Manipulator::kTransformer || kind == Manipulator::kHandleBox ||
           kind == Manipulator::kTransformBox;
}

}  // namespace tessera

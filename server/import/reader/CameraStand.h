/// Where the wall stands for a file's camera.
#pragma once

#include <optional>

#include "common/math/Box.h"

namespace tessera {

/// A wall of `unitsPerMetre` that is moved by `offset` in the camera's own axes: it looks along -Z, +Y is up.
struct CameraStand {
    Vec3d offset = Vec3d::Zero();
    double unitsPerMetre = 1;
};

/// A file's camera says where the eye is and how wide it looks; ours says where the wall stands and how large it is.
/// The wall's window covers exactly what the file's camera shows at one depth, in or before `bounds`, those of the
/// scene. `height`: that it sees at each distance (0) or, with `perDistance` 0, everywhere. Nothing: it can show
/// nothing.
[[nodiscard]] std::optional<CameraStand> standOf(const Affine3d& world_T_camera, const Box& bounds, double perDistance,
                                                 double height);

}  // namespace tessera

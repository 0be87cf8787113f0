/// How models want to be looked at: their cameras, and how bright their lights are.
#pragma once

#include <optional>
#include <string>

#include "common/math/Box.h"
#include "server/import/reader/PlainScene.h"

namespace tessera {

struct ModelCamera {
    std::string name;
    std::optional<double> fieldOfView;  ///< vertical, in radians; nothing: it shows all at one scale
    double height = 0;                  ///< of what such a one shows, in units of the world
};

/// Adds the camera below its node: it looks along -Z there, and the wall stands as CameraStand.h says. `bounds`: of the
/// scene. False: it can show nothing.
bool addModelCamera(const ModelCamera& camera, const Affine3d& world_T_node, const Box& bounds, PlainScene& scene,
                    proto::scene::Node& node);

/// All lights of a model together.
class ModelLight {
public:
    /// Lux, or candela at one metre; here 1 of either makes a white surface white. `at`: where it stands in the world.
    void add(double intensity, bool directional, const Vec3d& at, const Box& bounds);
    /// Numbers of real lights are lux and candela that somebody has measured: only an exposure makes a picture of them.
    /// Adds an Environment that is metered, and says so, where there are such.
    void addExposure(PlainScene& scene) const;

private:
    double illuminance_ = 0;  ///< in the middle of the model
};

}  // namespace tessera

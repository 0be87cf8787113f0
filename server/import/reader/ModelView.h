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

/// Beyond, numbers of a light mean nothing to a picture.
inline constexpr double kUtmostLight = 1e15;
/// 1 / (x + y d + z d²) at distance d, as a PointLight has it.
inline const Vec3d kNoFalloff{1, 0, 0}, kInverseSquare{0, 0, 1};

/// All lights of a model together.
class ModelLight {
public:
    /// Lux, or candela at one metre; here 1 of either makes a white surface white. `at`: where it stands in the world.
    void add(double intensity, const Vec3d& falloff, const Vec3d& at, const Box& bounds);
    /// Numbers of real lights are lux and candela that somebody has measured: only an exposure makes a picture of them.
    /// Adds an Environment that is metered, and says so, where there are such: `dazzling` times the light that makes a
    /// white surface white. Files that reckon without an exposure have less; a dim room, in lux, has more.
    void addExposure(PlainScene& scene, double dazzling = 20) const;

private:
    double illuminance_ = 0;  ///< in the middle of the model
};

}  // namespace tessera

/// What a core that shines sends out.
#pragma once

#include "common/change/Value.h"
#include "common/math/Types.h"

namespace tessera {

/// A core that shines has a member `LightSource light() const`; the table of types finds it there. It stands at the
/// origin of its node and looks along -Z.
struct LightSource {
    enum class Kind : std::uint8_t { kDirectional, kPoint, kSpot };
    Kind kind = Kind::kPoint;
    Vec3f radiance = Vec3f::Ones();  ///< colour × intensity; linear RGB. Of a point or spot: one world unit away
    float range = 0;                 ///< world units; 0: unlimited
    /// Of a spot: full light up to the inner angle from its axis, none beyond the outer one; radians.
    float innerAngle = 0, outerAngle = 0;
    bool shadows = false;  ///< things stand in its way
    bool on = true;
    ObjectId beacon;  ///< a Node that it stands at instead of its own
    Vec3f attenuation{
        0, 0, 1};    ///< 1 / (x + y d + z d²) at distance d in world units; not of directional ones; all 0: no falloff
    ObjectId scope;  ///< a Node: it lights what is below that alone; none: everything
    bool outside = false;  ///< with a scope: it lights everything but what is below
};

}  // namespace tessera

/// Key-framed motion.
#pragma once

#include "common/cores/ShippedTypes.h"
#include "common/field/Field.h"

namespace tessera {

/// Moves a Transform. Evaluated on the server only; its results travel as values.
struct Motion {
    static constexpr ObjectType kType{11};
    static constexpr std::int64_t kOnce = 0, kLoop = 1, kPingPong = 2;
    ObjectId target;  ///< a Transform
    /// double[11] per key: time in s (ascending), translation xyz, rotation wxyz, scale xyz. Linear between keys,
    /// rotation by slerp along the shorter arc.
    Blob keys;
    std::int64_t mode = kOnce;
    bool playing = true;
    /// Local time: grows by 1/60 s per frame while the motion plays and nothing stops its target; setting it is a seek.
    double time = 0.0;
};
template <>
inline constexpr auto kSaid<Motion> = []<typename T>(Describing<T>) {
    return describe("Motion", field<&T::target>(1, "target").to(typeOf<Transform>()).affects(Effect::kTime),
                    field<&T::keys>(2, "keys").affects(Effect::kTime),
                    field<&T::mode>(3, "mode")
                        .oneOf({{Motion::kOnce, "once"}, {Motion::kLoop, "loop"}, {Motion::kPingPong, "ping-pong"}})
                        .affects(Effect::kTime),
                    field<&T::playing>(4, "playing").affects(Effect::kTime),
                    field<&T::time>(5, "time").unit(Unit::kSecond).affects(Effect::kTime));
};

}  // namespace tessera

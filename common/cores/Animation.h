/// Key frames of any fields, and what plays them.
#pragma once

#include "common/cores/ShippedTypes.h"
#include "common/field/Field.h"

namespace tessera {

/// The key frames of one field of one object. Evaluated on the server only; what comes of it travels as values.
struct KeyFrames {
    static constexpr ObjectType kType{24};
    static constexpr std::int64_t kStep = 0, kLinear = 1, kSpline = 2;
    ObjectId target;    ///< any object: a core, a material, a light
    std::string field;  ///< its name, as `tessera-ctl types` tells it; numbers, flags, and arrays of floats or doubles
    Blob times;         ///< double per key: s, ascending
    /// double: of each key all numbers of the field; quaternions as w x y z. kSpline: of each key the tangent that
    /// leads in, the value, the tangent that leads out (per s), as glTF 2.0 has them.
    Blob values;
    /// Between keys; before the first and after the last their values hold. Quaternions turn along the shorter arc
    /// (kLinear), or are brought to length one (kSpline). Flags and whole numbers step, whatever this says.
    std::int64_t interpolation = kLinear;
};
template <>
inline constexpr auto kSaid<KeyFrames> = []<typename T>(Describing<T>) {
    return describe(
               "KeyFrames", field<&T::target>(1, "target").toAnything().affects(Effect::kTime),
               field<&T::field>(2, "field").affects(Effect::kTime),
               field<&T::times>(3, "times").doublesEach(1).affects(Effect::kTime),
               field<&T::values>(4, "values").doublesEach(1).affects(Effect::kTime),
               field<&T::interpolation>(5, "interpolation")
                   .oneOf({{KeyFrames::kStep, "step"}, {KeyFrames::kLinear, "linear"}, {KeyFrames::kSpline, "spline"}})
                   .affects(Effect::kTime))
        .notACore();
};

/// Plays channels together: one take of a film, one way of walking.
struct Animation {
    static constexpr ObjectType kType{25};
    static constexpr std::int64_t kOnce = 0, kLoop = 1, kPingPong = 2;
    RefList channels;  ///< of KeyFrames
    bool playing = true;
    /// Grows by speed / 60 s per frame while it plays; setting it is a seek. It begins at 0 and ends at the last key of
    /// any channel.
    double time = 0;
    double speed = 1;  ///< below 0: backwards
    std::int64_t mode = kLoop;
};
template <>
inline constexpr auto kSaid<Animation> = []<typename T>(Describing<T>) {
    return describe(
        "Animation", field<&T::channels>(1, "channels").to(typeOf<KeyFrames>()).affects(Effect::kTime),
        field<&T::playing>(2, "playing").affects(Effect::kTime),
        field<&T::time>(3, "time").unit(Unit::kSecond).between(-1e9, 1e9).affects(Effect::kTime),
        field<&T::speed>(4, "speed").between(-1e6, 1e6).affects(Effect::kTime),
        field<&T::mode>(5, "mode")
            .oneOf({{Animation::kOnce, "once"}, {Animation::kLoop, "loop"}, {Animation::kPingPong, "ping-pong"}})
            .affects(Effect::kTime));
};

}  // namespace tessera

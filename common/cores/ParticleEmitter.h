/// A source of many small things.
#pragma once

#include "common/cores/ShippedTypes.h"
#include "common/field/Field.h"

namespace tessera {

/// Sparks, smoke, fountains, snow: particles that are born one after the other, fly as forces say and end. Nothing of
/// them is kept: each host works out where they are from these fields, so no array travels and who joins needs nothing
/// else. They live in the node's coordinates and go where it goes. They collide with nothing, nobody collides with
/// them, and no ray meets them. Drawn as Particles are, with the same modes (common/drawable/EmitterArrays.h has the
/// formulas).
///
/// What a field says holds for all that are there: another rate, force or seed is another stream, in that same frame.
struct ParticleEmitter {
    static constexpr ObjectType kType{38};
    static constexpr std::int64_t kPoint = 0, kBox = 1, kSphere = 2, kDisc = 3;
    static constexpr std::int64_t kPoints = 0, kLines = 1, kQuads = 2;
    /// At most so many are there at a time: rate × life.
    static constexpr double kMostLive = 65536;

    bool playing = true;
    /// s. Grows by speed / 60 per frame while it plays; setting it is a seek. Particle n = 0, 1, … is born at n / rate.
    double time = 0;
    double speed = 1;   ///< below 0: backwards, to 0
    double rate = 100;  ///< births per s
    double life = 2;    ///< s; of some less, by a share of it that is up to `lifeSpread`
    double lifeSpread = 0;
    std::int64_t seed = 0;
    /// Where they are born: at the node's origin, or anywhere in a box, a sphere (an ellipsoid) or a disc in XZ (an
    /// ellipse), `extent` across.
    std::int64_t place = kPoint;
    Vec3d extent = Vec3d::Ones();
    /// Which way they leave, how far off that way at most, and how fast. Some are faster, others slower, by a share of
    /// up to `paceSpread`.
    Vec3d direction = Vec3d::UnitY();
    double directionSpread = 0;
    double pace = 1;
    double paceSpread = 0;
    Vec3d acceleration = Vec3d::Zero();  ///< the same for all, always: gravity, lift
    /// 1/s: what air takes of their velocity. They come to rest, or to `acceleration` / `drag`.
    double drag = 0;
    /// Over a life, linear in between: diameters of points, sides of quads, of lines pixels; sRGB and alpha, multiplied
    /// with the material.
    double beginSize = 0.05, endSize = 0.05;
    Vec4f beginColor = Vec4f::Ones(), endColor = Vec4f::Ones();
    std::int64_t mode = kPoints;
    double streak = 0.05;  ///< s: of lines, how long ago they were where each begins
    bool sorted = true;    ///< drawn from back to front; false: the oldest first
    ObjectId material;
};
template <>
inline constexpr auto kSaid<ParticleEmitter> = []<typename T>(Describing<T>) {
    return describe(
        "ParticleEmitter", field<&T::playing>(1, "playing").affects(Effect::kTime),
        field<&T::time>(2, "time").unit(Unit::kSecond).between(0, 1e9).affects(Effect::kTime | Effect::kShape),
        field<&T::speed>(3, "speed").between(-1e6, 1e6).affects(Effect::kTime),
        field<&T::rate>(4, "rate").between(0, 1e6).affects(Effect::kShape),
        field<&T::life>(5, "life").unit(Unit::kSecond).between(0, 1e6).affects(Effect::kShape),
        field<&T::lifeSpread>(6, "lifeSpread").between(0, 1).affects(Effect::kShape),
        field<&T::seed>(7, "seed").affects(Effect::kShape),
        field<&T::place>(8, "place")
            .oneOf({{ParticleEmitter::kPoint, "point"},
                    {ParticleEmitter::kBox, "box"},
                    {ParticleEmitter::kSphere, "sphere"},
                    {ParticleEmitter::kDisc, "disc"}})
            .affects(Effect::kShape),
        field<&T::extent>(9, "extent").unit(Unit::kWorld).between(0, 1e9).affects(Effect::kShape),
        field<&T::direction>(10, "direction").between(-1e9, 1e9).affects(Effect::kShape),
        field<&T::directionSpread>(11, "directionSpread")
            .unit(Unit::kRadian)
            .between(0, 3.1415926535897931)
            .affects(Effect::kShape),
        field<&T::pace>(12, "pace").unit(Unit::kWorldPerSecond).between(0, 1e6).affects(Effect::kShape),
        field<&T::paceSpread>(13, "paceSpread").between(0, 1).affects(Effect::kShape),
        field<&T::acceleration>(14, "acceleration")
            .unit(Unit::kWorldPerSecond2)
            .between(-1e6, 1e6)
            .affects(Effect::kShape),
        field<&T::drag>(15, "drag").between(0, 1e4).affects(Effect::kShape),
        field<&T::beginSize>(16, "beginSize").between(0, 1e9).affects(Effect::kShape),
        field<&T::endSize>(17, "endSize").between(0, 1e9).affects(Effect::kShape),
        field<&T::beginColor>(18, "beginColor").between(0, 1).affects(Effect::kLook),
        field<&T::endColor>(19, "endColor").between(0, 1).affects(Effect::kLook),
        field<&T::mode>(20, "mode")
            .oneOf({{ParticleEmitter::kPoints, "points"},
                    {ParticleEmitter::kLines, "lines"},
                    {ParticleEmitter::kQuads, "quads"}})
            .affects(Effect::kShape),
        field<&T::streak>(21, "streak").unit(Unit::kSecond).between(0, 1e6).affects(Effect::kShape),
        field<&T::sorted>(22, "sorted").affects(Effect::kLook),
        field<&T::material>(23, "material").to(typeOf<Material>()).affects(Effect::kLook));
};

}  // namespace tessera

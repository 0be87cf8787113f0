/// Two bodies on their ways, from a seed: how they move and how they lie to each other as they begin. Nobody who is
/// judged has a say.
#pragma once

#include <cstdint>
#include <optional>
#include <random>
#include <string>

#include "tests/truth/StraightOracle.h"
#include "tests/unit/motion/Bodies.h"

namespace tessera::truth {

struct Trial {
    std::string what;
    bodies::Body a, b;
    BodyMotion motionA, motionB;
    double tolerance = 1e-4;
    VolumeKind volume = TreeOptions{}.volume;

    /// No coordinate that arises on the way is larger, about.
    [[nodiscard]] double extent() const;
};

/// The points of a lattice that a rotation by a quaternion of whole numbers maps to doubles exactly; `norm`: its
/// squared length.
[[nodiscard]] bodies::Body snapped(bodies::Body body, double norm);

class Random {
public:
    explicit Random(std::uint64_t seed) : engine_(seed) {}
    double uniform(double low, double high) {
        return low + (high - low) * static_cast<double>(engine_() >> 11) * 0x1p-53;
    }
    int whole(int low, int high) {
        return low + static_cast<int>(engine_() % static_cast<std::uint64_t>(high - low + 1));
    }
    Vec3d direction();
    Quatd turn(double most) { return Quatd(Eigen::AngleAxisd(uniform(1e-3, most), direction())); }
    Quatd rotation() { return turn(3.1); }
    /// Of whole numbers, up to 4.
    Quatd wholeRotation();
    std::mt19937_64& engine() { return engine_; }

private:
    std::mt19937_64 engine_;
};

enum class Moves {
    kScrew,    ///< one turns as it goes
    kBoth,     ///< both do
    kScale,    ///< both, growing or shrinking evenly
    kStretch,  ///< along each axis by itself, some inside out
    kOrbit,    ///< about a point outside of themselves; mirrored and sheared meshes
    kArc,      ///< round a point, past or into something on the inner side of the arc: only its bend leads there
    kFar,      ///< large coordinates, small and large bodies
};
/// Of 2 to 60 faces, about of size 1.
[[nodiscard]] bodies::Body anyBody(Random& random);
/// Apart at the start, mostly; near misses and hits in equal parts.
[[nodiscard]] Trial freeTrial(Moves moves, std::uint64_t seed);

/// They begin in touch, exactly: a corner, edge or face of the one on one of the other, which rationals confirm; then
/// they part, slide, press, tumble, or turn about the contact.
[[nodiscard]] Trial touchingTrial(std::uint64_t seed);
/// The same with a gap of 1e-12 to 1e-2, more or less that of the tolerance.
[[nodiscard]] Trial nearTrial(std::uint64_t seed);

/// Small whole numbers, no turning: for the StraightOracle, with as many coincidences as that brings.
[[nodiscard]] Trial latticeTrial(std::uint64_t seed);

}  // namespace tessera::truth

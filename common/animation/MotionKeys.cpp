#include "common/animation/MotionKeys.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "common/cores/Motion.h"

namespace tessera {
namespace {

Pose poseOfKey(std::span<const double> keys, std::size_t index) {
    const double* k = keys.data() + index * kScalarsPerKey;
    return {.translation = Vec3d(k[1], k[2], k[3]),
            .rotation = Quatd(k[4], k[5], k[6], k[7]).normalized(),
            .scale = Vec3d(k[8], k[9], k[10])};
}

/// Local time folded into the keys' interval.
double foldTime(double seconds, double first, double last, std::int64_t mode) {
    const double length = last - first;
    if (length <= 0 || mode == Motion::kOnce) return std::clamp(seconds, first, last);
    double phase = std::fmod(seconds - first, mode == Motion::kPingPong ? 2 * length : length);
    if (phase < 0) phase += mode == Motion::kPingPong ? 2 * length : length;
    return first + (phase > length ? 2 * length - phase : phase);
}

}  // namespace

Expected<void> checkKeys(std::span<const double> keys) {
    if (keys.empty()) return fail(ErrorCode::kBadInput, "a motion without keys");
    if (keys.size() % kScalarsPerKey != 0)
        return fail(ErrorCode::kBadInput,
                    fmt::format("{} numbers are not a whole number of motion keys of {}", keys.size(), kScalarsPerKey));
    for (std::size_t i = 0; i < keys.size(); ++i)
        if (!std::isfinite(keys[i]))
            return fail(ErrorCode::kBadInput,
                        fmt::format("motion key {} holds a number that is not finite", i / kScalarsPerKey));
    for (std::size_t i = 0; i < keys.size() / kScalarsPerKey; ++i) {
        if (i > 0 && keyTime(keys, i) <= keyTime(keys, i - 1))
            return fail(ErrorCode::kBadInput, fmt::format("motion key {} is not later than the one before", i));
        const double* q = keys.data() + i * kScalarsPerKey + 4;
        if (!tellsRotation(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]))
            return fail(ErrorCode::kBadInput, fmt::format("motion key {} has a rotation that cannot be normalised", i));
    }
    return {};
}

Pose poseAt(std::span<const double> keys, std::int64_t mode, double seconds) {
    const std::size_t count = keys.size() / kScalarsPerKey;
    const double time = foldTime(seconds, keyTime(keys, 0), keyTime(keys, count - 1), mode);
    std::size_t next = 0;  // the first key after that time
    for (std::size_t end = count; next < end;) {
        const std::size_t middle = next + (end - next) / 2;
        if (time < keyTime(keys, middle))
            end = middle;
        else
            next = middle + 1;
    }
    if (next == 0) return poseOfKey(keys, 0);
    if (next == count) return poseOfKey(keys, count - 1);
    const Pose a = poseOfKey(keys, next - 1);
    const Pose b = poseOfKey(keys, next);
    const double u = (time - keyTime(keys, next - 1)) / (keyTime(keys, next) - keyTime(keys, next - 1));
    return {.translation = (1 - u) * a.translation + u * b.translation,
            .rotation = a.rotation.slerp(u, b.rotation),
            .scale = (1 - u) * a.scale + u * b.scale};
}

}  // namespace tessera

/// What pairs of parts remember from frame to frame: impulses to start from, and where to look first.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/math/Types.h"
#include "server/collision/rigid_bodies/SolidContacts.h"

namespace tessera::rigid {

struct PointMemory {
    Vec3d position, normal;  ///< world, as the frame ended
    double impulse = 0;      ///< of a sub-step
    Vec3d rubbing;           ///< of friction, a vector
};

struct PairMemory {
    std::uint64_t partA = 0, partB = 0;
    SolidMemory memory;
    std::uint32_t firstPoint = 0, points = 0;
};

/// Of one frame; pairs ascending.
struct ContactMemory {
    std::vector<PairMemory> pairs;
    std::vector<PointMemory> points;

    void clear() {
        pairs.clear();
        points.clear();
    }
    [[nodiscard]] std::span<const PointMemory> pointsOf(const PairMemory& pair) const {
        return std::span(points).subspan(pair.firstPoint, pair.points);
    }
};

/// The remembered point that is this one, or null: nearest, no farther than `near`, and of nearly the same normal.
[[nodiscard]] inline const PointMemory* recall(std::span<const PointMemory> points, const Vec3d& position,
                                               const Vec3d& normal, double near) {
    const PointMemory* best = nullptr;
    double least = near * near;
    for (const PointMemory& p : points) {
        const double square = (p.position - position).squaredNorm();
        if (square < least && p.normal.dot(normal) > 0.9) {
            least = square;
            best = &p;
        }
    }
    return best;
}

}  // namespace tessera::rigid

/// What a walk over two trees (tree/kernel/Distance.inl) finds, and the nearest pair of faces of what was measured of
/// it. For searches for the nearest pair.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "server/collision/mesh/TriangleContact.h"
#include "server/collision/query/DistanceQuery.h"
#include "server/collision/tree/KernelTypes.h"

namespace tessera {

struct DistanceCandidates {
    static constexpr std::size_t kMost = 256;

    kernel::DistanceSink sink{};
    std::array<std::uint32_t, kMost> facesA, facesB;
    std::array<float, kMost> atLeast;  ///< of A's own units
    Distance best;                     ///< of those measured

    /// Whenever they are full, `search.decide()` is called, which measures and empties them. `search` stays where it
    /// is, and so do they.
    template <typename Search>
    DistanceCandidates(Search& search, const QueryWork& work) {
        sink.facesA = facesA.data();
        sink.facesB = facesB.data();
        sink.atLeast = atLeast.data();
        sink.capacity = kMost;
        sink.decide = [](kernel::DistanceSink&, void* self) { static_cast<Search*>(self)->decide(); };
        sink.context = &search;
        sink.nodeTests = work.boxTests;
        sink.triangleTests = work.triangleTests;
        sink.limit = work.limit;
        sink.unexplored = std::numeric_limits<float>::infinity();
    }
    DistanceCandidates(const DistanceCandidates&) = delete;
    DistanceCandidates& operator=(const DistanceCandidates&) = delete;

    /// A's own units to a unit of its frame: before the walk. Bounds are rounded so that nothing is missed.
    void setUnit(double unit, double upperBound, double tolerance) {
        unit_ = unit;
        sink.bound = roundedUp(upperBound * unit);
        sink.tolerance = -roundedUp(-tolerance * unit);
    }
    [[nodiscard]] double unit() const { return unit_; }

    [[nodiscard]] bool canBeNearest(std::uint32_t i) const { return atLeast[i] <= sink.bound + sink.tolerance; }

    void measured(const FacePair& faces, const NearestPoints& near) {
        if (near.distance > best.distance || (near.distance == best.distance && best.faces < faces)) return;
        best = {near.distance, faces, near.onA, near.onB};
        // Not below what a float can say: a pair as near as this one must still be looked at.
        sink.bound = std::min(sink.bound, roundedUp(near.distance * unit_) - sink.tolerance);
    }

    /// Counting went on from that work.
    void countIn(QueryWork& work) const {
        work.boxTests = sink.nodeTests;
        work.triangleTests = sink.triangleTests;
    }

private:
    static float roundedUp(double x) {
        const float f = static_cast<float>(std::min(x, 3e38));
        return static_cast<double>(f) >= x ? f : std::nextafter(f, std::numeric_limits<float>::infinity());
    }

    double unit_ = 1;
};

}  // namespace tessera

/// One transform on trial: where it wants to go, and what may be in its way.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <unordered_map>
#include <vector>

#include "server/collision/query/TouchQuery.h"
#include "server/collision/response/Way.h"

namespace tessera {

struct MotionLimits {
    double stopTolerance = 1e-4;  ///< see CollisionLimits
    double arcTolerance = 1e-3;
    int maxPieces = 64;
};

/// A pair of parts, one of which the transform carries, that may not be led into each other. A: of the interest's object.
struct ObstaclePair {
    std::uint32_t partA = 0, partB = 0;
    bool slide = false;  ///< what is left of the motion may go on along the other's surface
};

/// A pair of parts that move against each other, near enough that they may touch on the way.
struct Obstacle {
    std::uint32_t partA = 0;  ///< of an interest's object
    std::uint32_t partB = 0;
    bool slide = false;
    std::uint64_t touchingAtStart = 0;  ///< intersecting face pairs before the motion begins
};

/// Answers a response's questions about the way. Fractions run from 0, where the transform is, to 1, where it is
/// wanted. All answers are conservative: kUnknown means that the step's work is used up.
class MotionTrial {
public:
    /// Pairs whose boxes do not meet anywhere on the way are no obstacles; of the others `touchingAtStart` is asked for
    /// the number of face pairs that meet before the motion begins.
    MotionTrial(const ObjectHandler& handler, ObjectId transform, const Way& way,
                std::span<const ObstaclePair> pairs,
                const std::function<std::uint64_t(std::uint32_t, std::uint32_t)>& touchingAtStart,
                const MotionLimits& limits, QueryWork& work, std::uint64_t& queries);

    /// In the order in which boxes come to meet.
    [[nodiscard]] std::span<const Obstacle> obstacles() const { return obstacles_; }
    /// Before `first` and after `last` the boxes of the pair are apart.
    struct Span {
        double first = 0, last = 1;
    };
    [[nodiscard]] const Span& boxesMeet(std::size_t obstacle) const { return pairs_[obstacle].meet; }
    [[nodiscard]] const MotionLimits& limits() const { return limits_; }
    [[nodiscard]] const Way& way() const { return way_; }

    /// No point of the pair moves further against the other over the whole way (world units).
    [[nodiscard]] double length(std::size_t obstacle) const;
    /// Box diagonal and smallest extent of the moving part (of the smaller one where both move), in world units.
    [[nodiscard]] double size(std::size_t obstacle) const { return pairs_[obstacle].size; }
    [[nodiscard]] double thickness(std::size_t obstacle) const { return pairs_[obstacle].thickness; }

    [[nodiscard]] Touch touching(std::size_t obstacle, double fraction) const;
    [[nodiscard]] FacePairs facesTouching(std::size_t obstacle, double fraction) const;
    /// Anything on the way from one fraction (taken to be free) to another, the end included.
    [[nodiscard]] Touch touchingOnTheWay(std::size_t obstacle, double from, double to) const;
    [[nodiscard]] FacePairs facesTouchingOnTheWay(std::size_t obstacle, double from, double to) const;

    /// How deep the deepest of these faces meet at a fraction (see `penetration`), in world units.
    [[nodiscard]] double depth(std::size_t obstacle, std::span<const FacePair> faces, double fraction) const;
    /// Those of these faces that lie on each other, outside against outside, before the motion begins.
    [[nodiscard]] std::vector<FacePair> facing(std::size_t obstacle, std::span<const FacePair> faces) const;
    /// How far B's part of these pairs has come past A's outside, at most; below 0: how far it has parted, at least.
    [[nodiscard]] double overlap(std::size_t obstacle, std::span<const FacePair> facing, double fraction) const;

    [[nodiscard]] Affine3d worldOfA(std::size_t obstacle, double fraction) const;
    [[nodiscard]] Affine3d worldOfB(std::size_t obstacle, double fraction) const;

private:
    struct Traveller {
        PartOnTheWay path;
        const TriangleMesh* mesh;
        WayBound bound;
        Box start, end;
    };
    struct Pair {
        const Traveller* a;
        const Traveller* b;
        double size = 0;
        double thickness = 0;
        Span meet;
    };

    const Traveller& traveller(std::uint32_t part, ObjectId transform);
    [[nodiscard]] Pair pairOf(std::uint32_t partA, std::uint32_t partB, ObjectId transform);
    /// visit(triangle of A, triangle of B), in the world; both counter-clockwise seen from outside.
    template <typename Visit>
    void forFaces(std::size_t obstacle, std::span<const FacePair> faces, double fraction, Visit&& visit) const;
    [[nodiscard]] StraightMotion straight(const Pair& pair, const Obstacle& obstacle, double from, double to) const;
    [[nodiscard]] int pieces(const Pair& pair, double interval) const;
    [[nodiscard]] bool boxesMeetBetween(const Pair& pair, double from, double to) const;

    const ObjectHandler& handler_;
    Way way_;
    std::unordered_map<std::uint32_t, Traveller> travellers_;
    std::vector<Obstacle> obstacles_;
    std::vector<Pair> pairs_;
    MotionLimits limits_;
    QueryWork& work_;
    std::uint64_t& queries_;
};

}  // namespace tessera

/// One transform on trial: where it wants to go, and what may be in its way.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include "server/collision/pairwise/FreeformPairs.h"
#include "server/collision/query/TimeOfImpact.h"
#include "server/collision/response/Rest.h"
#include "server/collision/response/Way.h"

namespace tessera {

/// A pair of parts, one of which the transform carries, that may not be led into each other. A: of the interest's
/// object.
struct ObstaclePair {
    std::uint32_t partA = 0, partB = 0;
    bool slide = false;  ///< what is left of the motion may go on along the other's surface
};

/// A pair of parts that move against each other, near enough that they may touch on the way.
struct Obstacle {
    std::uint32_t partA = 0;  ///< of an interest's object
    std::uint32_t partB = 0;
    bool slide = false;
    /// Intersecting face pairs before the motion begins; of hulls also 1 where one is wholly within the other.
    std::uint64_t touchingAtStart = 0;
};

/// Answers a response's questions about the way. Fractions run from 0, where the transform is, to 1, where it is
/// wanted. All answers are conservative: kUnknown means that the step's work is used up.
class MotionTrial {
public:
    using TouchingAtStart = std::function<std::uint64_t(std::uint32_t, std::uint32_t)>;

    /// Pairs whose boxes do not meet anywhere on the way are no obstacles, unless a slide may lead there; of the others
    /// `touchingAtStart` is asked for the number of face pairs that meet before the motion begins. Where pairs let
    /// slide, `pairs` must hold all whose boxes on all ways (boxOnAllWays with `slides`) meet.
    /// `stopTolerance`: see CollisionLimits.
    MotionTrial(const ObjectHandler& handler, ObjectId transform, const Way& way, std::span<const ObstaclePair> pairs,
                const TouchingAtStart& touchingAtStart, double stopTolerance, QueryWork& work, std::uint64_t& queries);

    /// The same transform on another way, that begins somewhere on this one: against all pairs anew.
    [[nodiscard]] MotionTrial leg(const Way& way) const;

    /// In the order in which boxes come to meet; those whose boxes do not, last.
    [[nodiscard]] std::span<const Obstacle> obstacles() const { return obstacles_; }
    /// Before `first` and after `last` the boxes of the pair are apart.
    struct Span {
        double first = 0, last = 1;
        [[nodiscard]] bool holds(double fraction) const { return first <= fraction && fraction <= last; }
    };
    [[nodiscard]] const Span& boxesMeet(std::size_t obstacle) const { return pairs_[obstacle].meet; }
    [[nodiscard]] const Way& way() const { return way_; }

    /// No point of the pair moves further against the other over the whole way (world units).
    [[nodiscard]] double length(std::size_t obstacle) const;
    /// Box diagonal of the moving part (of the smaller one where both move), in world units.
    [[nodiscard]] double size(std::size_t obstacle) const { return pairs_[obstacle].size; }
    /// How near the pair may be when the motion stops, in world units.
    [[nodiscard]] double tolerance(std::size_t obstacle) const {
        const Obstacle& o = obstacles_[obstacle];
        return handler_.toleranceOf(o.partA, o.partB, size(obstacle), stopTolerance_);
    }

    /// Whether a pose of the transform takes the pair from its start by no more than is taken for touching (kTogether),
    /// or than the coordinates there can tell: that is no way at all.
    [[nodiscard]] bool leadsNowhere(std::size_t obstacle, const Pose& pose) const;

    /// Solid: hulls that are within each other touch, too.
    [[nodiscard]] Touch touching(std::size_t obstacle, double fraction) const;
    [[nodiscard]] FacePairs facesTouching(std::size_t obstacle, double fraction) const;
    /// When faces first touch on the way up to a fraction that are apart at the start and do not lie flush with what
    /// rests on something; or when what rests gets deeper (Impact::support >= 0). Its t is a fraction of the whole way;
    /// faces within a millionth of the tolerance count as touching.
    [[nodiscard]] Impact firstContact(std::size_t obstacle, double upTo) const;
    /// Whether the pair is kept apart as the smooth surfaces that it is of (FreeformPairs.h), instead of face by face:
    /// it is apart at the start, by more than rounding. Then it is apart where `touching` says kNo, and nothing of it
    /// rests or is stuck.
    [[nodiscard]] bool smooth(std::size_t obstacle) const { return smoothGap(obstacle) > 0; }
    /// Of such a pair: the places that are nearest, in the world.
    [[nodiscard]] std::optional<freeform_pairs::NearestPlaces> nearestPlaces(std::size_t obstacle,
                                                                             double fraction) const;
    /// Whether anything rests here or is stuck, before the motion begins.
    [[nodiscard]] bool rests(std::size_t obstacle) const;
    /// At a fraction: does nothing touch but what is flush with what it rests on, or was stuck from the start?
    [[nodiscard]] Touch touchingAnew(std::size_t obstacle, double fraction) const;

    [[nodiscard]] bool bothHulls(std::size_t obstacle) const { return pairs_[obstacle].bothHulls; }
    /// How deep two hulls are in each other, and which way B gets out; in the world. Nothing where that cannot be told.
    struct HullOverlap {
        double depth = 0;              ///< 0 where they are apart
        Vec3d normal = Vec3d::Zero();  ///< of unit length, from A to B
    };
    [[nodiscard]] std::optional<HullOverlap> hullOverlap(std::size_t obstacle, double fraction) const;

    /// In which directions the moving part of a pair gets free of the other, at a fraction at which they are near (the
    /// one of the nearest points) or touch (those of the faces that meet); of unit length, in the world. A's or B's
    /// way, whichever moves.
    [[nodiscard]] std::vector<Vec3d> waysOut(std::size_t obstacle, double fraction) const;
    /// The same of two faces that are near each other: of the directions that part them the one that is least against
    /// where the motion is wanted.
    [[nodiscard]] Vec3d wayOutOf(std::size_t obstacle, const FacePair& faces, double fraction,
                                 const Vec3d& wanted) const;
    /// The moving part's way, from a direction that leads from A to B.
    [[nodiscard]] Vec3d wayOfMover(std::size_t obstacle, const Vec3d& normal) const;
    /// How far the pair is apart, in world units (of the nearest points in A's frame).
    [[nodiscard]] double gap(std::size_t obstacle, double fraction) const;
    [[nodiscard]] double gapOf(std::size_t obstacle, const FacePair& faces, double fraction) const;
    /// See PartOnTheWay; nothing where both parts move.
    [[nodiscard]] std::optional<Mat3d> frameAbove(std::size_t obstacle) const;

    [[nodiscard]] Affine3d worldOfA(std::size_t obstacle, double fraction) const;
    [[nodiscard]] Affine3d worldOfB(std::size_t obstacle, double fraction) const;

private:
    struct Traveller {
        PartOnTheWay path;
        const CollisionShape* shape;
        WayBound bound;
        Box start, end;
    };
    struct Pair {
        const Traveller* a;
        const Traveller* b;
        double size = 0;
        bool bothHulls = false;
        Span meet;
    };
    const Traveller& traveller(std::uint32_t part);
    [[nodiscard]] Pair pairOf(const ObstaclePair& parts);
    [[nodiscard]] bool hullsOverlap(std::size_t obstacle, double fraction, Touch& touch) const;
    [[nodiscard]] bool withinHull(std::size_t obstacle) const;
    [[nodiscard]] WorldFaces placed(std::size_t obstacle, const FacePair& faces, double fraction) const;
    /// How far such a pair is apart at the start, at least, as far as it matters; 0 of others.
    [[nodiscard]] double smoothGap(std::size_t obstacle) const;
    /// Of its own faces; and together with what others rest on whom the same motion carries.
    bool addNearRests() const;
    Rest& ownRest(std::size_t obstacle) const;
    [[nodiscard]] std::vector<Support> supportsOf(std::size_t obstacle) const;
    [[nodiscard]] RestTerms restTerms(std::size_t obstacle) const;
    /// The nearest faces; nothing where that cannot be told.
    [[nodiscard]] std::optional<WorldFaces> nearest(std::size_t obstacle, double fraction) const;
    [[nodiscard]] const CollisionShape& shapeA(std::size_t obstacle) const {
        return *handler_.parts()[obstacles_[obstacle].partA].shape;
    }
    [[nodiscard]] const CollisionShape& shapeB(std::size_t obstacle) const {
        return *handler_.parts()[obstacles_[obstacle].partB].shape;
    }
    /// visit(faces, WorldFaces).
    template <typename Visit>
    void forFaces(std::size_t obstacle, std::span<const FacePair> faces, double fraction, Visit&& visit) const;

    const ObjectHandler& handler_;
    ObjectId transform_;
    Way way_;
    std::vector<ObstaclePair> all_;
    std::unordered_map<std::uint32_t, std::unique_ptr<const Traveller>> travellers_;
    std::vector<Obstacle> obstacles_;
    std::vector<Pair> pairs_;
    mutable std::vector<std::optional<Rest>> rests_;  ///< by obstacle, once asked for
    mutable std::vector<std::optional<double>> smoothGaps_;
    mutable bool lookedNear_ = false;
    double stopTolerance_;
    QueryWork& work_;
    std::uint64_t& queries_;
};

}  // namespace tessera

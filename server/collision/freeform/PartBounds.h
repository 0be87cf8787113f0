/// Two shapes where they stand: how far apart two of their parts are at least, and the points of two parts that are
/// near each other.
///
/// Lower bounds are gaps between hulls along some directions: between the middles, the parts' normals, where the last
/// nearest points lay. Along a normal a part is as thin as its curvature lets it, so that bounds are off by the square
/// of the parts' size. Nearer points are found by Levenberg-Marquardt steps clamped to the parts. For the queries of
/// this library.
#pragma once

#include <array>
#include <optional>

#include "server/collision/freeform/FreeformParts.h"

namespace tessera {

/// A place on both: parameters of the parts.
struct PlacePair {
    std::uint32_t a = 0, b = 0;
    Vec2d inA = Vec2d::Zero(), inB = Vec2d::Zero();
    Vec3d onA = Vec3d::Zero(), onB = Vec3d::Zero();
    double distance = 0;
};

class PartBounds {
public:
    PartBounds(const FreeformParts& a, const FreeformParts& b) : a_(a), b_(b) {}

    /// From the shapes' frames to one that both share. `reach`: of the largest coordinate in it.
    void place(const Affine3d& a, const Affine3d& b, double reach);

    /// Rounding in points and gaps: hulls that are farther apart than this are.
    [[nodiscard]] double slack() const { return slack_; }

    struct Gap {
        double length = 0;  ///< the parts are no nearer than this, along a direction; below 0 where none parts them
        Vec3d along = Vec3d::UnitX();  ///< of length 1, from A to B
        double apart = 0;              ///< the middles
    };
    /// The best of the directions; the first that reaches `enough` will do.
    [[nodiscard]] Gap gap(const FreeformPart& a, const FreeformPart& b, double enough,
                          const std::optional<Vec3d>& hint) const;
    /// Along one direction of length 1 more, where that is better.
    void offerAlong(const FreeformPart& a, const FreeformPart& b, const Vec3d& along, Gap& best) const;
    /// Both maps keep lengths: boxes stay boxes.
    [[nodiscard]] bool areRigid() const { return isRigidA_ && isRigidB_; }
    using Gaps = std::array<double, kernel::kBoxLanes>;
    /// Of all parts of a block of A to one part of B, and the other way round; they are no nearer than this. `hint` is
    /// in the shared frame, of length 1. Of rigid maps, and parts that have boxes (FreeformParts::boxOf).
    void gapsOfA(const PartBlock& ofA, std::uint32_t b, const Vec3d& hint, Gaps& least) const {
        gaps(ofA, b_.boxOf(b), a_T_b_, toA_ * hint, least);
    }
    void gapsOfB(const PartBlock& ofB, std::uint32_t a, const Vec3d& hint, Gaps& least) const {
        gaps(ofB, a_.boxOf(a), b_T_a_, toB_ * hint, least);
    }
    [[nodiscard]] double radiusA(const FreeformPart& a) const { return stretchA_ * a.radius; }
    [[nodiscard]] double radiusB(const FreeformPart& b) const { return stretchB_ * b.radius; }

    [[nodiscard]] Vec3d centerA(const FreeformPart& a) const { return isStillA_ ? a.center : Vec3d(mapA_ * a.center); }
    [[nodiscard]] Vec3d centerB(const FreeformPart& b) const { return mapB_ * b.center; }

    /// Of two parts with samples.
    [[nodiscard]] PlacePair samples(std::uint32_t a, std::uint32_t b) const;
    /// Goes from there to where the parts are nearer, until they are within `enough` or steps lead nowhere. Parts that
    /// have no parameters (groups, neighbourhoods) stay at their sample. A step that leaves more than the share `slow`
    /// of the distance is the last.
    [[nodiscard]] PlacePair descend(PlacePair from, double enough, int steps, double slow = 0.999) const;
    [[nodiscard]] bool isThere(const PlacePair& at) const;

    /// The normal of the surface there in the shared frame, outwards as the windings have it, of length 1; zero where
    /// there is none.
    [[nodiscard]] Vec3d normalA(const PlacePair& at) const { return normalOf(a_, a_[at.a], mapA_, at.inA); }
    [[nodiscard]] Vec3d normalB(const PlacePair& at) const { return normalOf(b_, b_[at.b], mapB_, at.inB); }

private:
    /// A direction of length 1 in the shared frame, and how far each of the shapes' axes reaches along it.
    struct BoxAxis {
        Vec3d along, reachA, reachB;
    };
    [[nodiscard]] BoxAxis boxAxis(const Vec3d& along) const;
    [[nodiscard]] Gap boxGap(const FreeformPart& a, const FreeformPart& b, const Vec3d& between, double enough,
                             const std::optional<Vec3d>& hint, Gap best) const;
    void gaps(const PartBlock& block, const PartBox& one, const Affine3d& block_T_one, const Vec3d& hint,
              Gaps& least) const;
    static Vec3d normalOf(const FreeformParts& parts, const FreeformPart& part, const Affine3d& map, const Vec2d& at);

    const FreeformParts &a_, &b_;
    Affine3d mapA_ = Affine3d::Identity(), mapB_ = Affine3d::Identity();
    Affine3d a_T_b_ = Affine3d::Identity(), b_T_a_ = Affine3d::Identity();  // of rigid maps
    kernel::GapsOfBoxes gapsOfBoxes_ = kernel::gapsOfBoxes();
    Mat3d toA_ = Mat3d::Identity(), toB_ = Mat3d::Identity();  // directions of the shared frame in the shapes'
    std::optional<Mat3d> normalsA_, normalsB_;                 // the shapes' normals in the shared frame
    std::array<BoxAxis, 6> axes_;                              // of the sides of groups' boxes
    std::size_t boxAxes_ = 0;
    bool isStillA_ = true, isRigidA_ = true, isRigidB_ = true;
    double stretchA_ = 1, stretchB_ = 1, slack_ = 0;
};

}  // namespace tessera

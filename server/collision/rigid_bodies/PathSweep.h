/// Do two parts that go their ways in a frame get deeper into each other than contact allows?
///
/// Conservative advancement (B. Mirtich, "Impulse-based Dynamic Simulation of Rigid Body Systems", 1996) over the
/// signed gap: along the axis that parts two convex solids best, or holds them apart least, the gap closes no faster
/// than both move along it. So the way is looked at without holes, and what is thinner than a step is not missed. Pairs
/// that touch as the frame begins are told from those that get through each other by depth, not by contact.
#pragma once

#include <vector>

#include "server/collision/rigid_bodies/BodyPath.h"
#include "server/collision/rigid_bodies/ContactPoint.h"
#include "server/collision/rigid_bodies/FrameBodies.h"
#include "server/collision/rigid_bodies/SolidContacts.h"

namespace tessera::rigid {

/// Allowed depth, in sizes of the smaller body.
constexpr double kAllowedSizes = 0.01;

/// One part on its way.
struct SweptPart {
    const BodyPath* path = nullptr;
    const FramePart* part = nullptr;
    const PlacedSolid* solid = nullptr;  ///< as the frame begins; null: faces only
    double size = 0;                     ///< of the body
};

/// What the narrow phase knows of them as the frame begins.
struct KnownGap {
    double gap = 0;                   ///< solids: at least this, along `normal`
    Vec3d normal = Vec3d::Zero();     ///< from A to B
    double slack = 0;                 ///< others: so far was looked in every direction,
    double nearest = 0;               ///< and no face is nearer than this
    std::span<const NearFace> faces;  ///< of a solid among faces: all that are not farther than `slack`
    std::span<const ContactPoint> points;
    double slop = 0;  ///< so deep they rest in each other
};

/// A point in which they hold each other, found on their way, as both have it when the frame begins.
struct SweepPoint {
    Vec3d onA, onB;  ///< world, as the frame begins
    Vec3d normal;    ///< from A to B, when they meet
    double gap = 0;  ///< along it, as the frame begins
};

struct SweepHit {
    bool hit = false;
    double t = 1;  ///< of both ways: up to here they do not
    /// No hit: while no point of them is together by so much elsewhere than on these ways, there is none either.
    double room = 0;
    std::vector<SweepPoint> points;
};

/// Kept between calls.
struct SweepScratch {
    struct Room {
        std::vector<Vec3d> corners;
        std::vector<PlacedSide> sides;
        std::vector<PlacedEdge> edges;
    };
    Room face, moved;
    Room from;                     ///< of a piece of a way, where it begins,
    std::vector<Vec3d> cornersTo;  ///< and where it ends
    std::vector<PlacedSide> axes;  ///< along which it rests on something
    ClipScratch clip;
    std::vector<std::uint32_t> faces;
    std::vector<ContactPoint> points;
};

/// No point of it is farther from its path's centre.
[[nodiscard]] double farthestOf(const SweptPart& part);
/// How far any point of it comes by turning, at most.
[[nodiscard]] double turningOf(const SweptPart& part);

/// Which depth two solids may reach at most, if they are not in each other already: a share of the thinner one, and of
/// the smaller body. 0: both are flat.
[[nodiscard]] double allowedDepth(const SweptPart& a, const SweptPart& b);

/// What is twice as deep in each other as is allowed when the frame begins is let go. Exhausted work: a hit where it
/// ended. Without `wantPoints` a hit has no points.
[[nodiscard]] SweepHit sweep(const SweptPart& a, const SweptPart& b, const KnownGap& known, SweepScratch& scratch,
                             QueryWork& work, bool wantPoints = true);

}  // namespace tessera::rigid

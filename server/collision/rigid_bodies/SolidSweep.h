/// Two convex solids on their ways in a frame: do they get deeper into each other than they may?
///
/// Conservative advancement over the signed gap, seen from one of the two, so that bodies that go and turn together
/// stand still in each other's eyes. Along an axis that is fixed in one body the corners of the other leave the
/// straight lines between two of their places by no more than an arc's height: so the gap is known between two looks at
/// it. For PathSweep and FaceSweep.
#pragma once

#include "server/collision/rigid_bodies/PathSweep.h"

namespace tessera::rigid {

/// A placed solid somewhere else: `to` moves it from where it is as the frame begins.
[[nodiscard]] PlacedSolid movedTo(const PlacedSolid& from, const Isometry3d& to, SweepScratch::Room& room);

class SolidSweep {
public:
    /// `solidB` may be something else than b.solid: one face of B. `farA`, `farB`: see farthestOf.
    SolidSweep(const SweptPart& a, const PlacedSolid& solidA, double farA, const SweptPart& b,
               const PlacedSolid& solidB, double farB, double allowed, SweepScratch& scratch, QueryWork& work);

    /// Whether they get deeper than they may between two times; then `t` is before that. `known`: an axis that parts
    /// them as the frame begins, and by how much at least.
    [[nodiscard]] bool find(double from, double to, double& t, const SolidGap& known = {});

    /// Does a plane of B with this normal (world, as the frame begins) keep them apart, or no deeper in each other than
    /// they may be?
    [[nodiscard]] bool keptApartByB(const Vec3d& fromAToB, double from, double to);

    /// After find() or keptApartByB(): how much nearer they might come all the way. 0 where that was not found.
    [[nodiscard]] double room() const { return room_; }

    /// What holds them at t, unless all is nearer to parting than `deep`.
    void holds(double t, double deep, std::vector<SweepPoint>& out);

private:
    enum class Seen : std::uint8_t { kFromA, kFromB };
    /// An axis at rest in one of them, and a time. From there: the other's corners on their way.
    struct Look {
        Seen seen = Seen::kFromA;
        Vec3d normal = Vec3d::Zero();  ///< from A to B, in the body's place as the frame begins
        double own = 0;                ///< how far the body itself comes along it
    };

    [[nodiscard]] Isometry3d bSeenFromA(double t) const;
    [[nodiscard]] Look lookAlong(Seen seen, const Vec3d& normalInA, double t) const;
    [[nodiscard]] double gapAt(const Look& look, double t) const;
    /// From t on, `gap` apart then: how long it stays above the target at least.
    [[nodiscard]] double clearFor(const Look& look, double gap, double t, double to, double target);
    /// By how much a corner may leave the straight line between its places.
    [[nodiscard]] double arc(Seen seen, double part) const;
    [[nodiscard]] SolidAxis axisAt(double t, double margin);
    [[nodiscard]] SolidAxis deepestAt(double t);

    const SweptPart &a_, &b_;
    const PlacedSolid &solidA_, &solidB_;
    double allowed_, farA_, farB_;
    double bend_[2];  ///< of a corner's way, per whole way squared: seen from A, from B
    SweepScratch& scratch_;
    QueryWork& work_;
    double room_ = 0;
    ConvexCache cache_;
};

}  // namespace tessera::rigid

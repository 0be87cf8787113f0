/// What holds pairs of faces that rest on each other while two bodies move (see Support).
#pragma once

#include <cmath>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "server/collision/mesh/TriangleContact.h"
#include "server/collision/query/BodyWay.h"
#include "server/collision/tree/TreeStorage.h"

namespace tessera {

/// Two faces at one moment, in the shared frame.
struct MovingPair {
    Triangle a, b, velocityA, velocityB;
    double reachA = 0, reachB = 0;  ///< of their corners, see BodyWay::reachOf

    /// For how long every corner of B is certain to be above every corner of A along n, by more than `least`, which
    /// grows by `growth` and where rates fall by `bend` per unit of time at most. Each corner has its own rate: that
    /// far ones come nearer does not matter.
    [[nodiscard]] double timeApart(const Vec3d& n, double least, double growth, double bend) const;
};

/// The least of n · corner.
[[nodiscard]] double lowest(const Vec3d& n, const Triangle& t);
/// The first zero of gap + rate t - bend/2 t², rounded towards less.
[[nodiscard]] double timeUntilZero(double gap, double rate, double bend);

struct Extent {
    double low, high;
};
/// Of what a volume of a tree holds, along a direction of the shared frame.
[[nodiscard]] Extent extentAlong(const TreeStorage& tree, const BodyMoment& moment, kernel::Slot slot, const Vec3d& n);

/// How far apart two bodies are in contact (ImpactOptions::margin).
class Thickness {
public:
    explicit Thickness(const ImpactOptions& options) : start_(options.margin), growth_(options.marginGrowth) {}
    /// Finite, and never negative.
    [[nodiscard]] bool valid() const {
        return std::isfinite(start_) && std::isfinite(growth_) && start_ >= 0 && start_ + growth_ >= 0;
    }
    [[nodiscard]] double at(double t) const { return start_ + t * growth_; }
    [[nodiscard]] double growth() const { return growth_; }

private:
    double start_, growth_;
};

/// A pair that is held has a ticket (not 0) for the support that holds it and for how far it may overlap.
class SupportSet {
public:
    /// `margin`: what rounding can do to a distance. `reach`: of all points of a body, see BodyWay::reachOf.
    SupportSet(const BodyWay& a, double reachA, const BodyWay& b, double reachB, std::span<const Support> supports,
               double margin, const Thickness& thickness);

    using Start = std::function<std::pair<Triangle, Triangle>()>;
    /// Who holds a pair that is near; 0: nobody. `apart`: from A to B, zero for faces that meet. Of those that it lies
    /// flush with, that is to say of those that nearly separate it and the one along which it overlaps least, the one
    /// that holds longest. None that it is behind of, unless it was at the start already. What was held by another one
    /// (`before`) is handed over where the new one separates.
    std::uint32_t choose(const MovingPair& pair, double t, const Vec3d& apart, std::uint32_t before,
                         const Start& start);
    /// For how long it is certain to hold; 0: no longer.
    [[nodiscard]] double heldFor(const MovingPair& pair, double t, std::uint32_t ticket) const;
    [[nodiscard]] bool stays(const MovingPair& pair, double t, std::uint32_t ticket) const;
    /// Faces that are apart in this direction have gone through each other.
    [[nodiscard]] bool behind(const Vec3d& apart, double t, std::uint32_t ticket) const;
    /// When it began to overlap by more than when it was found, of a pair that is held up to t.
    [[nodiscard]] double gotDeeperAfter(double t, std::uint32_t ticket) const {
        return straight_ ? tickets_[ticket - 1].since : t;
    }
    [[nodiscard]] std::size_t indexOf(std::uint32_t ticket) const { return tickets_[ticket - 1].support; }

    /// Of two volumes with everything in them, by their extents at the start: where all goes along or away all the way,
    /// and turns about the normal if at all.
    template <typename ExtentA, typename ExtentB>
    [[nodiscard]] bool holdsToTheEnd(const ExtentA& ofA, const ExtentB& ofB) const {
        for (const Support& support : along_)
            if (ofA(support.normal).high - ofB(support.normal).low + thickness_.at(0) <= support.overlap) return true;
        return false;
    }

private:
    struct Ticket {
        std::size_t support;
        double overlap;
        double since;
    };
    /// A support's normal at a moment, and how it turns.
    [[nodiscard]] BodyWay::Turned directionAt(const Support& support, double t) const;
    [[nodiscard]] double heldFor(const MovingPair& pair, double t, const Support& support, double overlap) const;

    const BodyWay &a_, &b_;
    std::vector<Support> supports_;
    std::vector<Support> along_;  ///< along which no overlap grows
    std::vector<Ticket> tickets_;
    double margin_;
    Thickness thickness_;
    bool straight_;
};

}  // namespace tessera

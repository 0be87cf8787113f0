/// The transforms between a frame and a part, some of them on ways of their own.
#pragma once

#include <optional>
#include <vector>

#include "server/collision/query/TimeOfImpact.h"
#include "server/collision/response/Reach.h"

namespace tessera {

/// From above down; the same fraction of every way has passed.
class Chain {
public:
    void append(const Way& way);
    void append(const Affine3d& fixed);

    [[nodiscard]] bool moves() const { return moves_; }
    /// above_T_below.
    [[nodiscard]] Affine3d at(double fraction) const;
    /// Of points that are `below`, in the frame above.
    [[nodiscard]] Reach reach(Reach below) const;
    /// No length is stretched by more, at any time.
    [[nodiscard]] double stretch() const;
    /// The linear map of what stands above the first transform that turns or scales; the identity where none does.
    [[nodiscard]] Mat3d frameOfTurn() const;
    /// The whole as one motion in a frame of which the chain's upper frame is `frame`, to rounding. Nothing where it is
    /// none: more than one turns, one moves below another that turns, or one turns in a frame that is sheared or scaled
    /// unevenly.
    [[nodiscard]] std::optional<BodyMotion> asOneMotion(const Mat3d& frame) const;
    /// The whole, one motion carried by another, whatever it is.
    [[nodiscard]] BodyMotion asCarriedMotion() const;
    /// Translations alone.
    [[nodiscard]] bool straight() const;

private:
    struct Step {
        std::optional<Way> way;
        Affine3d fixed = Affine3d::Identity();  ///< where there is no way
    };
    std::vector<Step> steps_;
    bool moves_ = false;
};

/// What two parts share, and what each has of its own below.
struct ChainPair {
    Chain shared, a, b;
};
[[nodiscard]] ChainPair chainsOf(const ObjectHandler& handler, std::uint32_t partA, std::uint32_t partB,
                                 const WayLookup& wayOf);

}  // namespace tessera

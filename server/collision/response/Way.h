/// The way of a transform from where it is to where it is wanted, and how far a part can stray on it.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "common/math/Decompositions.h"
#include "common/math/Pose.h"
#include "server/collision/objects/ObjectHandler.h"

namespace tessera {

/// Translation and scale run linearly, rotation by slerp along the shorter arc.
struct Way {
    Pose start, end;

    /// 0: the start, 1: the end, bit for bit.
    [[nodiscard]] Pose at(double fraction) const;
};

[[nodiscard]] Affine3d localOf(const Pose& value);

/// Finite, a rotation that is one, and no zero in the scale.
[[nodiscard]] bool possible(const Pose& value);

/// Of every point of a part, in the world, over the whole way (fraction 0 to 1).
struct WayBound {
    double length = 0;  ///< no point travels further
    /// Of the second derivative, where everything that moves has the same fraction: over an interval h of it the path
    /// leaves its chord by at most curvature·h²/8.
    double curvature = 0;
    /// The sum of the second derivatives by each place's own fraction: where each moves for itself, the part stays
    /// within bow/8 of the boxes around its poses at the ends of all ways.
    double bow = 0;
    double drift = 0;  ///< how far the translations alone carry it
    int bends = 0;     ///< how many places on ways of their own lie above the part, its own included
};

/// The way of a transform by its id, or null where it stands still.
using WayLookup = std::function<const Way*(ObjectId)>;

/// `length` holds for any progress of each moving transform above the part.
[[nodiscard]] WayBound boundWay(const ObjectHandler& handler, std::uint32_t part, const WayLookup& wayOf);

/// The box that holds a part wherever the transforms above it may be on their ways, each for itself. With `slides` also
/// wherever a response may lead it that turns what is left of their translations along surfaces.
[[nodiscard]] Box boxOnAllWays(const ObjectHandler& handler, std::uint32_t part, const WayLookup& wayOf,
                               bool slides = false);

/// The world pose of a part while one transform is on its way and everything else is as the handler has it.
class PartOnTheWay {
public:
    PartOnTheWay(const ObjectHandler& handler, std::uint32_t part, ObjectId transform);

    [[nodiscard]] bool moves() const { return !path_.empty(); }
    /// The nearest place of the transform above the part (Place::kNone where it does not move).
    [[nodiscard]] std::uint32_t carrier() const { return carrier_; }
    /// The linear map to the world from the frame that the transform's translation is in; nothing where the part does
    /// not move, and where it has the transform above it more than once.
    [[nodiscard]] std::optional<Mat3d> frameAbove() const;
    /// Multiplies as the object handler does: the same bits once the value is committed.
    [[nodiscard]] Affine3d world(const Affine3d& local) const;

private:
    struct Step {
        bool onTheWay;
        Affine3d local;
    };
    Affine3d above_ = Affine3d::Identity();
    std::vector<Step> path_;  // from the transform's topmost place down to the part
    std::uint32_t carrier_ = Place::kNone;
};

}  // namespace tessera

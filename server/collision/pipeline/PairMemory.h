/// What is known about pairs of parts: asked once, remembered until one of them moves; hints from frame to frame.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "server/collision/convex/ConvexQuery.h"
#include "server/collision/neighbours/NeighbourFinder.h"
#include "server/collision/objects/ObjectHandler.h"
#include "server/collision/query/DistanceQuery.h"
#include "server/collision/query/TouchFront.h"

namespace tessera {

/// Do two parts touch, and with which faces? Holds for the two poses that the versions name.
struct TouchAnswer {
    std::uint64_t versionA = 0, versionB = 0;  ///< 0: nothing is known
    bool all = false;                          ///< all faces were asked for; else one pair of them
    bool touching = false;
    bool complete = true;         ///< false: the work was exhausted; not touching then means nothing
    std::uint64_t faceCount = 0;  ///< pairs of faces found; of two hulls 1
    std::vector<FacePair> faces;  ///< ascending; the first of them. Of two hulls none

    [[nodiscard]] bool holds(const Part& a, const Part& b, bool wantAll) const {
        return versionA == a.poseVersion && versionB == b.poseVersion && versionA != 0 &&
               (all || !wantAll || (complete && !touching));
    }
};

struct DistanceAnswer {
    std::uint64_t versionA = 0, versionB = 0;
    double upperBound = 0;  ///< world units; farther was of no interest
    bool farther = true;
    bool complete = true;
    double distance = 0;  ///< world units
    FacePair faces;
    Vec3d pointA = Vec3d::Zero(), pointB = Vec3d::Zero();  ///< world
};

/// Where two hulls touch that do, in the poses that the versions name. World.
struct HullContact {
    std::uint64_t versionA = 0, versionB = 0;
    Vec3d point = Vec3d::Zero(), normal = Vec3d::Zero();
};

struct PairState {
    std::uint32_t a = 0, b = 0;  ///< parts; A is of the deciding interest's object
    ObjectId nodeA, nodeB;
    TouchAnswer touch;
    DistanceAnswer distance;
    HullContact hullContact;
    // Hints: they change no answer.
    TouchFront front;
    ConvexCache hulls;
    std::optional<FacePair> nearest;
};

/// Not thread-safe; different states may be worked on by different threads.
class PairMemory {
public:
    /// Makes the states those of these pairs (ascending): known ones stay, others are forgotten.
    void align(std::span<const NeighbourPair> near, const ObjectHandler& handler);

    [[nodiscard]] std::span<PairState> states() { return states_; }  ///< parallel to the pairs given last

private:
    void renumber(const ObjectHandler& handler);

    std::vector<PairState> states_, before_;
    std::uint64_t generation_ = 0;
};

}  // namespace tessera

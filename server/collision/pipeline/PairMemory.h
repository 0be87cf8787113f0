/// What is known about pairs of parts: asked once, remembered until one of them moves; hints from frame to frame.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "server/collision/neighbours/NeighbourFinder.h"
#include "server/collision/objects/ObjectHandler.h"
#include "server/collision/pairwise/PairTable.h"

namespace tessera {

/// Do two parts touch, and with which faces? Holds for the two poses that the versions name.
struct TouchAnswer {
    std::uint64_t versionA = 0, versionB = 0;  ///< 0: nothing is known
    bool all = false;                          ///< all faces were asked for; else one pair of them
    bool touching = false;
    bool complete = true;              ///< false: the work was exhausted; not touching then means nothing
    std::uint64_t faceCount = 0;       ///< pairs of faces found; of two hulls 1
    std::vector<FacePair> faces;       ///< ascending; the first of them. Of two hulls none
    std::vector<MeetingPlace> places;  ///< world; as PairTouch::places

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
    double error = 0;                                      ///< as PairDistance::error
};

/// Where two hulls touch that do, in the poses that the versions name. World.
struct HullContact {
    std::uint64_t versionA = 0, versionB = 0;
    Vec3d point = Vec3d::Zero(), normal = Vec3d::Zero();
    double depth = 0;  ///< as Contact::depth
};

struct PairState {
    static constexpr std::uint32_t kNowhere = 0xffffffffu;

    std::uint32_t a = 0, b = 0;  ///< parts; A is of the deciding interest's object
    ObjectId nodeA, nodeB;       ///< none: the number is free
    TouchAnswer touch;
    DistanceAnswer distance;
    HullContact hullContact;
    PairHints hints;
    // Kept by PairMemory.
    std::uint32_t inA = 0, inB = 0;  ///< where it stands among the pairs of its parts
    std::uint32_t inTold = kNowhere;
    bool loose = false;  ///< perhaps no pair any more
    bool stale = false;  ///< among what is to be looked at
};

/// Pairs have numbers that stay as long as their parts may meet. Not thread-safe; different states may be worked on by
/// different threads.
class PairMemory {
public:
    /// Forgets everything.
    void clear();
    /// Numbers of parts that may be others now, or of interest to others: their pairs are none unless they begin anew.
    /// Returns them as the finder knows them.
    [[nodiscard]] std::vector<NeighbourPair> loosen(std::span<const std::uint32_t> parts);
    /// Pairs that have begun and ended; those loosened that have not begun end.
    void follow(std::span<const NeighbourPair> begun, std::span<const NeighbourPair> ended,
                const ObjectHandler& handler);
    /// These are all pairs, ascending.
    void align(std::span<const NeighbourPair> all, const ObjectHandler& handler);
    /// What interests ask of the pairs of these parts, or which of the two comes first, is another matter.
    void reconsider(std::span<const std::uint32_t> parts, const ObjectHandler& handler);

    [[nodiscard]] std::span<PairState> states() { return states_; }  ///< by number
    [[nodiscard]] std::span<const PairState> states() const { return states_; }
    [[nodiscard]] std::size_t size() const { return size_; }
    [[nodiscard]] std::span<const std::uint32_t> pairsOf(std::uint32_t part) const {
        return part < pairsOfPart_.size() ? std::span<const std::uint32_t>(pairsOfPart_[part])
                                          : std::span<const std::uint32_t>();
    }
    /// Pairs to be looked at: those that begin, and all of parts that have moved.
    void moved(std::span<const std::uint32_t> parts);
    void lookAgain(std::uint32_t pair) { makeStale(pair); }
    /// In the order of their parts in the document, so that nothing depends on numbers.
    [[nodiscard]] std::vector<std::uint32_t> takeStale(const ObjectHandler& handler);
    void sort(std::vector<std::uint32_t>& pairs, const ObjectHandler& handler) const;
    /// The same, and each once.
    void sortOnce(std::vector<std::uint32_t>& pairs, const ObjectHandler& handler) const;

    /// Pairs that touch or are near.
    void tell(std::uint32_t pair, bool yes);
    [[nodiscard]] std::span<const std::uint32_t> told() const { return told_; }
    /// Whether one pair comes before another in the order of their parts in the document.
    [[nodiscard]] bool before(std::uint32_t x, std::uint32_t y, const ObjectHandler& handler) const;
    /// Numbers that have ceased to be a pair since the last call, and may be another one; nothing: all of them.
    [[nodiscard]] std::optional<std::vector<std::uint32_t>> takeEnded();

private:
    [[nodiscard]] std::uint32_t find(const NeighbourPair& pair) const;
    void begin(const NeighbourPair& pair, const ObjectHandler& handler);
    void end(std::uint32_t pair);
    void dropLoose();
    void makeStale(std::uint32_t pair);
    void name(PairState& state, const NeighbourPair& pair, const ObjectHandler& handler) const;

    std::vector<PairState> states_;
    std::vector<std::uint32_t> free_, loose_, stale_, told_, ended_;
    bool allEnded_ = false;
    std::vector<std::vector<std::uint32_t>> pairsOfPart_;
    std::size_t size_ = 0;
};

}  // namespace tessera

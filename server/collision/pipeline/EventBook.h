/// Who touches whom, or is near whom, by interest: what began, stays and ended.
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <set>
#include <span>
#include <tuple>
#include <vector>

#include "server/collision/pipeline/StepResult.h"

namespace tessera {

/// Remembers the last frame in ids of the scene, so that it survives any change of structure: a pair whose object is
/// deleted, hidden or no longer of interest ends. What rests is kept from frame to frame: a frame costs what has come,
/// gone or is told besides. Not thread-safe.
class EventBook {
public:
    using Key = std::tuple<ObjectId, ObjectId, ObjectId>;  ///< interest, objectA, objectB

    /// Two objects of an interest touch at the end of the frame, or touched on the way (firstTime, point, normal).
    /// Several entries for one pair (of several parts): the earliest counts.
    struct Touching {
        PairEvent event;  ///< phase is of no meaning
        bool atEnd = true;
    };

    /// From now on a pair of parts, by its number, touches where it rests, for these, and is near for those (phase is
    /// of no meaning), instead of what it did before.
    void rests(std::uint32_t pair, std::vector<Key> touching, std::vector<PairDistance> near);
    void takeOut(std::uint32_t pair) {
        if (pair < ofPair_.size()) rests(pair, {}, {});
    }
    /// Numbers mean nothing any more.
    void takeOutAll();

    /// Of a frame that ends. Numbers are of the lists, at most so many entries each.
    struct Page {
        std::size_t events = 0, distances = 0, leftOut = 0;
        std::vector<PairEvent> eventChanges;  ///< in order
        std::vector<PairDistance> distanceChanges;
        DistanceList::Near near;
    };
    /// Whether one pair of parts is before another.
    using Before = std::function<bool(std::uint32_t, std::uint32_t)>;
    /// Takes what touches besides, in this frame alone, in any order.
    [[nodiscard]] Page turnPage(std::span<const Touching> besides, const Before& before, std::size_t most);

    // Of the page, in order, at most so many. Until anything else is called.
    [[nodiscard]] std::vector<PairEvent> events(std::size_t most) const;
    [[nodiscard]] std::vector<PairDistance> distances(std::size_t most) const;

private:
    struct NearPair {
        std::uint32_t pair = 0;
        PairDistance distance;
    };
    struct OfPair {
        std::vector<Key> touching, near;
    };
    using Besides = std::map<Key, Touching>;

    void turnEvents(std::span<const Touching> besides, Page& page);
    void turnDistances(const Before& before, Page& page);

    std::vector<OfPair> ofPair_;            // by number
    std::map<Key, std::uint32_t> resting_;  // how many pairs of parts
    std::map<Key, bool> restedBefore_;      // of those that came or went since the page: whether they rested then
    Besides besides_;                       // of the page
    std::vector<PairEvent> special_;        // of the page: all but those that merely rest on; ascending
    std::map<Key, std::vector<NearPair>> nearOf_;
    std::set<Key> nearChanged_;              // since the page
    std::map<Key, PairDistance> near_;       // of the page
    std::multiset<double> leastFirst_;       // their distances
    std::vector<PairDistance> specialNear_;  // of the page: that began or ended; ascending
};

}  // namespace tessera

/// Who is of interest to whom: parts in groups, and what each two groups are to each other.
#pragma once

#include <cstdint>
#include <deque>
#include <span>
#include <vector>

#include "server/collision/neighbours/NeighbourFinder.h"
#include "server/collision/objects/IdTable.h"
#include "server/collision/objects/Relation.h"

namespace tessera {

/// The two sides of an interest, as ranges of places.
struct InterestSides {
    struct Range {
        std::uint32_t begin = 0, end = 0;
        [[nodiscard]] bool holds(std::uint32_t place) const { return begin <= place && place < end; }
        bool operator==(const Range&) const = default;
    };
    bool awake = false;  ///< both of its nodes are visible
    bool ignores = false;
    bool oneObject = false;  ///< `object` is one body, and the whole of it: nothing in it is on the other side
    Range object, against;
    std::int64_t objectLayers = -1, againstLayers = -1;
};

/// Geometry that may take part, as interests see it.
struct InterestItem {
    std::uint32_t place = 0;
    std::uint32_t body = 0;   ///< the topmost place of its body
    bool object = false;      ///< a CollisionObject makes that body
    std::int64_t layers = 1;  ///< the body's
    bool alone = false;       ///< its body shares no group with others
};

/// Items that interests cannot tell apart form a group, so there are few groups, however many parts, and what two parts
/// are to each other is a lookup by their groups. Of two groups with interests of their own each that is a list of its
/// own, so a thousand interests could mean half a million lists: a list is made when it is first asked for.
class RelationTable {
public:
    /// Items in document order. Interests count in their order while their groups stay within `maxGroups`. Returns per
    /// item: whether it takes part, that is, is on a side of an interest that does not ignore.
    [[nodiscard]] std::vector<bool> make(std::span<const InterestTerms> terms, std::span<const InterestSides> sides,
                                         std::span<const InterestItem> items, std::size_t maxGroups);
    /// The terms have changed, the sides and what is ignored have not.
    void refresh(std::span<const InterestTerms> terms);

    /// How many interests count.
    [[nodiscard]] std::size_t taken() const { return sides_.size(); }
    /// By number among the items that take part.
    [[nodiscard]] const InteractionTable& interactions() const { return interactions_; }
    /// Of two items that take part and belong to different bodies; a < b. Two groups are asked about for the first time
    /// by one thread at a time, and then by any number of threads.
    [[nodiscard]] Relation relation(std::uint32_t a, std::uint32_t b) const;

private:
    /// The other side of one interest or of several.
    struct OtherSide {
        InterestSides::Range range;
        std::int64_t layers = -1;
        std::vector<bool> reaches;  ///< per group
        [[nodiscard]] bool holds(const InterestItem& item) const {
            return range.holds(item.place) && (item.layers & layers) != 0;
        }
    };
    struct Group {
        InterestItem example;
        bool manyBodies = false;
        std::vector<std::uint32_t> interests;  ///< on whose object's side it is, ascending
    };
    struct Asked {
        Relation relation;  ///< all but `firstIsObject` and `interests`
        /// Whether the lower-numbered part can be the object where it is of the lower group, or of the other. In a pair
        /// that could be either way round it always is.
        bool lowIsObject = false, highIsObject = false;
        std::vector<std::uint32_t> interests;
    };
    using GroupPair = StrongId<struct GroupPairTag>;

    void findOtherSides();
    [[nodiscard]] std::size_t findGroups(std::span<const InterestItem> items, std::size_t maxGroups);
    void relateGroups();
    [[nodiscard]] bool isAgainst(std::uint32_t interest, std::uint32_t group) const;
    [[nodiscard]] Asked ask(std::uint32_t low, std::uint32_t high) const;
    void sumUp(Asked& asked) const;

    std::vector<InterestTerms> terms_;
    std::vector<InterestSides> sides_;
    std::vector<std::uint32_t> otherSideOf_;  // per interest
    std::vector<OtherSide> otherSides_;
    std::vector<std::uint32_t> groupOfItem_;  // kNobody: takes no part
    std::vector<Group> groups_;
    InteractionTable interactions_;
    mutable std::deque<Asked> asked_;  // stay where they are, so that lists can be handed out
    mutable BasicIdTable<GroupPair> askedNumbers_;
};

}  // namespace tessera

/// Who is of interest to whom: parts in groups, and what each two groups are to each other.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/collision/neighbours/NeighbourFinder.h"
#include "server/collision/objects/Relation.h"

namespace tessera {

/// The two sides of an interest, as ranges of places.
struct InterestSides {
    struct Range {
        std::uint32_t begin = 0, end = 0;
        [[nodiscard]] bool holds(std::uint32_t place) const { return begin <= place && place < end; }
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

/// Items that the same interests speak of in the same way form a group, so a lookup takes a table of groups by groups,
/// however many parts there are. The table holds 4 bytes for each two groups, and 40 more for each list of interests
/// that some two of them have.
class RelationTable {
public:
    /// Items in document order. Interests count in their order while their groups stay within `maxGroups`. Returns per
    /// item: whether it takes part, that is, is on a side of an interest that does not ignore.
    [[nodiscard]] std::vector<bool> make(std::span<const InterestTerms> terms, std::span<const InterestSides> sides,
                                         std::span<const InterestItem> items, std::size_t maxGroups);
    /// The terms have changed, the sides and what is ignored have not.
    void refresh(std::span<const InterestTerms> terms);

    /// How many interests count.
    [[nodiscard]] std::size_t taken() const { return taken_; }
    /// By number among the items that take part.
    [[nodiscard]] const InteractionTable& interactions() const { return interactions_; }
    /// Of two items that take part and belong to different bodies; a < b.
    [[nodiscard]] Relation relation(std::uint32_t a, std::uint32_t b) const;

private:
    /// A list of interests: another one and one more. List 0 is empty.
    struct List {
        std::uint32_t before = 0;
        std::uint32_t interest = 0;
        std::uint32_t length = 0;
        std::uint32_t first = 0;  ///< in listed_
        Relation relation;        ///< all but `firstIsObject` and `interests`
    };
    static constexpr std::uint32_t kFirstIsObject = 1;  // the lowest bit of an entry; above it the list's number

    std::size_t findGroups(std::span<const InterestSides> sides, std::span<const InterestItem> items,
                           std::size_t maxGroups);
    void relate(std::span<const InterestSides> sides, std::span<const InterestItem> items);
    void listInterests();

    std::size_t taken_ = 0;
    std::vector<std::uint32_t> groupOfItem_;     // kNobody: takes no part
    std::vector<std::uint32_t> representative_;  // per group: an item
    std::vector<bool> manyBodies_;               // per group
    InteractionTable interactions_;
    std::vector<std::uint32_t> entries_;  // groups × groups; the lower-numbered part's group first
    std::vector<List> lists_;
    std::vector<std::uint32_t> listed_;
};

}  // namespace tessera

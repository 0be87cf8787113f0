/// Who is of interest to whom: geometry in groups, and what each two groups are to each other.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include "server/collision/neighbours/NeighbourFinder.h"
#include "server/collision/objects/Place.h"
#include "server/collision/objects/Relation.h"

namespace tessera {

/// The two sides of an interest: places at and below which they are.
struct InterestSides {
    bool awake = false;  ///< both of its nodes are visible
    bool ignores = false;
    bool alone = false;      ///< asks what runs into itself: there is no other side
    bool oneObject = false;  ///< `object` is one body, and the whole of it: nothing in it is on the other side
    std::uint32_t object = kNobody, against = kNobody;
    std::int64_t objectLayers = -1, againstLayers = -1;
    bool operator==(const InterestSides&) const = default;
};

/// All that interests can tell a geometry by.
struct Likeness {
    std::uint32_t side = kNobody;  ///< the nearest place at or above it where a side begins
    std::uint32_t bodySide =
        kNobody;          ///< the same of its body's topmost place, where a CollisionObject makes that body
    bool object = false;  ///< one does
    std::int64_t layers = 1;
    auto operator<=>(const Likeness&) const = default;
};

/// Geometry that no interest can tell apart forms a group, so there are few groups, however many parts, and what two
/// parts are to each other is a lookup by their groups. A group comes with its first member and goes with its last one.
/// Of two groups with interests of their own each that is a list of its own, so a thousand interests could mean half a
/// million lists: a list is made when it is first asked for.
class RelationTable {
public:
    /// The nearest place above one where a side begins; kNobody.
    using SideAbove = std::function<std::uint32_t(std::uint32_t)>;

    void clear();
    /// Who the interests are, in document order, has changed, or what their sides are: all groups are looked at again.
    void setInterests(std::span<const InterestTerms> terms, std::span<const InterestSides> sides,
                      const SideAbove& above);
    /// The terms have changed, the sides and what is ignored have not.
    void setTerms(std::span<const InterestTerms> terms);
    /// Groups that may interact with others than before, or take part now, or no longer, since the last call;
    /// ascending. (Of two groups that come to interact, or to be something else to each other, one at least.)
    [[nodiscard]] std::vector<std::uint32_t> takeChanged();

    /// Adds a geometry (by its place) to its group, which may be new; says to which.
    std::uint32_t join(const Likeness& likeness, std::uint32_t place, const SideAbove& above);
    /// The last member takes the number of the one that leaves.
    void leave(std::uint32_t group, std::uint32_t member);
    [[nodiscard]] std::span<const std::uint32_t> members(std::uint32_t group) const { return groups_[group].members; }
    [[nodiscard]] const Likeness& likeness(std::uint32_t group) const { return groups_[group].likeness; }
    /// On a side of an interest that does not ignore.
    [[nodiscard]] bool takesPart(std::uint32_t group) const { return groups_[group].takesPart; }
    /// Groups that take part.
    [[nodiscard]] std::size_t size() const { return taking_; }

    /// Which group and body a part is of; kNobody: the number is free.
    void setPart(std::uint32_t part, std::uint32_t group, std::uint32_t body);
    /// So many bodies have parts in a group now; `body` is the one that came or went.
    void countBody(std::uint32_t group, std::uint32_t body, bool comes);

    /// By number of parts and groups; there may be numbers that nobody has.
    [[nodiscard]] const InteractionTable& interactions() const { return interactions_; }
    /// Another one whenever what groups are to each other, or whether a group has parts, has changed.
    [[nodiscard]] std::uint64_t version() const { return logStart_ + log_.size(); }
    /// Groups that have become something else to any group since then, some of them several times; nothing where it may
    /// be all of them.
    [[nodiscard]] std::optional<std::span<const std::uint32_t>> changedSince(std::uint64_t version) const {
        if (version < logStart_) return std::nullopt;
        return std::span(log_).subspan(version - logStart_);
    }
    /// What is asked of two groups' parts together, where they may meet: less than their relation, and nothing is kept.
    struct Pairing {
        std::int64_t response = InterestWords::kReport;
        bool dynamic = false;
    };
    [[nodiscard]] std::optional<Pairing> pairing(std::uint32_t group, std::uint32_t other) const;
    /// Numbers of groups are below this.
    [[nodiscard]] std::size_t groupNumbers() const { return groups_.size(); }
    /// Of two groups; the first part is before the second in document order, and of another body.
    [[nodiscard]] Relation relation(std::uint32_t first, std::uint32_t second) const;
    /// The interests on whose object's side a group is, ascending.
    [[nodiscard]] std::span<const std::uint32_t> interestsOf(std::uint32_t group) const {
        return groups_[group].interests;
    }

private:
    struct Group {
        Likeness likeness;
        std::uint32_t serial = 0;  ///< of no other group, now or before
        std::vector<std::uint32_t> members;
        std::vector<std::uint32_t> roots;      ///< places above where sides begin, from below up
        std::vector<std::uint32_t> interests;  ///< on whose object's side it is, ascending
        std::vector<std::uint32_t> others;     ///< other sides that hold it, ascending
        bool takesPart = false;
        std::uint32_t bodies = 0, bodyMix = 0;  ///< how many have parts in it; their numbers, by exclusive or
    };
    /// The other side of one interest or of several.
    struct OtherSide {
        std::uint32_t root = kNobody;
        std::int64_t layers = -1;
        bool asked = false;  ///< by one that does not ignore
    };
    struct Rooted {
        std::vector<std::uint32_t> interests, others;
    };
    struct Asked {
        Relation relation;  ///< all but `firstIsObject` and `interests`
        /// Whether the first part can be the object where it is of the lower group, or of the other. In a pair that
        /// could be either way round it always is.
        bool lowIsObject = false, highIsObject = false;
        std::vector<std::uint32_t> interests;
        std::uint32_t low = kNobody, high = kNobody;  ///< the groups, as long as they live
    };
    /// How interests are numbered now; kNobody: gone, or with other sides.
    struct Renumbering {
        std::vector<std::uint32_t> interests, others;
        std::vector<bool> reworded;  ///< of those that stay, by their new number: other terms
        bool inOrder = true;         ///< those that stay are in the same order
    };

    /// Two bodies at least are in them.
    [[nodiscard]] static bool meet(const Group& a, const Group& b, bool same) {
        if (same) return a.bodies > 1;
        return a.bodies > 0 && b.bodies > 0 && (a.bodies > 1 || b.bodies > 1 || a.bodyMix != b.bodyMix);
    }
    [[nodiscard]] Renumbering renumber(std::span<const InterestTerms> terms,
                                       std::span<const InterestSides> sides) const;
    [[nodiscard]] bool sameRoots(const Group& group, const SideAbove& above) const;
    void keepAsked(const Renumbering& now, const std::vector<bool>& different);
    void note(std::uint32_t group);
    void noteAll();
    void findOtherSides();
    void sign(Group& group, const SideAbove& above) const;
    void setTakesPart(std::uint32_t number);
    void relate(std::uint32_t number);
    void makeRoom();
    [[nodiscard]] bool isAgainst(std::uint32_t interest, const Group& group) const;
    [[nodiscard]] bool interact(const Group& a, const Group& b) const;
    [[nodiscard]] Asked ask(const Group& low, const Group& high) const;
    void sumUp(Asked& asked) const;

    std::vector<InterestTerms> terms_;
    std::vector<InterestSides> sides_;
    std::vector<std::uint32_t> otherSideOf_;  // per interest
    std::vector<OtherSide> otherSides_;
    std::unordered_map<std::uint32_t, Rooted> rooted_;  // per place where a side begins
    std::vector<Group> groups_;
    std::vector<std::uint32_t> free_;
    std::map<Likeness, std::uint32_t> known_;
    std::vector<std::uint32_t> changed_;
    std::size_t taking_ = 0;
    std::uint32_t nextSerial_ = 1;
    std::vector<std::uint32_t> log_;  // groups that became something else
    std::uint64_t logStart_ = 1;
    InteractionTable interactions_;
    mutable std::unordered_map<std::uint64_t, Asked> asked_;  // stay where they are, so that lists can be handed out
};

}  // namespace tessera

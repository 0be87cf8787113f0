/// What touches in a frame, as it is told: sorted, and worked out as far as it is listed.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "server/collision/pipeline/PairQueries.h"

namespace tessera {

/// Two parts that touch: with which faces, in which poses, and when.
struct Touching {
    ObjectId nodeA, nodeB;
    std::uint32_t partA = 0, partB = 0;
    std::vector<FacePair> faces;  ///< ascending; empty: of two hulls, or of a hull and what is inside it
    std::uint64_t faceCount = 0;  ///< there are so many
    Affine3d worldA = Affine3d::Identity(), worldB = Affine3d::Identity();
    ObjectId interest;
    double time = 1;
    HullContact* known = nullptr;  ///< of two hulls, in the poses in which they are now: what is known of the contact
    bool allFaces = false;         ///< all that meet in these poses are there, as triangles
    std::vector<MeetingPlace> places = {};  ///< of smooth surfaces one for each of `faces`
};

/// Of a pair that touches: how many faces there are of those asked for.
[[nodiscard]] std::uint64_t facesTold(const PairState& pair, const Relation& relation);
/// How many entries of a list it makes.
[[nodiscard]] std::uint64_t facesListed(const PairState& pair, const Relation& relation);
/// What is told of it.
[[nodiscard]] Touching restingContact(const ObjectHandler& handler, PairState& pair);

/// What touches is kept from step to step: a step costs what has come to touch or ceased to, and what is listed.
class ContactList {
    using NodePair = std::pair<ObjectId, ObjectId>;

public:
    /// A pair, by its number, touches where it is now, with so many faces, so many of which are listed (facesTold,
    /// facesListed). Those that came to be another pair, or none, are taken out before.
    void rests(std::uint32_t pair, ObjectId nodeA, ObjectId nodeB, std::uint64_t faceCount, std::uint64_t listed);
    [[nodiscard]] bool restsAs(std::uint32_t pair, ObjectId nodeA, ObjectId nodeB) const {
        return pair < restingOf_.size() && restingOf_[pair].key == NodePair(nodeA, nodeB);
    }
    void takeOut(std::uint32_t pair);
    /// Numbers mean nothing any more.
    void takeOutAll();
    /// Of this step alone, besides.
    void add(Touching touching) {
        if (std::exchange(pageTurned_, false)) touching_.clear();
        touching_.push_back(std::move(touching));
    }

    using Describe = std::function<Touching(std::uint32_t pair)>;
    struct Page {
        std::size_t size = 0;  ///< of the list
        std::uint64_t leftOut = 0, begun = 0;
    };
    /// Ends a step: how long the list is, and how many pairs of nodes touch that did not when this was last called.
    [[nodiscard]] Page turnPage(const ObjectHandler& handler, const Describe& describe, std::size_t most);
    /// Ascending by (objectA, objectB, faceA, faceB); a pair of faces once, by its first account: that of what rests,
    /// then what was added, in its order. Those beyond `most` are counted. Until anything else is called.
    [[nodiscard]] std::vector<Contact> list(const ObjectHandler& handler, const Describe& describe, std::size_t most,
                                            std::uint64_t& leftOut) const;

private:
    struct Resting {
        NodePair key;  // none: it does not rest
        std::uint64_t faceCount = 0, listed = 0;
    };
    /// Of one pair of nodes: faces and their first accounts, ascending.
    using Accounts = std::vector<std::pair<FacePair, const Touching*>>;
    static void account(std::span<const Touching* const> all, Accounts& out);
    void noteBefore(const NodePair& key);

    std::map<NodePair, std::uint32_t> resting_;  // by number
    std::vector<Resting> restingOf_;             // per number
    std::uint64_t faceCount_ = 0, listed_ = 0;   // of all that rest
    std::map<NodePair, bool> before_;    // of those that came or went: whether they touched when it was last written
    std::vector<NodePair> addedBefore_;  // then, ascending
    std::vector<Touching> touching_;     // of the step, then of the page
    bool pageTurned_ = false;
};

}  // namespace tessera

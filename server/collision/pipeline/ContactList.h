/// What touches in a frame, as it is told: sorted, and worked out as far as it is listed.
#pragma once

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
};

class ContactList {
public:
    void add(Touching touching) { touching_.push_back(std::move(touching)); }

    /// Ascending by (objectA, objectB, faceA, faceB); a pair of faces once, by its first account. Those beyond `most`
    /// are counted. Also the pairs of nodes that touch, ascending.
    void write(const ObjectHandler& handler, std::size_t most, StepResult& result,
               std::vector<std::pair<ObjectId, ObjectId>>& nodes);

private:
    std::vector<Touching> touching_;
};

}  // namespace tessera

/// Where do two bodies meet: per pair of faces a segment, a point and a normal.
#pragma once

#include <vector>

#include "server/collision/mesh/TriangleContact.h"
#include "server/collision/query/TouchQuery.h"

namespace tessera {

struct BodyContact {
    FacePair faces;
    TriangleContact contact;  ///< in A's frame; the normal points from A to B
};

struct BodyContacts {
    std::vector<BodyContact> contacts;  ///< by ascending faces
    bool complete = true;               ///< false: the work was exhausted or `most` were found
};

/// One contact for each pair that allTouching finds, the first `most` of them.
[[nodiscard]] BodyContacts contactsBetween(const TriangleTree& a, const TriangleTree& b, const Affine3d& a_T_b,
                                           QueryWork& work, std::size_t most = ~std::size_t{0},
                                           const TouchOptions& options = {});

}  // namespace tessera

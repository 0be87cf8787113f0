/// A place in the tree.
#pragma once

#include "common/field/Field.h"
#include "common/cores/ChildList.h"

namespace tessera {

/// One node, one path; several nodes may share one core.
struct Node {
    static constexpr ObjectType kType{1};
    std::string name;
    ObjectId core;  ///< none: an empty group
    // Structure: changed by placements only.
    ObjectId parent;
    ChildList children;
};
template <>
inline constexpr auto kDescription<Node> =
    describe("Node",
             field<&Node::name>(1, "name").affects(Effect::kName),
             field<&Node::core>(2, "core").affects(Effect::kStructure))
        .notACore();

}  // namespace tessera

/// A place in the tree.
#pragma once

#include "common/cores/ChildList.h"
#include "common/field/Field.h"

namespace tessera {

/// One node, one path; several nodes may share one core.
struct Node {
    static constexpr ObjectType kType{1};
    std::string name;
    ObjectId core;  ///< none: an empty group
    /// Which child of a DistanceLOD each user sees: a byte per user, the first one's lowest; the server chooses
    /// (README.md). Means nothing with other cores.
    std::int64_t levels = 0;
    /// The top of what whoever serves the scene hangs into it so that something is seen (common/scene/ServerNodes.h).
    /// Nobody else says it.
    bool ofServer = false;
    // Structure: changed by placements only.
    ObjectId parent;
    ChildList children;
};
template <>
inline constexpr auto kSaid<Node> = []<typename T>(Describing<T>) {
    return describe("Node", field<&T::name>(1, "name").affects(Effect::kName),
                    field<&T::core>(2, "core").affects(Effect::kStructure),
                    field<&T::levels>(3, "levels").affects(Effect::kVisibility),
                    field<&T::ofServer>(4, "ofServer").affects(Effect::kStructure))
        .notACore();
};

}  // namespace tessera

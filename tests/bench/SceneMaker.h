/// Scenes of a given shape and size, and edits of a given kind in them. An edit concerns as many objects whatever the
/// size of the scene is: what it costs should not depend on that size.
///
/// In every scene: geometry that shares sixteen meshes and materials, a sun, a lamp, a crane with an interest that
/// watches all other geometry, a camera as the last node. Nothing touches anything. What edits are made at comes first
/// in document order or is spread over the tree.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/change/ChangeList.h"
#include "common/scene/Aspect.h"

namespace tessera::bench {

enum class SceneShape : std::uint8_t {
    kBushy,   ///< ten below each node, Geometry at the leaves
    kWide,    ///< one node with very many children, each a Transform with a Geometry below
    kChains,  ///< at least three chains of Transforms down to the depth limit, a Geometry at the bottom of each
};

struct SceneWish {
    SceneShape shape = SceneShape::kBushy;
    std::uint64_t size = 1000;            ///< nodes, give or take some dozens; wide: children of the one node
    ObjectId firstId{kFirstPlaceholder};  ///< the objects' ids ascend from here; 2 for an empty Aspect
    SceneLimits limits;                   ///< how deep chains are
};

/// The list that makes it in an empty scene.
[[nodiscard]] ChangeList makeScene(const SceneWish& wish);

/// Where edits are made, found in a scene that holds what makeScene made.
struct ScenePlaces {
    /// A leaf with a Geometry and a Material that nobody shares.
    struct Own {
        ObjectId transform, geometry, material;
    };
    std::vector<Own> own;           ///< bushy: spread over the tree
    std::vector<ObjectId> slots;    ///< bushy: nodes with a Transform and nothing below, spread over the tree
    std::vector<ObjectId> bottoms;  ///< chains: the lowest Transform nodes, each above a Geometry node
    ObjectId wide;                  ///< wide: the node with the children
    ObjectId toggled;               ///< a node with a Switch above a subtree of ten nodes
    ObjectId moved, from, to;       ///< a subtree of ten nodes, and the groups that it goes between
    ObjectId lamp;                  ///< a PointLight
    ObjectId geometry[2];           ///< two of the shared ones
    ObjectId material[2];           ///< theirs
};
[[nodiscard]] ScenePlaces findPlaces(const Aspect& scene);

/// Edits come in pairs; the second takes back what the first has done.
struct EditKind {
    std::string first;
    std::string second;  ///< empty: the same kind of edit
    /// The next edit of a scene as it is now; new objects are placeholders. `turn` chooses the place where there are
    /// several.
    ChangeList (*make)(const ScenePlaces& places, const Aspect& scene, std::size_t turn, bool second);
};
/// All that make sense in scenes of this shape.
[[nodiscard]] std::span<const EditKind> editKinds(SceneShape shape);

}  // namespace tessera::bench

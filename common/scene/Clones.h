/// Copies of a part of the scene, as change lists. Nothing is changed here: propose the list.
///
/// OpenSG's `cloneTree` and `deepCloneTree` (FieldContainer share lists), with one difference: what several nodes of
/// the original share, the nodes of the copy share too.
#pragma once

#include <cstddef>
#include <limits>
#include <string>
#include <vector>

#include "common/base/Error.h"
#include "common/change/ChangeList.h"
#include "common/scene/Aspect.h"

namespace tessera {

/// Where a copy comes to stand, and what of it is new. Nodes are always new.
struct CloneOptions {
    ObjectId under;    ///< becomes its last child; none: beside the original
    std::string name;  ///< of the copy of the node itself; empty: as the original's
    /// New cores too, and new materials, images, key frames and whatever else beside the tree they refer to. Each once,
    /// however many refer to it. What is referred to inside the original (nodes, their cores) is then the copy's own;
    /// nodes outside, cores that no node of the original holds, and what key frames alone refer to, stay what they
    /// were. Otherwise the copy's nodes hold the original's cores.
    bool deep = false;
    /// With `deep`: objects of these types, and these objects, are not copied, nor what only they refer to: the copy
    /// refers to the original's. A node stands for its core.
    std::vector<ObjectType> shareTypes;
    std::vector<ObjectId> shareObjects;
    std::size_t maxChanges = std::numeric_limits<std::size_t>::max();  ///< of the list
};

struct Clone {
    ChangeList list;          ///< one step of undo
    ObjectId node;            ///< the placeholder of the node's copy
    std::size_t objects = 0;  ///< that are created
};

/// `node` with everything below it, once more, but for what the server makes there (ServerNodes.h), which it makes for
/// the copy too. Proportional to the copy. kRefused: the root, a copy below its own original, or something of the
/// server's. kNotFound: a node or a shared object that is not there. kUsage: a share list of a copy that is not deep,
/// or that names nodes as a type or an unknown type. kLimit: too many changes.
[[nodiscard]] Expected<Clone> cloneList(const Aspect& aspect, ObjectId node, const CloneOptions& options);

}  // namespace tessera

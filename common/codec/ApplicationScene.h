/// What applications are told of the scene without following it: objects by name, and the tree page by page.
#pragma once

#include <string>
#include <vector>

#include "common/base/ByteSlice.h"
#include "common/change/Value.h"

namespace tessera {

/// An object as it stands in the scene; its fields are in the `content` beside it.
struct ObjectInfo {
    ObjectId id;  ///< none: there is no such object, and `path` says why, for a person
    ObjectType type;
    ObjectId parent;             ///< of a node
    ObjectId core;               ///< of a node
    ObjectType coreType;         ///< where it has a core
    std::uint64_t children = 0;  ///< of a node
    ObjectId movable;            ///< the nearest node, from this one upwards, whose core is a Transform; none: there is none
    std::string path;            ///< of a node as `pathOf` has it (where it was asked for); "#17" of anything else
    bool operator==(const ObjectInfo&) const = default;
};

/// A node of a page.
struct TreeNode {
    ObjectId node, parent;
    std::uint64_t children = 0;  ///< all it has, told or not
    bool operator==(const TreeNode&) const = default;
};

/// How long an Animation, a Motion or a film lasts.
struct PlayLength {
    ObjectId core;
    double seconds = 0;
    bool operator==(const PlayLength&) const = default;
};

namespace answer {

struct Objects {
    Sequence sequence;                ///< as of this list
    std::vector<ObjectInfo> objects;  ///< as asked
    /// An encoded ChangeList that creates these objects, and the cores of those that are nodes, and sets their fields.
    /// Empty where it was not asked for. It is for reading: what its references name is not in it.
    ByteSlice content;
};
struct TreePage {
    Sequence sequence;
    std::vector<TreeNode> nodes;  ///< in the order of the document, parents before their children
    ByteSlice content;            ///< as in Objects
    std::vector<ObjectId> next;   ///< `GetTree::after` of the next page; empty: this is the last
    /// Where `GetTree::coreType` is a type that plays: of the cores on this page whose length is known.
    std::vector<PlayLength> lengths = {};
};
struct FoundPage {
    Sequence sequence;
    std::vector<ObjectInfo> nodes;  ///< in the order of the document
    std::vector<ObjectId> next;     ///< `Find::after` of the next page; empty: this is the last
    std::uint64_t lookedAt = 0;     ///< nodes, for this page
};

}  // namespace answer
}  // namespace tessera

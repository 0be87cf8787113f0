/// Requests that ask what is in the scene, without following it: objects by name, and nodes page by page.
#pragma once

#include "common/request/ValueMembers.h"

namespace tessera {

/// An object as it stands in the scene; its fields are in the `content` beside it.
struct ObjectInfo {
    ObjectId id;  ///< none: there is no such object, and `path` says why, for a person
    ObjectType type;
    ObjectId parent;             ///< of a node
    ObjectId core;               ///< of a node
    ObjectType coreType;         ///< where it has a core
    std::uint64_t children = 0;  ///< of a node
    ObjectId movable;  ///< the nearest node, from this one upwards, whose core is a Transform; none: there is none
    std::string path;  ///< of a node as `pathOf` has it (where it was asked for); "#17" of anything else
    bool operator==(const ObjectInfo&) const = default;

    static constexpr std::string_view kName = "ObjectInfo";
    static constexpr void members(auto&& take) {
        take(member<&ObjectInfo::id>("id").said("0: there is none, and the path says why"),
             member<&ObjectInfo::parent>("parent").said("of a node"),
             member<&ObjectInfo::core>("core").said("of a node"),
             member<&ObjectInfo::children>("children").said("of a node"),
             member<&ObjectInfo::movable>("movable").said(
                 "the nearest node from here upwards with a Transform; 0: none"),
             member<&ObjectInfo::type>("type"), member<&ObjectInfo::coreType>("core_type"),
             member<&ObjectInfo::path>("path").said("of a node, where it was asked for; else \"#17\""));
    }
};

/// Where a node stands in the world: a point (x, y, z) of its own lies at origin + x · x_axis + y · y_axis + z ·
/// z_axis.
struct PlaceValue {
    Vec3d xAxis = Vec3d::UnitX(), yAxis = Vec3d::UnitY(), zAxis = Vec3d::UnitZ(), origin = Vec3d::Zero();
    bool operator==(const PlaceValue&) const = default;

    static constexpr std::string_view kName = "NodePlace";
    static constexpr void members(auto&& take) {
        take(member<&PlaceValue::xAxis>(1, "x_axis").said("where a unit of the node's leads in the world"),
             member<&PlaceValue::yAxis>(2, "y_axis"), member<&PlaceValue::zAxis>(3, "z_axis"),
             member<&PlaceValue::origin>(4, "origin").in("world units"));
    }
};

/// A node of a page.
struct TreeNode {
    ObjectId node, parent;
    std::uint64_t children = 0;  ///< all it has, told or not
    bool operator==(const TreeNode&) const = default;

    static constexpr std::string_view kName = "TreeNode";
    static constexpr void members(auto&& take) {
        take(member<&TreeNode::node>("node"), member<&TreeNode::parent>("parent"),
             member<&TreeNode::children>("children").said("all it has, told or not"));
    }
};

/// How long an Animation, a Motion or a film lasts.
struct PlayLength {
    ObjectId core;
    double seconds = 0;
    bool operator==(const PlayLength&) const = default;

    static constexpr std::string_view kName = "PlayLength";
    static constexpr void members(auto&& take) {
        take(member<&PlayLength::core>(1, "core"), member<&PlayLength::seconds>(2, "seconds").in("s"));
    }
};

/// What stands at these names: a node's path, or "#17" of any object.
struct ObjectsWish {
    std::vector<std::string> names;
    bool paths = true;     ///< false: for who knows them
    bool content = false;  ///< their fields, and those of the nodes' cores, too
    bool places = false;   ///< where nodes stand in the world, too

    static constexpr std::string_view kName = "ObjectsWish";
    static constexpr void members(auto&& take) {
        take(member<&ObjectsWish::names>(1, "names")
                 .atMost(&ApplicationLimits::maxNames)
                 .said("paths of nodes, or \"#17\" of any object"),
             member<&ObjectsWish::content>(2, "content").said("their fields, and those of the nodes' cores, too"),
             member<&ObjectsWish::paths>(3, "paths").said("the paths of nodes, too"),
             member<&ObjectsWish::places>(4, "places").said("where nodes stand in the world, too"));
    }
};

/// A page of the tree: `node` and what is below it, in the order of the document. What one page costs is bounded,
/// however large the scene is. A node that stays in its place while the pages are asked for is told, if `after` has
/// been removed or moved meanwhile perhaps twice; one that comes, goes or moves meanwhile may be told or not.
struct TreeWish {
    static constexpr std::uint32_t kAllLevels = 0xffffffffu;

    ObjectId node = kRootNode;
    std::uint32_t levels = kAllLevels;  ///< below `node`
    std::vector<ObjectId> after;        ///< `TreePage::next` of the page before; empty: from the start
    // With either of these only nodes with such a core are told. A page may then be empty and not the last.
    ObjectType coreType;          ///< cores of this type
    std::vector<ObjectId> cores;  ///< these cores
    std::uint32_t pageSize = 0;   ///< nodes told at most, the server has a bound of its own; 0: that one

    static constexpr std::string_view kName = "TreeWish";
    static constexpr void members(auto&& take) {
        take(member<&TreeWish::node>(1, "node"), member<&TreeWish::levels>(2, "levels").said("below the node"),
             member<&TreeWish::coreType>(3, "core_type").said("only nodes with such a core; 0: all"),
             member<&TreeWish::pageSize>(4, "page_size").said("nodes told at most; 0: as many as may be"),
             partMember<&TreeWish::after>("after")
                 .atMost(&ApplicationLimits::maxDepth)
                 .said("where the page before has ended; none: from the start"),
             partMember<&TreeWish::cores>("cores")
                 .atMost(&ApplicationLimits::maxFilterCores)
                 .said("only nodes with one of these; none: all"));
    }
};

/// A page of the nodes that an expression finds (common/scene/PathPattern.h), in the order of the document. What one
/// page costs is bounded, however large the scene is: it may tell nothing and not be the last. While the pages are
/// asked for the scene may change as with a TreeWish.
struct NodeSearch {
    std::string expression;
    ObjectId node = kRootNode;     ///< the expression's "/": what is below it is searched
    ObjectType coreType;           ///< only nodes with such a core; none: any
    std::uint32_t pageSize = 256;  ///< nodes told at most; the server has a bound of its own
    std::vector<ObjectId> after;   ///< `FoundPage::next` of the page before; empty: from the start

    static constexpr std::string_view kName = "NodeSearch";
    static constexpr void members(auto&& take) {
        take(member<&NodeSearch::expression>(1, "expression").said("as \"/hall/**/wheel*\""),
             member<&NodeSearch::node>(2, "node").said("the expression's \"/\""),
             member<&NodeSearch::coreType>(3, "core_type").said("only nodes with such a core; 0: all"),
             member<&NodeSearch::pageSize>(4, "page_size").said("nodes told at most"),
             partMember<&NodeSearch::after>("after")
                 .atMost(&ApplicationLimits::maxDepth)
                 .said("where the page before has ended; none: from the start"));
    }
};

namespace answer {

struct Objects {
    Sequence sequence;                ///< as of this list
    std::vector<ObjectInfo> objects;  ///< as asked
    /// An encoded ChangeList that creates these objects, and the cores of those that are nodes, and sets their fields.
    /// Empty where it was not asked for. It is for reading: what its references name is not in it.
    ByteSlice content;
    std::vector<PlaceValue> places;  ///< of each object, where they were asked for; of what is no node the world's own

    static constexpr ToldInfo kInfo{.name = "Objects", .answer = 11, .help = "What stands at names"};
    static constexpr void members(auto&& take) {
        take(member<&Objects::sequence>(1, "sequence").said("as of this list"),
             member<&Objects::places>(2, "places")
                 .atMost(&ApplicationLimits::maxNames)
                 .said("of each object, where they were asked for"),
             partMember<&Objects::objects>("objects")
                 .atMost(&ApplicationLimits::maxNames)
                 .ofBytes(&ApplicationLimits::maxSceneBytes)
                 .said("as they were asked for"),
             partMember<&Objects::content>("content")
                 .holding(Holds::kChanges)
                 .ofBytes(&ApplicationLimits::maxSceneBytes)
                 .said("a list of changes that makes them, for reading; or nothing"));
    }
};
struct TreePage {
    Sequence sequence;
    std::vector<TreeNode> nodes;  ///< in the order of the document, parents before their children
    ByteSlice content;            ///< as in Objects
    std::vector<ObjectId> next;   ///< `TreeWish::after` of the next page; empty: this is the last
    /// Where `TreeWish::coreType` is a type that plays: of the cores on this page whose length is known.
    std::vector<PlayLength> lengths = {};

    static constexpr ToldInfo kInfo{.name = "TreePage", .answer = 12, .help = "A page of the tree"};
    static constexpr void members(auto&& take) {
        take(member<&TreePage::sequence>(1, "sequence").said("as of this list"),
             member<&TreePage::lengths>(2, "lengths")
                 .atMost(&ApplicationLimits::maxPageNodes)
                 .said("of the cores on this page that play, where they are known"),
             partMember<&TreePage::nodes>("nodes")
                 .atMost(&ApplicationLimits::maxPageNodes)
                 .said("in the order of the document"),
             partMember<&TreePage::next>("next")
                 .atMost(&ApplicationLimits::maxDepth)
                 .said("after which it goes on; none: this is the last"),
             partMember<&TreePage::content>("content")
                 .holding(Holds::kChanges)
                 .ofBytes(&ApplicationLimits::maxSceneBytes)
                 .said("a list of changes that makes them, for reading"));
    }
};
struct FoundPage {
    Sequence sequence;
    std::vector<ObjectInfo> nodes;  ///< in the order of the document
    std::vector<ObjectId> next;     ///< `NodeSearch::after` of the next page; empty: this is the last
    std::uint64_t lookedAt = 0;     ///< nodes, for this page

    static constexpr ToldInfo kInfo{.name = "FoundPage", .answer = 13, .help = "A page of the nodes that were found"};
    static constexpr void members(auto&& take) {
        take(member<&FoundPage::sequence>(1, "sequence").said("as of this list"),
             member<&FoundPage::lookedAt>(2, "looked_at").said("nodes, for this page"),
             partMember<&FoundPage::nodes>("nodes")
                 .atMost(&ApplicationLimits::maxPageNodes)
                 .ofBytes(&ApplicationLimits::maxSceneBytes)
                 .said("in the order of the document"),
             partMember<&FoundPage::next>("next")
                 .atMost(&ApplicationLimits::maxDepth)
                 .said("after which it goes on; none: this is the last"));
    }
};

/// Bytes of an array.
struct ArrayPiece {
    std::uint64_t size = 0;  ///< of the whole array
    ByteSlice bytes;         ///< from the offset that was asked for, to the end of the piece or of the array

    static constexpr ToldInfo kInfo{.name = "ArrayPiece", .answer = 16, .help = "Bytes of an array"};
    static constexpr void members(auto&& take) {
        take(member<&ArrayPiece::size>(1, "size").in("bytes").said("of the whole array"),
             partMember<&ArrayPiece::bytes>("bytes")
                 .ofBytes(&ApplicationLimits::maxPieceBytes)
                 .said("from the offset on"));
    }
};

}  // namespace answer

namespace request {

struct GetObjects {
    ObjectsWish wish;

    using Answer = answer::Objects;
    static constexpr RequestInfo kInfo{.number = 15,
                                       .name = "GetObjects",
                                       .help = "What stands at names: nodes by their paths, objects by their numbers",
                                       .forPanels = true,
                                       .example = R"({"names":["/hall/crane","#1"],"content":true})"};
    static constexpr void members(auto&& take) { take(spreadMember<&GetObjects::wish>(1)); }
};

struct GetTree {
    TreeWish wish;

    using Answer = answer::TreePage;
    static constexpr RequestInfo kInfo{.number = 16,
                                       .name = "GetTree",
                                       .help = "A page of a node and what is below it",
                                       .example = R"({"node":"/hall","levels":2})"};
    static constexpr void members(auto&& take) { take(spreadMember<&GetTree::wish>(1)); }
};

struct FindNodes {
    NodeSearch wish;

    using Answer = answer::FoundPage;
    static constexpr RequestInfo kInfo{.number = 22,
                                       .name = "FindNodes",
                                       .help = "A page of the nodes that an expression names",
                                       .example = R"({"expression":"/hall/**/crane*","page_size":100})"};
    static constexpr void members(auto&& take) { take(spreadMember<&FindNodes::wish>(1)); }
};

/// A large array is read in several pieces: the frames go on between them.
struct GetArray {
    std::string blob;          ///< 32 hexadecimal digits: the array's name, as lists of changes have it
    std::uint64_t offset = 0;  ///< bytes
    std::uint64_t length = 0;  ///< 0: as many as a piece may have

    using Answer = answer::ArrayPiece;
    static constexpr RequestInfo kInfo{.number = 32,
                                       .name = "GetArray",
                                       .help = "Bytes of an array that the scene holds, by its name",
                                       .example = R"({"blob":"8fbc75bd6f0e8d5b6d33266de7325ff5","length":288})"};
    static constexpr void members(auto&& take) {
        take(member<&GetArray::blob>(1, "blob").said("32 hexadecimal digits, as changes have them"),
             member<&GetArray::offset>(2, "offset").in("bytes"),
             member<&GetArray::length>(3, "length")
                 .in("bytes")
                 .between(0, static_cast<double>(ApplicationLimits().maxPieceBytes))
                 .said("0: as many as there may be"));
    }
};

using OfScene = std::variant<GetObjects, GetTree, FindNodes, GetArray>;

}  // namespace request

/// As the house calls it, where it asks by itself.
using ObjectsQuestion = request::GetObjects;

}  // namespace tessera

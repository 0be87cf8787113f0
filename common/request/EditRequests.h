/// Requests that change the scene, and what answers them.
#pragma once

#include "common/request/ValueMembers.h"

namespace tessera {

/// How a node is copied with everything below it (`cloneList` in common/scene/Clones.h says what each means).
struct CloneWish {
    ObjectId node, under;
    std::string name;
    bool deep = false;
    std::vector<ObjectType> shareTypes;
    std::vector<ObjectId> shareObjects;

    static constexpr std::string_view kName = "CloneWish";
    static constexpr void members(auto&& take) {
        take(member<&CloneWish::node>(1, "node"), member<&CloneWish::under>(2, "under").said("0: beside the original"),
             member<&CloneWish::name>(3, "name").said("empty: as the original's"),
             member<&CloneWish::deep>(4, "deep").said("cores are copied, too, and not shared"),
             member<&CloneWish::shareTypes>(5, "share_types")
                 .atMost(&ApplicationLimits::maxShared)
                 .said("of cores that are shared all the same"),
             member<&CloneWish::shareObjects>(6, "share_objects")
                 .atMost(&ApplicationLimits::maxShared)
                 .said("that are shared all the same"));
    }
};

namespace answer {

/// It is done, and there is no more to say.
struct Done {
    static constexpr ToldInfo kInfo{.name = "Done", .answer = 1, .help = "It is done"};
    static constexpr void members(auto&& take) { take(); }
};

struct Committed {
    Sequence sequence;
    /// Ids given to the placeholders of the proposal; of a copy its node alone.
    std::vector<std::pair<ObjectId, ObjectId>> ids;
    /// Objects whose transforms the collision response kept from going where the proposal wanted them.
    std::vector<ObjectId> stopped;
    std::uint64_t removed = 0;  ///< objects that were removed
    std::uint64_t created = 0;  ///< objects that were copied

    static constexpr ToldInfo kInfo{.name = "Committed", .answer = 2, .help = "The edit is in the scene"};
    static constexpr void members(auto&& take) {
        take(member<&Committed::sequence>(1, "sequence").said("of the list that holds the edit"),
             member<&Committed::removed>(2, "removed").said("objects that were removed"),
             member<&Committed::created>(3, "created").said("objects that were copied"),
             partMember<&Committed::ids>("ids")
                 .atMost(&ApplicationLimits::maxIds)
                 .said("given to placeholders; of a copy its node alone"),
             partMember<&Committed::stopped>("stopped")
                 .atMost(&ApplicationLimits::maxIds)
                 .said("transforms that collisions kept from going where they should"));
    }
};

struct Loaded {
    static constexpr std::size_t kMostNotes = ApplicationLimits{}.maxNotes;
    ObjectId node;  ///< the new node that holds the file's content
    std::uint64_t objects = 0, triangles = 0;
    std::vector<std::string> notes = {};  ///< what was left out or guessed, for people; no more than so many
    /// It was in the scene already, and has been brought up to date: values and objects of which what has become.
    bool reloaded = false;
    std::uint64_t changed = 0, created = 0, removed = 0, kept = 0;

    static constexpr ToldInfo kInfo{.name = "Loaded", .answer = 4, .help = "The file is in the scene"};
    static constexpr void members(auto&& take) {
        take(member<&Loaded::node>(1, "node").said("the new node that holds the file's content"),
             member<&Loaded::objects>(2, "objects"), member<&Loaded::triangles>(3, "triangles"),
             member<&Loaded::notes>(4, "notes")
                 .atMost(&ApplicationLimits::maxNotes)
                 .said("what was left out or guessed, for people; of a reload what was kept, and why"),
             member<&Loaded::reloaded>(5, "reloaded").said("it was in the scene, and has been brought up to date"),
             member<&Loaded::changed>(6, "changed").said("of a reload: values of what was there"),
             member<&Loaded::created>(7, "created").said("of a reload: objects"),
             member<&Loaded::removed>(8, "removed").said("of a reload: objects"),
             member<&Loaded::kept>(9, "kept").said(
                 "of a reload: values that the file has changed, and somebody here too"));
    }
};

/// What the next step of undo, or of redo, would do.
struct StepPlan {
    std::string what;               ///< a sentence without its full stop, for people; empty: there is no such step
    std::vector<ObjectId> objects;  ///< some of those that it writes, makes or removes
    std::uint64_t changes = 0;      ///< at least so many
    bool operator==(const StepPlan&) const = default;

    static constexpr std::string_view kName = "StepPlan";
    static constexpr void members(auto&& take) {
        take(member<&StepPlan::what>(1, "what").said("in words; empty: there is no such step"),
             member<&StepPlan::objects>(2, "objects")
                 .atMost(&ApplicationLimits::maxNames)
                 .said("some that it writes, makes or removes"),
             member<&StepPlan::changes>(3, "changes").said("at least"));
    }
};
struct Steps {
    Sequence sequence;
    StepPlan undo, redo;

    static constexpr ToldInfo kInfo{.name = "Steps", .answer = 24, .help = "What undo and redo would do now"};
    static constexpr void members(auto&& take) {
        take(member<&Steps::sequence>(1, "sequence").said("as of this list"), member<&Steps::undo>(2, "undo"),
             member<&Steps::redo>(3, "redo"));
    }
};

}  // namespace answer

namespace request {

/// An encoded ChangeList (ChangeCodec); new objects carry placeholders. Blobs it names are uploaded in `blobs`.
/// Proposals in a row of one gesture of one application are one step of undo (0: none).
struct ProposeChanges {
    ByteSlice list;
    std::vector<ByteSlice> blobs;
    std::uint64_t gesture = 0;

    using Answer = answer::Committed;
    static constexpr RequestInfo kInfo{
        .number = 1,
        .name = "ProposeChanges",
        .role = Role::kEditor,
        .answered = Answered::kLater,
        .changes = Changes::kScene,
        .help = "Commits a list of changes, whole or not at all",
        .bringsArrays = true,
        .forPanels = true,
        .example = R"({"list":{"created":[{"id":"$0","type":"Node"}],"placed":[{"node":"$0","parent":"/hall"}],)"
                   R"("set":[{"type":"Node","field":"name","ids":["$0"],"values":["lamp"]}]}})"};
    static constexpr void members(auto&& take) {
        take(member<&ProposeChanges::gesture>(1, "gesture")
                 .said("proposals in a row of one gesture are one step of undo; 0: none"),
             partMember<&ProposeChanges::list>("list")
                 .holding(Holds::kChanges)
                 .said("an encoded list of changes (change.proto)"),
             restMember<&ProposeChanges::blobs>("blobs")
                 .atMost(&ApplicationLimits::maxBlobs)
                 .said("its small arrays, one each"));
    }
};

/// Takes back the last step, whoever made it.
struct UndoStep {
    using Answer = answer::Committed;
    static constexpr RequestInfo kInfo{.number = 2,
                                       .name = "UndoStep",
                                       .role = Role::kEditor,
                                       .answered = Answered::kLater,
                                       .changes = Changes::kScene,
                                       .help = "Takes back the last step, whoever made it"};
    static constexpr void members(auto&& take) { take(); }
};

struct RedoStep {
    using Answer = answer::Committed;
    static constexpr RequestInfo kInfo{.number = 14,
                                       .name = "RedoStep",
                                       .role = Role::kEditor,
                                       .answered = Answered::kLater,
                                       .changes = Changes::kScene,
                                       .help = "Does again the step that was taken back last"};
    static constexpr void members(auto&& take) { take(); }
};

/// Moves the nearest Transform from a node upwards. What "from where it is" means is worked out in the frame that makes
/// the edit, behind the edits before it: of several that move the same node by so much all count.
struct MoveNode {
    ObjectId node;
    NodeMove move;
    std::uint64_t gesture = 0;

    using Answer = answer::Committed;
    static constexpr RequestInfo kInfo{.number = 25,
                                       .name = "MoveNode",
                                       .role = Role::kEditor,
                                       .answered = Answered::kLater,
                                       .changes = Changes::kScene,
                                       .help = "Moves a node to a place, or by so much",
                                       .example = R"({"node":"/hall/crane","translation":[0,0.5,-1]})"};
    static constexpr void members(auto&& take) {
        take(member<&MoveNode::node>(1, "node").said("moves the nearest Transform from here upwards"),
             spreadMember<&MoveNode::move>(2),
             member<&MoveNode::gesture>(6, "gesture")
                 .said("moves in a row of one gesture are one step of undo; 0: none"));
    }
};

/// Takes a node away with everything below it, and what only they used (`removalList`).
struct RemoveNode {
    ObjectId node;

    using Answer = answer::Committed;
    static constexpr RequestInfo kInfo{.number = 17,
                                       .name = "RemoveNode",
                                       .role = Role::kEditor,
                                       .answered = Answered::kLater,
                                       .changes = Changes::kScene,
                                       .help = "Removes a node with everything below it",
                                       .example = R"({"node":"/hall/crate"})"};
    static constexpr void members(auto&& take) { take(member<&RemoveNode::node>(1, "node")); }
};

struct CloneNode {
    CloneWish wish;

    using Answer = answer::Committed;
    static constexpr RequestInfo kInfo{.number = 21,
                                       .name = "CloneNode",
                                       .role = Role::kEditor,
                                       .answered = Answered::kLater,
                                       .changes = Changes::kScene,
                                       .help = "Copies a node with everything below it",
                                       .example = R"({"node":"/hall/crane","name":"second crane","deep":true})"};
    static constexpr void members(auto&& take) { take(spreadMember<&CloneNode::wish>(1)); }
};

/// Imports a file on the server's disk and adds it below `parent` (none: the root).
struct LoadFile {
    std::string path;
    ObjectId parent;
    Placing placing = {};  ///< without its variants
    bool reload = false;
    std::vector<std::string> variants = {};  ///< Placing::variants

    using Answer = answer::Loaded;
    static constexpr RequestInfo kInfo{.number = 4,
                                       .name = "LoadFile",
                                       .role = Role::kOperator,
                                       .answered = Answered::kLater,
                                       .changes = Changes::kScene,
                                       .help = "Adds a file on the server's disk to the scene",
                                       .example = R"({"path":"/srv/models/box.tsct","parent":"/hall","fit":2})"};
    static constexpr void members(auto&& take) {
        take(member<&LoadFile::path>(1, "path").said("at the server, below what it allows"),
             member<&LoadFile::parent>(2, "parent").said("a node; 0: the root"), spreadMember<&LoadFile::placing>(3),
             member<&LoadFile::reload>(8, "reload")
                 .said("if it is in the scene already (below parent, where one is said) it is taken in again"),
             member<&LoadFile::variants>(9, "variants")
                 .atMost(&ApplicationLimits::maxVariants)
                 .said("of USD's prims: /Chair:color=red"));
    }
};

/// The same of one of the server's assets.
struct LoadAsset {
    static constexpr std::string_view kPrefix = "asset://";  ///< of assets where files could stand, too

    std::string name;  ///< without the prefix
    ObjectId parent;
    Placing placing = {};  ///< without its variants
    bool reload = false;
    std::vector<std::string> variants = {};  ///< Placing::variants

    using Answer = answer::Loaded;
    static constexpr RequestInfo kInfo{.number = 26,
                                       .name = "LoadAsset",
                                       .role = Role::kEditor,
                                       .answered = Answered::kLater,
                                       .changes = Changes::kScene,
                                       .help = "Adds one of the server's assets to the scene",
                                       .example = R"({"name":"box.tsct","parent":"/hall","at":[3,0,0]})"};
    static constexpr void members(auto&& take) {
        take(member<&LoadAsset::name>(1, "name").said("behind asset://"),
             member<&LoadAsset::parent>(2, "parent").said("a node; 0: the root"), spreadMember<&LoadAsset::placing>(3),
             member<&LoadAsset::reload>(8, "reload")
                 .said("if it is in the scene already (below parent, where one is said) it is taken in again"),
             member<&LoadAsset::variants>(9, "variants")
                 .atMost(&ApplicationLimits::maxVariants)
                 .said("of USD's prims: /Chair:color=red"));
    }
};

/// Another's edit may come before the step that is asked for behind this: `sequence` says as of when it holds.
struct GetSteps {
    using Answer = answer::Steps;
    static constexpr RequestInfo kInfo{
        .number = 35, .name = "GetSteps", .help = "What the next step of undo, and of redo, would do"};
    static constexpr void members(auto&& take) { take(); }
};

using OfEdits =
    std::variant<ProposeChanges, UndoStep, RedoStep, MoveNode, RemoveNode, CloneNode, LoadFile, LoadAsset, GetSteps>;

}  // namespace request

/// As the house calls it, from who makes it to who decodes its list.
using Proposal = request::ProposeChanges;

}  // namespace tessera

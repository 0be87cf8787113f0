/// How what has changed in a file gets into the scene as it is now.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/scene/Aspect.h"
#include "server/sim/reload/FileChange.h"

namespace tessera {

/// The lists of one reload, for a frame each.
///
/// **Whose word counts.** A value that the file has changed is written where the scene still has what the file said
/// before. Where it has another one, because a person, an animation or a collision has changed it since, that one is
/// kept and named. Of a type with arrays all of the object is kept then: half of a mesh would be none. What the server
/// alone says is left to it.
///
/// **What is gone.** Objects that are in the scene no more stay away, and what is new below them. What the file says of
/// them waits until they are back: an undo may bring them as they were (`waits`). Nodes that the file
/// has no more are taken away with what only they used, but for those below which people have put others, or that
/// others name: these stay, and are named. So are those that were changed here and go.
///
/// **Order.** New nodes come behind the sibling that they follow in the file. Others move where the file has another
/// order.
struct ReloadPlan {
    struct Limits {
        std::size_t changes = 4'096;                 ///< of a part
        std::size_t bytes = std::size_t{512} << 10;  ///< of the values in a part, as they are counted (LoadParts.h)
        std::size_t whole = 8'192;                   ///< of a reload in one list
    };
    static constexpr std::size_t kMostNotes = 32;

    struct Part {
        ChangeList list;
        /// Of the values that the list writes to what is there: what has to be there when its frame comes. Columns
        /// alone.
        ChangeList before;
    };
    std::vector<Part> parts;
    std::size_t creating = 0;   ///< so many parts, the first ones, make all that is new; 0: a single part does all
    std::uint64_t objects = 0;  ///< that are made
    std::vector<std::uint32_t> made;  ///< their places in `FileChange::after`, in the order of the placeholders
    std::vector<Blob> arrays;         ///< that the parts name

    /// What the plan leaves for the time when those who have been removed here are back, written into what is held of
    /// the file (HeldFile::write): what it said of them before, and those of them that it has no more.
    ChangeList waits;
    std::vector<ObjectId> idsWaiting;    ///< of the latter
    std::vector<std::uint32_t> leftOut;  ///< HeldFile::leftOut

    std::uint64_t changed = 0, kept = 0;  ///< values
    std::uint64_t removed = 0;            ///< objects
    std::vector<std::string>
        notes;  ///< for a person: what was kept, and why; at most kMostNotes and one that counts the others
};

/// `below`: the node that the file was loaded below. Fails where that is gone (kNotFound). Costs what has changed, and
/// for each node with other children a look at all of its children. Any thread.
[[nodiscard]] Expected<ReloadPlan> planReload(const Aspect& scene, const FileChange& change, ObjectId below,
                                              const ReloadPlan::Limits& limits = {});

/// What is to be held of the file once the plan has been carried out.
[[nodiscard]] HeldFile heldAfter(HeldFile next, const ReloadPlan& plan);

/// A last look, in the frame that takes the part: what has changed since the plan was made is left out of it, and
/// counted as kept. Costs what the part writes.
void leaveOutWhatChanged(const Aspect& scene, ReloadPlan::Part& part, ReloadPlan& plan);

}  // namespace tessera

/// Contacts and distances drawn on the wall, for the interests that ask for it: as nodes of the scene, like everything
/// that is seen.
#pragma once

#include <array>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "common/scene/Aspect.h"
#include "server/collision/pipeline/StepResult.h"
#include "server/sim/commit/Committer.h"
#include "server/sim/display/ContactDisplayMarks.h"

namespace tessera {

/// Keeps one node, `/contacts`, the last child of the root, while an enabled Interest has `show` bits set: below it a
/// ball per contact point, an arrow from A to B per normal, a bright triangle per face that touches; for interests in
/// distances the same bits draw the ends, the line between with its ticks, and the nearest faces (MarkMaker). Without
/// such an interest there is nothing.
///
/// **No frame waits for it.** A list that names new arrays would have to be held until all hosts have them, and
/// contacts change in every frame. So there are a few fixed shapes (`blobs()`), which the frame loop announces before
/// the first host comes, and a mark is a Transform above one of them; of a triangle, two, which together are any affine
/// map of the one triangle. Once there are enough marks, only values of Transforms travel: marks that are not needed
/// have the scale 0, because whatever changes the tree, or what a Switch shows, lets everybody make their tables anew.
/// Their number doubles where it is not enough, up to kMaxMarks.
///
/// **It is nobody's obstacle**: a CollisionObject with layers 0 stands at `/contacts`. Its lists are no edits: undo
/// does not know them, and as the last child of the root it is in the way of no position that an undo goes back to.
///
/// **What people do to it** is undone in the next frame: marks that were moved go back; where nodes are missing or
/// misused, all that can be removed is, and it begins anew. What somebody else uses (a node of theirs below it, a core)
/// stays, as theirs.
///
/// Deterministic: a function of the scene's history and the steps' contacts. How to use it, in Simulation::step, once
/// the accepted poses are committed and before the frame is closed:
///
///     if (const ChangeListPtr list = display_.commit(committer_, result.collision))
///         pipeline_.sceneChanged(scene(), list.get());
///
/// and `display_.sceneChanged(scene(), list or null)` wherever the pipeline is told the same.
class ContactDisplay {
public:
    /// As CollisionPipeline::sceneChanged: after each list, with that list; null: anything may have changed.
    void sceneChanged(const Aspect& scene, const ChangeList* list);

    /// Brings the display up to date with a step. The numbered list that was committed; null where none was needed. A
    /// scene that is full has no display; nothing else fails.
    [[nodiscard]] ChangeListPtr commit(Committer& committer, const StepResult& step);

    /// Its objects in an order of its own, for one that goes on in another process; empty: there is none. What it is
    /// handed may be anything: what does not fit the scene is removed as far as it is there.
    [[nodiscard]] std::vector<ObjectId> ids() const;
    void goOnWith(std::span<const ObjectId> ids);
    /// Another one whenever `ids` may have changed.
    [[nodiscard]] std::uint64_t version() const { return version_; }

    struct Counts {
        std::array<std::uint64_t, kMarkKinds> drawn{}, leftOut{};
        bool operator==(const Counts&) const = default;
    };
    /// Of the last commit.
    [[nodiscard]] const Counts& counts() const { return counts_; }

    /// All arrays that the display will ever name.
    [[nodiscard]] static std::vector<Blob> blobs();

private:
    /// A mark's objects. `inner` and `innerTransform` are for faces only.
    struct Slot {
        ObjectId node, transform, inner, innerTransform, leaf;
    };
    struct Kind {
        ObjectId group, geometry, material;
        std::vector<Slot> slots;
    };
    struct State {
        ObjectId node, object;  ///< /contacts and its CollisionObject; none: there is no display
        std::array<Kind, kMarkKinds> kinds;
        /// Calls `f` with every id held.
        template <typename F>
        void forEachId(F&& f);
    };

    void look(const Aspect& scene, ObjectId interest);
    /// Fresh objects carry placeholders, in the list and in the state.
    [[nodiscard]] ChangeList update(const Aspect& scene, const StepResult& step);
    void build(ChangeListBuilder& list);
    void growTo(ChangeListBuilder& list, MarkKind kind, std::size_t count);
    void place(ChangeListBuilder& list, const Aspect& scene, MarkKind kind, std::span<const Mark> marks) const;
    [[nodiscard]] bool intact(const Aspect& scene) const;
    void dismantle(ChangeListBuilder& list, const Aspect& scene);
    [[nodiscard]] ObjectId fresh() { return ObjectId{kFirstPlaceholder + placeholders_++}; }

    std::map<ObjectId, std::int64_t> asked_;  ///< enabled interests that want something drawn → their `show`
    MarkMaker maker_;
    State state_;
    Counts counts_;
    std::uint64_t placeholders_ = 0;
    std::uint64_t version_ = 0;
};

}  // namespace tessera

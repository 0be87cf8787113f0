/// The single writer: numbers objects and lists.
#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "common/scene/Aspect.h"
#include "common/session/CommittedList.h"
#include "server/rules/SceneRules.h"

namespace tessera {

/// What one frame changed, as it is sent.
struct CommittedFrame {
    CommittedListPtr sent = nothingCommitted();  ///< its sequence grows only when something changed
    ChangeListPtr list;                          ///< the same as a value; null when nothing changed
};

/// Owns the authoritative scene. Edits of one frame are applied one after the other, each whole or not at all;
/// `closeFrame` packs them into the one list that everybody else applies. Not thread-safe.
class Committer {
public:
    explicit Committer(SceneLimits limits = {});

    [[nodiscard]] const Aspect& scene() const { return scene_; }
    [[nodiscard]] Sequence sequence() const { return sequence_; }
    /// Of the scene, the root included. Kept, not counted.
    [[nodiscard]] std::size_t nodeCount() const { return nodes_; }

    /// Whether the list that leads back is made. It costs as much again as the list, and only undo asks for it.
    enum class Inverse : bool { kNone, kMade };
    struct Applied {
        ChangeListPtr list;  ///< as it was applied, with ids for placeholders
        /// Placeholder, id: in the order of the creations, which is that of the ids.
        std::vector<std::pair<ObjectId, ObjectId>> ids;
        ChangeList inverse;  ///< empty where none was asked for
    };
    /// Gives ids to placeholders and applies. Refused when the list is not valid on the present scene, when it brings
    /// its own new ids, or when it would leave behind what makes no sense (server/rules).
    [[nodiscard]] Expected<Applied> apply(ChangeList list, Inverse inverse = Inverse::kNone);
    /// Ids in a row, for objects that come in several lists. Nobody else is given them.
    [[nodiscard]] ObjectId reserveIds(std::uint64_t count);
    /// New objects have ids from this one on.
    void skipIds(ObjectId upTo) { nextId_ = std::max(nextId_, upTo.value); }
    /// The next list follows this one.
    void skipLists(Sequence behind) { sequence_ = std::max(sequence_, behind); }
    /// As apply, with reserved ids: kFirstPlaceholder + i becomes first + i, for i below `count`. `Applied::ids` stays
    /// empty.
    [[nodiscard]] Expected<Applied> applyReserved(ChangeList list, ObjectId first, std::uint64_t count,
                                                  Inverse inverse = Inverse::kNone);
    /// As apply, for lists that bring back old ids (inverses). Refused with kRefused, and worth another try in the next
    /// frame, when such an id was destroyed in this very frame.
    [[nodiscard]] Expected<Applied> applyInverse(ChangeListPtr list, Inverse inverse = Inverse::kNone);

    /// The scene as it was before the list that was applied last, by the list that leads back from it: nobody sees that
    /// it was there.
    void takeBack(const Applied& applied);

    /// Whether the list would bring back what was destroyed in this very frame.
    [[nodiscard]] Expected<void> checkNotDestroyedNow(const ChangeList& list) const;

    /// Goes on from a scene that lists up to `sequence` have made. Only of one that has committed nothing.
    void goOnFrom(Aspect scene, Sequence sequence);

    /// Ends the frame.
    [[nodiscard]] CommittedFrame closeFrame();

private:
    [[nodiscard]] Expected<Applied> applyNumbered(ChangeListPtr list, std::vector<std::pair<ObjectId, ObjectId>> ids,
                                                  Inverse inverse);
    [[nodiscard]] std::size_t nodesAfter(const ChangeList& list) const;

    Aspect scene_;
    std::size_t nodes_ = 1;
    SceneRules rules_;
    std::uint64_t nextId_ = kRootNode.value + 1;
    Sequence sequence_;
    std::vector<ChangeListPtr> open_;
};

}  // namespace tessera

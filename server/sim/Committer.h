/// The single writer: numbers objects and lists, keeps the inverses for undo.
#pragma once

#include <deque>
#include <utility>
#include <vector>

#include "common/scene/Aspect.h"
#include "common/session/CommittedList.h"

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

    struct Applied {
        std::vector<std::pair<ObjectId, ObjectId>> ids;  ///< placeholder, id
        ChangeList inverse;
    };
    /// Gives ids to placeholders and applies. Refused when the list is not valid on the present scene, when it brings
    /// its own new ids, or when a geometry would be left with arrays that do not fit together.
    [[nodiscard]] Expected<Applied> apply(ChangeList list);
    /// As apply, for lists that bring back old ids (inverses). Refused with kRefused, and worth another try in the next
    /// frame, when such an id was destroyed in this very frame.
    [[nodiscard]] Expected<Applied> applyInverse(ChangeList list);

    /// Ends the frame.
    [[nodiscard]] CommittedFrame closeFrame();

private:
    [[nodiscard]] Expected<Applied> applyNumbered(ChangeList list, std::vector<std::pair<ObjectId, ObjectId>> ids);
    [[nodiscard]] Expected<void> checkGeometries(const ChangeList& list) const;

    Aspect scene_;
    std::uint64_t nextId_ = kRootNode.value + 1;
    Sequence sequence_;
    std::vector<ChangeListPtr> open_;
};

/// Inverses of the edits of people and applications, newest last; bounded.
class UndoStack {
public:
    static constexpr std::size_t kMaxDepth = 256;

    void push(ChangeList inverse);
    [[nodiscard]] std::size_t depth() const { return inverses_.size(); }
    [[nodiscard]] const ChangeList& top() const { return inverses_.back(); }
    void pop() { inverses_.pop_back(); }

private:
    std::deque<ChangeList> inverses_;
};

}  // namespace tessera

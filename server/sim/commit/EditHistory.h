/// What can be taken back, and what was taken back and can be done again.
#pragma once

#include <deque>
#include <optional>
#include <utility>
#include <vector>

#include "common/change/ChangeList.h"

namespace tessera {

/// Edits in a row of one gesture (a drag) are one step. `by` tells whose gestures these are.
struct Gesture {
    std::uint64_t by = 0, id = 0;  ///< id 0: none
    bool operator==(const Gesture&) const = default;
};

/// Ids in a row.
struct IdRange {
    std::uint64_t first = 0, count = 0;
    [[nodiscard]] std::uint64_t end() const { return first + count; }
    [[nodiscard]] bool contains(ObjectId id) const { return id.value - first < count; }
    bool operator==(const IdRange&) const = default;
};

/// Nodes that bear geometry and touched, two by two, the lower id first; ascending.
using Overlaps = std::vector<std::pair<ObjectId, ObjectId>>;
/// Of more of them this one alone is kept: it stands for all.
inline constexpr std::size_t kMostOverlaps = 4096;
inline constexpr Overlaps::value_type kAllOverlap{};

/// One thing that happened to a history, as a value: the same events lead to the same history.
struct HistoryEvent {
    enum class Kind : std::uint8_t {
        kEdited,
        kUndone,
        kRedone,
        kPartArrived,
        kPartsWhole,
        kPartsTakenAway,
        kPartDone,
        kPartRefused,
        kPartsKept,
        kUndoForgotten,
        kRedoForgotten,
        kEditedAnew,
    };
    Kind kind = Kind::kEdited;
    ChangeListPtr inverse;  ///< null where the kind has none
    Gesture gesture = {};   ///< of an edit
    IdRange made = {};      ///< of a part that arrived: what all of them create
    /// Of an edit, an undo and a redo: the pairs that touched in the scene to which `inverse` leads back.
    Overlaps overlaps = {};
};
/// The list that leads back belongs to it.
[[nodiscard]] constexpr bool hasInverse(HistoryEvent::Kind kind) {
    using enum HistoryEvent::Kind;
    return (kind <= kPartDone && kind != kPartsWhole && kind != kPartsTakenAway) || kind == kEditedAnew;
}

/// Inverses of the edits of people and applications. Their number and the memory of their lists are bounded. Above a
/// bound the oldest step goes; the newest stays, however large it is. Not thread-safe.
///
/// A step too large for one frame is held in parts, and led back part by part. Its first list is that of `undoList` or
/// `redoList`. `nextPart` has the others, until no step is under way any more. Edits may come in between.
class EditHistory {
public:
    struct Limits {
        std::size_t steps = 256;
        /// Of both directions together, including the arrays that the lists name.
        std::uint64_t bytes = std::uint64_t{512} << 20;
    };
    EditHistory() : EditHistory(Limits()) {}
    explicit EditHistory(const Limits& limits) : limits_(limits) {}

    /// What was called, in order, since it was last asked.
    [[nodiscard]] std::vector<HistoryEvent> happened() { return std::exchange(happened_, {}); }
    /// Repeats an event of another history, which this one follows. `happened` does not say it again. False, and
    /// nothing done: the event cannot happen to this history.
    bool take(const HistoryEvent& event);

    /// Adds a new edit. `inverse` is the list that leads back from it. Nothing can be done again after it.
    ///
    /// The edit joins the newest step of its gesture, where it and the steps since can be taken back in either order.
    /// Else it begins a step. It joins only if all of these hold:
    /// - The owner of the gesture (`Gesture::by`) has edited nothing else since.
    /// - Edits of others since name no object that this edit names.
    /// - Those edits have only brought things, or changed poses of Transforms, as far as touching goes.
    /// - Where there are such edits, this one changes poses alone in that respect, and creates nothing.
    ///
    /// An empty `inverse` says that all work of the gesture is as it was before. The step of the gesture is removed.
    void edited(ChangeList inverse, Gesture gesture = {}, Overlaps overlaps = {});
    /// The same, but that it begins a step.
    void editedAnew(ChangeList inverse, Gesture gesture, Overlaps overlaps = {});
    /// The steps above the one that such an edit would join, the newest first. Empty where it joins none, or the
    /// newest.
    struct Above {
        std::vector<ChangeListPtr> lists;  ///< the oldest first
        const Overlaps* overlaps = nullptr;
    };
    [[nodiscard]] std::vector<Above> stepsAbove(const Gesture& gesture, const ChangeList& inverse) const;
    /// The lists of the step that edits of a gesture join, the oldest first; none: the next one begins a step.
    [[nodiscard]] std::vector<ChangeListPtr> listsOf(const Gesture& gesture) const;

    /// The same for an edit that comes in several lists, in their order. `made`: what all of them create.
    void partArrived(ChangeList inverse, IdRange made);
    /// Those that have arrived are one step.
    void partsWhole();
    /// They are nobody's step: no way leads back from them.
    void partsKept();
    /// Leads back part by part the edit that cannot be finished, and forgets it. No step may be under way.
    void partsTakenAway();
    /// Parts have arrived that are no step yet.
    [[nodiscard]] bool arriving() const { return arriving_.has_value(); }
    [[nodiscard]] IdRange idsArriving() const { return arriving_ ? arriving_->made : IdRange(); }

    /// Steps that are whole; one that is under way counts in neither direction.
    [[nodiscard]] std::size_t undoDepth() const { return back_.size(); }
    [[nodiscard]] std::size_t redoDepth() const { return forth_.size(); }
    /// The list that takes the newest step back, or does the last undone step again. Null: there is none. It stays
    /// until `undone` or `redone` says that it has been applied, with the list that leads back from it.
    [[nodiscard]] ChangeListPtr undoList();
    [[nodiscard]] ChangeListPtr redoList();
    /// Of that step the lists that are applied first, `most` at most: as they are kept, before they are made one.
    [[nodiscard]] std::vector<ChangeListPtr> firstToUndo(std::size_t most) const { return firstOf(back_, most); }
    [[nodiscard]] std::vector<ChangeListPtr> firstToRedo(std::size_t most) const { return firstOf(forth_, most); }
    /// What that step makes, of a step in parts; of others an empty range.
    [[nodiscard]] IdRange idsToUndo() const { return back_.empty() ? IdRange() : back_.back().made; }
    [[nodiscard]] IdRange idsToRedo() const { return forth_.empty() ? IdRange() : forth_.back().made; }
    void undone(ChangeList inverse, Overlaps overlaps = {});
    void redone(ChangeList inverse, Overlaps overlaps = {});
    /// What touched in the scene to which that list leads.
    [[nodiscard]] const Overlaps& overlapsOfUndo() const { return back_.back().overlaps; }
    [[nodiscard]] const Overlaps& overlapsOfRedo() const { return forth_.back().overlaps; }
    /// Forgets the newest step of a direction: it names objects that are gone. An edit that is no step has taken them
    /// away. No step may be under way.
    void undoForgotten();
    void redoForgotten();
    /// Whether that list is one of several that stay apart.
    [[nodiscard]] bool undoesInParts() const { return !back_.empty() && back_.back().apart; }
    [[nodiscard]] bool redoesInParts() const { return !forth_.empty() && forth_.back().apart; }
    /// All arrays that the newest step names, in either direction.
    [[nodiscard]] std::vector<Blob> arraysToUndo() const;
    [[nodiscard]] std::vector<Blob> arraysToRedo() const;

    /// A step is partly taken back or done again: `nextPart` is to be applied, then `partDone` called.
    [[nodiscard]] bool underWay() const { return moving_.has_value(); }
    /// It is being taken back, not done again.
    [[nodiscard]] bool takesBack() const { return moving_ && moving_->forth; }
    /// What the step under way has made or makes; none: an empty range.
    [[nodiscard]] IdRange idsUnderWay() const { return moving_ ? moving_->rest.made : IdRange(); }
    /// What leads back from what has been taken back of it, as a redo applies it; empty where none will be there.
    [[nodiscard]] std::vector<ChangeListPtr> takenBack() const;
    [[nodiscard]] ChangeListPtr nextPart() const { return moving_ ? moving_->rest.lists.back().list : nullptr; }
    void partDone(ChangeList inverse);
    /// The part is refused. From here on the step goes back to where it came from. Refused on that way too, it is
    /// forgotten.
    void partRefused();
    /// The lists of forgotten steps that nobody needs; of steps in parts some at a time. Call it once a frame, and free
    /// the lists on another thread: a large array takes longer than a frame.
    std::vector<ChangeListPtr> sweep();

    /// A step as it is kept elsewhere: its lists in the order in which they were made.
    struct Kept {
        /// Those of one under way are apart: what is left of it, and what leads back from what was done.
        enum class Place : std::uint8_t { kUndo, kRedo, kArriving, kRest, kDone };
        Place place = Place::kUndo;
        std::vector<ChangeListPtr> lists;
        Gesture gesture = {};
        bool apart = false;
        IdRange made = {};
        bool forth = false, dropped = false, turned = false;  ///< of kRest
        Overlaps overlaps = {};
    };
    /// All steps in the order in which they can be put together again.
    [[nodiscard]] std::vector<Kept> kept() const;
    /// Adds a step to a history that is put together again. False, and nothing done: it is no step, or it stands in the
    /// wrong place.
    bool keep(Kept step);
    /// Edits begin new steps, whatever gestures they name.
    void endGestures() {
        for (Step& step : back_) step.gesture = {};
    }

    /// Memory held, as it is counted.
    [[nodiscard]] std::uint64_t bytes() const { return bytes_; }

private:
    struct Held {
        ChangeListPtr list;
        std::uint64_t bytes = 0;
    };
    /// Lists in the order in which they were made: the last one is applied first.
    struct Step {
        std::vector<Held> lists;
        Gesture gesture;
        bool apart = false;  ///< its lists stay what they are
        IdRange made = {};   ///< of a step in parts
        Overlaps overlaps = {};
    };
    /// A step on its way from one direction into the other.
    struct StepMoving {
        Step rest, done;
        bool forth = false;    ///< being taken back: in the end it can be done again
        bool dropped = false;  ///< unless somebody has edited meanwhile
        bool turned = false;   ///< it was refused midway
    };
    void happen(HistoryEvent::Kind kind, ChangeList inverse, Overlaps overlaps = {});
    void happen(HistoryEvent event);
    void carryOut(const HistoryEvent& event);
    void addEdit(const HistoryEvent& event);
    /// The index in `back_` of the step that an edit of a gesture joins. Nothing: it joins none. `inverse` null: the
    /// edit may name any object.
    [[nodiscard]] std::optional<std::size_t> stepOf(const Gesture& gesture, const ChangeList* inverse) const;
    void addPart(ChangeListPtr inverse, IdRange made);
    void finishParts();
    void keepParts();
    void forgetNewest(std::deque<Step>& steps);
    void takePartsAway();
    void moveBack(const HistoryEvent& event);
    void moveForth(const HistoryEvent& event);
    void takePart(ChangeListPtr inverse);
    void turnBack();
    void nothingToRedo();
    [[nodiscard]] static Kept kept(const Step& step, Kept::Place place);
    [[nodiscard]] Held hold(ChangeListPtr list);
    void letGo(Step step);
    void addOverlaps(Step& step, const Overlaps& overlaps);
    /// False where the last two of its lists cannot be one.
    bool mergeLast(Step& step);
    [[nodiscard]] ChangeListPtr newest(std::deque<Step>& steps);
    [[nodiscard]] static std::vector<ChangeListPtr> firstOf(const std::deque<Step>& steps, std::size_t most);
    [[nodiscard]] static std::vector<Blob> arraysOf(const std::deque<Step>& steps);
    void begin(std::deque<Step>& from, bool forth, ChangeListPtr inverse);
    void arrive();
    void bound();

    Limits limits_;
    std::deque<Step> back_, forth_;  ///< the newest last
    std::optional<StepMoving> moving_;
    std::optional<Step> arriving_;
    std::vector<HistoryEvent> happened_;
    std::vector<ChangeListPtr> forgotten_, forgottenParts_;  ///< not counted any more; of steps in parts
    std::uint64_t bytes_ = 0;
};

/// Bytes of memory that a list holds, including the arrays that it names. Absent arrays count as if they were here. So
/// histories without arrays keep and forget the same steps.
[[nodiscard]] std::uint64_t memoryOf(const ChangeList& list);
[[nodiscard]] std::uint64_t memoryWithoutArrays(const ChangeList& list);

}  // namespace tessera

#include "server/sim/commit/EditHistory.h"

#include <algorithm>
#include <utility>

#include "common/scene/Aspect.h"

namespace tessera {

std::uint64_t memoryOf(const ChangeList& list) {
    std::uint64_t bytes = sizeof(ChangeList) + list.creations.size() * sizeof(Creation) + list.placements.size() * sizeof(Placement) +
                          list.destructions.size() * sizeof(ObjectId) + list.ranges.size() * sizeof(RangeEdit);
    for (const FieldColumn& column : list.columns) {
        bytes += sizeof(FieldColumn) + column.ids.size() * sizeof(ObjectId);
        std::visit(
            [&](const auto& values) {
                using Value = typename std::decay_t<decltype(values)>::value_type;
                bytes += values.size() * sizeof(Value);
                if constexpr (std::is_same_v<Value, std::string>)
                    for (const std::string& text : values) bytes += text.size();
                if constexpr (std::is_same_v<Value, RefList>)
                    for (const RefList& refs : values) bytes += refs.size() * sizeof(ObjectId);
            },
            column.values);
    }
    for (const Blob& array : blobsOf(list))
        if (array.resident()) bytes += array.sizeBytes();
    return bytes;
}

void EditHistory::edited(ChangeList inverse, Gesture gesture) {
    happen({.kind = HistoryEvent::Kind::kEdited, .inverse = std::make_shared<const ChangeList>(std::move(inverse)), .gesture = gesture});
}
void EditHistory::partArrived(ChangeList inverse, IdRange made) {
    happen({.kind = HistoryEvent::Kind::kPartArrived, .inverse = std::make_shared<const ChangeList>(std::move(inverse)), .made = made});
}
void EditHistory::partsWhole() {
    happen({.kind = HistoryEvent::Kind::kPartsWhole, .inverse = nullptr});
}
void EditHistory::partsKept() {
    happen({.kind = HistoryEvent::Kind::kPartsKept, .inverse = nullptr});
}
void EditHistory::undoForgotten() {
    happen({.kind = HistoryEvent::Kind::kUndoForgotten, .inverse = nullptr});
}
void EditHistory::redoForgotten() {
    happen({.kind = HistoryEvent::Kind::kRedoForgotten, .inverse = nullptr});
}
void EditHistory::partsTakenAway() {
    happen({.kind = HistoryEvent::Kind::kPartsTakenAway, .inverse = nullptr});
}
void EditHistory::undone(ChangeList inverse) {
    happen(HistoryEvent::Kind::kUndone, std::move(inverse));
}
void EditHistory::redone(ChangeList inverse) {
    happen(HistoryEvent::Kind::kRedone, std::move(inverse));
}
void EditHistory::partDone(ChangeList inverse) {
    happen(HistoryEvent::Kind::kPartDone, std::move(inverse));
}
void EditHistory::partRefused() {
    happen({.kind = HistoryEvent::Kind::kPartRefused, .inverse = nullptr});
}

void EditHistory::happen(HistoryEvent::Kind kind, ChangeList inverse) {
    happen({.kind = kind, .inverse = std::make_shared<const ChangeList>(std::move(inverse))});
}

void EditHistory::happen(HistoryEvent event) {
    carryOut(event);
    happened_.push_back(std::move(event));
}

bool EditHistory::take(const HistoryEvent& event) {
    using enum HistoryEvent::Kind;
    if (hasInverse(event.kind) != (event.inverse != nullptr)) return false;
    const auto canHappen = [&] {
        switch (event.kind) {
            case kEdited:
                return true;
            case kUndone:
                return !moving_ && undoList() != nullptr;
            case kRedone:
                return !moving_ && redoList() != nullptr;
            case kPartArrived:
                return !arriving_ || arriving_->made == event.made;
            case kPartsWhole:
            case kPartsKept:
                return arriving_.has_value();
            case kUndoForgotten:
                return !moving_ && !back_.empty();
            case kRedoForgotten:
                return !moving_ && !forth_.empty();
            case kPartsTakenAway:
                return arriving_ && !moving_;
            case kPartDone:
            case kPartRefused:
                return moving_.has_value();
        }
        return false;
    };
    if (!canHappen()) return false;
    carryOut(event);
    return true;
}

void EditHistory::carryOut(const HistoryEvent& event) {
    using enum HistoryEvent::Kind;
    switch (event.kind) {
        case kEdited:
            return addEdit(event.inverse, event.gesture);
        case kUndone:
            return moveBack(event.inverse);
        case kRedone:
            return moveForth(event.inverse);
        case kPartArrived:
            return addPart(event.inverse, event.made);
        case kPartsWhole:
            return finishParts();
        case kPartsTakenAway:
            return takePartsAway();
        case kPartDone:
            return takePart(event.inverse);
        case kPartRefused:
            return turnBack();
        case kPartsKept:
            return keepParts();
        case kUndoForgotten:
            return forgetNewest(back_);
        case kRedoForgotten:
            return forgetNewest(forth_);
    }
}

void EditHistory::nothingToRedo() {
    for (Step& step : std::exchange(forth_, {})) letGo(std::move(step));
    if (moving_) moving_->dropped = true;
}

void EditHistory::addEdit(ChangeListPtr inverse, Gesture gesture) {
    nothingToRedo();
    Held held = hold(std::move(inverse));
    if (gesture.id == 0 || back_.empty() || back_.back().apart || back_.back().gesture != gesture) {
        back_.push_back({{std::move(held)}, gesture});
    } else {
        // Lists of like size become one: so a drag of any length holds few, and each of its edits costs what it says and now and
        // then what came before.
        std::vector<Held>& lists = back_.back().lists;
        lists.push_back(std::move(held));
        while (lists.size() > 1 && lists[lists.size() - 2].bytes <= 2 * lists.back().bytes)
            if (!mergeLast(back_.back())) break;
    }
    bound();
}

void EditHistory::addPart(ChangeListPtr inverse, IdRange made) {
    if (!arriving_) arriving_ = Step{.lists = {}, .gesture = {}, .apart = true, .made = made};
    arriving_->lists.push_back(hold(std::move(inverse)));
}

void EditHistory::finishParts() {
    TESSERA_CHECK(arriving_, "a step in parts has at least one");
    nothingToRedo();
    if (!back_.empty()) back_.back().gesture = {};
    back_.push_back(std::move(*arriving_));
    arriving_.reset();
    bound();
}

void EditHistory::keepParts() {
    TESSERA_CHECK(arriving_, "parts are kept that have arrived");
    letGo(std::move(*arriving_));
    arriving_.reset();
}

void EditHistory::forgetNewest(std::deque<Step>& steps) {
    TESSERA_CHECK(!moving_ && !steps.empty(), "a step is forgotten while it is whole");
    letGo(std::move(steps.back()));
    steps.pop_back();
    if (!back_.empty()) back_.back().gesture = {};
}

void EditHistory::takePartsAway() {
    TESSERA_CHECK(!moving_, "one step is under way at a time");
    if (!arriving_) return;
    const IdRange made = arriving_->made;
    moving_ = StepMoving{.rest = std::move(*arriving_),
                         .done = {.lists = {}, .gesture = {}, .apart = true, .made = made},
                         .forth = true,
                         .dropped = true};
    arriving_.reset();
}

ChangeListPtr EditHistory::undoList() {
    return newest(back_);
}

ChangeListPtr EditHistory::redoList() {
    return newest(forth_);
}

std::vector<Blob> EditHistory::arraysToUndo() const {
    return arraysOf(back_);
}

std::vector<Blob> EditHistory::arraysToRedo() const {
    return arraysOf(forth_);
}

std::vector<Blob> EditHistory::arraysOf(const std::deque<Step>& steps) {
    std::vector<Blob> all;
    if (!steps.empty())
        for (const Held& held : steps.back().lists)
            for (Blob& array : blobsOf(*held.list)) all.push_back(std::move(array));
    return all;
}

void EditHistory::moveBack(ChangeListPtr inverse) {
    if (back_.back().apart) return begin(back_, true, std::move(inverse));
    letGo(std::move(back_.back()));
    back_.pop_back();
    if (!back_.empty()) back_.back().gesture = {};  // whose next edit begins a new step
    forth_.push_back({{hold(std::move(inverse))}, {}});
    bound();
}

void EditHistory::moveForth(ChangeListPtr inverse) {
    if (forth_.back().apart) return begin(forth_, false, std::move(inverse));
    letGo(std::move(forth_.back()));
    forth_.pop_back();
    back_.push_back({{hold(std::move(inverse))}, {}});
    bound();
}

void EditHistory::begin(std::deque<Step>& from, bool forth, ChangeListPtr inverse) {
    TESSERA_CHECK(!moving_, "one step is under way at a time");
    moving_ = StepMoving{.rest = std::move(from.back()),
                     .done = {.lists = {}, .gesture = {}, .apart = true, .made = from.back().made},
                     .forth = forth};
    from.pop_back();
    if (!back_.empty()) back_.back().gesture = {};
    takePart(std::move(inverse));
}

void EditHistory::takePart(ChangeListPtr inverse) {
    bytes_ -= moving_->rest.lists.back().bytes;
    moving_->rest.lists.pop_back();
    if (!moving_->dropped || !moving_->forth) moving_->done.lists.push_back(hold(std::move(inverse)));
    if (moving_->rest.lists.empty()) arrive();
}

void EditHistory::turnBack() {
    const bool leadsBack = !moving_->turned && !(moving_->dropped && moving_->forth) && !moving_->done.lists.empty();
    if (!leadsBack) {
        letGo(std::move(moving_->rest));
        letGo(std::move(moving_->done));
        moving_.reset();
        return;
    }
    std::swap(moving_->rest, moving_->done);
    moving_->forth = !moving_->forth;
    moving_->turned = true;
}

void EditHistory::arrive() {
    StepMoving arrived = std::move(*moving_);
    moving_.reset();
    if (arrived.dropped && arrived.forth) return letGo(std::move(arrived.done));
    (arrived.forth ? forth_ : back_).push_back(std::move(arrived.done));
    bound();
}

EditHistory::Kept EditHistory::kept(const Step& step, Kept::Place place) {
    Kept one{.place = place, .lists = {}, .gesture = step.gesture, .apart = step.apart, .made = step.made};
    for (const Held& held : step.lists) one.lists.push_back(held.list);
    return one;
}

std::vector<EditHistory::Kept> EditHistory::kept() const {
    std::vector<Kept> all;
    for (const Step& step : back_) all.push_back(kept(step, Kept::Place::kUndo));
    for (const Step& step : forth_) all.push_back(kept(step, Kept::Place::kRedo));
    if (arriving_) all.push_back(kept(*arriving_, Kept::Place::kArriving));
    if (moving_) {
        Kept& rest = all.emplace_back(kept(moving_->rest, Kept::Place::kRest));
        rest.forth = moving_->forth;
        rest.dropped = moving_->dropped;
        rest.turned = moving_->turned;
        all.push_back(kept(moving_->done, Kept::Place::kDone));
    }
    return all;
}

bool EditHistory::keep(Kept kept) {
    using Place = Kept::Place;
    const bool mayBeEmpty = kept.place == Place::kDone;
    const bool isPart = kept.place != Place::kUndo && kept.place != Place::kRedo;
    if ((kept.lists.empty() && !mayBeEmpty) || (isPart && !kept.apart)) return false;
    if (kept.place == Place::kArriving && arriving_) return false;
    if (kept.place == Place::kRest && moving_) return false;
    if (kept.place == Place::kDone && (!moving_ || !moving_->done.lists.empty())) return false;
    Step step{.lists = {}, .gesture = kept.gesture, .apart = kept.apart, .made = kept.made};
    for (ChangeListPtr& list : kept.lists) step.lists.push_back(hold(std::move(list)));
    switch (kept.place) {
        case Place::kUndo:
            back_.push_back(std::move(step));
            break;
        case Place::kRedo:
            forth_.push_back(std::move(step));
            break;
        case Place::kArriving:
            arriving_ = std::move(step);
            break;
        case Place::kRest:
            moving_ = StepMoving{.rest = std::move(step),
                                 .done = {.lists = {}, .gesture = {}, .apart = true, .made = kept.made},
                                 .forth = kept.forth,
                                 .dropped = kept.dropped,
                                 .turned = kept.turned};
            break;
        case Place::kDone:
            moving_->done = std::move(step);
            break;
    }
    bound();
    return true;
}

EditHistory::Held EditHistory::hold(ChangeListPtr list) {
    const std::uint64_t bytes = memoryOf(*list);
    bytes_ += bytes;
    return {std::move(list), bytes};
}

void EditHistory::letGo(Step step) {
    for (Held& held : step.lists) {
        bytes_ -= held.bytes;
        if (step.apart) forgotten_.push_back(std::move(held.list));
    }
}

void EditHistory::sweep() {
    constexpr std::size_t kListsAtOnce = 8;
    forgotten_.resize(forgotten_.size() - std::min(forgotten_.size(), kListsAtOnce));
}

bool EditHistory::mergeLast(Step& step) {
    std::vector<Held>& lists = step.lists;
    const Held newer = lists.back(), older = lists[lists.size() - 2];
    // What a gesture makes has new ids and goes once, so the way back never brings back what it has let go of.
    std::vector<ChangeList> one = compact(std::vector<ChangeListPtr>{newer.list, older.list});
    if (one.size() != 1) return false;
    bytes_ -= newer.bytes + older.bytes;
    lists.pop_back();
    lists.back() = hold(std::make_shared<const ChangeList>(std::move(one.front())));
    return true;
}

/// As one list, for whoever applies it.
ChangeListPtr EditHistory::newest(std::deque<Step>& steps) {
    if (steps.empty()) return nullptr;
    if (steps.back().apart) return steps.back().lists.back().list;
    while (steps.back().lists.size() > 1 && mergeLast(steps.back())) {
    }
    // Lists that cannot be one are steps of their own.
    while (steps.back().lists.size() > 1) {
        steps.insert(steps.end() - 1, Step{{steps.back().lists.front()}, {}});
        steps.back().lists.erase(steps.back().lists.begin());
    }
    return steps.back().lists.back().list;
}

void EditHistory::bound() {
    while (back_.size() + forth_.size() > limits_.steps || bytes_ > limits_.bytes) {
        std::deque<Step>& from = back_.size() > 1 ? back_ : forth_;
        if (from.size() <= 1) return;
        letGo(std::move(from.front()));
        from.pop_front();
    }
}

}  // namespace tessera

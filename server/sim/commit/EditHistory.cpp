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

void EditHistory::nothingToRedo() {
    for (Step& step : std::exchange(forth_, {})) letGo(std::move(step));
    if (moving_) moving_->dropped = true;
}

void EditHistory::edited(ChangeList inverse, Gesture gesture) {
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

void EditHistory::editedInParts(std::vector<ChangeList> inverses, IdRange made) {
    nothingToRedo();
    Step step{.lists = {}, .gesture = {}, .apart = true, .made = made};
    for (ChangeList& inverse : inverses) step.lists.push_back(hold(std::move(inverse)));
    if (!back_.empty()) back_.back().gesture = {};
    back_.push_back(std::move(step));
    bound();
}

void EditHistory::takeAway(std::vector<ChangeList> inverses, IdRange made) {
    TESSERA_CHECK(!moving_, "one step is under way at a time");
    if (inverses.empty()) return;
    moving_ = StepMoving{.rest = {.lists = {}, .gesture = {}, .apart = true, .made = made},
                     .done = {.lists = {}, .gesture = {}, .apart = true, .made = made},
                     .forth = true,
                     .dropped = true};
    for (ChangeList& inverse : inverses) moving_->rest.lists.push_back(hold(std::move(inverse)));
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

void EditHistory::undone(ChangeList inverse) {
    if (back_.back().apart) return begin(back_, true, std::move(inverse));
    letGo(std::move(back_.back()));
    back_.pop_back();
    if (!back_.empty()) back_.back().gesture = {};  // whose next edit begins a new step
    forth_.push_back({{hold(std::move(inverse))}, {}});
    bound();
}

void EditHistory::redone(ChangeList inverse) {
    if (forth_.back().apart) return begin(forth_, false, std::move(inverse));
    letGo(std::move(forth_.back()));
    forth_.pop_back();
    back_.push_back({{hold(std::move(inverse))}, {}});
    bound();
}

void EditHistory::begin(std::deque<Step>& from, bool forth, ChangeList inverse) {
    TESSERA_CHECK(!moving_, "one step is under way at a time");
    moving_ = StepMoving{.rest = std::move(from.back()),
                     .done = {.lists = {}, .gesture = {}, .apart = true, .made = from.back().made},
                     .forth = forth};
    from.pop_back();
    if (!back_.empty()) back_.back().gesture = {};
    partDone(std::move(inverse));
}

void EditHistory::partDone(ChangeList inverse) {
    bytes_ -= moving_->rest.lists.back().bytes;
    moving_->rest.lists.pop_back();
    if (!moving_->dropped || !moving_->forth) moving_->done.lists.push_back(hold(std::move(inverse)));
    if (moving_->rest.lists.empty()) arrive();
}

void EditHistory::partRefused() {
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

EditHistory::Held EditHistory::hold(ChangeList list) {
    const std::uint64_t bytes = memoryOf(list);
    bytes_ += bytes;
    return {std::make_shared<const ChangeList>(std::move(list)), bytes};
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
    lists.back() = hold(std::move(one.front()));
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

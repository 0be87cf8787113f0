#include "server/sim/commit/EditHistory.h"

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
    for (const Step& step : std::exchange(forth_, {})) letGo(step);
    Held held = hold(std::move(inverse));
    if (gesture.id == 0 || back_.empty() || back_.back().gesture != gesture) {
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

ChangeListPtr EditHistory::undoList() {
    return newest(back_);
}

ChangeListPtr EditHistory::redoList() {
    return newest(forth_);
}

void EditHistory::undone(ChangeList inverse) {
    letGo(back_.back());
    back_.pop_back();
    if (!back_.empty()) back_.back().gesture = {};  // whose next edit begins a new step
    forth_.push_back({{hold(std::move(inverse))}, {}});
    bound();
}

void EditHistory::redone(ChangeList inverse) {
    letGo(forth_.back());
    forth_.pop_back();
    back_.push_back({{hold(std::move(inverse))}, {}});
    bound();
}

EditHistory::Held EditHistory::hold(ChangeList list) {
    const std::uint64_t bytes = memoryOf(list);
    bytes_ += bytes;
    return {std::make_shared<const ChangeList>(std::move(list)), bytes};
}

void EditHistory::letGo(const Step& step) {
    for (const Held& held : step.lists) bytes_ -= held.bytes;
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
        letGo(from.front());
        from.pop_front();
    }
}

}  // namespace tessera

#include "server/sim/commit/EditHistory.h"

#include <algorithm>
#include <iterator>
#include <span>
#include <unordered_set>
#include <utility>

#include "common/scene/Aspect.h"
#include "common/scene/FieldTable.h"

namespace tessera {

std::uint64_t memoryWithoutArrays(const ChangeList& list) {
    std::uint64_t bytes = sizeof(ChangeList) + list.creations.size() * sizeof(Creation) +
                          list.placements.size() * sizeof(Placement) + list.destructions.size() * sizeof(ObjectId) +
                          list.ranges.size() * sizeof(RangeEdit);
    for (const RangeEdit& range : list.ranges) bytes += range.bytes.sizeBytes();
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
    return bytes;
}

std::uint64_t memoryOf(const ChangeList& list) {
    std::uint64_t bytes = memoryWithoutArrays(list);
    for (const Blob& array : blobsOf(list)) bytes += array.sizeBytes();
    return bytes;
}

namespace {

/// Whether two lists name an object in common. Costs what both hold.
class NamedObjects {
public:
    explicit NamedObjects(const ChangeList& list) {
        forObjects(list, [&](ObjectId id) { ids_.insert(id); });
    }
    [[nodiscard]] bool anyIn(const ChangeList& list) const {
        bool found = false;
        forObjects(list, [&](ObjectId id) { found = found || ids_.contains(id); });
        return found;
    }
    [[nodiscard]] bool anyIn(const IdRange& range) const {
        return std::ranges::any_of(ids_, [&](ObjectId id) { return range.contains(id); });
    }

private:
    template <typename Visit>
    static void forObjects(const ChangeList& list, const Visit& visit) {
        for (const Creation& creation : list.creations) visit(creation.id);
        for (const Placement& placement : list.placements) visit(placement.node), visit(placement.parent);
        for (const FieldColumn& column : list.columns) {
            std::ranges::for_each(column.ids, visit);
            if (const auto* refs = std::get_if<std::vector<ObjectId>>(&column.values))
                std::ranges::for_each(*refs, visit);
            if (const auto* lists = std::get_if<std::vector<RefList>>(&column.values))
                for (const RefList& refs : *lists) std::ranges::for_each(refs, visit);
        }
        for (const RangeEdit& edit : list.ranges) visit(edit.object);
        std::ranges::for_each(list.destructions, visit);
    }
    std::unordered_set<ObjectId> ids_;
};

/// Whether a list brings nothing, and changes nothing by which things touch but the poses of Transforms: then where
/// things stand once it is applied can be told beforehand.
bool tellsWhereThingsStand(const ChangeList& list) {
    if (!list.creations.empty() || !list.ranges.empty()) return false;
    if (std::ranges::any_of(list.placements, [](const Placement& placement) { return placement.parent != ObjectId(); }))
        return false;
    return std::ranges::all_of(list.columns, [](const FieldColumn& column) {
        const TypeInfo* type = findType(column.type);
        const FieldEntry* field = type ? findField(*type, column.field) : nullptr;
        if (!field || field->effects &
                          (Effect::kStructure | Effect::kVisibility | Effect::kShape | Effect::kRules | Effect::kTerms))
            return false;
        return column.type == typeOf<Transform>() || !(field->effects & Effect::kPose);
    });
}

std::uint64_t memoryOf(const Overlaps& overlaps) {
    return overlaps.size() * sizeof(Overlaps::value_type);
}

}  // namespace

void EditHistory::edited(ChangeList inverse, Gesture gesture, Overlaps overlaps) {
    happen({.kind = HistoryEvent::Kind::kEdited,
            .inverse = std::make_shared<const ChangeList>(std::move(inverse)),
            .gesture = gesture,
            .overlaps = std::move(overlaps)});
}
void EditHistory::editedAnew(ChangeList inverse, Gesture gesture, Overlaps overlaps) {
    happen({.kind = HistoryEvent::Kind::kEditedAnew,
            .inverse = std::make_shared<const ChangeList>(std::move(inverse)),
            .gesture = gesture,
            .overlaps = std::move(overlaps)});
}
void EditHistory::partArrived(ChangeList inverse, IdRange made) {
    happen({.kind = HistoryEvent::Kind::kPartArrived,
            .inverse = std::make_shared<const ChangeList>(std::move(inverse)),
            .made = made});
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
void EditHistory::undone(ChangeList inverse, Overlaps overlaps) {
    happen(HistoryEvent::Kind::kUndone, std::move(inverse), std::move(overlaps));
}
void EditHistory::redone(ChangeList inverse, Overlaps overlaps) {
    happen(HistoryEvent::Kind::kRedone, std::move(inverse), std::move(overlaps));
}
void EditHistory::partDone(ChangeList inverse) {
    happen(HistoryEvent::Kind::kPartDone, std::move(inverse));
}
void EditHistory::partRefused() {
    happen({.kind = HistoryEvent::Kind::kPartRefused, .inverse = nullptr});
}

void EditHistory::happen(HistoryEvent::Kind kind, ChangeList inverse, Overlaps overlaps) {
    happen({.kind = kind,
            .inverse = std::make_shared<const ChangeList>(std::move(inverse)),
            .overlaps = std::move(overlaps)});
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
            case kEditedAnew:
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
        case kEditedAnew:
            return addEdit(event);
        case kUndone:
            return moveBack(event);
        case kRedone:
            return moveForth(event);
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

std::optional<std::size_t> EditHistory::stepOf(const Gesture& gesture, const ChangeList* inverse) const {
    if (gesture.id == 0) return std::nullopt;
    constexpr std::size_t kMostChanges = 10'000;  // looked at for each edit of a drag
    std::optional<NamedObjects> named;
    for (std::size_t i = back_.size(); i-- > 0;) {
        const Step& step = back_[i];
        if (step.gesture == gesture) return step.apart ? std::nullopt : std::optional(i);
        if (step.gesture.by == gesture.by) return std::nullopt;
        if (!inverse) continue;
        if (!named && (!tellsWhereThingsStand(*inverse) || !inverse->destructions.empty())) return std::nullopt;
        if (!named) named.emplace(*inverse);
        if (step.apart && named->anyIn(step.made)) return std::nullopt;
        for (const Held& held : step.apart ? std::span<const Held>() : std::span<const Held>(step.lists))
            if (held.list->changeCount() > kMostChanges || !tellsWhereThingsStand(*held.list) ||
                named->anyIn(*held.list))
                return std::nullopt;
    }
    return std::nullopt;
}

std::vector<EditHistory::Above> EditHistory::stepsAbove(const Gesture& gesture, const ChangeList& inverse) const {
    std::vector<Above> above;
    const std::optional<std::size_t> at = stepOf(gesture, &inverse);
    for (std::size_t i = back_.size(); at && i-- > *at + 1;) {
        Above& step = above.emplace_back(Above{.lists = {}, .overlaps = &back_[i].overlaps});
        // What stays apart speaks of the poses of what it makes itself only.
        if (back_[i].apart) continue;
        for (const Held& held : back_[i].lists) step.lists.push_back(held.list);
    }
    return above;
}

std::vector<ChangeListPtr> EditHistory::listsOf(const Gesture& gesture) const {
    std::vector<ChangeListPtr> lists;
    if (const std::optional<std::size_t> at = stepOf(gesture, nullptr))
        for (const Held& held : back_[*at].lists) lists.push_back(held.list);
    return lists;
}

void EditHistory::addEdit(const HistoryEvent& event) {
    nothingToRedo();
    const bool wasNothing = event.inverse->empty();
    const bool anew = event.kind == HistoryEvent::Kind::kEditedAnew;
    const std::optional<std::size_t> at =
        anew ? std::nullopt : stepOf(event.gesture, wasNothing ? nullptr : event.inverse.get());
    if (wasNothing) {
        if (!at) return;
        letGo(std::move(back_[*at]));
        back_.erase(back_.begin() + static_cast<std::ptrdiff_t>(*at));
        return;
    }
    Held held = hold(event.inverse);
    if (!at) {
        back_.push_back({{std::move(held)}, event.gesture});
    } else {
        // Lists of like size become one: so a drag of any length holds few, and each of its edits costs what it says
        // and now and then what came before.
        std::vector<Held>& lists = back_[*at].lists;
        lists.push_back(std::move(held));
        while (lists.size() > 1 && lists[lists.size() - 2].bytes <= 2 * lists.back().bytes)
            if (!mergeLast(back_[*at])) break;
    }
    addOverlaps(at ? back_[*at] : back_.back(), event.overlaps);
    bound();
}

void EditHistory::addOverlaps(Step& step, const Overlaps& overlaps) {
    if (overlaps.empty()) return;
    Overlaps both;
    std::ranges::set_union(step.overlaps, overlaps, std::back_inserter(both));
    if (both.size() > kMostOverlaps) both.assign(1, kAllOverlap);
    bytes_ += memoryOf(both) - memoryOf(step.overlaps);
    step.overlaps = std::move(both);
}

void EditHistory::addPart(ChangeListPtr inverse, IdRange made) {
    if (!arriving_) arriving_ = Step{.lists = {}, .gesture = {}, .apart = true, .made = made};
    arriving_->lists.push_back(hold(std::move(inverse)));
}

void EditHistory::finishParts() {
    TESSERA_CHECK(arriving_, "a step in parts has at least one");
    nothingToRedo();
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
    endGestures();
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

std::vector<ChangeListPtr> EditHistory::firstOf(const std::deque<Step>& steps, std::size_t most) {
    std::vector<ChangeListPtr> first;
    if (steps.empty()) return first;
    const std::vector<Held>& lists = steps.back().lists;
    for (auto held = lists.rbegin(); held != lists.rend() && first.size() < most; ++held) first.push_back(held->list);
    return first;
}

std::vector<ChangeListPtr> EditHistory::takenBack() const {
    std::vector<ChangeListPtr> lists;
    if (!takesBack() || moving_->dropped || moving_->turned) return lists;
    const std::vector<Held>& done = moving_->done.lists;
    for (auto held = done.rbegin(); held != done.rend(); ++held) lists.push_back(held->list);
    return lists;
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

void EditHistory::moveBack(const HistoryEvent& event) {
    if (back_.back().apart) return begin(back_, true, event.inverse);
    letGo(std::move(back_.back()));
    back_.pop_back();
    endGestures();
    forth_.push_back({{hold(event.inverse)}, {}});
    addOverlaps(forth_.back(), event.overlaps);
    bound();
}

void EditHistory::moveForth(const HistoryEvent& event) {
    if (forth_.back().apart) return begin(forth_, false, event.inverse);
    letGo(std::move(forth_.back()));
    forth_.pop_back();
    endGestures();
    back_.push_back({{hold(event.inverse)}, {}});
    addOverlaps(back_.back(), event.overlaps);
    bound();
}

void EditHistory::begin(std::deque<Step>& from, bool forth, ChangeListPtr inverse) {
    TESSERA_CHECK(!moving_, "one step is under way at a time");
    moving_ = StepMoving{.rest = std::move(from.back()),
                         .done = {.lists = {}, .gesture = {}, .apart = true, .made = from.back().made},
                         .forth = forth};
    from.pop_back();
    endGestures();
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
    Kept one{.place = place,
             .lists = {},
             .gesture = step.gesture,
             .apart = step.apart,
             .made = step.made,
             .overlaps = step.overlaps};
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
    addOverlaps(step, kept.overlaps);
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
    bytes_ -= memoryOf(step.overlaps);
    for (Held& held : step.lists) {
        bytes_ -= held.bytes;
        (step.apart ? forgottenParts_ : forgotten_).push_back(std::move(held.list));
    }
}

std::vector<ChangeListPtr> EditHistory::sweep() {
    constexpr std::size_t kListsAtOnce = 8;
    std::vector<ChangeListPtr> swept = std::exchange(forgotten_, {});
    for (std::size_t left = std::min(forgottenParts_.size(), kListsAtOnce); left > 0; --left) {
        swept.push_back(std::move(forgottenParts_.back()));
        forgottenParts_.pop_back();
    }
    return swept;
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
        addOverlaps(steps[steps.size() - 2], steps.back().overlaps);
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

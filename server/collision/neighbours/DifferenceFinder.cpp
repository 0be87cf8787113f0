#include "server/collision/neighbours/DifferenceFinder.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/base/Error.h"
#include "server/collision/neighbours/GridOrder.h"
#include "server/collision/neighbours/Tasks.h"
#include "server/collision/neighbours/TreeOrder.h"

namespace tessera::neighbours {

namespace {

constexpr std::uint32_t kNoSlot = ~0U;
constexpr std::size_t kItemsPerTask = 1024;
constexpr std::size_t kQueriesPerTask = 256;
constexpr std::size_t kGridFrom = 4096;  // the order of fewer is made as fast for a tree
constexpr std::uint32_t kNoItem = ~0U;
constexpr std::size_t kFewStrays = 256;  // more that move in a frame stay where they are in the order
constexpr std::size_t kShareForAll = 3;  // where more than one of three moved, all are looked at

static_assert(sizeof(Box) == 6 * sizeof(double), "boxes are read as six doubles");

}  // namespace

DifferenceFinder::DifferenceFinder(NeighbourMethod method, Workers* workers, const SlotKernels& kernels)
    : kernels_(kernels), workers_(workers) {
    if (method != NeighbourMethod::kTree) grid_ = std::make_unique<GridOrder>(kernels);
    if (method != NeighbourMethod::kGrid) tree_ = std::make_unique<TreeOrder>(kernels);
    order_ = grid_ ? grid_.get() : tree_.get();
}

DifferenceFinder::~DifferenceFinder() = default;

void DifferenceFinder::reset(std::span<const Box> boxes, InteractionTable table) {
    TESSERA_CHECK(boxes.size() <= SlotPair::kSlotMask / 2, "too many boxes");
    boxes_.assign(boxes.begin(), boxes.end());
    table_ = std::move(table);
    const std::size_t groups = table_.active.size();
    std::vector<bool> sociable(groups, expected_ > 0);  // who may come, nobody knows
    for (std::size_t i = 0; i < groups * groups && expected_ == 0; ++i)
        if (table_.interacts[i]) sociable[i / groups] = true;
    everybody_ = table_.bodyOf.empty() &&
                 std::find(table_.interacts.begin(), table_.interacts.end(), false) == table_.interacts.end();
    slotOf_.assign(boxes.size(), kNoSlot);
    spares_.clear();
    vacated_.clear();
    holes_ = 0;
    settled_ = 0;
    activeItems_ = 0;
    for (std::uint32_t i = 0; i < boxes.size(); ++i) {
        if (table_.groupOf[i] == InteractionTable::kNoGroup || !sociable[table_.groupOf[i]]) continue;
        slotOf_[i] = static_cast<std::uint32_t>(settled_++);
        activeItems_ += table_.activeItem(i);
    }
    for (; settled_ < expected_; ++settled_) spares_.push_back(static_cast<std::uint32_t>(settled_));
    itemMoved_.assign(boxes.size(), false);
    movedItems_.clear();
    fresh_ = true;
    upToDate_ = false;
}

void DifferenceFinder::move(std::uint32_t item, const Box& box) {
    if (boxes_[item].lower == box.lower && boxes_[item].upper == box.upper) return;
    boxes_[item] = box;
    if (slotOf_[item] == kNoSlot) return;
    upToDate_ = false;
    if (fresh_ || itemMoved_[item]) return;
    itemMoved_[item] = true;
    movedItems_.push_back(item);
}

std::span<const NeighbourPair> DifferenceFinder::pairs() {
    bringUpToDate();
    (void)pairs_.pairs(workers_);
    if (!pairs_.sound()) findAfresh();
    foundAfresh_ = false;
    untold_.clear();
    return pairs_.pairs(workers_);
}

bool DifferenceFinder::changes(std::vector<NeighbourPair>& begun, std::vector<NeighbourPair>& ended) {
    begun.clear();
    ended.clear();
    bringUpToDate();
    const bool known = !std::exchange(foundAfresh_, false);
    for (std::size_t i = 0; known && i < untold_.size(); ++i) {
        const PairChange change = untold_[i];
        if (i + 1 < untold_.size() && untold_[i + 1] >> 1U == change >> 1U) {
            ++i;  // ended and began
            continue;
        }
        ((change & 1U) != 0 ? begun : ended)
            .push_back({static_cast<std::uint32_t>(change >> 33U), static_cast<std::uint32_t>(change >> 1U)});
    }
    untold_.clear();
    return known;
}

void DifferenceFinder::bringUpToDate() {
    if (upToDate_) return;
    if (fresh_) {
        findAfresh();
    } else if (movedItems_.size() > settled_ / kShareForAll) {
        convert();
        findAll();
    } else {
        findMoved();
    }
    if (!pairs_.sound()) findAfresh();
    clearMoves();
    upToDate_ = true;
}

void DifferenceFinder::regroup(std::span<const std::uint32_t> items, std::span<const NeighbourPair> known,
                               const InteractionTable& table) {
    const std::size_t coming =
        static_cast<std::size_t>(std::count_if(items.begin(), items.end(), [&](std::uint32_t item) {
            return table.groupOf[item] != InteractionTable::kNoGroup &&
                   (item >= slotOf_.size() || slotOf_[item] == kNoSlot);
        }));
    if (fresh_ || !tree_ || items.size() > kShareForAll * 64 + settled_ / kShareForAll) {
        std::vector<Box> boxes = boxes_;
        boxes.resize(table.groupOf.size());
        for (const std::uint32_t item : items) boxes[item] = {};
        expected_ = std::max(expected_, table.groupOf.size() + table.groupOf.size() / 8 + 64);
        reset(boxes, table);
        return;
    }
    bringUpToDate();
    if (coming > spares_.size() && holes_ > settled_ / 16 && coming <= spares_.size() + holes_)
        arrange(Occasion::kOrderDecayed);
    if (coming > spares_.size()) makeSpares(coming + settled_ / 8 + 64);
    // A grid has no room for those who come.
    if (order_ == grid_.get()) arrange(Occasion::kOrderDecayed);
    if (!prevIsCur_) {
        std::copy(cur_.data(), cur_.data() + keyIndex(0, slots_ + kBlockSlots), prev_.data());
        prevIsCur_ = true;
    }
    boxes_.resize(table.groupOf.size());
    slotOf_.resize(table.groupOf.size(), kNoSlot);
    itemMoved_.resize(table.groupOf.size(), false);
    std::vector<PairChange> ends;
    for (const NeighbourPair& pair : known)
        if (pair.a < pair.b && pair.b < boxes_.size()) ends.push_back(pairChange(pair.a, pair.b, false));
    pairs_.apply(ends, boxes_.size(), workers_);
    for (const std::uint32_t item : items) {
        boxes_[item] = {};
        const bool gone = table.groupOf[item] == InteractionTable::kNoGroup;
        std::uint32_t& slot = slotOf_[item];
        if (slot != kNoSlot) {
            forget(slot);
            if (item < table_.groupOf.size() && table_.groupOf[item] != InteractionTable::kNoGroup)
                activeItems_ -= table_.activeItem(item);
            if (gone) {
                itemOf_[slot] = kNoItem;
                ++holes_;
                slot = kNoSlot;
            }
        } else if (!gone) {
            slot = spares_.back();
            spares_.pop_back();
            itemOf_[slot] = item;
        }
        if (!gone) activeItems_ += table.activeItem(item);
    }
    table_.active = table.active;
    table_.interacts = table.interacts;
    table_.groupOf.resize(table.groupOf.size(), InteractionTable::kNoGroup);
    if (!table.bodyOf.empty()) table_.bodyOf.resize(table.bodyOf.size());
    for (const std::uint32_t item : items) {
        table_.groupOf[item] = table.groupOf[item];
        if (!table.bodyOf.empty()) table_.bodyOf[item] = table.bodyOf[item];
    }
    everybody_ = false;
    // Whoever told of other pairs than there are may have left some out.
    fresh_ = fresh_ || ends.size() != known.size() || !pairs_.sound();
    upToDate_ = upToDate_ && !fresh_;
}

/// As if the box had always been empty.
void DifferenceFinder::forget(std::uint32_t slot) {
    cur_.clear(slot);
    prev_.clear(slot);
    std::fill_n(records_.begin() + 8 * std::ptrdiff_t{slot}, 8, -kNowhere);
}

/// Room for what comes, in a new order.
void DifferenceFinder::makeSpares(std::size_t count) {
    const std::size_t before = settled_;
    const std::vector<std::uint32_t> items(itemOf_.begin(), itemOf_.begin() + static_cast<std::ptrdiff_t>(before));
    SlotBounds kept;
    kept.allocate(before);
    for (std::size_t slot = 0; slot < before; ++slot) kept.copy(cur_, slot, slot);
    settled_ = slots_ = before + count;
    allocate();
    for (std::size_t slot = 0; slot < before; ++slot) cur_.copy(kept, slot, slot);
    std::copy(items.begin(), items.end(), itemOf_.begin());
    std::fill(itemOf_.begin() + static_cast<std::ptrdiff_t>(before), itemOf_.end(), kNoItem);
    arrange(Occasion::kOrderDecayed);
    convert();
}

void DifferenceFinder::clearMoves() {
    for (const std::uint32_t item : movedItems_) itemMoved_[item] = false;
    movedItems_.clear();
}

/// Keys into records.
void DifferenceFinder::convert() {
    const std::size_t tasks = tasksFor(boxes_.size(), kItemsPerTask);
    runTasks(workers_, tasks, [&](std::size_t i) {
        const std::size_t first = boxes_.size() * i / tasks, last = boxes_.size() * (i + 1) / tasks;
        if (first == last) return;
        kernels_.convert(boxes_[first].lower.data(), slotOf_.data() + first, last - first, origin_.data(),
                         records_.data());
    });
}

void DifferenceFinder::convertOne(std::uint32_t item) {
    kernels_.convert(boxes_[item].lower.data(), &slotOf_[item], 1, origin_.data(), records_.data());
}

/// Room for all that have slots, and for as many as may leap in a frame.
void DifferenceFinder::allocate() {
    const std::size_t slots = settled_ + leapLimit();
    records_.assign(8 * (slots + kSlotPadding), -kNowhere);
    itemOf_.resize(slots + kSlotPadding);
    placed_.assign(placeIndex(0, slots + kSlotPadding + kBlockSlots), -kNowhere);
    movedBits_.assign(slots / 64 + 1, 0);
    cur_.allocate(slots);
    prev_.allocate(slots);
}

/// Everything anew; pairs that were known are forgotten.
void DifferenceFinder::findAfresh() {
    slots_ = settled_;
    allocate();
    movedSlots_.clear();
    leaps_.clear();
    vacated_.clear();
    foundAfresh_ = true;
    std::fill(itemOf_.begin(), itemOf_.end(), kNoItem);
    for (std::uint32_t item = 0; item < boxes_.size(); ++item)
        if (slotOf_[item] != kNoSlot) itemOf_[slotOf_[item]] = item;
    origin_ = middle(boxes_);
    convert();
    kernels_.spread(records_.data(), 0, slots_, cur_.data());
    arrange(Occasion::kAfresh);
    for (std::size_t slot = 0; slot < slots_; ++slot) prev_.clear(slot);
    pairs_.clear();
    lastDrift_ = {};
    fresh_ = false;
    if (!sweepEverybody() || !pairs_.sound()) findOneByOne();
    searches_ = 0;
    if (order_->decayed()) arrange(Occasion::kOrderDecayed);
}

/// Without any order.
void DifferenceFinder::findOneByOne() {
    pairs_.clear();
    const std::vector<PairChange> begins = beginsOneByOne(boxes_, [&](std::uint32_t a, std::uint32_t b) {
        return slotOf_[a] != kNoSlot && slotOf_[b] != kNoSlot && (everybody_ || table_.relevant(a, b));
    });
    pairs_.apply(begins, boxes_.size(), workers_);
}

/// Puts the slots in a new order. What was before is lost: this is for the end of a frame.
void DifferenceFinder::arrange(Occasion occasion) {
    ++arrangements_;
    order_ = tree_ ? tree_.get() : grid_.get();
    if (grid_ && (!tree_ || (occasion == Occasion::kAfresh && slots_ >= kGridFrom))) {
        grid_->arrange(cur_, slots_, workers_, from_);
        if (!tree_ || grid_->expectedSteps() < tree_->expectedSteps()) order_ = grid_.get();
    }
    if (order_ == tree_.get()) tree_->arrange(cur_, slots_, workers_, from_);
    const std::size_t tasks = tasksFor(slots_, kItemsPerTask);
    std::vector<std::uint32_t> items(itemOf_.size());
    runTasks(workers_, tasks, [&](std::size_t i) {
        const std::size_t first = slots_ * i / tasks, last = slots_ * (i + 1) / tasks;
        for (std::size_t s = first; s < last; ++s) {
            prev_.copy(cur_, from_[s], s);
            for (std::size_t a = 0; a < 3; ++a) placed_[placeIndex(a, s)] = prev_.at(a, s);
        }
        for (std::size_t s = first; s < last; ++s) {
            items[s] = itemOf_[from_[s]];
            if (items[s] != kNoItem)
                slotOf_[items[s]] = static_cast<std::uint32_t>(s);
            else
                std::fill_n(records_.begin() + 8 * static_cast<std::ptrdiff_t>(s), 8, -kNowhere);
        }
    });
    itemOf_.swap(items);
    spares_.clear();
    holes_ = 0;
    for (std::size_t s = slots_; s > 0 && prev_.empty(s - 1); --s)  // what is empty comes last
        if (itemOf_[s - 1] == kNoItem) spares_.push_back(static_cast<std::uint32_t>(s - 1));
    std::swap(cur_, prev_);
    prevIsCur_ = false;
    drift_ = lastDrift_ = {};
}

bool DifferenceFinder::beginFrame(bool all) {
    std::array<float, 3> drift{};
    for (std::size_t a = 0; a < 3; ++a) drift[a] = std::max(drift_[a], lastDrift_[a]);
    return order_->beginFrame({cur_.data(), prev_.data()}, slots_, drift.data(), movedSlots_, all, workers_);
}

void DifferenceFinder::findAll() {
    std::swap(cur_, prev_);
    prevIsCur_ = false;
    lastDrift_ = drift_;
    spreadAndSettle();
    std::vector<std::uint32_t> leavers;
    for (const Findings& task : tasks_) leavers.insert(leavers.end(), task.leavers.begin(), task.leavers.end());
    if (!releaseLeavers(leavers)) {
        findAfresh();
        return;
    }
    if (!sweepEverybody()) {
        findAfresh();
        return;
    }
    const bool due = arrangementDue();
    takeHome();
    if (due) arrange(Occasion::kOrderDecayed);
}

bool DifferenceFinder::arrangementDue() const {
    // The tree pays when boxes have been searched for about twice.
    const bool settled = order_ == grid_.get() && tree_ && searches_ > 2 * settled_;
    const bool crowded = spares_.empty() && !vacated_.empty();
    return settled || crowded || !leaps_.empty() || order_->decayed();
}

/// Records to the arrays of now; who has left his place, and how far the others have drifted.
void DifferenceFinder::spreadAndSettle() {
    const std::size_t settling = order_->settlingSlots();
    const std::size_t tasks = tasksFor(slots_, kItemsPerTask);
    if (tasks_.size() < tasks) tasks_.resize(tasks);
    runTasks(workers_, tasks, [&](std::size_t i) {
        // In multiples of sixteen, as the kernel asks.
        const std::size_t blocks = (slots_ + 15) / 16;
        const std::size_t first = blocks * i / tasks * 16, last = std::min(slots_, blocks * (i + 1) / tasks * 16);
        Findings& task = tasks_[i];
        kernels_.spread(records_.data(), first, last, cur_.data());
        task.settlement = order_->limits();
        task.leavers.resize(last - first);
        const std::size_t end = std::min(last, settling);
        std::size_t count = 0;
        if (first < end) {
            count = kernels_.settle(cur_.data(), placed_.data(), first, end, task.settlement, task.leavers.data());
        } else {
            std::fill(std::begin(task.settlement.maxDrift), std::end(task.settlement.maxDrift), 0.0F);
        }
        task.leavers.resize(count);
    });
    drift_ = {};
    for (std::size_t i = 0; i < tasks; ++i)
        for (std::size_t a = 0; a < 3; ++a) drift_[a] = std::max(drift_[a], tasks_[i].settlement.maxDrift[a]);
    for (std::size_t i = tasks; i < tasks_.size(); ++i) tasks_[i].leavers.clear();
}

/// Gives new, loose, slots to what has left its place: in the old one it vanishes, in the new one it appears. False if
/// it is so many that all had better be found afresh.
bool DifferenceFinder::releaseLeavers(std::span<const std::uint32_t> leavers) {
    leaps_.clear();
    for (const std::uint32_t slot : leavers)
        if (!cur_.empty(slot))  // what has become empty stays where it is
            leaps_.push_back({slot, static_cast<std::uint32_t>(slots_ + leaps_.size())});
    if (leaps_.size() > leapLimit()) {
        leaps_.clear();
        return false;
    }
    for (const Leap& leap : leaps_) {
        itemOf_[leap.to] = itemOf_[leap.from];
        cur_.copy(cur_, leap.from, leap.to);
        cur_.clear(leap.from);
        prev_.clear(leap.to);
    }
    slots_ += leaps_.size();
    return true;
}

/// After the sweep, what has leapt goes to its old slot again (though not its old place): a new order is due.
void DifferenceFinder::takeHome() {
    for (const Leap& leap : leaps_) {
        cur_.copy(cur_, leap.to, leap.from);
        cur_.clear(leap.to);
        prev_.clear(leap.to);
    }
    slots_ = settled_;
    leaps_.clear();
}

void DifferenceFinder::findMoved() {
    if (!prevIsCur_) {
        std::copy(cur_.data(), cur_.data() + keyIndex(0, slots_ + kBlockSlots), prev_.data());
        prevIsCur_ = true;
    }
    lastDrift_ = drift_;
    const Settlement& limits = order_->limits();
    const std::size_t settling = order_->settlingSlots();
    const bool fewMoved = movedItems_.size() <= kFewStrays;
    std::vector<std::uint32_t> leavers;
    for (const std::uint32_t item : movedItems_) {
        convertOne(item);
        const std::uint32_t slot = slotOf_[item];
        const float* const record = records_.data() + std::size_t{8} * slot;
        bool stays = true;
        std::array<float, 3> drift{};
        for (std::size_t a = 0; a < 3; ++a) {
            cur_.at(a, slot) = record[a];
            cur_.at(a + 3, slot) = record[a + 4];
            drift[a] = std::abs(record[a] - placed_[placeIndex(a, slot)]);
            stays = stays && drift[a] <= limits.maxDrift[a] && record[a + 4] + record[a] <= limits.maxExtent[a];
        }
        movedBits_[slot / 64] |= std::uint64_t{1} << slot % 64;
        if (slot >= settling) {
            if (fewMoved && !spares_.empty() && order_->strays(cur_, slot)) settleStray(item);
            continue;
        }
        if (!stays) {
            leavers.push_back(slot);
            continue;
        }
        for (std::size_t a = 0; a < 3; ++a) drift_[a] = std::max(drift_[a], drift[a]);
    }
    std::sort(leavers.begin(), leavers.end());
    if (!releaseLeavers(leavers)) {
        findAfresh();
        return;
    }
    for (const Leap& leap : leaps_) movedBits_[leap.to / 64] |= std::uint64_t{1} << leap.to % 64;
    movedSlots_.clear();
    if (movedItems_.size() < movedBits_.size() / 8) {
        for (const std::uint32_t item : movedItems_) movedSlots_.push_back(slotOf_[item]);
        for (const Leap& leap : leaps_) movedSlots_.push_back(leap.to);
        movedSlots_.insert(movedSlots_.end(), vacated_.begin(), vacated_.end());
        std::sort(movedSlots_.begin(), movedSlots_.end());
    } else {
        for (std::size_t word = 0; word < movedBits_.size(); ++word)
            for (std::uint64_t left = movedBits_[word]; left != 0; left &= left - 1)
                movedSlots_.push_back(static_cast<std::uint32_t>(64 * word) +
                                      static_cast<std::uint32_t>(__builtin_ctzll(left)));
    }
    if (!beginFrame(false)) {
        findAfresh();
        return;
    }
    sweepMoved();
    keepMoved();
}

/// Gives a spare slot to what has strayed from its neighbours: where it was it vanishes, where it is it appears.
void DifferenceFinder::settleStray(std::uint32_t item) {
    const std::uint32_t from = slotOf_[item], to = spares_.back();
    spares_.pop_back();
    vacated_.push_back(from);
    slotOf_[item] = to;
    itemOf_[to] = item;
    cur_.copy(cur_, from, to);
    std::copy_n(records_.begin() + 8 * std::ptrdiff_t{from}, 8, records_.begin() + 8 * std::ptrdiff_t{to});
    cur_.clear(from);
    std::fill_n(records_.begin() + 8 * std::ptrdiff_t{from}, 8, -kNowhere);
    prev_.clear(to);
    movedBits_[to / 64] |= std::uint64_t{1} << to % 64;
}

void DifferenceFinder::sweepMoved() {
    sweep(movedSlots_.size(), kQueriesPerTask, true, [&](std::size_t begin, std::size_t end, PairSink& sink) {
        return order_->sweepSome(movedSlots_, begin, end, sink);
    });
}

/// False if all had better be found afresh.
bool DifferenceFinder::sweepEverybody() {
    if (activeItems_ > settled_ / kShareForAll) {
        if (!beginFrame(true)) return false;
        sweep(order_->units(), order_->unitsPerTask(), false,
              [&](std::size_t begin, std::size_t end, PairSink& sink) { return order_->sweepAll(begin, end, sink); });
        return true;
    }
    if (!beginFrame(true)) return false;
    // Passive items, most of a scene, are of no interest to each other: it is enough that the active ones search.
    for (std::uint32_t slot = 0; slot < slots_; ++slot) {
        if (itemOf_[slot] == kNoItem || !table_.activeItem(itemOf_[slot])) continue;
        movedSlots_.push_back(slot);
        movedBits_[slot / 64] |= std::uint64_t{1} << slot % 64;
    }
    sweepMoved();
    for (const std::uint32_t slot : movedSlots_) movedBits_[slot / 64] = 0;
    movedSlots_.clear();
    return true;
}

/// The end of a frame in which some moved: what is now is what was before the next.
void DifferenceFinder::keepMoved() {
    const bool due = arrangementDue();
    takeHome();
    for (const std::uint32_t slot : movedSlots_) {
        movedBits_[slot / 64] = 0;
        if (slot >= slots_) continue;
        prev_.copy(cur_, slot, slot);
    }
    movedSlots_.clear();
    for (const std::uint32_t slot : vacated_) {
        itemOf_[slot] = kNoItem;
        ++holes_;
    }
    vacated_.clear();
    if (due) arrange(Occasion::kOrderDecayed);
}

/// Cuts the units into tasks, by their number and nothing else, collects what the kernels find and takes it in.
template <typename Sweep>
void DifferenceFinder::sweep(std::size_t units, std::size_t perTask, bool some, const Sweep& sweepUnits) {
    searches_ += some ? units : settled_;
    const std::size_t tasks = tasksFor(units, perTask);
    if (tasks_.size() < tasks) tasks_.resize(tasks);
    runTasks(workers_, tasks, [&](std::size_t i) {
        Findings& task = tasks_[i];
        task.changes.clear();
        const std::size_t end = units * (i + 1) / tasks;
        for (std::size_t at = units * i / tasks; at < end;) {
            if (task.found.empty()) task.found.resize(4096);
            PairSink sink{task.found.data(), task.found.size(), 0};
            const std::size_t next = sweepUnits(at, end, sink);
            judge(task, sink.count, some);
            // What begins at `next` needs more room than there was.
            if (next == at) task.found.resize(2 * task.found.size());
            at = next;
        }
    });
    applyChanges(tasks);
}

/// From slots to items: leaves out what is of no interest, decides what the keys could not.
void DifferenceFinder::judge(Findings& task, std::size_t count, bool some) const {
    for (std::size_t i = 0; i < count; ++i) {
        const SlotPair& pair = task.found[i];
        const std::uint32_t second = pair.secondAndFlags & SlotPair::kSlotMask;
        // Where only some search, two of them find each other twice, and each may find itself.
        if (some && (second == pair.first || (second < pair.first && isMoved(second)))) continue;
        std::uint32_t a = itemOf_[pair.first], b = itemOf_[second];
        if (a > b) std::swap(a, b);
        if (!everybody_ && !table_.relevant(a, b)) continue;
        bool begins = (pair.secondAndFlags & SlotPair::kBegins) != 0;
        if ((pair.secondAndFlags & SlotPair::kUnsure) != 0 && !decide(pair, a, b, begins)) continue;
        task.changes.push_back(pairChange(a, b, begins));
    }
}

/// Whether a pair with equal keys has changed, and how.
bool DifferenceFinder::decide(const SlotPair& pair, std::uint32_t a, std::uint32_t b, bool& begins) const {
    const std::uint32_t i = pair.first, k = pair.secondAndFlags & SlotPair::kSlotMask;
    const auto overlap = [&](const SlotBounds& bounds) {
        float least = kNowhere;
        for (std::size_t x = 0; x < 3; ++x) {
            least = std::min(least, bounds.at(x + 3, i) + bounds.at(x, k));
            least = std::min(least, bounds.at(x + 3, k) + bounds.at(x, i));
        }
        return least;
    };
    const float now = overlap(cur_), before = overlap(prev_);
    const bool meetNow = now > 0 || (now == 0 && boxes_[a].overlaps(boxes_[b]));
    const bool metBefore = before > 0 || (before == 0 && pairs_.contains(a, b));
    begins = meetNow;
    return meetNow != metBefore;
}

void DifferenceFinder::applyChanges(std::size_t tasks) {
    std::vector<const std::vector<PairChange>*> lists;
    for (std::size_t i = 0; i < tasks; ++i) lists.push_back(&tasks_[i].changes);
    pairs_.apply(lists, boxes_.size(), workers_);
    const bool merges = !untold_.empty();
    untold_.insert(untold_.end(), pairs_.lastChanges().begin(), pairs_.lastChanges().end());
    if (merges) std::sort(untold_.begin(), untold_.end());
}

}  // namespace tessera::neighbours

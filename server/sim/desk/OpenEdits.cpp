#include "server/sim/desk/OpenEdits.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "common/cores/Node.h"
#include "server/sim/desk/AuditNames.h"
#include "server/sim/frame/Simulation.h"
#include "server/sim/reload/ReloadPlan.h"

namespace tessera {

namespace {

std::size_t partsOf(const OpenEdits::Open& open) {
    return open.reload ? open.reload->parts.size() : open.parts.size();
}

ApplicationAnswer committedAnswer(const OpenEdits::Open& open, answer::Committed committed) {
    committed.removed = open.removed;
    committed.created = open.created;
    if (open.parts.size() > 1) {  // ids in a row
        const auto [placeholder, first] = committed.ids.front();
        committed.ids.front() = {open.copy, ObjectId(first.value + (open.copy.value - placeholder.value))};
    } else if (open.copy) {
        std::erase_if(committed.ids, [&](const auto& pair) { return pair.first != open.copy; });
    }
    return committed;
}

ApplicationAnswer loadedAnswer(const OpenEdits::Open& open, const answer::Committed& committed) {
    answer::Loaded loaded = open.loaded;
    const auto given = std::ranges::find(committed.ids, loaded.node, &std::pair<ObjectId, ObjectId>::first);
    if (given != committed.ids.end())
        loaded.node = given->second;
    else if (!committed.ids.empty())  // of parts: ids in a row
        loaded.node =
            ObjectId(committed.ids.front().second.value + (loaded.node.value - committed.ids.front().first.value));
    return loaded;
}

Expected<ApplicationAnswer> answerOf(const OpenEdits::Open& open, Expected<answer::Committed> result) {
    if (!result) return tl::unexpected(std::move(result.error()));
    return open.isLoad ? loadedAnswer(open, *result) : committedAnswer(open, std::move(*result));
}

}  // namespace

void OpenEdits::open(std::uint64_t ticket, Open open) {
    open.edit.ticket = ticket;
    open_[ticket] = std::move(open);
}

OpenEdits::Open* OpenEdits::find(std::uint64_t ticket) {
    const auto found = open_.find(ticket);
    return found == open_.end() ? nullptr : &found->second;
}

ServerActions OpenEdits::enter(Open open, std::vector<Blob> named, TimePoint now) {
    const std::uint64_t ticket = newTicket();
    this->open(ticket, std::move(open));
    return queue(ticket, std::move(named), now);
}

ServerActions OpenEdits::queue(std::uint64_t ticket, std::vector<Blob> named, TimePoint now) {
    if (const std::optional<Error> why = around_.whyNoEdit()) return refuse(ticket, *why);
    if (named.empty()) {
        ready_.push_back(ticket);
        return {};
    }
    std::vector<BlobInfo> infos;
    for (const Blob& blob : named) {
        around_.blobs.add(blob);
        infos.push_back({blob.id(), blob.sizeBytes()});
    }
    // Hosts fetch them before the commit. What an undo names may leave the history before its turn comes: others undo
    // too.
    open_.at(ticket).announced = std::move(named);
    return around_.session.announceBlobs(ticket, std::move(infos), now);
}

ServerActions OpenEdits::refuse(std::uint64_t ticket, const Error& why) {
    const auto open = open_.find(ticket);
    std::erase(ready_, ticket);
    std::erase(loading_, ticket);
    ServerActions actions = tell(open->second, tl::unexpected(why));
    drop(std::move(open->second.parts));
    around_.session.forgetBlobs(ticket);
    close(open);
    return actions;
}

void OpenEdits::blobsEverywhere(std::uint64_t ticket) {
    const auto open = open_.find(ticket);
    if (open == open_.end()) return;
    open->second.isEverywhere = true;
    ready_.push_back(ticket);
}

OpenEdits::Count OpenEdits::countOf(ConnectionId connection) const {
    Count count;
    for (const auto& [ticket, open] : open_) {
        if (open.asker.connection != connection) continue;
        ++count.edits;
        count.bytes += open.bytes;
    }
    return count;
}

bool OpenEdits::waitsForHosts(std::uint64_t ticket) const {
    const auto open = open_.find(ticket);
    return open != open_.end() && !open->second.announced.empty() && !open->second.isEverywhere;
}

bool OpenEdits::hasNotBegun(std::uint64_t ticket) const {
    const auto open = open_.find(ticket);
    return open != open_.end() && partsOf(open->second) > 0 && open->second.nextPart == 0;
}

std::optional<Error> OpenEdits::whyNowhere(const Open& open) const {
    if (!open.below || around_.simulation.scene().get<Node>(open.below)) return std::nullopt;
    return Error{
        ErrorCode::kNotFound,
        fmt::format("{} is not loaded: {} (#{}), below which it was to go, has been removed meanwhile; load it "
                    "below another node, or bring that one back (undo) and load it again",
                    open.loadedFrom, open.belowName, open.below.value)};
}

std::vector<OpenEdits::Appearing> OpenEdits::appearing() const {
    std::vector<Appearing> found;
    for (const auto& [ticket, open] : open_) {
        if (!open.isLoad || partsOf(open) == 0) continue;
        std::optional<double> part;
        if (open.nextPart > 0) part = static_cast<double>(open.nextPart) / static_cast<double>(partsOf(open));
        found.push_back({ticket, &open, !waitsForHosts(ticket), part});
    }
    return found;
}

std::size_t OpenEdits::copiedBytes() const {
    std::size_t bytes = 0;
    for (const auto& [ticket, open] : open_)
        if (open.isCopy) bytes += open.bytes;
    return bytes;
}

void OpenEdits::forgetLeftBehind(const std::function<bool(ConnectionId)>& isPresent) {
    const auto leftBehind = [&](const Opens::value_type& entry) {
        const Open& open = entry.second;
        return !open.isLoad && open.parts.empty() && !isPresent(open.asker.connection);
    };
    auto many = static_cast<std::size_t>(std::ranges::count_if(open_, leftBehind));
    for (auto it = open_.end(); many > limits_.maxLeftBehind && it != open_.begin();) {
        if (--it; !leftBehind(*it)) continue;
        std::erase(ready_, it->first);
        around_.session.forgetBlobs(it->first);
        it = close(it);
        --many;
    }
}

std::size_t weightOf(const ChangeList& list) {
    std::size_t weight = list.changeCount();
    for (const FieldColumn& column : list.columns)
        if (const auto* lists = std::get_if<std::vector<RefList>>(&column.values))
            for (const RefList& references : *lists) weight += references.size();
    return weight;
}

std::vector<Edit> OpenEdits::takeEdits() {
    std::vector<Edit> edits;
    std::vector<std::uint64_t> later;
    bool full = false;  // the others open another frame
    std::size_t changes = 0, bytes = 0;
    const Simulation& simulation = around_.simulation;
    for (const std::uint64_t ticket : std::exchange(ready_, {})) {
        Open& open = open_.at(ticket);
        const bool step = isStep(open.edit.kind);
        if (!open.parts.empty() || open.reload) {
            loading_.push_back(ticket);
            continue;
        }
        if (step && (simulation.stepUnderWay() || simulation.appearing())) {  // it waits for that, and nobody for it
            later.push_back(ticket);
            continue;
        }
        // An undo may bring back what an edit of the same frame removes: it opens a frame of its own.
        full = full || (step && !edits.empty());
        // Nor do many large ones hold up a frame.
        changes += open.edit.move ? 1 : weightOf(open.edit.list);
        bytes += open.bytes;
        full = full || (!edits.empty() && (changes > limits_.maxFrameChanges || bytes > limits_.maxFrameBytes));
        if (full) {
            later.push_back(ticket);
            continue;
        }
        note(open, open.edit);
        edits.push_back(std::move(open.edit));
    }
    ready_ = std::move(later);
    return edits;
}

void OpenEdits::takePart(std::vector<Edit>& edits) {
    constexpr std::size_t kDroppedAtOnce = 8;
    dropped_.resize(dropped_.size() - std::min(dropped_.size(), kDroppedAtOnce));
    if (loading_.empty() || around_.simulation.stepUnderWay() || std::ranges::any_of(edits, isStep, &Edit::kind))
        return;
    Open& open = open_.at(loading_.front());
    Edit part = open.reload ? nextPartOf(open) : open.edit;
    if (!open.reload) part.list = std::move(open.parts[open.nextPart++]);
    note(open, part);
    const bool isLast = open.nextPart == partsOf(open);
    // What is one part only is an edit like others.
    if (open.parts.size() > 1) part.kind = isLast ? Edit::Kind::kLastPart : Edit::Kind::kPart;
    edits.insert(open.reload ? edits.begin() : edits.end(), std::move(part));
    if (isLast) loading_.pop_front();
}

/// What has changed since it was planned stays. It comes first in its frame: nobody's edit of the same one is lost by
/// it.
Edit OpenEdits::nextPartOf(Open& open) const {
    ReloadPlan& plan = *open.reload;
    const std::size_t number = open.nextPart++;
    ReloadPlan::Part& next = plan.parts[number];
    leaveOutWhatChanged(around_.simulation.scene(), next, plan);
    Edit part = open.edit;
    part.objects = plan.objects;
    if (number < plan.creating)
        part.kind = number + 1 == plan.creating ? Edit::Kind::kLastPart : Edit::Kind::kPart;
    else if (plan.creating > 0)
        replaceIds(next.list, [&](ObjectId id) {
            return isPlaceholder(id) ? ObjectId(open.firstMade.value + (id.value - kFirstPlaceholder)) : id;
        });
    part.list = std::move(next.list);
    return part;
}

void OpenEdits::note(const Open& open, const Edit& edit) const {
    AuditBook* const audit = around_.audit;
    if (!audit || open.content || !open.asker.connection) return;
    Simulation& simulation = around_.simulation;
    const ChangeListPtr step = isStep(edit.kind) ? simulation.listOf(edit.kind) : nullptr;
    const ChangeList& list = step ? *step : edit.list;
    const Asker& asker = open.asker;
    if (audit->wantsObjects(asker.connection, asker.deed))
        audit->names(asker.connection, asker.deed, auditNames(simulation, list, AuditBook::kMostObjects));
    audit->changes(asker.connection, asker.deed, edit.move ? 1 : list.changeCount());
}

bool OpenEdits::has(ConnectionId connection, std::uint64_t deed) const {
    return std::ranges::any_of(open_, [&](const auto& entry) {
        return entry.second.asker.connection == connection && entry.second.asker.deed == deed;
    });
}

void OpenEdits::drop(std::vector<ChangeList> parts) {
    std::ranges::move(parts, std::back_inserter(dropped_));
}

ServerActions OpenEdits::committed(std::vector<EditOutcome> outcomes) {
    ServerActions actions;
    for (EditOutcome& outcome : outcomes) {
        const auto found = open_.find(outcome.ticket);
        if (found == open_.end() || outcome.underWay) continue;
        Open& open = found->second;
        const bool morePartsFollow = open.nextPart < partsOf(open);
        if (outcome.result && !outcome.result->ids.empty()) {
            open.firstMade = outcome.result->ids.front().second;
            if (open.given) open.given(open.firstMade);
        }
        if (morePartsFollow && outcome.result) continue;
        // Its words would be about numbers that nobody has given.
        if (!outcome.result)
            if (std::optional<Error> why = whyNowhere(open)) outcome.result = tl::unexpected(*std::move(why));
        append(actions, tell(open, answerOf(open, std::move(outcome.result))));
        if (morePartsFollow) {
            std::erase(loading_, outcome.ticket);
            drop(std::move(open.parts));
        }
        // Of an edit that was refused nobody holds the arrays any more: who joins could not fetch them.
        around_.session.forgetBlobs(outcome.ticket);
        close(found);
    }
    return actions;
}

ServerActions OpenEdits::tell(const Open& open, const Expected<ApplicationAnswer>& outcome) {
    if (open.ended) return open.ended(outcome ? std::nullopt : std::optional(outcome.error()));
    if (!open.content) return around_.answers().to(open.asker, outcome);
    if (around_.inlines)
        around_.inlines->ended(open.content, outcome ? std::nullopt : std::optional(outcome.error().message));
    return {};
}

OpenEdits::Opens::iterator OpenEdits::close(Opens::iterator open) {
    if (around_.uploads) {
        around_.uploads->letGo(std::move(open->second.announced));
        around_.uploads->handedOver(open->second.upload);
    }
    return open_.erase(open);
}

}  // namespace tessera

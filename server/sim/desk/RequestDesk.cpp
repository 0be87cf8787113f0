#include "server/sim/desk/RequestDesk.h"

#include <algorithm>

#include <fmt/format.h>

#include "common/base/Utf8.h"
#include "common/codec/ChangeCodec.h"
#include "common/scene/Edits.h"
#include "server/sim/desk/SceneAnswers.h"
#include "server/sim/frame/Simulation.h"

namespace tessera {

namespace {
constexpr std::size_t kMostNoteBytes = 500;
constexpr std::size_t kCopiedAtOnce = 1024;  ///< changes: of a copy that takes more the list is made beside the frames
constexpr std::uint64_t kHeldTicket = ~std::uint64_t{5};  ///< of what is said of held handles; nobody waits for it

/// "art: dtrack, 2 of 3 sensors at 60 Hz".
std::string lineOf(const TrackerInfo& tracker) {
    std::size_t speaking = 0;
    double rate = 0;
    for (const SensorInfo& sensor : tracker.sensors) {
        if (sensor.ageMs < 0 || sensor.ageMs > 1000) continue;
        ++speaking;
        rate = std::max(rate, sensor.rateHz);
    }
    return fmt::format("{}: {}, {} of {} sensors speak{}{}", tracker.name, tracker.protocol, speaking,
                       tracker.sensors.size(), speaking > 0 ? fmt::format(", {:.0f} Hz", rate) : std::string(),
                       tracker.trouble.empty() ? "" : "; " + tracker.trouble);
}
}  // namespace

RequestDesk::RequestDesk(const Surroundings& around, const Limits& limits)
    : around_(around),
      limits_(limits),
      images_(around.wall, around.session, limits.imageDeadline),
      views_(around.session, around.view, around.simulation, around.orderSurvey),
      news_(around.session, limits.news) {}

ServerActions RequestDesk::received(const server_action::RequestReceived& received, TimePoint now) {
    const Asker asker{.connection = received.connection, .request = received.id};
    const Expected<ApplicationRequest> decoded = decodeRequest(received.body);
    if (!decoded) return refuse(asker, decoded.error());
    return std::visit(
        [&]<typename Request>(const Request& request) {
            if constexpr (Request::kInfo.answered == Answered::kLater)
                if (std::optional<Error> why = tooManyOpen(asker)) {
                    if (Request::kInfo.bringsArrays && around_.uploads) around_.uploads->drop(asker.connection);
                    return refuse(asker, std::move(*why));
                }
            return on(asker, request, now);
        },
        *decoded);
}

/// Each application for itself: one that asks without end keeps no other from asking.
std::optional<Error> RequestDesk::tooManyOpen(const Asker& asker) const {
    std::size_t count = images_.openCount(asker.connection) + views_.openCount(asker.connection), bytes = 0;
    for (const auto& [ticket, open] : open_) {
        if (open.asker.connection != asker.connection) continue;
        ++count;
        bytes += open.bytes;
    }
    if (count >= limits_.maxOpenRequests)
        return Error{ErrorCode::kLimit,
                     fmt::format("{} requests of this application are open already; try again later", count)};
    if (bytes >= limits_.maxOpenBytes)
        return Error{ErrorCode::kLimit,
                     fmt::format("proposals of {} MiB of this application wait already; try again later", bytes >> 20)};
    return std::nullopt;
}

ServerActions RequestDesk::on(const Asker& asker, const request::ProposeChanges& proposal, TimePoint now) {
    const Expected<Uploads::Closed> upload = around_.uploads ? around_.uploads->close(asker.connection) : Uploads::Closed();
    if (!upload) return refuse(asker, failWith("proposal", upload.error()).value());
    const std::uint64_t ticket = nextTicket_++;
    std::size_t bytes = proposal.list.size() + upload->bytes;
    for (const ByteSlice& blob : proposal.blobs) bytes += blob.size();
    open_[ticket] = {.asker = asker, .edit = {.ticket = ticket, .gesture = {asker.connection.value, proposal.gesture}}, .bytes = bytes};
    if (upload->upload == 0) return propose(ticket, proposal, now);
    awaiting_[upload->upload] = {ticket, proposal};
    return {};
}

ServerActions RequestDesk::propose(std::uint64_t ticket, const request::ProposeChanges& proposal, TimePoint now) {
    Open& open = open_.at(ticket);
    Expected<ChangeList> list = listFrom(proposal);
    if (!list) {
        ServerActions actions = tell(open, tl::unexpected(list.error()));
        close(open_.find(ticket));
        return actions;
    }
    open.edit.list = std::move(*list);
    return queueEdit(ticket, blobsOf(open.edit.list), now);
}

void RequestDesk::uploading(const server_action::UploadReceived& received) {
    if (around_.uploads) around_.uploads->take(received.connection, received.upload);
}

ServerActions RequestDesk::uploaded(UploadFinished finished, TimePoint now) {
    auto awaiting = awaiting_.extract(finished.upload);
    const auto open = awaiting ? open_.find(awaiting.mapped().ticket) : open_.end();
    if (open == open_.end()) {
        around_.uploads->handedOver(finished.upload);
        if (finished.blobs) around_.uploads->letGo(std::move(*finished.blobs));
        return {};
    }
    open->second.upload = finished.upload;
    if (!finished.blobs) {
        ServerActions actions = tell(open->second, failWith("proposal", finished.blobs.error()));
        close(open);
        return actions;
    }
    // Findable until the list holds them.
    for (Blob& blob : *finished.blobs) blob = around_.blobs.add(std::move(blob));
    ServerActions actions = propose(open->first, awaiting.mapped().proposal, now);
    around_.uploads->letGo(std::move(*finished.blobs));
    return actions;
}

ServerActions RequestDesk::on(const Asker& asker, const request::UndoStep&, TimePoint now) {
    return step(asker, Edit::Kind::kUndo, now);
}

ServerActions RequestDesk::on(const Asker& asker, const request::RedoStep&, TimePoint now) {
    return step(asker, Edit::Kind::kRedo, now);
}

ServerActions RequestDesk::step(const Asker& asker, Edit::Kind kind, TimePoint now) {
    const std::uint64_t ticket = nextTicket_++;
    open_[ticket] = {.asker = asker, .edit = {.ticket = ticket, .kind = kind}};
    return queueEdit(ticket, around_.simulation.arraysOf(kind), now);
}

ServerActions RequestDesk::on(const Asker& asker, const request::LoadFile& wish, TimePoint) {
    return load(asker, {.path = wish.path, .parent = wish.parent, .placing = wish.placing});
}

ServerActions RequestDesk::on(const Asker& asker, const request::LoadAsset& wish, TimePoint) {
    return load(
        asker,
        {.path = std::string(request::LoadAsset::kPrefix) + wish.name, .parent = wish.parent, .placing = wish.placing});
}

ServerActions RequestDesk::load(const Asker& asker, LoadOrder order) {
    if (const std::optional<Error> why = editsRefused()) return refuse(asker, *why);
    if (!order.parent) order.parent = kRootNode;
    if (!around_.simulation.scene().get<Node>(order.parent))
        return refuse(asker,
                      {ErrorCode::kNotFound, fmt::format("there is no node #{} to load below", order.parent.value)});
    const std::uint64_t ticket = order.ticket = nextTicket_++;
    if (!around_.loader.order(std::move(order)))
        return refuse(asker, {ErrorCode::kLimit, "too many files wait to be loaded already"});
    open_[ticket] = {.asker = asker, .edit = {.ticket = ticket}, .isLoad = true};
    return {};
}

void RequestDesk::loadContent(InlineOrder order) {
    const std::uint64_t ticket = nextTicket_++;
    const ObjectId core = order.core;
    if (!around_.loader.order({.ticket = ticket, .path = order.file, .parent = order.node, .content = std::move(order)})) {
        around_.inlines->ended(core, std::nullopt);  // it is ordered again
        return;
    }
    open_[ticket] = {.asker = {}, .edit = {.ticket = ticket, .undoable = false}, .isLoad = true, .content = core};
}

ServerActions RequestDesk::tell(const Open& open, const Expected<ApplicationAnswer>& outcome) {
    if (!open.content) return answer(open.asker, outcome);
    if (around_.inlines) around_.inlines->ended(open.content, outcome ? std::nullopt : std::optional(outcome.error().message));
    return {};
}

ServerActions RequestDesk::on(const Asker& asker, const request::GetStatus&, TimePoint) {
    const ServerSession& session = around_.session;
    const Simulation& simulation = around_.simulation;
    answer::Status status;
    status.wallName = around_.wall.name;
    status.epoch = around_.session.epoch();
    status.frame = session.nextFrame();
    status.sequence = simulation.sequence();
    status.stateHash = simulation.scene().stateHash();
    for (const ServerSession::HostStatus& host : session.hosts())
        status.hosts.push_back({.name = host.name,
                                .state = std::string(nameOf(host.state)),
                                .lastShown = host.lastShown,
                                .roundTripMs = toMilliseconds(host.roundTrip)});
    status.waitingFor = session.waitingFor();
    status.objects = simulation.scene().objectCount();
    status.nodes = simulation.nodeCount();
    status.undoDepth = simulation.history().undoDepth();
    status.redoDepth = simulation.history().redoDepth();
    status.applications = applications_.size();
    status.journal = around_.journal;
    if (const std::optional<Error> why = editsRefused()) status.journalTrouble = why->message;
    if (around_.describeWaits) around_.describeWaits(status);
    if (around_.describePrograms) status.programs = around_.describePrograms();
    if (around_.budget) {
        status.budgetMs = around_.budget->milliseconds();
        status.detail = around_.budget->step();
    }
    const answer::Trackers told = around_.describeTrackers ? around_.describeTrackers() : answer::Trackers();
    for (const TrackerInfo& tracker : told.trackers) status.trackers.push_back(lineOf(tracker));
    if (around_.steering && around_.steering->takesInput()) {
        status.navigation = std::string(nameOf(around_.steering->mode()));
        status.steering = around_.steering->active();
    }
    return answer(asker, ApplicationAnswer(std::move(status)));
}

ServerActions RequestDesk::on(const Asker& asker, const request::SetView& wish, TimePoint) {
    if (const std::optional<Error> why = editsRefused()) return refuse(asker, *why);
    return views_.ask(asker, wish.wish);
}

ServerActions RequestDesk::on(const Asker& asker, const request::ShowPicture& wish, TimePoint) {
    if (!around_.showing) return refuse(asker, {ErrorCode::kUnsupported, "this server shows its scene and nothing else"});
    *around_.showing = wish.showing;
    return answer(asker, answer::Done{});
}

ServerActions RequestDesk::on(const Asker& asker, const request::SetBudget& wish, TimePoint) {
    if (!around_.budget) return refuse(asker, {ErrorCode::kUnsupported, "this server draws all frames with all of their detail"});
    around_.budget->set(wish.milliseconds);
    return answer(asker, answer::Done{});
}

ServerActions RequestDesk::on(const Asker& asker, const request::NavigateView& wish, TimePoint now) {
    if (const std::optional<Error> why = editsRefused()) return refuse(asker, *why);
    if (!around_.steering) return refuse(asker, {ErrorCode::kRefused, "nobody flies here"});
    const Expected<void> done = around_.steering->asked(asker.connection.value, wish.wish, now);
    if (!done) return refuse(asker, done.error());
    return answer(asker, ApplicationAnswer(answer::Done{}));
}

ServerActions RequestDesk::on(const Asker& asker, const request::GetTrackers&, TimePoint) {
    return answer(asker, ApplicationAnswer(around_.describeTrackers ? around_.describeTrackers() : answer::Trackers()));
}

ServerActions RequestDesk::on(const Asker& asker, const request::GetImages&, TimePoint now) {
    return images_.ask(asker, now);
}
ServerActions RequestDesk::on(const Asker& asker, const request::GetContacts&, TimePoint) {
    return answer(asker, ApplicationAnswer(news_.contacts()));
}
ServerActions RequestDesk::on(const Asker& asker, const request::GetEvents&, TimePoint) {
    return answer(asker, ApplicationAnswer(news_.events()));
}
ServerActions RequestDesk::on(const Asker& asker, const request::GetDistances&, TimePoint) {
    return answer(asker, ApplicationAnswer(news_.distances()));
}
ServerActions RequestDesk::on(const Asker& asker, const request::GetQuestions&, TimePoint) {
    return answer(asker, ApplicationAnswer(news_.questions()));
}

ServerActions RequestDesk::on(const Asker& asker, const request::AnswerQuestion& decision, TimePoint) {
    const Expected<void> taken = news_.decide(decision.reply);
    if (!taken) return refuse(asker, taken.error());
    return answer(asker, ApplicationAnswer(answer::Done{}));
}

ServerActions RequestDesk::on(const Asker& asker, const request::SubscribeNews& wanted, TimePoint) {
    ServerActions actions = news_.subscribe(asker.connection, wanted.wanted);
    append(actions, answer(asker, ApplicationAnswer(answer::Done{})));
    return actions;
}

ServerActions RequestDesk::on(const Asker& asker, const request::GetObjects& wanted, TimePoint) {
    answer::Objects objects = describe(around_.simulation.scene(), wanted.wish);
    objects.sequence = around_.simulation.sequence();
    return answer(asker, ApplicationAnswer(std::move(objects)));
}

ServerActions RequestDesk::on(const Asker& asker, const request::GetTree& wanted, TimePoint) {
    Expected<answer::TreePage> page = treePage(around_.simulation.scene(), wanted.wish);
    if (!page) return refuse(asker, page.error());
    if (wanted.wish.coreType == typeOf<Movie>() && around_.filmLength)
        for (const TreeNode& told : page->nodes) {
            const ObjectId core = around_.simulation.scene().get<Node>(told.node)->core;
            if (const double seconds = around_.filmLength(core); seconds > 0) page->lengths.push_back({core, seconds});
        }
    page->sequence = around_.simulation.sequence();
    return answer(asker, ApplicationAnswer(std::move(*page)));
}

ServerActions RequestDesk::on(const Asker& asker, const request::MoveNode& wish, TimePoint now) {
    const std::uint64_t ticket = nextTicket_++;
    open_[ticket] = {.asker = asker,
                     .edit = {.ticket = ticket, .gesture = {asker.connection.value, wish.gesture}, .move = MoveWish{wish.node, wish.move}}};
    return queueEdit(ticket, {}, now);
}

ServerActions RequestDesk::on(const Asker& asker, const request::RemoveNode& wish, TimePoint now) {
    // Each node is taken from its place and destroyed: two changes at least.
    Expected<ChangeList> list = removalList(around_.simulation.scene(), wish.node, limits_.maxProposalChanges / 2);
    if (!list) return refuse(asker, list.error());
    if (list->changeCount() > limits_.maxProposalChanges)
        return refuse(asker,
                      {ErrorCode::kLimit,
                       fmt::format("it would take {} changes at once, and {} may be made; remove it part by part",
                                   list->changeCount(), limits_.maxProposalChanges)});
    const std::uint64_t ticket = nextTicket_++;
    const std::uint64_t removed = list->destructions.size();
    open_[ticket] = {.asker = asker, .edit = {.ticket = ticket, .list = std::move(*list)}, .removed = removed};
    return queueEdit(ticket, {}, now);
}

ServerActions RequestDesk::on(const Asker& asker, const request::CloneNode& request, TimePoint now) {
    const CloneWish& wish = request.wish;
    const Aspect& scene = around_.simulation.scene();
    CloneOptions options{.under = wish.under,
                         .name = wish.name,
                         .deep = wish.deep,
                         .shareTypes = wish.shareTypes,
                         .shareObjects = wish.shareObjects,
                         .maxChanges = around_.orderCopy ? std::min(kCopiedAtOnce, limits_.maxProposalChanges) : limits_.maxProposalChanges};
    Expected<Clone> clone = cloneList(scene, wish.node, options);
    if (!clone && clone.error().code == ErrorCode::kLimit && options.maxChanges < limits_.maxProposalChanges) {
        const std::uint64_t ticket = nextTicket_++;
        options.maxChanges = limits_.maxProposalChanges;
        open_[ticket] = {.asker = asker, .edit = {.ticket = ticket}, .isCopy = true};
        copies_.push_back({.ticket = ticket, .node = wish.node, .options = std::move(options)});
        orderCopy();
        return {};
    }
    if (!clone) return refuse(asker, clone.error());
    const std::uint64_t ticket = nextTicket_++;
    std::vector<Blob> named = blobsOf(clone->list);
    const std::size_t bytes = memoryWithoutArrays(clone->list);
    open_[ticket] = {.asker = asker, .edit = {.ticket = ticket, .list = std::move(clone->list)}, .created = clone->objects, .copy = clone->node, .bytes = bytes};
    return queueEdit(ticket, std::move(named), now);
}

/// One at a time: who joins, and what else that thread does, comes in between. And none while those that wait for frames hold much.
void RequestDesk::orderCopy() {
    while (!copies_.empty() && !open_.contains(copies_.front().ticket)) copies_.pop_front();
    if (copies_.empty() || copiedBytes_ >= limits_.maxOpenBytes || std::exchange(copying_, true)) return;
    around_.orderCopy(std::move(copies_.front()));
    copies_.pop_front();
}

ServerActions RequestDesk::copied(CopyMade made, TimePoint now) {
    copying_ = false;
    const auto found = open_.find(made.ticket);
    if (found == open_.end()) {
        std::ranges::move(made.parts.lists, std::back_inserter(dropped_));
        orderCopy();
        return {};
    }
    Open& open = found->second;
    if (!made.node) {
        ServerActions actions = tell(open, tl::unexpected(made.node.error()));
        close(found);
        return actions;
    }
    open.copy = *made.node;
    open.created = open.edit.objects = made.parts.objects;
    open.bytes = made.bytes;
    copiedBytes_ += made.bytes;
    orderCopy();
    open.parts = std::move(made.parts.lists);
    return queueEdit(made.ticket, std::move(made.named), now);
}

ServerActions RequestDesk::on(const Asker& asker, const request::FindNodes& wanted, TimePoint) {
    Expected<answer::FoundPage> page = foundPage(around_.simulation.scene(), wanted.wish);
    if (!page) return refuse(asker, page.error());
    page->sequence = around_.simulation.sequence();
    return answer(asker, ApplicationAnswer(std::move(*page)));
}

Expected<ChangeList> RequestDesk::listFrom(const request::ProposeChanges& proposal) {
    std::size_t bytes = 0;
    for (const ByteSlice& blob : proposal.blobs) bytes += blob.size();
    if (bytes > limits_.maxInlineArrayBytes)
        return fail(ErrorCode::kLimit, fmt::format("proposal: arrays of {} bytes beside its list; {} may be there, larger ones come before it in pieces", bytes, limits_.maxInlineArrayBytes));
    std::vector<Blob> uploads;  // keeps them findable until the list holds them
    for (const ByteSlice& blob : proposal.blobs) uploads.push_back(around_.blobs.add(Blob(Bytes(blob.begin(), blob.end()))));
    Expected<ChangeList> list =
        decodeChangeList(proposal.list, around_.blobs, AbsentBlobs::kRefuse,
                         {.maxBytes = limits_.maxProposalBytes, .maxChanges = limits_.maxProposalChanges});
    if (!list) return failWith("proposal", list.error());
    return list;
}

ServerActions RequestDesk::queueEdit(std::uint64_t ticket, std::vector<Blob> named, TimePoint now) {
    Open& open = open_.at(ticket);
    if (const std::optional<Error> why = editsRefused()) {
        ServerActions actions = tell(open, tl::unexpected(*why));
        std::ranges::move(open.parts, std::back_inserter(dropped_));
        close(open_.find(ticket));
        return actions;
    }
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
    open.announced = std::move(named);
    return around_.session.announceBlobs(ticket, std::move(infos), now);
}

ServerActions RequestDesk::blobsEverywhere(std::uint64_t token) {
    if (open_.contains(token)) ready_.push_back(token);
    return {};
}

ServerActions RequestDesk::loaded(LoadFinished finished, TimePoint now) {
    const auto found = open_.find(finished.ticket);
    if (found == open_.end()) return {};
    if (!finished.scene) {
        ServerActions actions = tell(found->second, tl::unexpected(finished.scene.error()));
        close(found);
        return actions;
    }
    ImportedScene& scene = *finished.scene;
    found->second.loaded = {.node = scene.top, .objects = scene.nodes + scene.cores, .triangles = scene.triangles};
    for (const std::string& note : scene.notes) {
        if (found->second.loaded.notes.size() == answer::Loaded::kMostNotes) break;
        found->second.loaded.notes.emplace_back(cutUtf8(note, kMostNoteBytes));
    }
    Open& open = found->second;
    open.edit.objects = finished.parts.objects;
    open.parts = std::move(finished.parts.lists);
    return queueEdit(finished.ticket, std::move(finished.arrays), now);
}

void RequestDesk::applicationLeft(ConnectionId connection) {
    applications_.erase(connection);
    news_.applicationLeft(connection);
    if (around_.steering) around_.steering->applicationLeft(connection.value);
    images_.applicationLeft(connection);
    views_.applicationLeft(connection);
    if (around_.uploads) around_.uploads->drop(connection);
    around_.drags.release(connection.value);
    // Edits on their way are carried out: they were asked for. Their answers go nowhere. Where those who come and go
    // leave too many behind, because no frame takes them, the newest do not count.
    const auto leftBehind = [&](const auto& entry) {
        return !entry.second.isLoad && entry.second.parts.empty() && !applications_.contains(entry.second.asker.connection);
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

std::map<std::uint64_t, RequestDesk::Open>::iterator RequestDesk::close(std::map<std::uint64_t, Open>::iterator open) {
    if (around_.uploads) {
        around_.uploads->letGo(std::move(open->second.announced));
        around_.uploads->handedOver(open->second.upload);
    }
    const bool isCopy = open->second.isCopy;
    if (isCopy) copiedBytes_ -= open->second.bytes;
    const auto next = open_.erase(open);
    if (isCopy) orderCopy();
    return next;
}

std::vector<Edit> RequestDesk::takeEdits() {
    std::vector<Edit> edits;
    std::vector<std::uint64_t> later;
    bool full = false;  // the others open another frame
    std::size_t changes = 0;
    for (const std::uint64_t ticket : std::exchange(ready_, {})) {
        Open& open = open_.at(ticket);
        const bool step = isStep(open.edit.kind);
        if (!open.parts.empty()) {
            loading_.push_back(ticket);
            continue;
        }
        if (step && (around_.simulation.stepUnderWay() || around_.simulation.appearing())) {  // it waits for that, and nobody waits for it
            later.push_back(ticket);
            continue;
        }
        // An undo may bring back what an edit of the same frame removes: it opens a frame of its own.
        full = full || (step && !edits.empty());
        // Nor do many large ones hold up a frame.
        changes += open.edit.move ? 1 : open.edit.list.changeCount();
        full = full || (!edits.empty() && changes > limits_.maxFrameChanges);
        if (full)
            later.push_back(ticket);
        else
            edits.push_back(std::move(open.edit));
    }
    ready_ = std::move(later);
    // Beside steps of undo there is nothing else in a frame.
    const bool noStep = std::ranges::none_of(edits, isStep, &Edit::kind);
    if (around_.steering && editsRefused()) around_.steering->letGoOfHandles();
    if (around_.steering && noStep) std::ranges::move(around_.steering->takeEdits(), std::back_inserter(edits));
    if (noStep)
        if (ChangeList held = around_.drags.corrections(around_.simulation.scene(), around_.simulation.manipulators()); !held.empty())
            edits.push_back({.ticket = kHeldTicket, .list = std::move(held), .undoable = false});
    takePart(edits);
    return edits;
}

/// One in a frame, and none beside a step, which may take several frames itself.
void RequestDesk::takePart(std::vector<Edit>& edits) {
    constexpr std::size_t kDroppedAtOnce = 8;
    dropped_.resize(dropped_.size() - std::min(dropped_.size(), kDroppedAtOnce));
    if (loading_.empty() || around_.simulation.stepUnderWay() || std::ranges::any_of(edits, isStep, &Edit::kind))
        return;
    Open& open = open_.at(loading_.front());
    Edit part = open.edit;
    part.list = std::move(open.parts[open.nextPart++]);
    const bool isLast = open.nextPart == open.parts.size();
    // What is one part only is an edit like others.
    if (open.parts.size() > 1) part.kind = isLast ? Edit::Kind::kLastPart : Edit::Kind::kPart;
    edits.push_back(std::move(part));
    if (isLast) loading_.pop_front();
}

ServerActions RequestDesk::committed(FrameResult frame, FrameNumber number,
                                     std::span<const std::uint64_t> openQuestions) {
    ServerActions actions;
    for (const EditOutcome& outcome : frame.outcomes) {
        const auto found = open_.find(outcome.ticket);
        if (found == open_.end() || outcome.underWay) continue;
        const bool morePartsFollow = found->second.nextPart < found->second.parts.size();
        if (morePartsFollow && outcome.result) continue;
        if (morePartsFollow) {
            std::erase(loading_, outcome.ticket);
            std::ranges::move(found->second.parts, std::back_inserter(dropped_));
        }
        append(actions, tell(found->second, outcomeOf(found->second, outcome, frame.commit.sent->sequence)));
        // Of an edit that was refused nobody holds the arrays any more: who joins could not fetch them.
        around_.session.forgetBlobs(outcome.ticket);
        close(found);
    }
    if (around_.uploads) around_.uploads->letGo(std::move(frame.unneeded));
    append(actions, news_.committed(std::move(frame.collision), number, openQuestions));
    return actions;
}

Expected<ApplicationAnswer> RequestDesk::outcomeOf(const Open& open, const EditOutcome& outcome,
                                                   Sequence sequence) const {
    if (!outcome.result) return tl::unexpected(outcome.result.error());
    if (!open.isLoad) {
        answer::Committed committed{.sequence = sequence, .stopped = outcome.stopped, .removed = open.removed, .created = open.created};
        if (open.parts.size() > 1)  // ids in a row
            committed.ids.emplace_back(open.copy, ObjectId(outcome.ids.front().second.value + (open.copy.value - outcome.ids.front().first.value)));
        else
            for (const auto& pair : outcome.ids)
                if (!open.copy || pair.first == open.copy) committed.ids.push_back(pair);
        return ApplicationAnswer(std::move(committed));
    }
    answer::Loaded loaded = open.loaded;
    const auto given = std::ranges::find(outcome.ids, loaded.node, &std::pair<ObjectId, ObjectId>::first);
    if (given != outcome.ids.end())
        loaded.node = given->second;
    else if (!outcome.ids.empty())  // of parts: ids in a row
        loaded.node =
            ObjectId(outcome.ids.front().second.value + (loaded.node.value - outcome.ids.front().first.value));
    return ApplicationAnswer(loaded);
}

}  // namespace tessera

#include "server/sim/RequestDesk.h"

#include <algorithm>
#include <set>

#include <fmt/format.h>

#include "common/codec/ChangeCodec.h"
#include "server/sim/CollisionAnswers.h"

namespace tessera {

RequestDesk::RequestDesk(const Wall& wall, BlobStore& blobs, Peers& peers, Simulation& simulation, ViewSource& view,
                         Loader& loader, Limits limits)
    : wall_(wall),
      blobs_(blobs),
      peers_(peers),
      simulation_(simulation),
      view_(view),
      loader_(loader),
      limits_(limits) {}

void RequestDesk::append(ServerActions& to, ServerActions more) {
    to.insert(to.end(), std::make_move_iterator(more.begin()), std::make_move_iterator(more.end()));
}

void RequestDesk::answerTo(ServerActions& actions, ConnectionId connection, std::uint64_t request,
                           const Expected<ApplicationAnswer>& answer) {
    message::Reply reply{.id = request, .code = {}, .error = {}, .body = {}};
    if (answer) {
        reply.body = encodeAnswer(*answer);
    } else {
        reply.code = answer.error().code;
        reply.error = answer.error().message;
    }
    append(actions, peers_.perform(peers_.session().reply(connection, std::move(reply))));
}

template <typename Subscribed, typename MakeNotice>
void RequestDesk::tell(ServerActions& actions, Subscribed subscribed, MakeNotice notice) {
    ByteSlice body;
    for (const auto& [connection, subscription] : subscriptions_) {
        if (!subscribed(subscription)) continue;
        if (body.empty()) body = encodeNotice(notice());
        append(actions, peers_.perform(peers_.session().notify(connection, {.body = body})));
    }
}

ServerActions RequestDesk::received(const server_action::RequestReceived& received, TimePoint now) {
    ServerActions actions;
    const auto refuse = [&](const Error& error) {
        answerTo(actions, received.connection, received.id, tl::unexpected(error));
        return actions;
    };
    const Expected<ApplicationRequest> decoded = decodeRequest(received.body);
    if (!decoded) return refuse(decoded.error());
    if (open_.size() + images_.size() >= limits_.maxOpenRequests)
        return refuse(
            {ErrorCode::kLimit, fmt::format("{} requests are open already; try again later", limits_.maxOpenRequests)});

    const auto respond = [&](const Expected<ApplicationAnswer>& answer) {
        answerTo(actions, received.connection, received.id, answer);
        return actions;
    };
    if (const auto* propose = std::get_if<request::Propose>(&*decoded)) {
        Expected<Edit> edit = editFrom(*propose);
        if (!edit) return refuse(edit.error());
        const std::uint64_t ticket = nextTicket_++;
        edit->ticket = ticket;
        open_[ticket] = {.connection = received.connection, .request = received.id, .edit = std::move(*edit)};
        return queueEdit(ticket, now);
    }
    if (std::holds_alternative<request::Undo>(*decoded)) {
        const std::uint64_t ticket = nextTicket_++;
        open_[ticket] = {
            .connection = received.connection, .request = received.id, .edit = {.ticket = ticket, .undo = true}};
        return queueEdit(ticket, now);
    }
    if (const auto* load = std::get_if<request::Load>(&*decoded)) {
        const ObjectId parent = load->parent ? load->parent : kRootNode;
        if (!simulation_.scene().get<Node>(parent))
            return refuse({ErrorCode::kNotFound, fmt::format("there is no node #{} to load below", parent.value)});
        const std::uint64_t ticket = nextTicket_++;
        if (!loader_.order({.ticket = ticket, .path = load->path, .parent = parent}))
            return refuse({ErrorCode::kLimit, "too many files wait to be loaded already"});
        open_[ticket] = {
            .connection = received.connection, .request = received.id, .edit = {.ticket = ticket}, .isLoad = true};
        return actions;
    }
    if (const auto* setView = std::get_if<request::SetView>(&*decoded)) {
        const Expected<void> set = view_.set(simulation_.scene(), *setView);
        if (!set) return refuse(set.error());
        return respond(ApplicationAnswer(answer::Done{}));
    }
    if (const auto* wish = std::get_if<request::Pick>(&*decoded))
        return respond(pick(received.connection, *wish, actions));
    if (std::holds_alternative<request::GetContacts>(*decoded))
        return respond(ApplicationAnswer(contactsOf(collision_, frame_, contactsBegun_)));
    if (std::holds_alternative<request::GetEvents>(*decoded))
        return respond(ApplicationAnswer(eventsOf(collision_, frame_, true, limits_.maxEventsTold)));
    if (std::holds_alternative<request::GetDistances>(*decoded))
        return respond(ApplicationAnswer(distancesOf(collision_, frame_, limits_.maxDistancesTold)));
    if (std::holds_alternative<request::GetQuestions>(*decoded))
        return respond(ApplicationAnswer(answer::Questions{.frame = frame_,
                                                           .questions = openQuestions(),
                                                           .closed = {},
                                                           .unanswered = collision_.counters.unanswered}));
    if (const auto* decision = std::get_if<request::Respond>(&*decoded)) return respond(decide(*decision));
    if (std::holds_alternative<request::GetImages>(*decoded)) return askForImages(received, now);
    if (const auto* subscribe = std::get_if<request::Subscribe>(&*decoded)) {
        append(actions, this->subscribe(received.connection, *subscribe));
        return respond(ApplicationAnswer(answer::Done{}));
    }
    return respond(answerNow(std::get<request::GetStatus>(*decoded)));
}

Expected<ApplicationAnswer> RequestDesk::answerNow(const request::GetStatus&) {
    const ServerSession& session = peers_.session();
    answer::Status status;
    status.wallName = wall_.name;
    status.epoch = peers_.epoch();
    status.frame = session.nextFrame();
    status.sequence = simulation_.sequence();
    status.stateHash = StateHash(simulation_.scene().stateHash());
    for (const ServerSession::HostStatus& host : session.hosts())
        status.hosts.push_back({.name = host.name,
                                .state = std::string(nameOf(host.state)),
                                .lastShown = host.lastShown,
                                .roundTripMs = toMilliseconds(host.roundTrip)});
    status.waitingFor = session.waitingFor();
    status.objects = simulation_.scene().objectCount();
    for (const ObjectId id : simulation_.scene().ids())
        if (simulation_.scene().get<Node>(id)) ++status.nodes;
    status.undoDepth = simulation_.undoDepth();
    status.applications = peers_.applicationCount();
    return ApplicationAnswer(std::move(status));
}

Expected<ApplicationAnswer> RequestDesk::pick(ConnectionId, const request::Pick& wish, ServerActions& actions) {
    const Expected<View> view = view_.view(simulation_.scene());
    if (!view) return tl::unexpected(view.error());
    const Expected<Ray> ray = pickRay(wall_, *view, wish.xPx, wish.yPx);
    if (!ray) return tl::unexpected(ray.error());
    answer::Picked picked{
        .hit = false, .node = {}, .face = 0, .point = Vec3d::Zero(), .xPx = wish.xPx, .yPx = wish.yPx};
    if (const std::optional<PickHit> hit = simulation_.pick(*ray)) {
        picked.hit = true;
        picked.node = hit->node;
        picked.face = hit->face;
        picked.point = hit->point;
    }
    tell(
        actions, [](const request::Subscribe& s) { return s.picks; }, [&] { return picked; });
    return ApplicationAnswer(picked);
}

Expected<Edit> RequestDesk::editFrom(const request::Propose& proposal) {
    std::size_t uploaded = 0;
    std::vector<Blob> uploads;  // keeps them findable until the list holds them
    for (const ByteSlice& bytes : proposal.blobs) {
        uploaded += bytes.size();
        if (uploaded > limits_.maxUploadBytes)
            return fail(ErrorCode::kLimit,
                        fmt::format("a proposal may bring {} MiB of blobs at most", limits_.maxUploadBytes >> 20));
        uploads.push_back(blobs_.add(Blob(Bytes(bytes.begin(), bytes.end()))));
    }
    Expected<ChangeList> list =
        decodeChangeList(proposal.list, blobs_, AbsentBlobs::kRefuse,
                         {.maxBytes = limits_.maxProposalBytes, .maxChanges = limits_.maxProposalChanges});
    if (!list) return failWith("proposal", list.error());
    Edit edit;
    edit.list = std::move(*list);
    return edit;
}

ServerActions RequestDesk::queueEdit(std::uint64_t ticket, TimePoint now) {
    Open& open = open_.at(ticket);
    std::vector<Blob> named;
    if (open.edit.undo) {
        if (simulation_.undoDepth() > 0) named = blobsOf(simulation_.newestInverse());
    } else {
        named = blobsOf(open.edit.list);
    }
    if (named.empty()) {
        ready_.push_back(ticket);
        return {};
    }
    std::vector<BlobInfo> infos;
    for (const Blob& blob : named) {
        blobs_.add(blob);  // to be handed out before the commit; the waiting edit (or the undo stack) keeps it alive
        infos.push_back({blob.id(), blob.sizeBytes()});
    }
    return peers_.perform(peers_.session().announceBlobs(ticket, std::move(infos), now));
}

ServerActions RequestDesk::blobsEverywhere(std::uint64_t token) {
    if (open_.contains(token)) ready_.push_back(token);
    return {};
}

ServerActions RequestDesk::loaded(LoadFinished finished, TimePoint now) {
    const auto found = open_.find(finished.ticket);
    if (found == open_.end()) return {};
    ServerActions actions;
    if (!finished.scene) {
        answerTo(actions, found->second.connection, found->second.request, tl::unexpected(finished.scene.error()));
        open_.erase(found);
        return actions;
    }
    ImportedScene& scene = *finished.scene;
    found->second.loaded = {.node = scene.top, .objects = scene.nodes + scene.cores, .triangles = scene.triangles};
    found->second.edit.list = std::move(scene.list);
    return queueEdit(finished.ticket, now);
}

ServerActions RequestDesk::askForImages(const server_action::RequestReceived& received, TimePoint now) {
    OpenImages images{.connection = received.connection,
                      .request = received.id,
                      .deadline = now + limits_.imageDeadline,
                      .awaited = {},
                      .answer = {}};
    std::set<std::string> live;
    for (const ServerSession::HostStatus& host : peers_.session().hosts())
        if (host.state == HostState::kLive || host.state == HostState::kLate) live.insert(host.name);
    for (const Tile& tile : layoutTiles(wall_))
        (live.contains(tile.host) ? images.awaited : images.answer.missing).push_back(tile.name);
    const std::uint64_t ticket = nextTicket_++;
    const auto [it, isNew] = images_.emplace(ticket, std::move(images));
    if (it->second.awaited.empty()) return finishImages(it);
    // The next frame to begin: on each host's control connection the question comes before that frame's Begin.
    return peers_.perform(peers_.session().requestImages(ticket, peers_.session().nextFrame()));
}

ServerActions RequestDesk::imageReceived(const server_action::ImageReceived& received) {
    const auto images = images_.find(received.image.request);
    if (images == images_.end()) return {};
    const auto tile = std::ranges::find(images->second.awaited, received.image.tile);
    if (tile == images->second.awaited.end()) return {};
    images->second.awaited.erase(tile);
    images->second.answer.tiles.push_back(
        {.tile = received.image.tile, .host = received.host, .frame = received.image.frame, .png = received.image.png});
    return images->second.awaited.empty() ? finishImages(images) : ServerActions{};
}

ServerActions RequestDesk::finishImages(std::map<std::uint64_t, OpenImages>::iterator images) {
    ServerActions actions;
    OpenImages done = std::move(images->second);
    images_.erase(images);
    done.answer.missing.insert(done.answer.missing.end(), done.awaited.begin(), done.awaited.end());
    answerTo(actions, done.connection, done.request, ApplicationAnswer(std::move(done.answer)));
    return actions;
}

ServerActions RequestDesk::advance(TimePoint now) {
    ServerActions actions;
    for (auto it = images_.begin(); it != images_.end();) {
        const auto next = std::next(it);
        if (it->second.deadline <= now) append(actions, finishImages(it));
        it = next;
    }
    return actions;
}

TimePoint RequestDesk::nextDeadline() const {
    TimePoint next = TimePoint::max();
    for (const auto& [ticket, images] : images_) next = std::min(next, images.deadline);
    return next;
}

void RequestDesk::applicationLeft(ConnectionId connection) {
    subscriptions_.erase(connection);
    std::erase_if(images_, [&](const auto& entry) { return entry.second.connection == connection; });
    // Edits on their way are carried out: they were asked for. Their answers go nowhere.
}

std::vector<Edit> RequestDesk::takeEdits() {
    std::vector<Edit> edits;
    std::vector<std::uint64_t> later;
    for (const std::uint64_t ticket : ready_) {
        Open& open = open_.at(ticket);
        // An undo may bring back what an edit of the same frame removes: it opens a frame of its own.
        if (!later.empty() || (open.edit.undo && !edits.empty())) {
            later.push_back(ticket);
            continue;
        }
        edits.push_back(std::move(open.edit));
    }
    ready_ = std::move(later);
    return edits;
}

ServerActions RequestDesk::committed(const FrameResult& frame, FrameNumber number,
                                     std::span<const std::uint64_t> openQuestions) {
    ServerActions actions;
    for (const EditOutcome& outcome : frame.outcomes) {
        const auto found = open_.find(outcome.ticket);
        if (found == open_.end()) continue;
        const Open& open = found->second;
        if (!outcome.result) {
            answerTo(actions, open.connection, open.request, tl::unexpected(outcome.result.error()));
        } else if (open.isLoad) {
            answer::Loaded loaded = open.loaded;
            const auto given = std::ranges::find(outcome.ids, loaded.node, &std::pair<ObjectId, ObjectId>::first);
            if (given != outcome.ids.end()) loaded.node = given->second;
            answerTo(actions, open.connection, open.request, ApplicationAnswer(loaded));
        } else {
            answerTo(actions, open.connection, open.request,
                     ApplicationAnswer(answer::Committed{
                         .sequence = frame.commit.sent->sequence, .ids = outcome.ids, .stopped = outcome.stopped}));
        }
        open_.erase(found);
    }
    frame_ = number;
    contactsBegun_ += frame.collision.contactsBegun;
    collision_.contacts = frame.collision.contacts;
    collision_.events = frame.collision.events;
    collision_.distances = frame.collision.distances;
    collision_.questions = frame.collision.questions;
    collision_.counters = frame.collision.counters;
    tellOfCollisions(actions, questions_.frameDone(frame.collision.questions, openQuestions));
    return actions;
}

void RequestDesk::tellOfCollisions(ServerActions& actions, std::span<const std::uint64_t> closedQuestions) {
    using Subscription = request::Subscribe;
    tell(
        actions, [](const Subscription& s) { return s.contacts; },
        [&] { return contactsOf(collision_, frame_, contactsBegun_); });
    for (const bool stays : {false, true})
        tell(
            actions, [&](const Subscription& s) { return s.events && s.stays == stays; },
            [&] { return eventsOf(collision_, frame_, stays, limits_.maxEventsTold); });
    tell(
        actions, [](const Subscription& s) { return s.distances; },
        [&] { return distancesOf(collision_, frame_, limits_.maxDistancesTold); });
    if (collision_.questions.empty() && closedQuestions.empty()) return;
    tell(
        actions, [](const Subscription& s) { return s.questions; },
        [&] {
            answer::Questions told{.frame = frame_,
                                   .questions = {},
                                   .closed = {closedQuestions.begin(), closedQuestions.end()},
                                   .unanswered = collision_.counters.unanswered};
            for (const Question& question : collision_.questions) told.questions.push_back(valueOf(question));
            return told;
        });
}

ServerActions RequestDesk::subscribe(ConnectionId connection, const request::Subscribe& wanted) {
    request::Subscribe& subscription = subscriptions_[connection];
    const bool newToQuestions = wanted.questions && !subscription.questions;
    subscription = wanted;
    if (!newToQuestions || questions_.unanswered().empty()) return {};
    const ApplicationNotice open =
        answer::Questions{.frame = frame_, .questions = openQuestions(), .closed = {}, .unanswered = 0};
    return peers_.perform(peers_.session().notify(connection, {.body = encodeNotice(open)}));
}

Expected<ApplicationAnswer> RequestDesk::decide(const request::Respond& decision) {
    const auto word = [&] {
        switch (decision.decision) {
            case request::Respond::Decision::kPass:
                return Reply::Decision::kPass;
            case request::Respond::Decision::kMove:
                return Reply::Decision::kMove;
            case request::Respond::Decision::kStop:
                break;
        }
        return Reply::Decision::kStop;
    };
    const Expected<void> taken =
        questions_.answer({.question = decision.question, .decision = word(), .pose = decision.pose});
    if (!taken) return tl::unexpected(taken.error());
    return ApplicationAnswer(answer::Done{});
}

std::vector<QuestionValue> RequestDesk::openQuestions() const {
    std::vector<QuestionValue> values;
    for (const Question& question : questions_.unanswered()) values.push_back(valueOf(question));
    return values;
}

ServerActions RequestDesk::frameReleased(const server_action::FrameReleased& release) {
    ServerActions actions;
    tell(
        actions, [](const request::Subscribe& s) { return s.frames; },
        [&] { return notice::Frame{.frame = release.frame, .shown = release.shown, .held = release.held}; });
    return actions;
}

}  // namespace tessera

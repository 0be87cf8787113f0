#include "client/replica/ServerLink.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <deque>

#include "common/base/ThreadPriority.h"
#include "common/codec/MessageCodec.h"
#include "common/codec/SnapshotCodec.h"
#include "common/scene/FieldTable.h"

namespace tessera {
namespace {

using namespace std::chrono_literals;

}  // namespace

ServerLink::ServerLink(ServerLinkOptions options, BlobShelf& blobs, DiskCache* cache, SharedArrays* arrays,
                       Channel<Event>& events, WorkQueue& work, Log& log)
    : options_(std::move(options)),
      blobs_(blobs),
      cache_(cache),
      arrays_(arrays),
      events_(events),
      work_(work),
      log_(log),
      pause_(options_.firstPause) {
    TransportLimits limits;
    limits.maxPayload = maxPayloadBytes;
    limits.tls = options_.keys;
    // Where this one is away, that thread wakes it.
    if (options_.ahead) limits.onThread = [] { (void)tessera::askToRunAhead(Urgency::kShowing); };
    transport_ =
        options_.platform.transport(std::move(limits), [this](LinkEvent event) { events_.push(std::move(event)); });
}

HostEnd ServerLink::run() {
    begin();
    while (!over()) turn();
    return finish();
}

void ServerLink::begin() {
    if (options_.ahead) askToRunAhead();
    dial();
}

void ServerLink::turn() {
    const Duration idle = std::clamp<Duration>(nextDeadline() - options_.platform.now(), 0ns, 1s);
    if (auto event = nextEvent(idle)) std::visit([this](auto&& e) { on(std::move(e)); }, std::move(*event));
    for (; !doneHere_.empty(); doneHere_.pop_front()) on(Outcome(std::move(doneHere_.front())));
    const TimePoint now = options_.platform.now();
    if (session_ && now >= session_->nextDeadline()) carryOut(session_->advance(now));
    if (dialAt_ && now >= *dialAt_) dial();
    if (arrays_) arrays_->step(now);
    sendInput(now);
    tellService(now);
    if (end_ && now >= giveUpAt_ && !drawThreadEnded_) {
        log_.error("the draw thread does not finish; giving it up");
        end_ = HostEnd{.error = {ErrorCode::kFailed, "the draw thread did not finish"}};
        givenUp_ = true;
    }
}

HostEnd ServerLink::finish() {
    // The transport's thread may wait for room in the channel.
    events_.close();
    transport_->end();
    return *end_;
}

void ServerLink::tellService(TimePoint now) {
    if (!options_.service) return;
    const std::uint64_t steps = options_.drawSteps ? options_.drawSteps->load(std::memory_order_relaxed) : 0;
    const bool works = work_.idle() || std::exchange(stepsSeen_, steps) != steps;
    options_.service->turned(now, works, [&] { return describe(now); });
}

std::string ServerLink::describe(TimePoint now) {
    const std::string server = toString(options_.server);
    if (end_) return "ends";
    if (!welcomed_ && lastReason_.empty()) return fmt::format("dials {}", server);
    if (!welcomed_) return fmt::format("dials {}: {}", server, lastReason_);
    return fmt::format("joined {}: {}", server, pace_.text(now));
}

void ServerLink::askToRunAhead() {
    const PriorityAnswer answer = tessera::askToRunAhead(Urgency::kShowing);
    if (answer.refused.empty()) return;
    log_.detail(fmt::format(
        "pictures are shown by a thread that {} (refused: {}); beside other load it may be late. CAP_SYS_NICE, or "
        "`rtprio 1` in /etc/security/limits.conf, puts it before all that draws",
        answer.got.empty() ? "runs like any other" : "has " + answer.got, answer.refused));
}

void ServerLink::tell(Outcome outcome) {
    if (events_.push(std::move(outcome))) transport_->wake();
}

/// Nobody else needs to be woken for what the network brings while this thread waits.
std::optional<ServerLink::Event> ServerLink::nextEvent(Duration wait) {
    std::optional<Event> event = events_.tryPop();
    if (event || wait <= Duration::zero()) return event;
    return transport_->attend(options_.platform.now() + wait) ? events_.tryPop() : events_.popFor(wait);
}

TimePoint ServerLink::nextDeadline() const {
    TimePoint next = TimePoint::max();
    if (session_) next = std::min(next, session_->nextDeadline());
    if (dialAt_) next = std::min(next, *dialAt_);
    if (arrays_) next = std::min(next, arrays_->nextStep());
    if (welcomed_ && !unsaid_.empty()) next = std::min(next, inputSaidAt_ + options_.inputEvery);
    if (end_) next = std::min(next, giveUpAt_);
    return next == TimePoint::max() ? options_.platform.now() + 1s : next;
}

void ServerLink::dial() {
    dialAt_.reset();
    ++attempt_.value;
    session_ = std::make_unique<ClientSession>(ClientSessionConfig{
        .name = options_.name,
        .role = PeerRole::kHost,
        .schema = schemaHash(),
        .pixelProbe = options_.pixelProbe,
        .seenEpoch = seenEpoch_,
        .machine = options_.machine,
        .board = options_.board,
        .access = options_.access,
        .openContent = decodeSnapshot,
        .elsewhere = elsewhere(),
        .place = place(),
        .firstShare = options_.firstShare < 0 ? static_cast<double>(::getpid() % 64) / 64 : options_.firstShare});
    session_->resume(std::exchange(fetchedParts_, {}));
    blobs_.forEach([this](const Blob& blob) { session_->holdBlob(blob.id()); });
    links_[ChannelKind::kControl] = transport_->connect(options_.server, options_.connectTimeout);
}

std::optional<ChannelKind> ServerLink::channelOf(LinkId link) const {
    for (const auto& [channel, id] : links_)
        if (id == link) return channel;
    return std::nullopt;
}

void ServerLink::on(const LinkEvent& event) {
    const LinkId link = linkOf(event);
    // Events of links that are hung up already still come.
    const std::optional<ChannelKind> channel = channelOf(link);
    if (!channel || !session_) return;
    if (const auto* opened = std::get_if<link_event::Opened>(&event.what)) {
        carryOut(session_->channelOpened(*channel, event.at, opened->peer));
    } else if (const auto* received = std::get_if<link_event::Received>(&event.what)) {
        const Expected<Message> message = decodeMessage(received->type, received->payload);
        carryOut(message ? session_->received(*channel, received->epoch, *message, event.at)
                         : session_->malformed(*channel, message.error().message));
    } else if (std::holds_alternative<link_event::Heard>(event.what)) {
        session_->heard(*channel, event.at);
    } else if (const auto* closed = std::get_if<link_event::Closed>(&event.what)) {
        links_.erase(*channel);
        if (*channel == ChannelKind::kControl && closed->code == ErrorCode::kRefused)
            noWayIn({ErrorCode::kNetwork, closed->reason});
        else if (*channel == ChannelKind::kControl)
            retryLater(closed->reason.empty() ? "the connection closed" : closed->reason);
        else
            carryOut(session_->channelClosed(*channel, event.at));
    }
}

void ServerLink::on(Outcome outcome) {
    if (std::holds_alternative<outcome::Ended>(outcome.what)) {
        drawThreadEnded_ = true;
        if (!end_) end({.error = {ErrorCode::kFailed, "the draw thread ended"}});
    } else if (const auto* broken = std::get_if<outcome::Broken>(&outcome.what)) {
        // A host that cannot draw leaves at once: the server then knows what a silent tile would not tell.
        hangUp("cannot draw");
        if (end_ && end_->over) end_ = HostEnd{.error = broken->error};  // it was to write its last pictures
        end({.error = broken->error});
    } else if (std::holds_alternative<outcome::Called>(outcome.what)) {
        if (!end_) give(work::Help{});
    } else if (const auto* input = std::get_if<outcome::Input>(&outcome.what)) {
        take(input->state);
    } else if (session_ && outcome.attempt == attempt_) {
        answer(std::move(outcome));
    }
}

void ServerLink::take(const InputState& state) {
    inputs_[state.source] = state;
    unsaid_.insert(state.source);
}

void ServerLink::sendInput(TimePoint now) {
    const auto link = links_.find(ChannelKind::kControl);
    if (!welcomed_ || unsaid_.empty() || link == links_.end() || now < inputSaidAt_ + options_.inputEvery) return;
    message::Input input;
    for (const std::uint32_t source : std::exchange(unsaid_, {})) input.states.push_back(inputs_.at(source));
    inputSaidAt_ = now;
    carryOut(client_action::Send{ChannelKind::kControl, std::move(input)});
}

void ServerLink::answer(Outcome outcome) {
    if (const auto* applied = std::get_if<outcome::Applied>(&outcome.what)) {
        carryOut(session_->applied(applied->sequence, applied->stateHash));
    } else if (const auto* failed = std::get_if<outcome::ApplyFailed>(&outcome.what)) {
        carryOut(session_->applyFailed(failed->reason));
    } else if (auto* drawn = std::get_if<outcome::Drawn>(&outcome.what)) {
        drawn_ = std::move(drawn->pictures);
        carryOut(session_->drawn(drawn->frame, drawn->stateHash, drawn->stats));
    } else if (const auto* shown = std::get_if<outcome::Shown>(&outcome.what)) {
        carryOut(session_->shown(shown->frame, shown->at));
    } else if (const auto* described = std::get_if<outcome::Described>(&outcome.what)) {
        carryOut(session_->hashes(described->answer));
    } else if (const auto* image = std::get_if<outcome::Image>(&outcome.what)) {
        carryOut(session_->image(image->image));
    }
    blobs_.trim([this](const BlobId& id) {
        if (session_) session_->dropBlob(id);
    });
}

void ServerLink::carryOut(ClientActions actions) {
    for (ClientAction& action : actions) {
        if (!session_) return;  // hung up meanwhile
        std::visit([this](auto& what) { carryOut(std::move(what)); }, action);
    }
}

void ServerLink::carryOut(client_action::Send&& send) {
    const auto link = links_.find(send.channel);
    if (link != links_.end())
        transport_->send(link->second, wireType(send.message), session_->epoch(), share(encodeMessage(send.message)));
}

void ServerLink::carryOut(client_action::OpenBulk&&) {
    links_[ChannelKind::kBulk] = transport_->connect(options_.server, options_.connectTimeout);
}

void ServerLink::carryOut(client_action::Configured&& configured) {
    seenEpoch_ = std::max(seenEpoch_, configured.epoch);
    pause_ = options_.firstPause;
    lastReason_.clear();
    // While the session thread hashes or decodes much, the network speaks for it.
    const Message life = message::Heartbeat{};
    transport_->keepAlive(links_.at(ChannelKind::kControl), configured.heartbeat, wireType(life), configured.epoch,
                          share(encodeMessage(life)));
    log_.detail(fmt::format("joined the server at {} (epoch {})", toString(options_.server), configured.epoch.value));
    give(std::move(configured));
    // A server that has not heard of these windows begins with how they are now.
    welcomed_ = true;
    for (const auto& [source, state] : inputs_) unsaid_.insert(source);
}

void ServerLink::carryOut(client_action::StoreBlob&& stored) {
    // In memory that an edit of a few bytes does not copy, wherever it lies.
    const Blob blob = (arrays_ ? arrays_->share(std::move(stored.blob)) : std::move(stored.blob)).paged();
    blobs_.put(blob);
    if (cache_) cache_->store(blob);
}

std::function<Blob(const BlobInfo&)> ServerLink::elsewhere() {
    if (!arrays_) return nullptr;
    return [this](const BlobInfo& wanted) { return arrays_->find(wanted); };
}

std::function<std::unique_ptr<BlobPlace>(const BlobInfo&)> ServerLink::place() {
    if (!arrays_) return nullptr;
    return [this](const BlobInfo& comes) { return arrays_->place(comes); };
}

void ServerLink::carryOut(client_action::Disconnect&& broken) {
    if (broken.retry) return retryLater(broken.reason);
    noWayIn({broken.code, broken.reason});
}

void ServerLink::noWayIn(const Error& why) {
    hangUp("refused");
    end({.error = {why.code,
                   fmt::format("no way in at the server at {}: {}", toString(options_.server), why.message)}});
}

void ServerLink::carryOut(client_action::Finish&& finished) {
    hangUp("over");
    log_.detail(fmt::format("over: {}", finished.reason));
    end({.over = true});
}

/// Of the frame drawn last: the session lets no other one through. Whatever the draw thread is at: it hears of it with
/// its next piece of work.
void ServerLink::carryOut(client_action::Show&& show) {
    if (options_.showsNothingFrom && show.frame >= *options_.showsNothingFrom)
        return log_.warning(fmt::format("frame {}: it is not shown, as --inject asks for", show.frame.value));
    if (auto shown = ReadyFrame::show(std::exchange(drawn_, {})); !shown) {
        doneHere_.push_back({attempt_, outcome::Broken{shown.error()}});
        return;
    }
    pace_.shown(show.frame.value);
    doneHere_.push_back({attempt_, outcome::Shown{show.frame, options_.platform.now()}});
    give(work::Shown{show.frame});
}

void ServerLink::hangUp(const std::string& reason) {
    welcomed_ = false;
    drawn_.clear();
    for (const auto& [channel, link] : links_) transport_->close(link, reason);
    links_.clear();
    if (session_) fetchedParts_ = session_->takeParts();
    session_.reset();
}

void ServerLink::retryLater(const std::string& reason) {
    hangUp("");
    if (end_) return;
    if (reason != lastReason_)
        log_.warning(fmt::format("{}; dialling {} again until the server answers or says that it is over", reason,
                                 toString(options_.server)));
    lastReason_ = reason;
    dialAt_ = options_.platform.now() + pause_;
    pause_ = std::min(2 * pause_, options_.longestPause);
}

void ServerLink::end(HostEnd end) {
    if (end_) return;
    end_ = std::move(end);
    dialAt_.reset();
    giveUpAt_ = options_.platform.now() + options_.finishDeadline;
    give(work::Finish{});
    work_.close();
}

void ServerLink::give(decltype(Work::what) what) {
    Work work{attempt_, std::move(what)};
    if (options_.atOnce && work_.idle())
        if (std::optional<Outcome> outcome = options_.atOnce(work)) {
            doneHere_.push_back(std::move(*outcome));
            return;
        }
    // Steps come one at a time and images are few: a full channel means a draw thread that hangs, and then nothing that
    // it does not get is missed.
    (void)work_.tryPush(std::move(work));
}

}  // namespace tessera

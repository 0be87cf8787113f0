#include "server/sim/FrameLoop.h"

#include <algorithm>
#include <variant>

#include <fmt/format.h>

#include "common/base/ThreadPriority.h"
#include "server/sim/FrameLoopParts.h"
#include "server/sim/navigation/WandInput.h"
#include "server/sim/report/ReportFile.h"
#include "server/sim/view/AnimatedBounds.h"

namespace tessera {

namespace {

using namespace std::chrono_literals;
constexpr std::size_t kMostInARow = 256;  ///< of what hosts say, before anybody else has a turn
/// Of what applications say, before the network is looked at again: the word of a host may be there.
constexpr Duration kLongestInARow = 500us;
constexpr Duration kLongestWait = 100ms, kFarewell = 5s, kGoodbyeTurn = 20ms;
constexpr Duration kFarewellToOthers = 1s;  ///< applications that do not listen keep nobody waiting

}  // namespace

FrameLoop::FrameLoop(ServerOptions options, Log& log) : impl_(std::make_unique<Impl>(std::move(options), log)) {}
FrameLoop::~FrameLoop() = default;
Expected<void> FrameLoop::run() {
    if (Expected<void> begun = begin(); !begun) return begun;
    while (!over())
        if (Expected<void> turned = turn(); !turned) return turned;
    return end();
}
Expected<void> FrameLoop::begin() {
    Expected<void> begun = impl_->begin();
    return begun ? begun : impl_->failed(std::move(begun));
}
Expected<void> FrameLoop::turn() {
    return impl_->step();
}
bool FrameLoop::over() const {
    return impl_->phase == Impl::Phase::kOver;
}
TimePoint FrameLoop::nextWake() const {
    return impl_->nextWake(impl_->now());
}
Expected<void> FrameLoop::end() {
    return impl_->end();
}
void FrameLoop::stop() {
    impl_->stopping = true;
    impl_->peers.wake();
}

void FrameLoop::renewAccess(AccessTokens access) {
    impl_->deliver(AccessRenewed{std::move(access)});
}

/// An end by an error is one in order for the journal: the next start goes on with the very next numbers.
Expected<void> FrameLoop::Impl::failed(Expected<void> why) {
    if (journal()) journal()->ends(peers.session().nextFrame());
    phase = Phase::kOver;
    return why;
}

Expected<void> FrameLoop::Impl::step() {
    if (phase == Phase::kGoodbye) return sayGoodbye(), Expected<void>();
    if (phase == Phase::kFrames && !(stopping && !pacing.frameOpen()) && !allFramesShown()) {
        Expected<void> turned = turn();
        if (turned) return turned;
        actions.carryOut(peers.session().finish(turned.error().message));
        return failed(std::move(turned));
    }
    if (options.service) options.service->stopping();
    phase = Phase::kGoodbye;
    goodbyeUntil = othersUntil = now() + kFarewell;
    return {};
}

Expected<void> FrameLoop::Impl::begin() {
    if (!opened) return tl::unexpected(opened.error());
    Address bound = options.listen;
    const Expected<std::uint16_t> port = peers.listen(options.listen, [&](std::uint16_t ours) {
        bound.port = ours;
        if (options.onBound) options.onBound(bound);
    });
    if (!port) return tl::unexpected(port.error());
    if (const Expected<void> heard = trackers.open(); !heard) return heard;
    // (Numbers that are skipped are not made again by who repeats it either.)
    if (!options.recordPath.empty() && (opened->state.begun || opened->behind))
        return fail(
            ErrorCode::kUsage,
            fmt::format("--record {}: a recording begins with the files of --scene; the journal {} goes on without "
                        "them. Leave one of the two away",
                        options.recordPath, options.journalPath));
    if (!options.recordPath.empty())
        if (Expected<void> begun = maker.record(options.recordPath, options.threads); !begun) return begun;
    if (const std::string refused = AheadForNow::refusal(); !refused.empty())
        log.detail(fmt::format(
            "frames are released by a thread that runs like any other (refused: {}); beside other load they may reach "
            "hosts one by one. CAP_SYS_NICE, or `rtprio {}` in /etc/security/limits.conf, lets it say so without a "
            "pause",
            refused, static_cast<int>(Urgency::kReleasing)));
    actions.carryOut(marks.announce(now()));
    if (options.onListening) options.onListening(bound);
    if (opened->state.begun) return goOnFromJournal();
    simulation.skipNumbers(opened->nextId, opened->behind);
    startScene.idsFrom(opened->nextId);
    // Whoever joins stands where the lists that come go on, though nothing is there yet.
    snapshots.follow(
        {.sent = share(CommittedList{.sequence = simulation.sequence(), .stateHash = simulation.scene().stateHash()}),
         .list = std::make_shared<const ChangeList>()});
    if (startScene.empty()) sceneIsThere();
    return startScene.order(loader, RequestDesk::kStartScene);
}

Expected<void> FrameLoop::Impl::goOnFromJournal() {
    const JournalState& state = opened->state;
    log.info(fmt::format("journal {}: goes on with frame {} from list {}, state {}; what --scene says is in it already",
                         journal()->folder(), state.nextFrame.value, state.sequence.value,
                         toHex(state.scene.stateHash())));
    if (const Expected<void> there = maker.goOnFrom(*opened); !there) return there;
    sceneIsThere();
    if (options.reload) desk.findAgain(state.sceneFiles(), options.placing, state.placing());
    return {};
}

ServerActions FrameLoop::Impl::untilWritten(ServerActions told) {
    if (!journal()) return told;
    return gate.pass(std::move(told), journal()->handed());
}

void FrameLoop::Impl::openGate() {
    if (!gate.awaited()) return;
    actions.carryOut(gate.open(journal()->written(), trouble()));
    if (const std::optional<std::uint64_t> written = gate.awaited()) journal()->tellWhen(*written);
}

/// Waits for what happens next. Hosts, whom frames wait for, are heard first; then frames and deadlines are due; what
/// applications and strangers say is for the time that is left, one message of each in turn, and at least one a frame.
Expected<void> FrameLoop::Impl::turn() {
    await(nextWake(now()));
    if (sceneReady && !actorsReady) actorsReady = maker.ready(now());
    const TimePoint until = std::min(now() + kLongestInARow, peers.session().nextDeadline());
    for (;;) {
        for (std::size_t count = 0; count < kMostInARow; ++count) {
            const Expected<bool> served = serve(Inbox::Rank::kFirst);
            if (!served) return tl::unexpected(served.error());
            if (!*served) break;
        }
        if (const TimePoint now = this->now(); stopping || now >= until || (othersServed && frameIsDue(now))) break;
        const Expected<bool> served = serve(Inbox::Rank::kOther);
        if (!served) return tl::unexpected(served.error());
        if (!*served) break;
        othersServed = true;
    }
    lookAtTheClock(now());
    if (const TimePoint now = this->now(); frameIsDue(now)) makeFrame(now);
    openGate();
    if (const TimePoint now = this->now(); options.service)
        options.service->turned(now, true, [&] { return serviceStatus(now); });
    return {};
}

/// Nobody else needs to be woken for what the network brings while this thread waits.
void FrameLoop::Impl::await(TimePoint until) {
    const TimePoint now = this->now();
    if (inbox.any(Inbox::Rank::kFirst) || inbox.any(Inbox::Rank::kOther, mayServe)) until = now;
    if (!peers.attend(until) && until > now) inbox.waitForNews(until - now);
}

/// One event; false where there is none.
Expected<bool> FrameLoop::Impl::serve(Inbox::Rank rank) {
    auto next = rank == Inbox::Rank::kFirst ? inbox.tryPop(rank) : inbox.tryPop(rank, mayServe);
    if (!next) return false;
    const bool closed = [&] {
        const auto* link = std::get_if<LinkEvent>(&next->second);
        return link && std::holds_alternative<link_event::Closed>(link->what);
    }();
    Expected<void> taken = std::visit([&](auto&& what) { return take(std::move(what)); }, std::move(next->second));
    if (!taken) return tl::unexpected(taken.error());
    if (closed)
        inbox.forget(next->first);
    else if (rank == Inbox::Rank::kOther && peers.isHost(LinkId{next->first}))
        inbox.setRank(next->first, Inbox::Rank::kFirst);
    return true;
}

void FrameLoop::Impl::lookAtTheClock(TimePoint now) {
    for (const Inbox::Rank rank : {Inbox::Rank::kFirst, Inbox::Rank::kOther})
        for (const Inbox::Source source : inbox.waiting(rank)) peers.waits(LinkId{source}, now);
    actions.carryOut(peers.advance(now));
    actions.carryOut(desk.advance(now));
    saySlowLoads(now);
}

void FrameLoop::Impl::saySlowLoads(TimePoint now) {
    constexpr std::chrono::seconds kEvery{5};
    if (now < loadsSaid + kEvery) return;
    loadsSaid = now;
    for (const Loader::UnderWay& one : loader.underWay())
        if (now >= one.since + kEvery)
            log.info(fmt::format("{}: {}, for {:.0f} s so far", one.path, inWords(one.watch->progress()),
                                 toMilliseconds(now - one.since) / 1000));
}

Expected<void> FrameLoop::Impl::end() {
    if (journal()) {
        journal()->ends(peers.session().nextFrame());
        report.journal(journal()->folder(), journal()->writtenBytes(), trouble());
    }
    if (!options.reportPath.empty())
        if (Expected<void> written =
                writeReport(options.reportPath, report.toJson(simulation.scene(), actors.budget, actors.exposure));
            !written)
            return written;
    if (options.frames > 0 && report.framesShown() == 0) {
        const std::vector<std::string> missing = peers.session().missing();
        return fail(ErrorCode::kFailed,
                    stopping ? "stopped before a frame was shown"
                    : missing.empty()
                        ? "no frame was shown: all hosts came, and none had drawn one before its deadline or its end"
                        : fmt::format("no frame was shown; hosts that never came: {}", fmt::join(missing, ", ")));
    }
    return {};
}

Expected<void> FrameLoop::Impl::take(Preparation made) {
    if (made.ticket != RequestDesk::kStartScene)
        return actions.carryOut(desk.prepared(std::move(made), now())), Expected<void>();
    Expected<std::optional<std::vector<ChangeList>>> lists = startScene.take(std::move(made), loader, log);
    if (!lists) return tl::unexpected(lists.error());
    if (!*lists) return {};
    if (const Expected<void> loaded = maker.load(std::move(**lists)); !loaded) return loaded;
    for (FileInScene& file : startScene.takeFiles()) desk.remember(std::move(file));
    sceneIsThere();
    return {};
}

Expected<void> FrameLoop::Impl::take(const StateCompared& found) {
    actions.compared(found);
    return {};
}

/// One serves all who wait: whoever asked after it began orders another one.
void FrameLoop::Impl::orderSurvey() {
    if (std::exchange(surveying, true)) return;
    lookBeside([this](const Aspect& scene, Sequence at) -> WorkedOut {
        return [this, at, bounds = animatedBounds(scene)](TimePoint) {
            surveying = false;
            view.surveyed(bounds, at);
            ServerActions told = desk.surveyed(bounds, at);
            return journal() && journal()->viewIs(view) ? untilWritten(std::move(told)) : told;
        };
    });
}

void FrameLoop::Impl::lookBeside(DeskSurroundings::Look look) {
    snapshots.lookAtNewest(
        [this, look = std::move(look)](const Aspect& scene, Sequence at) { deliver(BesideDone{look(scene, at)}); });
}

/// A line for the service manager.
std::string FrameLoop::Impl::serviceStatus(TimePoint now) {
    if (!sceneReady) return fmt::format("loads {}", fmt::join(options.scenes, ", "));
    const std::vector<ServerSession::HostStatus> hosts = peers.session().hosts();
    const auto live = std::ranges::count(hosts, HostState::kLive, &ServerSession::HostStatus::state);
    pace.shown(pacing.framesReleased());
    return fmt::format("{} of {} hosts live, {}", live, hosts.size(), pace.text(now));
}

void FrameLoop::Impl::sceneIsThere() {
    sceneReady = true;
    snapshots.sceneReady();
}

bool FrameLoop::Impl::mayBegin(TimePoint now) const {
    return sceneReady && actorsReady && !stopping && !allFramesShown() && !pacing.frameOpen() &&
           peers.session().mayBegin(now);
}

bool FrameLoop::Impl::lastFrameShown() const {
    return std::ranges::all_of(peers.session().hosts(), [&](const ServerSession::HostStatus& host) {
        return host.state != HostState::kLive ||
               (host.everShown && host.lastShown.next() >= peers.session().nextFrame());
    });
}

TimePoint FrameLoop::Impl::nextWake(TimePoint now) const {
    if (phase != Phase::kFrames) return phase == Phase::kOver ? now : now + kGoodbyeTurn;
    const TimePoint wake = std::min({now + kLongestWait, peers.session().nextDeadline(), desk.nextDeadline()});
    return mayBegin(now) ? std::min(wake, pacing.earliest()) : wake;
}

void FrameLoop::Impl::makeFrame(TimePoint now) {
    const FrameNumber number = peers.session().nextFrame();
    if (pacing.framesReleased() == 0)
        if (const std::vector<std::string> missing = peers.session().missing(); !missing.empty())
            log.warning(fmt::format("starting without: {}", fmt::join(missing, ", ")));
    FrameResult made = maker.make(number, desk.takeEdits(), desk.takeReplies(), now);
    poses = tracking.poses(number, maker.view());
    steering.wands(poses.wands);
    report.frameBegins();
    pacing.began(now);
    actions.carryOut(peers.session().beginFrame(maker.begin(number, made), now));
    if (std::optional<Preparation> order = actors.inlines.takeOrder()) desk.loadContent(std::move(*order));
    actions.carryOut(marks.named(made.commit.sent->blobs, this->now()));
    actions.carryOut(desk.heads(poses));
    actions.carryOut(untilWritten(desk.committed(std::move(made), number, simulation.openQuestions())));
}

void FrameLoop::Impl::moveHeads() {
    if (!options.wall.tracking.any()) return;
    for (const TrackerReading& reading : trackers.take()) tracking.take(reading);
    const TimePoint now = this->now();
    for (const std::string& text : tracking.advance(now, now + pacing.usualLength())) log.info(text);
    view.follow(tracking.heads());
    for (const WandState& wand : tracking.wands())
        if (const NavigationInput input = inputOf(wand); input.steers()) steering.add(input, "wand " + wand.name);
}

answer::Trackers FrameLoop::Impl::describeTrackers() const {
    answer::Trackers told{.trackers = tracking.describe(now())};
    trackers.describe(told.trackers);
    return told;
}

/// Lets everybody show the last frame, tells them that the show is over, and waits until they have gone. A turn of it.
void FrameLoop::Impl::sayGoodbye() {
    const auto somebodyStays = [&] {
        return peers.hostCount() > 0 || (peers.connectionCount() > 0 && now() < othersUntil);
    };
    if (now() >= goodbyeUntil || (goodbyeSaid && !somebodyStays())) {
        phase = Phase::kOver;
        return;
    }
    openGate();
    if (!goodbyeSaid && (lastFrameShown() || now() > goodbyeUntil - kFarewell / 2)) {
        actions.carryOut(peers.session().finish("the show is over"));
        goodbyeSaid = true;
        othersUntil = now() + kFarewellToOthers;
    }
    await(now() + kGoodbyeTurn);
    const TimePoint until = std::min(goodbyeUntil, now() + kGoodbyeTurn);  // however much is said
    for (const Inbox::Rank rank : {Inbox::Rank::kFirst, Inbox::Rank::kOther})
        while (auto next = now() < until ? inbox.tryPop(rank) : std::nullopt) {
            const auto* link = std::get_if<LinkEvent>(&next->second);
            if (!link) continue;
            ServerActions wanted = peers.handle(*link);
            // What comes after the end is no fault any more.
            if (goodbyeSaid)
                std::erase_if(wanted,
                              [](const ServerAction& a) { return std::holds_alternative<server_action::Fault>(a); });
            actions.carryOut(std::move(wanted));
            if (!goodbyeSaid && lastFrameShown()) break;
        }
    if (!goodbyeSaid) actions.carryOut(peers.advance(now()));
}

}  // namespace tessera

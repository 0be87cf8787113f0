#include "server/sim/FrameLoop.h"

#include <algorithm>
#include <atomic>
#include <variant>

#include <fmt/format.h>

#include "common/base/FairQueue.h"
#include "common/base/ThreadPriority.h"
#include "server/sim/FrameMaker.h"
#include "server/sim/SessionActions.h"
#include "server/sim/StartScene.h"
#include "server/sim/desk/FilmFiles.h"
#include "server/sim/frame/OutsideActors.h"
#include "server/sim/frame/Simulation.h"
#include "server/sim/journal/NextEpoch.h"
#include "server/sim/navigation/WandInput.h"
#include "server/sim/peers/AnswerGate.h"
#include "server/sim/peers/MarkArrays.h"
#include "server/sim/report/ReportFile.h"
#include "server/sim/tracking/TrackerInputs.h"
#include "server/sim/view/AnimatedBounds.h"

namespace tessera {

/// Something was worked out beside the frames. Named for the same reason.
struct BesideDone {
    WorkedOut then;
};

/// The journal has written what was awaited, or cannot. Named, because FrameLoop::Impl holds some.
struct JournalProgress {};

namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

using Event =
    std::variant<LinkEvent, Preparation, SnapshotMade, StateCompared, BesideDone, JournalProgress, UploadFinished>;
using Inbox = FairQueue<Event>;

constexpr Inbox::Source kOurselves = 0;  ///< no link has this id
constexpr std::size_t kMostInARow = 256;  ///< of what hosts say, before anybody else has a turn
/// Of what applications say, before the network is looked at again: the word of a host may be there.
constexpr Duration kLongestInARow = 500us;
constexpr Duration kLongestWait = 100ms, kFarewell = 5s;
constexpr Duration kFarewellToOthers = 1s;  ///< applications that do not listen keep nobody waiting

}  // namespace

struct FrameLoop::Impl {
    Impl(ServerOptions o, Log& l);
    // Whoever still delivers must not wait for room. The journal writes what is left while there is somebody to wake.
    ~Impl() {
        inbox.close();
        if (opened) opened->journal.reset();
    }

    Expected<void> run();
    Expected<void> begin();
    Expected<void> turn();
    Expected<void> end();
    void sayGoodbye();

    /// Of any thread but the network's.
    void deliver(Event event) {
        if (inbox.push(kOurselves, std::move(event))) peers.wake();
    }
    void await(TimePoint until);
    [[nodiscard]] Expected<bool> serve(Inbox::Rank rank);
    void lookAtTheClock(TimePoint now);

    Expected<void> take(const LinkEvent& event);
    Expected<void> take(Preparation made);
    Expected<void> take(SnapshotMade made);
    Expected<void> take(const StateCompared& found);
    Expected<void> take(const BesideDone& done);
    void lookBeside(DeskSurroundings::Look look);
    void orderSurvey();
    Expected<void> take(UploadFinished finished);
    Expected<void> take(JournalProgress) { return {}; }  // each turn looks
    void sceneIsThere();
    [[nodiscard]] Expected<Journal::Opened> openJournal();
    [[nodiscard]] FirstView firstView() const;
    [[nodiscard]] ImportOptions importOptions() const;
    [[nodiscard]] Expected<void> goOnFromJournal();
    [[nodiscard]] ServerSessionConfig sessionConfig() const;
    [[nodiscard]] bool goesOn() const { return opened && opened->state.begun; }
    [[nodiscard]] Journal* journal() const { return opened ? opened->journal.get() : nullptr; }
    [[nodiscard]] std::optional<Error> trouble() const { return journal() ? journal()->trouble() : std::nullopt; }
    /// Keeps the replies in it until the journal has what it has been handed.
    [[nodiscard]] ServerActions untilWritten(ServerActions told);
    void openGate();

    [[nodiscard]] bool mayBegin(TimePoint now) const;
    [[nodiscard]] bool frameIsDue(TimePoint now) const {
        return mayBegin(now) && now >= pacing.earliest();
    }
    [[nodiscard]] bool lastFrameShown() const;
    [[nodiscard]] bool allFramesShown() const {
        return options.frames > 0 && pacing.framesReleased() >= options.frames;
    }
    [[nodiscard]] TimePoint nextWake(TimePoint now) const;
    void makeFrame(TimePoint now);
    void moveHeads();
    [[nodiscard]] answer::Trackers describeTrackers() const;

    ServerOptions options;
    Log& log;
    Inbox inbox;
    std::function<bool(Inbox::Source)> mayServe = [this](Inbox::Source source) { return peers.mayServe(LinkId{source}); };
    BlobStore blobs;
    /// Before all that its epoch is told to. Without --journal both are empty.
    Expected<Journal::Opened> opened;
    AnswerGate gate;
    Simulation simulation;
    ViewSource view;
    ManipulatorDrags drags;
    Steering steering;
    Report report;
    Tracking tracking;
    TrackerInputs trackers;
    notice::Poses poses;                ///< of the newest frame
    std::shared_ptr<SceneFiles> files;  ///< what may be read
    OutsideActors actors;
    FrameMaker maker;
    FramePacing pacing;
    StartScene startScene;
    bool sceneReady = false, actorsReady = false;
    bool surveyWanted = false, surveying = false;
    bool othersServed = false;           ///< since the last frame began
    std::atomic<bool> stopping = false;  ///< said by any thread

    // Last: their threads deliver into what stands above.
    Peers peers;
    Loader loader;
    Workbench workbench, listings;
    Uploads uploads;
    Snapshots snapshots;
    MarkArrays marks;
    RequestDesk desk;
    SessionActions actions;
};

FrameLoop::FrameLoop(ServerOptions options, Log& log) : impl_(std::make_unique<Impl>(std::move(options), log)) {}
FrameLoop::~FrameLoop() = default;
Expected<void> FrameLoop::run() { return impl_->run(); }
void FrameLoop::stop() {
    impl_->stopping = true;
    impl_->peers.wake();
}

FrameLoop::Impl::Impl(ServerOptions o, Log& l)
    : options(std::move(o)),
      log(l),
      opened(openJournal()),
      simulation({.threads = options.threads}),
      view(options.wall, options.camera, firstView()),
      steering({.wall = options.wall,
                .simulation = simulation,
                .view = view,
                .takesInput = options.takesInput,
                .drags = &drags,
                .beside = {.look = [this](LooksBeside::Look look) {
                               lookBeside([look](const Aspect& scene) { return withoutWord(look(scene)); });
                           },
                           .work = [this](LooksBeside::Work work) {
                               workbench.add([work] { return withoutWord(work()); });
                           }}}),
      report(options.wall, fmt::format("{}", fmt::join(options.scenes, ", "))),
      tracking(options.wall),
      trackers(options.wall.tracking, log),
      poses(tracking.poses(FrameNumber(0), View())),
      files(std::make_shared<SceneFiles>(options.import, options.allowed,
                                         goesOn() ? opened->state.sceneFiles() : options.scenes, goesOn())),
      actors(options.wall, drags, filmOpener(files), options.notices),
      maker({.simulation = simulation,
             .view = view,
             .blobs = blobs,
             .report = report,
             .log = log,
             .journal = journal(),
             .moveHeads = [this] { moveHeads(); },
             .showing = &options.showing,
             .steering = &steering}),
      pacing(options.rateHz),
      startScene(options.scenes, options.placing),
      peers(sessionConfig(), blobs,
            [this](LinkEvent event) {
                const LinkId link = linkOf(event);
                inbox.push(link.value, std::move(event));
            },
            options.keys, [this](const std::string& words) { log.warning(words); }),
      loader(importOptions(), files, [this](Preparation made) { deliver(std::move(made)); }),
      workbench([this](WorkedOut then) { deliver(BesideDone{std::move(then)}); }),
      listings([this](WorkedOut then) { deliver(BesideDone{std::move(then)}); }),
      uploads([this](UploadFinished finished) { deliver(std::move(finished)); }),
      snapshots(peers.session(), blobs, [this](SnapshotMade made) { deliver(std::move(made)); }),
      marks(blobs, peers.session()),
      desk({.wall = options.wall,
            .blobs = blobs,
            .session = peers.session(),
            .simulation = simulation,
            .view = view,
            .loader = loader,
            .uploads = &uploads,
            .drags = drags,
            .journal = options.journalPath,
            .editsRefused = [this] { return trouble(); },
            .describeWaits =
                [this](answer::Status& status) {
                    report.describeWaits(status);
                    peers.describe(status);
                    if (journal()) status.journalBytes = journal()->writtenBytes();
                },
            .describeTrackers = [this] { return describeTrackers(); },
            .describePrograms = [this] { return actors.programs.troubles(simulation.scene()); },
            .filmLength = [this](ObjectId movie) { return actors.films.lengthOf(movie); },
            .poses = [this] { return poses; },
            .showing = &options.showing,
            .steering = &steering,
            .inlines = &actors.inlines,
            .orderSurvey = [this] { orderSurvey(); },
            .orderCopy = [this](Preparation order) {
                lookBeside([this, order = std::move(order)](const Aspect& scene) -> WorkedOut {
                    const auto made = std::make_shared<Preparation>(makeCopy(scene, order));
                    return [this, made](TimePoint now) { return desk.prepared(std::move(*made), now); };
                });
            },
            .lookBeside = [this](DeskSurroundings::Look look) { lookBeside(std::move(look)); },
            .workBeside = [this](std::function<WorkedOut()> work) { workbench.add(std::move(work)); },
            .listBeside = [this](std::function<WorkedOut()> work) { listings.add(std::move(work)); },
            .files = files.get(),
            .budget = &actors.budget,
            .watchesFiles = options.reload,
            .deliver = [this](WorkedOut then) { deliver(BesideDone{std::move(then)}); },
            .say = [this](const std::string& words, bool isWrong) { isWrong ? log.warning(words) : log.info(words); },
            .audit = options.audit}),
      actions({.peers = peers,
               .pacing = pacing,
               .snapshots = snapshots,
               .desk = desk,
               .steering = steering,
               .report = report,
               .budget = actors.budget,
               .programs = actors.programs,
               .log = log,
               .onReleased =
                   [this](std::uint64_t frames) {
                       if (options.onProgress) options.onProgress(frames, options.frames);
                   },
               .onAnswered =
                   [this](ServerActions told) {
                       // What was said about the view is not in a frame yet.
                       return journal() && journal()->viewIs(view) ? untilWritten(std::move(told)) : told;
                   },
               .onEpochRaised = [this](Epoch epoch) {
                   if (journal()) journal()->epochRaised(epoch);
               },
               .deliver = [this](StateCompared found) { deliver(std::move(found)); }}) {
    inbox.setRank(kOurselves, Inbox::Rank::kFirst);
    simulation.actWith(actors);
    view.surveyElsewhere([this] { return surveyWanted = true, simulation.sequence(); });
}

Expected<Journal::Opened> FrameLoop::Impl::openJournal() {
    if (options.journalPath.empty()) return Journal::Opened();
    return Journal::open({.folder = options.journalPath, .scenes = options.scenes, .placing = optionsText(options.placing)}, blobs, log, [this] {
        deliver(JournalProgress{});
    });
}

/// That of a wall that goes on is the one that it began with, whatever this command leaves unsaid.
FirstView FrameLoop::Impl::firstView() const {
    bool inMetres = !options.scenes.empty() && options.placing.isInMetres();
    if (goesOn()) {
        const std::string words = opened->state.placing();
        inMetres = words.find("--at ") != std::string::npos || words.find("--fit ") != std::string::npos;
    }
    return inMetres ? FirstView::kOfWall : FirstView::kOfScene;
}

/// Files within files of what stands in metres keep their cameras to themselves, as those do.
ImportOptions FrameLoop::Impl::importOptions() const {
    ImportOptions import = options.import;
    import.camerasEnabled = firstView() == FirstView::kOfScene;
    return import;
}

ServerSessionConfig FrameLoop::Impl::sessionConfig() const {
    const auto now = std::chrono::system_clock::now();
    ServerSessionConfig config = sessionConfigOf(options.wall, journal() ? journal()->epoch() : nextEpoch({}, now));
    config.furthestSeen = furthestEpoch(now);
    config.access = options.access;
    config.owner = options.owner;
    config.insecure = options.insecure;
    config.panelOf = options.panelOf;
    if (journal()) config.firstFrame = opened->state.nextFrame;
    return config;
}

Expected<void> FrameLoop::Impl::run() {
    // An end by an error is one in order for the journal: the next start goes on with the very next numbers.
    const auto failed = [&](Expected<void> why) {
        if (journal()) journal()->ends(peers.session().nextFrame());
        return why;
    };
    if (Expected<void> begun = begin(); !begun) return failed(std::move(begun));
    while (!(stopping && !pacing.frameOpen()) && !allFramesShown())
        if (Expected<void> turned = turn(); !turned) {
            actions.carryOut(peers.session().finish(turned.error().message));
            return failed(std::move(turned));
        }
    sayGoodbye();
    return end();
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
        return fail(ErrorCode::kUsage,
                    fmt::format("--record {}: a recording begins with the files of --scene; the journal {} goes on without "
                                "them. Leave one of the two away",
                                options.recordPath, options.journalPath));
    if (!options.recordPath.empty())
        if (Expected<void> begun = maker.record(options.recordPath, options.threads); !begun) return begun;
    if (const std::string refused = AheadForNow::refusal(); !refused.empty())
        log.detail(fmt::format("frames are released by a thread that runs like any other (refused: {}); beside other load they may reach "
                             "hosts one by one. CAP_SYS_NICE, or `rtprio {}` in /etc/security/limits.conf, lets it say so without a pause",
                             refused, static_cast<int>(Urgency::kReleasing)));
    actions.carryOut(marks.announce(Clock::now()));
    if (options.onListening) options.onListening(bound);
    if (opened->state.begun) return goOnFromJournal();
    simulation.skipNumbers(opened->nextId, opened->behind);
    startScene.idsFrom(opened->nextId);
    // Whoever joins stands where the lists that come go on, though nothing is there yet.
    snapshots.follow({.sent = share(CommittedList{.sequence = simulation.sequence(), .stateHash = simulation.scene().stateHash()}),
                      .list = std::make_shared<const ChangeList>()});
    if (startScene.empty()) sceneIsThere();
    return startScene.order(loader, RequestDesk::kStartScene);
}

Expected<void> FrameLoop::Impl::goOnFromJournal() {
    const JournalState& state = opened->state;
    log.info(fmt::format("journal {}: goes on with frame {} from list {}, state {}; what --scene says is in it already",
                         journal()->folder(), state.nextFrame.value, state.sequence.value,
                         toHex(state.scene.stateHash())));
    const Expected<CommittedFrame> there = maker.goOnFrom(*opened);
    if (!there) return tl::unexpected(there.error());
    snapshots.follow(*there);
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
    await(nextWake(Clock::now()));
    if (sceneReady && !actorsReady) actorsReady = maker.ready(Clock::now());
    const TimePoint until = std::min(Clock::now() + kLongestInARow, peers.session().nextDeadline());
    for (;;) {
        for (std::size_t count = 0; count < kMostInARow; ++count) {
            const Expected<bool> served = serve(Inbox::Rank::kFirst);
            if (!served) return tl::unexpected(served.error());
            if (!*served) break;
        }
        if (const TimePoint now = Clock::now(); stopping || now >= until || (othersServed && frameIsDue(now))) break;
        const Expected<bool> served = serve(Inbox::Rank::kOther);
        if (!served) return tl::unexpected(served.error());
        if (!*served) break;
        othersServed = true;
    }
    lookAtTheClock(Clock::now());
    if (const TimePoint now = Clock::now(); frameIsDue(now)) makeFrame(now);
    openGate();
    return {};
}

/// Nobody else needs to be woken for what the network brings while this thread waits.
void FrameLoop::Impl::await(TimePoint until) {
    const TimePoint now = Clock::now();
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
}

Expected<void> FrameLoop::Impl::end() {
    if (journal()) {
        journal()->ends(peers.session().nextFrame());
        report.journal(journal()->folder(), journal()->writtenBytes(), trouble());
    }
    if (!options.reportPath.empty())
        if (Expected<void> written = writeReport(options.reportPath, report.toJson(simulation.scene(), actors.budget));
            !written)
            return written;
    if (options.frames > 0 && report.framesShown() == 0) {
        const std::vector<std::string> missing = peers.session().missing();
        return fail(ErrorCode::kFailed,
                    stopping          ? "stopped before a frame was shown"
                    : missing.empty() ? "no frame was shown: all hosts came, and none had drawn one before its deadline or its end"
                                      : fmt::format("no frame was shown; hosts that never came: {}", fmt::join(missing, ", ")));
    }
    return {};
}

Expected<void> FrameLoop::Impl::take(const LinkEvent& event) {
    actions.carryOut(peers.handle(event));
    return {};
}

Expected<void> FrameLoop::Impl::take(Preparation made) {
    if (made.ticket != RequestDesk::kStartScene)
        return actions.carryOut(desk.prepared(std::move(made), Clock::now())), Expected<void>();
    Expected<std::optional<std::vector<ChangeList>>> lists = startScene.take(std::move(made), loader, log);
    if (!lists) return tl::unexpected(lists.error());
    if (!*lists) return {};
    const Expected<CommittedFrame> loaded = maker.load(std::move(**lists));
    if (!loaded) return tl::unexpected(loaded.error());
    snapshots.follow(*loaded);
    for (FileInScene& file : startScene.takeFiles()) desk.remember(std::move(file));
    sceneIsThere();
    return {};
}

Expected<void> FrameLoop::Impl::take(SnapshotMade made) {
    actions.carryOut(snapshots.made(std::move(made), Clock::now()));
    return {};
}

Expected<void> FrameLoop::Impl::take(const StateCompared& found) {
    actions.compared(found);
    return {};
}

/// One serves all who wait: whoever asked after it began orders another one.
void FrameLoop::Impl::orderSurvey() {
    if (std::exchange(surveying, true)) return;
    lookBeside([this, at = simulation.sequence()](const Aspect& scene) -> WorkedOut {
        return [this, at, bounds = animatedBounds(scene).box](TimePoint) {
            surveying = false;
            view.surveyed(bounds, at);
            ServerActions told = desk.surveyed(bounds, at);
            return journal() && journal()->viewIs(view) ? untilWritten(std::move(told)) : told;
        };
    });
}

void FrameLoop::Impl::lookBeside(DeskSurroundings::Look look) {
    snapshots.look(simulation.sequence(), [this, look = std::move(look)](const Aspect* scene) {
        TESSERA_CHECK(scene, "the scene of the newest list can be looked at");
        deliver(BesideDone{look(*scene)});
    });
}

Expected<void> FrameLoop::Impl::take(const BesideDone& done) {
    actions.carryOut(done.then(Clock::now()));
    return {};
}

Expected<void> FrameLoop::Impl::take(UploadFinished finished) {
    actions.carryOut(desk.uploaded(std::move(finished), Clock::now()));
    return {};
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
    snapshots.follow(made.commit);
    if (std::exchange(surveyWanted, false)) orderSurvey();
    report.frameBegins();
    pacing.began(now);
    actions.carryOut(peers.session().beginFrame(maker.begin(number, made), now));
    if (std::optional<Preparation> order = actors.inlines.takeOrder()) desk.loadContent(std::move(*order));
    actions.carryOut(marks.named(made.commit.sent->blobs, Clock::now()));
    actions.carryOut(desk.heads(poses));
    actions.carryOut(untilWritten(desk.committed(std::move(made), number, simulation.openQuestions())));
}

void FrameLoop::Impl::moveHeads() {
    if (!options.wall.tracking.any()) return;
    for (const TrackerReading& reading : trackers.take()) tracking.take(reading);
    const TimePoint now = Clock::now();
    for (const std::string& text : tracking.advance(now, now + pacing.usualLength())) log.info(text);
    view.follow(tracking.heads());
    for (const WandState& wand : tracking.wands())
        if (const NavigationInput input = inputOf(wand); input.steers()) steering.add(input, "wand " + wand.name);
}

answer::Trackers FrameLoop::Impl::describeTrackers() const {
    answer::Trackers told{.trackers = tracking.describe(Clock::now())};
    trackers.describe(told.trackers);
    return told;
}

/// Lets everybody show the last frame, tells them that the show is over, and waits until they have gone.
void FrameLoop::Impl::sayGoodbye() {
    const TimePoint deadline = Clock::now() + kFarewell;
    TimePoint others = deadline;
    bool told = false;
    const auto somebodyStays = [&](TimePoint now) {
        return peers.hostCount() > 0 || (peers.connectionCount() > 0 && now < others);
    };
    for (TimePoint now = Clock::now(); now < deadline && (!told || somebodyStays(now)); now = Clock::now()) {
        openGate();
        if (!told && (lastFrameShown() || Clock::now() > deadline - kFarewell / 2)) {
            actions.carryOut(peers.session().finish("the show is over"));
            told = true;
            others = Clock::now() + kFarewellToOthers;
        }
        await(Clock::now() + 20ms);
        const TimePoint until = std::min(deadline, Clock::now() + 20ms);  // however much is said
        for (const Inbox::Rank rank : {Inbox::Rank::kFirst, Inbox::Rank::kOther})
            while (auto next = Clock::now() < until ? inbox.tryPop(rank) : std::nullopt) {
                const auto* link = std::get_if<LinkEvent>(&next->second);
                if (!link) continue;
                ServerActions wanted = peers.handle(*link);
                // What comes after the end is no fault any more.
                if (told)
                    std::erase_if(
                        wanted, [](const ServerAction& a) { return std::holds_alternative<server_action::Fault>(a); });
                actions.carryOut(std::move(wanted));
                if (!told && lastFrameShown()) break;
            }
        if (!told) actions.carryOut(peers.advance(Clock::now()));
    }
}

}  // namespace tessera

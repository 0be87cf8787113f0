#include "server/sim/FrameLoop.h"

#include <algorithm>
#include <deque>
#include <limits>
#include <random>
#include <variant>

#include <fmt/format.h>

#include "common/base/Channel.h"
#include "common/base/Version.h"
#include "common/codec/ChangeCodec.h"
#include "common/codec/FrameCodec.h"
#include "common/codec/WallCodec.h"
#include "common/scene/FieldTable.h"
#include "server/collision/mesh/InstructionSet.h"
#include "server/sim/CollisionAnswers.h"
#include "server/sim/ContactDisplay.h"
#include "server/sim/Loader.h"
#include "server/sim/Peers.h"
#include "server/sim/RecordingWriter.h"
#include "server/sim/Report.h"
#include "server/sim/ReportFile.h"
#include "server/sim/RequestDesk.h"
#include "server/sim/Simulation.h"
#include "server/sim/StateComparison.h"
#include "server/sim/ViewSource.h"

namespace tessera {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

struct StopOrder {};
using Event = std::variant<LinkEvent, LoadFinished, StopOrder>;

/// With nobody in the barrier frames would fly by; simulation time then keeps the pace of the clock.
constexpr Duration kEmptyWallFrame =
    std::chrono::duration_cast<Duration>(std::chrono::duration<double>(kSecondsPerFrame));
constexpr Duration kLongestWait = 100ms;
constexpr Duration kFarewell = 5s;
/// The next frame begins when all who were told to show the last one have said so: then no two shown images differ by a
/// frame. A host that does not say so costs the others this much once, and is found by its other deadlines.
constexpr Duration kShownGrace = 50ms;

ServerSessionConfig sessionConfig(const Wall& wall) {
    ServerSessionConfig config;
    for (const WallHost& host : wall.hosts) config.hosts.push_back(host.name);
    config.sync = wall.sync;
    // Every start has a higher epoch than the one before, without a file: nanoseconds since 1970.
    config.epoch = Epoch(static_cast<std::uint64_t>(std::chrono::system_clock::now().time_since_epoch() / 1ns));
    config.schema = schemaHash();
    config.configuration = share(encodeWall(wall));
    config.tokenSeed = (std::uint64_t{std::random_device{}()} << 32) | std::random_device{}();
    return config;
}

std::string join(const std::vector<std::string>& names) {
    std::string text;
    for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
    return text;
}

}  // namespace

struct FrameLoop::Impl {
    Impl(ServerOptions o, Log& l)
        : options(std::move(o)),
          log(l),
          simulation({.threads = options.threads}),
          view(options.wall, options.camera),
          report(options.wall, join(options.scenes)),
          peers(sessionConfig(options.wall), blobs, [this](LinkEvent event) { inbox.push(std::move(event)); }),
          loader(options.import, [this](LoadFinished finished) { inbox.push(std::move(finished)); }),
          desk(options.wall, blobs, peers, simulation, view, loader) {}
    // Whoever still delivers must not wait for room.
    ~Impl() { inbox.close(); }

    Expected<void> run();
    Expected<void> handle(Event event);
    Expected<void> startSceneLoaded(LoadFinished finished);
    Expected<void> beginRecording();
    void announceMarks();
    void carryOut(ServerActions actions);
    void carryOut(const server_action::Fault& fault);
    void giveSnapshot(ConnectionId connection);
    bool allFramesShown() const { return options.frames > 0 && framesReleased >= options.frames; }
    bool frameIsDue(TimePoint now) const;
    void beginFrame(TimePoint now);
    TimePoint nextWake(TimePoint now) const;
    void sayGoodbye();
    bool lastFrameShown() const;

    ServerOptions options;
    Log& log;
    Channel<Event> inbox{1 << 16};
    BlobStore blobs;
    Simulation simulation;
    ViewSource view;
    View lastView;
    Report report;
    StateComparison comparison;
    std::unique_ptr<RecordingWriter> recording;  ///< null: none wanted
    const std::vector<Blob> marks = ContactDisplay::blobs();
    std::uint64_t marksToken = std::numeric_limits<std::uint64_t>::max();  ///< the desk's tokens count up, ours down

    std::vector<ChangeList> startScenes;
    bool sceneReady = false;
    std::vector<ConnectionId> waitingForScene;
    std::uint64_t framesReleased = 0;
    bool frameOpen = false;
    bool anyoneEverLive = false;
    bool stopping = false;
    bool cameraComplaint = false;
    TimePoint earliestNext{};
    TimePoint releasedAt{};

    // Last: their threads deliver into what stands above.
    Peers peers;
    Loader loader;
    RequestDesk desk;
};

FrameLoop::FrameLoop(ServerOptions options, Log& log) : impl_(std::make_unique<Impl>(std::move(options), log)) {}
FrameLoop::~FrameLoop() = default;
Expected<void> FrameLoop::run() {
    return impl_->run();
}
void FrameLoop::stop() {
    impl_->inbox.tryPush(StopOrder{});
}

Expected<void> FrameLoop::Impl::run() {
    const Expected<std::uint16_t> port = peers.listen(options.listen);
    if (!port) return tl::unexpected(port.error());
    if (Expected<void> begun = beginRecording(); !begun) return begun;
    announceMarks();
    Address bound = options.listen;
    bound.port = *port;
    if (!bound.isLoopback())
        log.warning("the link is plain: neither encrypted nor authenticated; keep it on a network of the wall's own");
    if (options.onListening) options.onListening(bound);
    for (const std::string& scene : options.scenes)
        if (!loader.order({.ticket = RequestDesk::kStartScene, .path = scene, .parent = kRootNode}))
            return fail(ErrorCode::kUsage, "too many --scene options");
    sceneReady = options.scenes.empty();

    while (!(stopping && !frameOpen) && !allFramesShown()) {
        const TimePoint now = Clock::now();
        const Duration wait = std::max<Duration>(Duration{0}, nextWake(now) - now);
        std::optional<Event> event = wait > Duration{0} ? inbox.popFor(wait) : inbox.tryPop();
        for (; event; event = inbox.tryPop()) {
            if (Expected<void> handled = handle(std::move(*event)); !handled) {
                carryOut(peers.perform(peers.session().finish(handled.error().message)));
                return handled;
            }
        }
        carryOut(peers.advance(Clock::now()));
        carryOut(desk.advance(Clock::now()));
        if (frameIsDue(Clock::now())) {
            const std::vector<std::string> missing = peers.session().missing();
            if (peers.session().nextFrame() == FrameNumber(0) && !missing.empty())
                log.warning(fmt::format("starting without: {}", join(missing)));
            beginFrame(Clock::now());
        }
    }
    sayGoodbye();
    if (!options.reportPath.empty())
        if (Expected<void> written = writeReport(options.reportPath, report.toJson(simulation.scene())); !written)
            return written;
    if (options.frames > 0 && report.framesShown() == 0)
        return fail(ErrorCode::kFailed, stopping ? "stopped before a frame was shown"
                                                 : fmt::format("no frame was shown; hosts that never came: {}",
                                                               join(peers.session().missing())));
    return {};
}

Expected<void> FrameLoop::Impl::handle(Event event) {
    if (const auto* link = std::get_if<LinkEvent>(&event)) {
        carryOut(peers.handle(*link));
    } else if (auto* loaded = std::get_if<LoadFinished>(&event)) {
        if (loaded->ticket == RequestDesk::kStartScene) return startSceneLoaded(std::move(*loaded));
        carryOut(desk.loaded(std::move(*loaded), Clock::now()));
    } else {
        stopping = true;
    }
    return {};
}

Expected<void> FrameLoop::Impl::startSceneLoaded(LoadFinished finished) {
    if (!finished.scene) return tl::unexpected(finished.scene.error());
    for (const std::string& note : finished.scene->notes) log.info(finished.path + ": " + note);
    startScenes.push_back(std::move(finished.scene->list));
    if (startScenes.size() < options.scenes.size()) return {};
    if (recording) recording->startScene(startScenes);
    const Expected<CommittedFrame> loaded = simulation.load(std::move(startScenes));
    if (!loaded) return tl::unexpected(loaded.error());
    if (recording) recording->started(*loaded);
    startScenes.clear();
    for (const Blob& blob : loaded->list ? blobsOf(*loaded->list) : std::vector<Blob>()) blobs.add(blob);
    const SceneCounts counts = countScene(simulation.scene());
    log.info(fmt::format("scene: {} nodes, {} cores, {} triangles ({} stored)", counts.nodes, counts.cores,
                         counts.triangles, counts.trianglesStored));
    // A camera that is not there is an error of the command line, found before anybody draws.
    const Expected<View> first = view.view(simulation.scene());
    if (!first) return tl::unexpected(first.error());
    sceneReady = true;
    for (const ConnectionId connection : std::exchange(waitingForScene, {})) giveSnapshot(connection);
    return {};
}

Expected<void> FrameLoop::Impl::beginRecording() {
    if (options.recordPath.empty()) return {};
    Expected<std::unique_ptr<RecordingWriter>> writer =
        RecordingWriter::create(options.recordPath,
                                {.schema = schemaHash(),
                                 .program = versionText("tessera-server"),
                                 .instructionSet = std::string(name(instructionSet())),
                                 .threads = options.threads,
                                 .limits = SceneLimits(),
                                 .collisionLimits = digestOf(CollisionLimits())},
                                log);
    if (!writer) return tl::unexpected(writer.error());
    recording = std::move(*writer);
    return {};
}

/// The display of contacts comes and goes in the middle of frames: every host has its arrays before it enters the barrier,
/// whether or not they are ever shown.
void FrameLoop::Impl::announceMarks() {
    std::vector<BlobInfo> infos;
    for (const Blob& blob : marks) {
        blobs.add(blob);
        infos.push_back({blob.id(), blob.sizeBytes()});
    }
    carryOut(peers.perform(peers.session().announceBlobs(marksToken--, std::move(infos), Clock::now())));
}

void FrameLoop::Impl::giveSnapshot(ConnectionId connection) {
    const ChangeList list = snapshot(simulation.scene());
    CommittedList whole{.sequence = simulation.sequence(),
                        .stateHash = StateHash(simulation.scene().stateHash()),
                        .encoded = encodeChangeList(list),
                        .blobs = {}};
    for (const Blob& blob : blobsOf(list)) whole.blobs.push_back({blob.id(), blob.sizeBytes()});
    carryOut(peers.perform(peers.session().snapshotReady(connection, {share(std::move(whole))}, Clock::now())));
}

bool FrameLoop::Impl::frameIsDue(TimePoint now) const {
    return sceneReady && !stopping && !allFramesShown() && !frameOpen && now >= earliestNext &&
           (lastFrameShown() || now >= releasedAt + kShownGrace) && peers.session().mayBegin(now);
}

void FrameLoop::Impl::beginFrame(TimePoint now) {
    const FrameNumber number = peers.session().nextFrame();
    std::vector<Edit> edits = desk.takeEdits();
    for (const Edit& edit : edits)
        for (const Blob& blob : blobsOf(edit.list)) blobs.add(blob);
    const std::vector<Reply> replies = desk.takeReplies();
    const bool first = number == FrameNumber(0);
    if (recording) recording->frameBegins(number.value, first, edits, replies);
    const FrameResult frame = simulation.step(first, std::move(edits), replies);
    if (recording) recording->frameDone(number.value, frame);
    report.frameCommitted(frame);

    const Expected<View> nextView = view.view(simulation.scene());
    if (nextView) {
        lastView = *nextView;
    } else if (!std::exchange(cameraComplaint, true)) {
        log.warning(nextView.error().message + "; the view stays where it was");
    }
    const FrameContent content{.frame = number,
                               .payload = encodeFrame({.view = lastView, .collision = numbersOf(frame.collision)}),
                               .list = frame.commit.sent};
    report.frameBegins();
    frameOpen = true;
    const Duration interval =
        options.rateHz > 0 ? std::chrono::duration_cast<Duration>(std::chrono::duration<double>(1 / options.rateHz))
                           : Duration{0};
    earliestNext = std::max(earliestNext + interval, now);
    carryOut(peers.perform(peers.session().beginFrame(content, now)));
    // The session forgets what a list has named; the display may go, a host join, and the display come back.
    const auto isMark = [&](const BlobInfo& info) {
        return std::ranges::any_of(marks, [&](const Blob& blob) { return blob.id() == info.id; });
    };
    if (std::ranges::any_of(frame.commit.sent->blobs, isMark)) announceMarks();
    carryOut(desk.committed(frame, number));
}

void FrameLoop::Impl::carryOut(ServerActions actions) {
    std::deque<ServerAction> pending(std::make_move_iterator(actions.begin()), std::make_move_iterator(actions.end()));
    const auto more = [&](ServerActions next) {
        pending.insert(pending.end(), std::make_move_iterator(next.begin()), std::make_move_iterator(next.end()));
    };
    while (!pending.empty()) {
        const ServerAction action = std::move(pending.front());
        pending.pop_front();
        if (const auto* wanted = std::get_if<server_action::SnapshotWanted>(&action)) {
            if (sceneReady) {
                giveSnapshot(wanted->connection);
            } else {
                waitingForScene.push_back(wanted->connection);
            }
        } else if (const auto* entered = std::get_if<server_action::HostEntered>(&action)) {
            anyoneEverLive = true;
            report.entered(*entered);
            log.info(entered->rejoined
                         ? fmt::format("{} is back: enters at frame {}, {:.0f} ms after it was lost", entered->host,
                                       entered->frame.value, toMilliseconds(entered->awayFor))
                         : fmt::format("{} enters at frame {}", entered->host, entered->frame.value));
        } else if (const auto* fault = std::get_if<server_action::Fault>(&action)) {
            report.fault(*fault);
            log.warning(fmt::format("frame {}: {}: {}, noticed {:.0f} ms after its last byte{}", fault->frame.value,
                                    fault->host, nameOf(fault->kind), toMilliseconds(fault->detectedAfter),
                                    fault->detail.empty() ? "" : " (" + fault->detail + ")"));
        } else if (const auto* released = std::get_if<server_action::FrameReleased>(&action)) {
            frameOpen = false;
            releasedAt = Clock::now();
            ++framesReleased;
            report.released(*released);
            if (released->shown.empty()) earliestNext = std::max(earliestNext, Clock::now() + kEmptyWallFrame);
            if (options.onProgress) options.onProgress(framesReleased, options.frames);
            more(desk.frameReleased(*released));
        } else if (const auto* stats = std::get_if<server_action::FrameStats>(&action)) {
            report.stats(*stats);
        } else if (const auto* shown = std::get_if<server_action::FrameShown>(&action)) {
            report.shown(*shown);
        } else if (const auto* mismatch = std::get_if<server_action::StateMismatch>(&action)) {
            comparison.begin(mismatch->host, simulation.scene());
        } else if (const auto* hashes = std::get_if<server_action::HashesReceived>(&action)) {
            const StateComparison::Step step = comparison.compare(*hashes, simulation.scene());
            if (step.queryLeaf) {
                more(peers.perform(peers.session().queryObjects(hashes->host, *step.queryLeaf)));
            } else {
                if (!step.finding.empty()) {
                    log.warning(fmt::format("{}: first differing object: {}", hashes->host, step.finding));
                    report.mismatch(hashes->host, step.finding);
                }
                more(peers.perform(peers.session().repair(hashes->host, Clock::now())));
            }
        } else if (const auto* request = std::get_if<server_action::RequestReceived>(&action)) {
            more(desk.received(*request, Clock::now()));
        } else if (const auto* left = std::get_if<server_action::ApplicationLeft>(&action)) {
            desk.applicationLeft(left->connection);
        } else if (const auto* everywhere = std::get_if<server_action::BlobsEverywhere>(&action)) {
            more(desk.blobsEverywhere(everywhere->token));
        } else if (const auto* image = std::get_if<server_action::ImageReceived>(&action)) {
            more(desk.imageReceived(*image));
        } else if (const auto* differ = std::get_if<server_action::PixelsDiffer>(&action)) {
            log.warning(
                fmt::format("{} draws other pixels than {} (another CPU or driver): seams between them may show",
                            differ->host, differ->reference));
        }
    }
}

TimePoint FrameLoop::Impl::nextWake(TimePoint now) const {
    TimePoint wake = std::min({now + kLongestWait, peers.session().nextDeadline(), desk.nextDeadline()});
    if (sceneReady && !stopping && !frameOpen && peers.session().mayBegin(now))
        wake = std::min(wake, lastFrameShown() ? earliestNext : std::max(earliestNext, releasedAt + kShownGrace));
    return wake;
}

bool FrameLoop::Impl::lastFrameShown() const {
    return std::ranges::all_of(peers.session().hosts(), [&](const ServerSession::HostStatus& host) {
        return host.state != HostState::kLive ||
               (host.everShown && host.lastShown.next() >= peers.session().nextFrame());
    });
}

void FrameLoop::Impl::sayGoodbye() {
    const TimePoint deadline = Clock::now() + kFarewell;
    bool told = false;
    while (Clock::now() < deadline && (!told || peers.connectionCount() > 0)) {
        if (!told && (lastFrameShown() || Clock::now() > deadline - kFarewell / 2)) {
            carryOut(peers.perform(peers.session().finish("the show is over")));
            told = true;
        }
        while (std::optional<Event> event = inbox.popFor(20ms)) {
            if (const auto* link = std::get_if<LinkEvent>(&*event)) {
                ServerActions actions = peers.handle(*link);
                // What comes after the end is no fault any more.
                if (told)
                    std::erase_if(
                        actions, [](const ServerAction& a) { return std::holds_alternative<server_action::Fault>(a); });
                carryOut(std::move(actions));
            }
            if (!told && lastFrameShown()) break;
        }
        if (!told) carryOut(peers.advance(Clock::now()));
    }
}

}  // namespace tessera

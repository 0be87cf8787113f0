#include "server/sim/FrameLoop.h"

#include <algorithm>
#include <variant>

#include <fmt/format.h>

#include "common/base/Channel.h"
#include "server/sim/FrameMaker.h"
#include "server/sim/MarkArrays.h"
#include "server/sim/ReportFile.h"
#include "server/sim/SessionActions.h"
#include "server/sim/StartScene.h"

namespace tessera {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

struct StopOrder {};
using Event = std::variant<LinkEvent, LoadFinished, StopOrder>;

constexpr Duration kLongestWait = 100ms;
constexpr Duration kFarewell = 5s;

std::string join(const std::vector<std::string>& names) {
    std::string text;
    for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
    return text;
}

}  // namespace

struct FrameLoop::Impl {
    Impl(ServerOptions o, Log& l);
    // Whoever still delivers must not wait for room.
    ~Impl() { inbox.close(); }

    Expected<void> run();
    Expected<void> begin();
    Expected<void> turn();
    Expected<void> end();
    void sayGoodbye();

    /// From any thread.
    void deliver(Event event) {
        if (inbox.push(std::move(event))) peers.wake();
    }
    [[nodiscard]] std::optional<Event> nextEvent(Duration wait);

    Expected<void> take(const LinkEvent& event);
    Expected<void> take(LoadFinished finished);
    Expected<void> take(StopOrder);
    void sceneIsThere();

    [[nodiscard]] bool mayBegin(TimePoint now) const;
    [[nodiscard]] bool lastFrameShown() const;
    [[nodiscard]] bool allFramesShown() const {
        return options.frames > 0 && pacing.framesReleased() >= options.frames;
    }
    [[nodiscard]] TimePoint nextWake(TimePoint now) const;
    void makeFrame(TimePoint now);

    ServerOptions options;
    Log& log;
    Channel<Event> inbox{1 << 16};
    BlobStore blobs;
    Simulation simulation;
    ViewSource view;
    Report report;
    FrameMaker maker;
    FramePacing pacing;
    StartScene startScene;
    bool sceneReady = false;
    bool stopping = false;

    // Last: their threads deliver into what stands above.
    Peers peers;
    Loader loader;
    Snapshots snapshots;
    MarkArrays marks;
    RequestDesk desk;
    SessionActions actions;
};

FrameLoop::FrameLoop(ServerOptions options, Log& log) : impl_(std::make_unique<Impl>(std::move(options), log)) {}
FrameLoop::~FrameLoop() = default;
Expected<void> FrameLoop::run() {
    return impl_->run();
}
void FrameLoop::stop() {
    if (impl_->inbox.tryPush(StopOrder{})) impl_->peers.wake();
}

FrameLoop::Impl::Impl(ServerOptions o, Log& l)
    : options(std::move(o)),
      log(l),
      simulation({.threads = options.threads}),
      view(options.wall, options.camera),
      report(options.wall, join(options.scenes)),
      maker({.simulation = simulation, .view = view, .blobs = blobs, .report = report, .log = log}),
      pacing(options.rateHz),
      startScene(options.scenes),
      peers(sessionConfigOf(options.wall), blobs, [this](LinkEvent event) { inbox.push(std::move(event)); }),
      loader(options.import, [this](LoadFinished finished) { deliver(std::move(finished)); }),
      snapshots(simulation, peers.session()),
      marks(blobs, peers.session()),
      desk({.wall = options.wall,
            .epoch = peers.epoch(),
            .blobs = blobs,
            .session = peers.session(),
            .simulation = simulation,
            .view = view,
            .loader = loader}),
      actions({.peers = peers,
               .pacing = pacing,
               .snapshots = snapshots,
               .desk = desk,
               .simulation = simulation,
               .report = report,
               .log = log,
               .onReleased = [this](std::uint64_t frames) {
                   if (options.onProgress) options.onProgress(frames, options.frames);
               }}) {}

Expected<void> FrameLoop::Impl::run() {
    if (Expected<void> begun = begin(); !begun) return begun;
    while (!(stopping && !pacing.frameOpen()) && !allFramesShown())
        if (Expected<void> turned = turn(); !turned) {
            actions.carryOut(peers.session().finish(turned.error().message));
            return turned;
        }
    sayGoodbye();
    return end();
}

Expected<void> FrameLoop::Impl::begin() {
    const Expected<std::uint16_t> port = peers.listen(options.listen);
    if (!port) return tl::unexpected(port.error());
    if (!options.recordPath.empty())
        if (Expected<void> begun = maker.record(options.recordPath, options.threads); !begun) return begun;
    actions.carryOut(marks.announce(Clock::now()));
    Address bound = options.listen;
    bound.port = *port;
    if (!bound.isLoopback())
        log.warning("the link is plain: neither encrypted nor authenticated; keep it on a network of the wall's own");
    if (options.onListening) options.onListening(bound);
    if (startScene.empty()) sceneIsThere();
    return startScene.order(loader, RequestDesk::kStartScene);
}

/// Waits for what happens next, takes all of it, and makes a frame when one is due.
Expected<void> FrameLoop::Impl::turn() {
    const TimePoint now = Clock::now();
    const Duration wait = std::max<Duration>(Duration{0}, nextWake(now) - now);
    std::optional<Event> event = nextEvent(wait);
    for (; event; event = inbox.tryPop()) {
        Expected<void> taken = std::visit([&](auto&& what) { return take(std::move(what)); }, std::move(*event));
        if (!taken) return taken;
    }
    actions.carryOut(peers.advance(Clock::now()));
    actions.carryOut(desk.advance(Clock::now()));
    if (const TimePoint later = Clock::now(); mayBegin(later) && later >= pacing.earliest(lastFrameShown()))
        makeFrame(later);
    return {};
}

/// Nobody else needs to be woken for what the network brings while this thread waits.
std::optional<Event> FrameLoop::Impl::nextEvent(Duration wait) {
    std::optional<Event> event = inbox.tryPop();
    if (event || wait <= Duration{0}) return event;
    return peers.attend(Clock::now() + wait) ? inbox.tryPop() : inbox.popFor(wait);
}

Expected<void> FrameLoop::Impl::end() {
    if (!options.reportPath.empty())
        if (Expected<void> written = writeReport(options.reportPath, report.toJson(simulation.scene())); !written)
            return written;
    if (options.frames > 0 && report.framesShown() == 0)
        return fail(ErrorCode::kFailed, stopping ? "stopped before a frame was shown"
                                                 : fmt::format("no frame was shown; hosts that never came: {}",
                                                               join(peers.session().missing())));
    return {};
}

Expected<void> FrameLoop::Impl::take(const LinkEvent& event) {
    actions.carryOut(peers.handle(event));
    return {};
}

Expected<void> FrameLoop::Impl::take(LoadFinished finished) {
    if (finished.ticket != RequestDesk::kStartScene) {
        if (finished.scene)
            for (const std::string& note : finished.scene->notes) log.info(finished.path + ": " + note);
        actions.carryOut(desk.loaded(std::move(finished), Clock::now()));
        return {};
    }
    Expected<std::optional<std::vector<ChangeList>>> lists = startScene.take(std::move(finished), log);
    if (!lists) return tl::unexpected(lists.error());
    if (!*lists) return {};
    if (Expected<void> loaded = maker.load(std::move(**lists)); !loaded) return loaded;
    sceneIsThere();
    return {};
}

Expected<void> FrameLoop::Impl::take(StopOrder) {
    stopping = true;
    return {};
}

void FrameLoop::Impl::sceneIsThere() {
    sceneReady = true;
    actions.carryOut(snapshots.sceneReady(Clock::now()));
}

bool FrameLoop::Impl::mayBegin(TimePoint now) const {
    return sceneReady && !stopping && !allFramesShown() && !pacing.frameOpen() && peers.session().mayBegin(now);
}

bool FrameLoop::Impl::lastFrameShown() const {
    return std::ranges::all_of(peers.session().hosts(), [&](const ServerSession::HostStatus& host) {
        return host.state != HostState::kLive ||
               (host.everShown && host.lastShown.next() >= peers.session().nextFrame());
    });
}

TimePoint FrameLoop::Impl::nextWake(TimePoint now) const {
    const TimePoint wake = std::min({now + kLongestWait, peers.session().nextDeadline(), desk.nextDeadline()});
    return mayBegin(now) ? std::min(wake, pacing.earliest(lastFrameShown())) : wake;
}

void FrameLoop::Impl::makeFrame(TimePoint now) {
    const FrameNumber number = peers.session().nextFrame();
    if (number == FrameNumber(0))
        if (const std::vector<std::string> missing = peers.session().missing(); !missing.empty())
            log.warning(fmt::format("starting without: {}", join(missing)));
    FrameMaker::Made made = maker.make(number, desk.takeEdits(), desk.takeReplies());
    report.frameBegins();
    pacing.began(now);
    actions.carryOut(peers.session().beginFrame(made.content, now));
    actions.carryOut(marks.named(made.result.commit.sent->blobs, Clock::now()));
    actions.carryOut(desk.committed(std::move(made.result), number, simulation.openQuestions()));
}

/// Lets everybody show the last frame, tells them that the show is over, and waits until they have gone.
void FrameLoop::Impl::sayGoodbye() {
    const TimePoint deadline = Clock::now() + kFarewell;
    bool told = false;
    while (Clock::now() < deadline && (!told || peers.connectionCount() > 0)) {
        if (!told && (lastFrameShown() || Clock::now() > deadline - kFarewell / 2)) {
            actions.carryOut(peers.session().finish("the show is over"));
            told = true;
        }
        while (std::optional<Event> event = nextEvent(20ms)) {
            if (const auto* link = std::get_if<LinkEvent>(&*event)) {
                ServerActions wanted = peers.handle(*link);
                // What comes after the end is no fault any more.
                if (told)
                    std::erase_if(
                        wanted, [](const ServerAction& a) { return std::holds_alternative<server_action::Fault>(a); });
                actions.carryOut(std::move(wanted));
            }
            if (!told && lastFrameShown()) break;
        }
        if (!told) actions.carryOut(peers.advance(Clock::now()));
    }
}

}  // namespace tessera

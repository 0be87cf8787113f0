#include "client/replica/HostProgram.h"

#include <fmt/format.h>
#include <sched.h>
#include <sys/resource.h>

#include <cstdlib>
#include <optional>
#include <thread>

#include "client/replica/HostCheck.h"
#include "client/replica/PartSharing.h"
#include "client/replica/RenderHost.h"
#include "client/replica/ServerLink.h"

namespace tessera {
namespace {

constexpr std::size_t kMaxEvents = 4096;
constexpr std::size_t kMaxWork = 1024;

unsigned coresHere() {
    cpu_set_t cores;
    return ::sched_getaffinity(0, sizeof cores, &cores) == 0 ? static_cast<unsigned>(std::max(1, CPU_COUNT(&cores)))
                                                             : 1;
}

/// What this host shares with its neighbours: its board, and a thread that hears them call.
class Neighbourhood {
public:
    Neighbourhood(Board made, SharingOptions options, Log& log)
        : board_(std::move(made)), sharing_(options, board_, log) {}
    ~Neighbourhood() { stop(); }

    [[nodiscard]] std::string place() const { return board_.place(); }
    [[nodiscard]] PartSharing& sharing() { return sharing_; }

    /// `called` is said on a thread of its own, once until `heard`.
    void listen(std::function<void()> called) {
        listener_ = std::thread([this, say = std::move(called)] {
            for (std::uint32_t seen = board_.calls(); !stopping_;) {
                board_.waitForCall(seen, std::chrono::seconds(1));
                const std::uint32_t now = board_.calls();
                if (std::exchange(seen, now) != now && !stopping_ && !said_.exchange(true)) say();
            }
        });
    }
    void heard() { said_ = false; }
    void stop() {
        stopping_ = true;
        board_.callMyself();
        if (listener_.joinable()) listener_.join();
    }

private:
    Board board_;
    PartSharing sharing_;
    std::atomic<bool> said_ = false, stopping_ = false;
    std::thread listener_;
};

/// Memory of neighbours is mapped beside one's own, through files: where the system gives this process few addresses or
/// files it does better alone, because what is missing then is missing anywhere, at the start of a thread for one.
bool roomToShare(Log& log) {
    constexpr rlim_t kAddresses = rlim_t{1} << 30, kFiles = 64;
    rlimit addresses{}, files{};
    if (::getrlimit(RLIMIT_AS, &addresses) != 0 || ::getrlimit(RLIMIT_NOFILE, &files) != 0) return true;
    if (addresses.rlim_cur >= kAddresses && files.rlim_cur >= kFiles) return true;
    log.info(fmt::format("this process may have {}: nothing is shared with hosts of this machine",
                         files.rlim_cur < kFiles ? fmt::format("{} open files", files.rlim_cur)
                                                 : fmt::format("{} MB of addresses", addresses.rlim_cur / 1'000'000)));
    return false;
}

/// Null where parts are not to be shared, or cannot be.
std::unique_ptr<Neighbourhood> makeNeighbourhood(const HostOptions& options, Log& log) {
    if (options.share == ShareMode::kOff || options.surface == "none" || machineIdentity().empty()) return nullptr;
    auto board = Board::create();
    if (!board) {
        log.warning(board.error().message);
        return nullptr;
    }
    return std::make_unique<Neighbourhood>(
        std::move(*board), SharingOptions{.mode = options.share, .cores = coresHere(), .threadsEach = options.threads},
        log);
}

}  // namespace

Expected<void> runHost(const HostOptions& wanted, Log& log) {
    HostOptions options = wanted;
    if (options.window)
        if (const Expected<void> can = checkWindows(options.windows); !can) return can;
    if (options.share != ShareMode::kOff && !roomToShare(log)) options.share = ShareMode::kOff;
    Channel<ServerLink::Event> events(kMaxEvents);
    WorkQueue work(kMaxWork);
    BlobStore store;
    std::atomic<std::uint64_t> steps = 0;  // of the draw thread, in long work

    std::unique_ptr<ServerLink> link;  // outlives the host, which speaks to it to its end

    std::unique_ptr<Surface> surface;
    if (options.surface != "none") {
        auto made = makeSurface(options.surface, {.device = options.device});
        if (!made) return tl::unexpected(made.error());
        surface = std::move(*made);
    }
    const std::unique_ptr<Neighbourhood> neighbourhood = makeNeighbourhood(options, log);
    std::optional<TileWindows> windows;
    if (options.window)
        windows.emplace(options.windows, log, [&](const InputState& state) {
            link->tell({Attempt{}, outcome::Input{state}});
        });
    RenderHost host({.name = options.name,
                     .output = options.output,
                     .culler = options.culler,
                     .keepFrames = options.keepFrames,
                     .injection = options.injection,
                     .anisotropy = options.anisotropy,
                     .glMemoryBytes = options.glMemoryBytes,
                     .sharing = neighbourhood ? &neighbourhood->sharing() : nullptr,
                     .workWaits = [&] { return work.more(); },
                     .windows = windows ? &*windows : nullptr,
                     .onStep = [&] { steps.fetch_add(1, std::memory_order_relaxed); }},
                    surface.get(), store, log, [&](Outcome outcome) { link->tell(std::move(outcome)); });
    const auto probe = host.probe();
    if (!probe) return failWith(surface->description(), probe.error());

    BlobShelf shelf(store, options.blobBudgetBytes);
    std::unique_ptr<SharedArrays> arrays;
    if (options.share != ShareMode::kOff) arrays = std::make_unique<SharedArrays>(log);
    std::unique_ptr<DiskCache> cache;
    if (!options.cache.empty()) {
        cache = std::make_unique<DiskCache>(options.cache, options.name, options.cacheBudgetBytes, log);
        cache->load([&](Blob blob) { shelf.put((arrays ? arrays->share(std::move(blob)) : std::move(blob)).paged()); });
    }
    link = std::make_unique<ServerLink>(
        ServerLinkOptions{.server = options.server,
                          .name = options.name,
                          .access = options.access,
                          .keys = options.keys,
                          .pixelProbe = *probe,
                          .machine = neighbourhood ? machineIdentity() : "",
                          .board = neighbourhood ? neighbourhood->place() : "",
                          .atOnce = [&](const Work& next) { return host.again(next); },
                          .ahead = true,
                          .showsNothingFrom = options.injection.kind == Injection::Kind::kShowHang
                                                  ? std::optional(FrameNumber(options.injection.frame))
                                                  : std::nullopt,
                          .service = options.service,
                          .drawSteps = &steps},
        shelf, cache.get(), arrays.get(), events, work, log);
    if (neighbourhood) neighbourhood->listen([&] { link->tell({Attempt{}, outcome::Called{}}); });
    // It can draw, and dials. Where there is no server yet it goes on dialling: to be started anew would not help.
    if (options.service) options.service->ready();
    HostEnd end;
    std::thread session([&] {
        end = link->run();
        // A draw thread that hangs cannot be joined, and nothing that it owns may be destroyed under it.
        if (link->drawThreadEnded()) return;
        log.flush();
        std::_Exit(1);
    });
    // However the work ends: the session speaks to its end, and what it uses outlives it.
    struct SessionEnd {
        ServerLink& link;
        std::thread& session;
        SessionEnd(ServerLink& ofLink, std::thread& thread) : link(ofLink), session(thread) {}
        ~SessionEnd() {
            link.tell({Attempt{}, outcome::Ended{}});
            session.join();
        }
    };
    std::optional<SessionEnd> sessionEnd;
    sessionEnd.emplace(*link, session);
    // Where nothing has come in hand for a moment there is time for what may be needed later.
    constexpr std::chrono::milliseconds kMoment(2);
    bool going = true, ahead = false;
    while (true) {
        const auto next = ahead ? work.popFor(kMoment) : work.pop();
        if (!next && !ahead) break;
        if (!next) {
            ahead = host.workAhead(clockNow());
            continue;
        }
        if (neighbourhood && std::holds_alternative<work::Help>(next->what)) neighbourhood->heard();
        // What is broken stays in hand: nobody else is to go on with it.
        if (going = going && host.perform(*next); going) work.done();
        steps.fetch_add(1, std::memory_order_relaxed);
        ahead = going;
    }
    sessionEnd.reset();
    if (neighbourhood) neighbourhood->stop();
    if (arrays && arrays->counts().own + arrays->counts().found > 0)
        log.detail(
            fmt::format("{} arrays ({} MB) lie in memory that other hosts here may share, {} ({} MB) were found there",
                        arrays->counts().own, arrays->counts().ownBytes / 1'000'000, arrays->counts().found,
                        arrays->counts().foundBytes / 1'000'000));
    if (end.over) return {};
    return tl::unexpected(end.error);
}

}  // namespace tessera

#include "client/replica/HostProgram.h"

#include <cstdlib>

namespace tessera {
namespace {

constexpr std::size_t kMaxEvents = 4096;
constexpr std::size_t kMaxWork = 1024;

}  // namespace

Expected<void> runHost(const HostOptions& options, Log& log) {
    Channel<ServerLink::Event> events(kMaxEvents);
    WorkQueue work(kMaxWork);
    BlobStore store;

    std::unique_ptr<ServerLink> link;  // outlives the host, which speaks to it to its end

    std::unique_ptr<Surface> surface;
    if (options.surface != "none") {
        auto made = makeSurface(options.surface);
        if (!made) return tl::unexpected(made.error());
        surface = std::move(*made);
    }
    RenderHost host({.name = options.name,
                     .output = options.output,
                     .culler = options.culler,
                     .keepFrames = options.keepFrames,
                     .injection = options.injection},
                    surface.get(), store, log, [&](Outcome outcome) { link->tell(std::move(outcome)); });
    const auto probe = host.probe();
    if (!probe) return failWith(surface->description(), probe.error());

    BlobShelf shelf(store, options.blobBudgetBytes);
    std::unique_ptr<DiskCache> cache;
    if (!options.cache.empty()) {
        cache = std::make_unique<DiskCache>(options.cache, options.name, options.cacheBudgetBytes, log);
        cache->load([&](Blob blob) { shelf.put(std::move(blob)); });
    }
    link = std::make_unique<ServerLink>(ServerLinkOptions{.server = options.server,
                                                          .name = options.name,
                                                          .pixelProbe = *probe,
                                                          .atOnce = [&](const Work& next) { return host.again(next); }},
                                        shelf, cache.get(), events, work, log);
    HostEnd end;
    std::thread session([&] {
        end = link->run();
        // A draw thread that hangs cannot be joined, and nothing that it owns may be destroyed under it.
        if (link->drawThreadEnded()) return;
        log.flush();
        std::_Exit(1);
    });
    // Where nothing has come in hand for a moment there is time for what may be needed later.
    constexpr std::chrono::milliseconds kMoment(2);
    bool going = true, ahead = false;
    while (true) {
        const auto next = ahead ? work.popFor(kMoment) : work.pop();
        if (!next && !ahead) break;
        if (!next) {
            ahead = host.workAhead();
            continue;
        }
        // What is broken stays in hand: nobody else is to go on with it.
        if (going = going && host.perform(*next); going) work.done();
        ahead = going;
    }
    link->tell({Attempt{}, outcome::Ended{}});
    session.join();
    if (end.over) return {};
    return tl::unexpected(end.error);
}

}  // namespace tessera

#include "client/replica/HostProgram.h"

#include <fmt/format.h>

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
    std::unique_ptr<SharedArrays> arrays;
    if (options.shareArrays) arrays = std::make_unique<SharedArrays>(log);
    std::unique_ptr<DiskCache> cache;
    if (!options.cache.empty()) {
        cache = std::make_unique<DiskCache>(options.cache, options.name, options.cacheBudgetBytes, log);
        cache->load([&](Blob blob) { shelf.put(arrays ? arrays->share(std::move(blob)) : std::move(blob)); });
    }
    link = std::make_unique<ServerLink>(ServerLinkOptions{.server = options.server,
                                                          .name = options.name,
                                                          .pixelProbe = *probe,
                                                          .atOnce = [&](const Work& next) { return host.again(next); }},
                                        shelf, cache.get(), arrays.get(), events, work, log);
    HostEnd end;
    std::thread session([&] {
        end = link->run();
        // A draw thread that hangs cannot be joined, and nothing that it owns may be destroyed under it.
        if (link->drawThreadEnded()) return;
        log.flush();
        std::_Exit(1);
    });
    bool going = true;
    while (const auto next = work.pop()) {
        // What is broken stays in hand: nobody else is to go on with it.
        if (going = going && host.perform(*next); going) work.done();
    }
    link->tell({Attempt{}, outcome::Ended{}});
    session.join();
    if (arrays && arrays->counts().own + arrays->counts().found > 0)
        log.info(fmt::format("arrays: {} of {} MB lie in memory that other hosts here may share, {} of {} MB were found there",
                             arrays->counts().own, arrays->counts().ownBytes / 1'000'000, arrays->counts().found,
                             arrays->counts().foundBytes / 1'000'000));
    if (end.over) return {};
    return tl::unexpected(end.error);
}

}  // namespace tessera

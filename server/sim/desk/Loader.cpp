#include "server/sim/desk/Loader.h"

#include <sys/resource.h>
#include <unistd.h>

namespace tessera {

Loader::Loader(ImportOptions options, std::vector<std::string> allowed, std::function<void(LoadFinished)> onFinished)
    : options_(std::move(options)),
      readable_{.folders = std::move(allowed), .assets = options_.assetFolders},
      onFinished_(std::move(onFinished)),
      thread_([this] {
          while (std::optional<LoadOrder> order = orders_.pop()) onFinished_(carryOut(*order));
      }) {}

LoadFinished Loader::carryOut(const LoadOrder& order) const {
    constexpr int kLowestPriority = 19;
    // Of this thread, on Linux; the importer that it starts inherits it. Where that is forbidden the load is as it
    // would be.
    if (order.asked) (void)::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), kLowestPriority);
    LoadFinished finished{.ticket = order.ticket, .path = order.path, .scene = read(order)};
    if (!order.asked || !finished.scene) return finished;
    // All that takes long with a large scene is done here, to the freeing of what is not needed any more.
    finished.arrays = blobsOf(finished.scene->list);
    finished.parts = cutForFrames(std::exchange(finished.scene->list, {}));
    finished.scene->later = {};
    return finished;
}

Loader::~Loader() {
    orders_.close();
    while (orders_.tryPop()) {
    }
    thread_.join();
}

/// Here and not where the order comes from: folders may be slow.
Expected<ImportedScene> Loader::read(const LoadOrder& order) const {
    ImportOptions options = options_;
    options.placing = order.placing;
    if (!order.asked) return importScene(order.path, order.parent, options);
    const Expected<std::string> path = readableFile(order.path, readable_);
    if (!path) return tl::unexpected(path.error());
    options.resolved = path->find("://") == std::string::npos;
    return importScene(*path, order.parent, options);
}

}  // namespace tessera

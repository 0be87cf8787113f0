#include "server/sim/desk/Loader.h"

#include <sys/resource.h>
#include <unistd.h>

namespace tessera {

Loader::Loader(ImportOptions options, std::function<void(LoadFinished)> onFinished)
    : options_(std::move(options)), onFinished_(std::move(onFinished)), thread_([this] {
          while (std::optional<LoadOrder> order = orders_.pop()) onFinished_(carryOut(*order));
      }) {}

LoadFinished Loader::carryOut(const LoadOrder& order) const {
    constexpr int kLowestPriority = 19;
    // Of this thread, on Linux; the importer that it starts inherits it. Where that is forbidden the load is as it would be.
    if (order.beside) (void)::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), kLowestPriority);
    LoadFinished finished{.ticket = order.ticket,
                          .path = order.path,
                          .scene = importScene(order.path, order.parent, options_)};
    if (!order.beside || !finished.scene) return finished;
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

}  // namespace tessera

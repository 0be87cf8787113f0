#include "server/sim/desk/Loader.h"

namespace tessera {

Loader::Loader(ImportOptions options, std::function<void(LoadFinished)> onFinished)
    : options_(std::move(options)), onFinished_(std::move(onFinished)), thread_([this] {
          while (std::optional<LoadOrder> order = orders_.pop())
              onFinished_({.ticket = order->ticket,
                           .path = order->path,
                           .scene = importScene(order->path, order->parent, options_)});
      }) {}

Loader::~Loader() {
    orders_.close();
    while (orders_.tryPop()) {
    }
    thread_.join();
}

}  // namespace tessera

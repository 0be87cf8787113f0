#include "server/sim/desk/Workbench.h"

#include <sys/resource.h>

#include <limits>
#include <utility>

namespace tessera {

Workbench::Workbench(std::function<void(WorkedOut)> deliver)
    : deliver_(std::move(deliver)), works_(std::numeric_limits<std::size_t>::max()), thread_([this] { run(); }) {}

Workbench::~Workbench() {
    works_.close();
    while (works_.tryPop()) {
    }
    thread_.join();
}

void Workbench::run() {
    constexpr int kNice = 10;                     // somebody waits for it: behind the frames, and not behind everything
    (void)::setpriority(PRIO_PROCESS, 0, kNice);  // Linux: of this thread
    while (const std::optional<std::function<WorkedOut()>> work = works_.pop()) deliver_((*work)());
}

}  // namespace tessera

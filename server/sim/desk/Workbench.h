/// A thread for what takes longer than a frame and needs no scene.
#pragma once

#include <functional>
#include <thread>

#include "common/base/Channel.h"
#include "common/base/Clock.h"
#include "common/session/ServerSession.h"

namespace tessera {

/// What is to be done on the frame thread once something has been worked out elsewhere. Returns what the session wants.
using WorkedOut = std::function<ServerActions(TimePoint now)>;

[[nodiscard]] inline WorkedOut withoutWord(std::function<void()> then) {
    return [then = std::move(then)](TimePoint) { return then(), ServerActions(); };
}

/// One piece of work behind the other, behind the frames. `deliver` is called on the thread of its
/// own, all else by the frame thread.
class Workbench {
public:
    explicit Workbench(std::function<void(WorkedOut)> deliver);
    /// Waits for the piece that is under way.
    ~Workbench();
    void add(std::function<WorkedOut()> work) { (void)works_.push(std::move(work)); }

private:
    void run();

    std::function<void(WorkedOut)> deliver_;
    Channel<std::function<WorkedOut()>> works_;
    std::thread thread_;
};

}  // namespace tessera

/// Work that takes longer than a frame and needs no scene.
#pragma once

#include <functional>
#include <memory>
#include <utility>

#include "common/base/Lane.h"
#include "common/session/ServerSession.h"

namespace tessera {

/// What is to be done on the frame thread once something has been worked out elsewhere. Returns what the session wants.
using WorkedOut = std::function<ServerActions(TimePoint now)>;

[[nodiscard]] inline WorkedOut withoutWord(std::function<void()> then) {
    return [then = std::move(then)](TimePoint) { return then(), ServerActions(); };
}

/// One piece of work behind the other, behind the frames. `deliver` is called by the lane, all else by the frame
/// thread. Destruction waits for the piece that is under way.
class Workbench {
public:
    Workbench(std::function<void(WorkedOut)> deliver, const MakeLane& lane)
        : deliver_(std::move(deliver)), lane_(lane({.nice = kNice})) {}
    void add(std::function<WorkedOut()> work) {
        lane_->post([this, work = std::move(work)] { deliver_(work()); });
    }

private:
    static constexpr int kNice = 10;  ///< somebody waits for it: behind the frames, and not behind everything

    std::function<void(WorkedOut)> deliver_;
    std::unique_ptr<Lane> lane_;
};

}  // namespace tessera

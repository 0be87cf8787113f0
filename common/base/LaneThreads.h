/// Lanes on threads.
#pragma once

#include <condition_variable>
#include <deque>
#include <map>
#include <mutex>
#include <thread>
#include <vector>

#include "common/base/Lane.h"

namespace tessera {

/// As many threads as it is wide, from its making to its end.
class LaneThreads final : public Lane {
public:
    explicit LaneThreads(const LaneOptions& options);
    ~LaneThreads() override;
    [[nodiscard]] static std::unique_ptr<Lane> make(const LaneOptions& options) {
        return std::make_unique<LaneThreads>(options);
    }

    void post(Piece piece) override;
    void postAt(TimePoint due, Piece piece) override;
    void finish() override;

private:
    enum class Ending : std::uint8_t { kNot, kWhenDone, kNow };
    void run();
    void end(Ending how);
    /// The next that may begin; empty: there is none, and `waitUntil` says when there may be.
    [[nodiscard]] Piece take(TimePoint& waitUntil);

    std::mutex mutex_;
    std::condition_variable news_;
    std::deque<Piece> pieces_;
    std::multimap<TimePoint, Piece> later_;
    Ending ending_ = Ending::kNot;
    std::vector<std::thread> threads_;
};

}  // namespace tessera

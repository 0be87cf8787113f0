/// A wall's trackers as they come in: sockets, parsers, and who may speak.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <vector>

#include "common/base/Channel.h"
#include "common/base/Log.h"
#include "common/net/Platform.h"
#include "common/wall/Wall.h"
#include "server/sim/tracking/Tracking.h"

namespace tessera {

/// Hears all trackers of a wall, on the thread of their feeds (common/net/Feeds), and hands over what they say through
/// a bounded channel. Other bytes are counted, and said once per tracker and kind of fault; nothing that
/// comes ends anything.
///
/// Costs are bounded: of one port at most Feeds::kMostInSlice datagrams in 16 ms are taken from the system, of them at
/// most kMostParsed are read; the others are counted.
class TrackerInputs {
public:
    static constexpr int kMostParsed = 250;            ///< datagrams of one tracker in one Feeds::kSlice
    static constexpr std::size_t kMostWaiting = 2048;  ///< readings that no frame has taken
    /// Log lines of one tracker in all; then it is silent, and `tessera-ctl trackers` tells.
    static constexpr int kMostSaid = 20;

    /// For a wall without trackers nothing is opened. `log` and `platform` outlive it.
    TrackerInputs(const WallTracking& tracking, const Platform& platform, Log& log);
    ~TrackerInputs();

    /// kNetwork: a port that cannot be listened at, by the tracker's name. VRPN's servers are dialled until they are
    /// there.
    [[nodiscard]] Expected<void> open();
    /// What has come since the last call, in the order of its coming. Any thread, one at a time; never waits.
    [[nodiscard]] std::vector<TrackerReading> take();
    /// Adds what the bytes cost to `Tracking::describe`.
    void describe(std::vector<TrackerInfo>& trackers) const;

private:
    class Input;
    WallTracking tracking_;
    const Platform& platform_;
    Log& log_;
    Channel<TrackerReading> readings_{kMostWaiting};
    std::vector<std::unique_ptr<Input>> inputs_;
    std::unique_ptr<Feeds> feeds_;  ///< last: its thread ends first
};

}  // namespace tessera

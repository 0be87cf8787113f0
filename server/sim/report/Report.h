/// What report.json says, collected while the wall runs.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/codec/FrameCodec.h"
#include "common/request/StatusRequests.h"
#include "common/session/ServerSession.h"
#include "server/sim/frame/Frame.h"
#include "server/sim/report/CollisionReport.h"
#include "server/sim/report/Series.h"
#include "server/sim/report/WaitStatistics.h"
#include "server/sim/view/ExposureMeter.h"
#include "server/sim/view/FrameBudget.h"

namespace tessera {

struct SceneCounts {
    std::uint64_t nodes = 0, cores = 0;
    std::uint64_t triangles = 0;        ///< instanced
    std::uint64_t trianglesStored = 0;  ///< each geometry core once
    /// What ProxyGroups say of content that is not there; none of it is in the numbers above.
    std::uint64_t promised = 0, promisedNodes = 0, promisedTriangles = 0;
};
[[nodiscard]] SceneCounts countScene(const Aspect& scene);

/// Bounded by the wall, however long it runs (Series).
class Report {
public:
    /// Of more faults those in between are left out and counted.
    static constexpr std::size_t kFirstFaults = 100, kLastFaults = 400;

    Report(const Wall& wall, std::string scene);

    void frameCommitted(const FrameResult& frame);
    /// `dueHosts`: hosts of the wall, whether there or not.
    void released(const server_action::FrameReleased& action);
    void stats(const server_action::FrameStats& action, const HostStats& stats);
    void shown(const server_action::FrameShown& action);
    void frameBegins();
    void fault(const server_action::Fault& action);
    void entered(const server_action::HostEntered& action);
    void mismatch(const std::string& host, const std::string& object);

    /// Where --journal is kept; `trouble` where it is not, at the end.
    void journal(const std::string& folder, std::uint64_t bytes, const std::optional<Error>& trouble);

    [[nodiscard]] std::uint64_t framesShown() const { return framesShown_; }
    /// The newest frames' waits, for who asks while the wall runs.
    void describeWaits(answer::Status& status) const;
    [[nodiscard]] std::string toJson(const Aspect& scene, const FrameBudget& budget,
                                     const ExposureMeter& exposure) const;

private:
    struct TileRow {
        std::string tile, host;
        std::uint64_t shown = 0, missed = 0;
        Series cullMs, drawMs;
        std::uint64_t still = 0;                                                ///< frames that needed no new picture
        TileStats last;                                                         ///< of the last frame
        std::uint64_t divided = 0, parts = 0, partsHelped = 0, partsTwice = 0;  ///< frames; over the run
    };
    struct FaultRow {
        FrameNumber frame;
        std::string host, kind, detail;
        double detectedMs = 0;
        double rejoinedMs = -1;
    };

    Wall wall_;
    std::string scene_;
    std::vector<TileRow> tiles_;
    std::vector<FaultRow> faults_;
    std::uint64_t faultsLeftOut_ = 0;  ///< between the first and the last
    std::map<std::string, std::uint64_t> lastShown_;
    /// Of one frame: when the first host showed it, and the last.
    struct SwapInstants {
        std::int64_t firstNs = 0, lastNs = 0;
        std::string last;
        [[nodiscard]] double spreadMs() const { return static_cast<double>(lastNs - firstNs) * 1e-6; }
    };
    /// The widest spread of the run.
    struct WorstSwap {
        std::uint64_t frame = 0;
        double ms = -1;
        std::string last;
    };
    static void note(WorstSwap& worst, std::uint64_t frame, const SwapInstants& instants);
    static constexpr std::size_t kUnsettledFrames = 1024;  ///< 17 s of a wall at 60 Hz
    std::map<std::uint64_t, SwapInstants> swapInstants_;   ///< by frame: those that hosts may still speak of
    std::uint64_t settledBefore_ = 0;                      ///< what is said of older frames comes too late
    WorstSwap worstSwap_;
    std::map<std::string, std::uint64_t> waitedFor_;
    WaitStatistics waits_;
    struct Help {
        std::uint64_t parts = 0;
        double ms = 0;
    };
    std::map<std::string, Help> helped_;  ///< by host: what it drew for its neighbours
    Series frameMs_, barrierMs_, swapSpreadMs_, collisionMs_;
    std::uint64_t framesShown_ = 0, worstSkew_ = 0;
    std::uint64_t lists_ = 0, changes_ = 0, bytes_ = 0, mismatches_ = 0, resnapshots_ = 0;
    CollisionReport collision_;
    struct JournalRow {
        std::string folder;
        std::uint64_t bytes = 0;
        std::string trouble;
    };
    std::optional<JournalRow> journal_;
};

}  // namespace tessera

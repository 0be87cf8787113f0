/// Which tile the wall waited for, how long, and what that tile did meanwhile.
#pragma once

#include <array>
#include <deque>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "common/codec/FrameCodec.h"
#include "common/session/ServerSession.h"
#include "common/wall/Wall.h"

namespace tessera {

/// What a host's time from Begin to Ready went to. All but `kNetwork` by the host's own clock, without the time in
/// which its draw thread waited for a processor: that is `kProcessor`.
enum class WaitReason : std::uint8_t {
    kApply,  ///< the change list
    kCull,
    kDraw,        ///< uploads, compiling and the read-back included: a software rasteriser draws when it is read
    kHandOver,    ///< the picture laid where it is shown from
    kProcessor,   ///< no processor was free
    kStoodStill,  ///< the rest of its work: it slept, or its disk was slow. Stopped (SIGSTOP) while it draws it draws
                  ///< for long
    kNetwork,     ///< there and back, both queues included: of a host that is stopped before it looks, too
    kGone,        ///< it left the barrier, or was left behind: nobody knows
};
inline constexpr std::size_t kWaitReasons = 8;
/// e.g. "draw"; also the key in report.json.
[[nodiscard]] std::string_view nameOf(WaitReason reason);

/// For each released frame: the last host to be ready (server's clock), and how long all others had been ready by then.
/// The last and the one before it both told what their time went to; what the last one spent more, piece by piece, adds
/// up to just the time that the others waited. Of the last host's tiles the one that took longest is named. Frames of a
/// single host are not counted: nobody waited.
///
/// Bounded by the wall. One thread.
class WaitStatistics {
public:
    using Parts = std::array<double, kWaitReasons>;  ///< ms; may be negative where the host before spent more
    struct Row {
        std::string tile, host;
        std::uint64_t frames = 0;                 ///< in which the wall waited for it
        double ms = 0, longestMs = 0;             ///< that the others waited
        Parts why{};                              ///< adds up to `ms`
        [[nodiscard]] WaitReason reason() const;  ///< the largest part
    };
    /// So many frames back `recent` looks.
    static constexpr std::size_t kRecent = 512;

    explicit WaitStatistics(const Wall& wall);

    /// What a host said with its Ready; before the frame's release where that came of it.
    void ready(const std::string& host, FrameNumber frame, const HostStats& stats);
    void released(const server_action::FrameReleased& action);

    /// Over the run, and over the last frames; those that others waited for longest first. Tiles that nobody waited for
    /// are left away.
    [[nodiscard]] std::vector<Row> all() const { return sorted(rows_); }
    [[nodiscard]] std::vector<Row> recent() const;
    /// Frames that `recent` looks at.
    [[nodiscard]] std::size_t recentFrames() const { return recent_.size(); }

private:
    struct Said {
        FrameNumber frame;
        HostStats stats;
    };
    struct Waited {
        std::size_t row = 0;
        bool waited = false;
        double ms = 0;
        Parts why{};
    };
    [[nodiscard]] Waited judge(const server_action::FrameReleased& action) const;
    [[nodiscard]] const HostStats* said(const std::string& host, FrameNumber frame) const;
    [[nodiscard]] std::size_t rowOf(const std::string& host, const HostStats* stats) const;
    static void add(Row& row, const Waited& waited);
    [[nodiscard]] static std::vector<Row> sorted(std::vector<Row> rows);

    std::vector<Row> rows_;  ///< a tile each
    std::map<std::string, Said> said_;
    std::deque<Waited> recent_;
};

}  // namespace tessera

#include "server/sim/report/WaitStatistics.h"

#include <algorithm>
#include <functional>

namespace tessera {
namespace {

/// What `took` went to, piece by piece; adds up to it.
WaitStatistics::Parts partsOf(const HostStats& stats, Duration took) {
    WaitStatistics::Parts parts{};
    const auto part = [&](WaitReason reason) -> double& { return parts[static_cast<std::size_t>(reason)]; };
    double known = 0;
    // A reading of the queue lies beside one of the clock, not at the same instant.
    const auto spend = [&](WaitReason reason, double ms, double queuedMs) {
        const double queued = std::min(ms, queuedMs);
        part(reason) += ms - queued;
        part(WaitReason::kProcessor) += queued;
        known += ms;
    };
    spend(WaitReason::kApply, stats.applyMs, stats.applyQueuedMs);
    for (const TileStats& tile : stats.tiles) {
        spend(WaitReason::kCull, tile.cullMs, tile.cullQueuedMs);
        spend(WaitReason::kDraw, tile.drawMs, tile.drawQueuedMs);
        spend(WaitReason::kHandOver, tile.handOverMs, 0);
    }
    part(WaitReason::kStoodStill) = std::max(0.0, stats.workMs - known);
    part(WaitReason::kNetwork) = toMilliseconds(took) - known - part(WaitReason::kStoodStill);
    return parts;
}

}  // namespace

std::string_view nameOf(WaitReason reason) {
    static constexpr std::array<std::string_view, kWaitReasons> kNames = {
        "apply", "cull", "draw", "hand_over", "processor", "stood_still", "network", "gone"};
    return kNames[static_cast<std::size_t>(reason)];
}

WaitReason WaitStatistics::Row::reason() const {
    return static_cast<WaitReason>(std::ranges::max_element(why) - why.begin());
}

WaitStatistics::WaitStatistics(const Wall& wall) {
    for (const Tile& tile : layoutTiles(wall)) rows_.push_back({.tile = tile.name, .host = tile.host});
}

void WaitStatistics::ready(const std::string& host, FrameNumber frame, const HostStats& stats) {
    if (std::ranges::find(rows_, host, &Row::host) != rows_.end()) said_[host] = {frame, stats};
}

void WaitStatistics::released(const server_action::FrameReleased& action) {
    if (action.shown.empty()) return;
    const Waited waited = judge(action);
    if (waited.waited) add(rows_[waited.row], waited);
    recent_.push_back(waited);
    if (recent_.size() > kRecent) recent_.pop_front();
}

WaitStatistics::Waited WaitStatistics::judge(const server_action::FrameReleased& action) const {
    const HostStats* const last = said(action.lastHost, action.frame);
    Waited waited{.row = rowOf(action.lastHost, last), .ms = toMilliseconds(action.wait.alone)};
    waited.waited = waited.row < rows_.size() && !action.wait.before.empty();
    const HostStats* const before = said(action.wait.before, action.frame);
    if (!action.wait.drew || !last || !before) {
        waited.why[static_cast<std::size_t>(WaitReason::kGone)] = waited.ms;
        return waited;
    }
    const Parts more = partsOf(*last, action.wait.took), less = partsOf(*before, action.wait.beforeTook);
    std::ranges::transform(more, less, waited.why.begin(), std::minus<>());
    return waited;
}

const HostStats* WaitStatistics::said(const std::string& host, FrameNumber frame) const {
    const auto found = said_.find(host);
    return found != said_.end() && found->second.frame == frame ? &found->second.stats : nullptr;
}

/// Of the host's tiles the one that took longest in this frame; the first where nobody knows.
std::size_t WaitStatistics::rowOf(const std::string& host, const HostStats* stats) const {
    std::size_t row = rows_.size();
    double longest = -1;
    for (std::size_t i = 0; i < rows_.size(); ++i) {
        if (rows_[i].host != host) continue;
        double ms = 0;
        if (stats)
            for (const TileStats& tile : stats->tiles)
                if (tile.tile == rows_[i].tile) ms = tile.cullMs + tile.drawMs + tile.handOverMs;
        if (ms > longest) {
            longest = ms;
            row = i;
        }
    }
    return row;
}

void WaitStatistics::add(Row& row, const Waited& waited) {
    ++row.frames;
    row.ms += waited.ms;
    row.longestMs = std::max(row.longestMs, waited.ms);
    std::ranges::transform(row.why, waited.why, row.why.begin(), std::plus<>());
}

std::vector<WaitStatistics::Row> WaitStatistics::recent() const {
    std::vector<Row> rows;
    for (const Row& row : rows_) rows.push_back({.tile = row.tile, .host = row.host});
    for (const Waited& waited : recent_)
        if (waited.waited) add(rows[waited.row], waited);
    return sorted(std::move(rows));
}

std::vector<WaitStatistics::Row> WaitStatistics::sorted(std::vector<Row> rows) {
    std::erase_if(rows, [](const Row& row) { return row.frames == 0; });
    std::ranges::stable_sort(rows, std::greater<>(), &Row::ms);
    return rows;
}

}  // namespace tessera

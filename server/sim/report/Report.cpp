#include "server/sim/report/Report.h"

#include <algorithm>
#include <set>

#include <nlohmann/json.hpp>

#include "common/drawable/Drawable.h"
#include "common/scene/Action.h"
#include "server/sim/frame/InlineContents.h"

namespace tessera {
namespace {

using Json = nlohmann::ordered_json;

Json seriesJson(const Series& series) {
    return {{"p50", series.quantile(0.5)}, {"p99", series.quantile(0.99)}, {"max", series.quantile(1.0)}};
}

Json waitsJson(const std::vector<WaitStatistics::Row>& rows) {
    Json waits = Json::array();
    for (const WaitStatistics::Row& row : rows) {
        Json why = Json::object();
        for (std::size_t i = 0; i < kWaitReasons; ++i)
            why[std::string(nameOf(static_cast<WaitReason>(i)))] = row.why[i];
        waits.push_back({{"tile", row.tile},
                         {"host", row.host},
                         {"frames", row.frames},
                         {"ms", row.ms},
                         {"longest_ms", row.longestMs},
                         {"reason", std::string(nameOf(row.reason()))},
                         {"why_ms", std::move(why)}});
    }
    return waits;
}

}  // namespace

SceneCounts countScene(const Aspect& scene) {
    SceneCounts counts;
    for (const ObjectId id : scene.ids()) {
        ++(scene.get<Node>(id) ? counts.nodes : counts.cores);
        if (const Drawable drawable = drawableOf(scene.find(id))) counts.trianglesStored += drawable.triangleCount();
    }
    Action action;
    action.visitHidden(true);
    action.onNode([&](const Visit& visit) {
        if (const Drawable drawable = drawableOf(scene, visit.node)) counts.triangles += drawable.triangleCount();
        const auto wish = visit.node.core ? loadWishOf(scene.find(visit.node.core)) : std::nullopt;
        if (wish && wish->promises && wish->state != LoadWords::kThere) {
            ++counts.promised;
            counts.promisedNodes += static_cast<std::uint64_t>(wish->nodes);
            counts.promisedTriangles += static_cast<std::uint64_t>(wish->triangles);
        }
        return Descend::kInto;
    });
    action.run(scene);
    return counts;
}

Report::Report(const Wall& wall, std::string scene) : wall_(wall), scene_(std::move(scene)), waits_(wall) {
    for (const Tile& tile : layoutTiles(wall)) tiles_.push_back({.tile = tile.name, .host = tile.host});
}

void Report::frameCommitted(const FrameResult& frame) {
    if (frame.commit.list) {
        ++lists_;
        changes_ += frame.commit.list->changeCount();
        bytes_ += frame.commit.sent->encoded.size();
    }
    collisionMs_.add(frame.collisionMs);
    collision_.frameDone(frame.collision);
}

void Report::released(const server_action::FrameReleased& action) {
    waits_.released(action);
    const std::set<std::string> shown(action.shown.begin(), action.shown.end());
    for (TileRow& row : tiles_) ++(shown.contains(row.host) ? row.shown : row.missed);
    if (shown.empty()) return;
    ++framesShown_;
    frameMs_.add(toMilliseconds(action.frameTime));
    barrierMs_.add(toMilliseconds(action.barrierTime));
    if (!action.lastHost.empty()) ++waitedFor_[action.lastHost];
}

void Report::stats(const server_action::FrameStats& action, const HostStats& stats) {
    waits_.ready(action.host, action.frame, stats);
    if (stats.helpedParts > 0) {
        Help& help = helped_[action.host];
        help.parts += stats.helpedParts;
        help.ms += stats.helpMs;
    }
    for (const TileStats& tile : stats.tiles) {
        const auto row = std::ranges::find_if(
            tiles_, [&](const TileRow& r) { return r.tile == tile.tile && r.host == action.host; });
        if (row == tiles_.end()) continue;
        row->cullMs.add(tile.cullMs);
        row->drawMs.add(tile.drawMs);
        row->still += tile.drawMs > 0 ? 0 : 1;
        row->last = tile;
        row->divided += tile.parts > 0 ? 1 : 0;
        row->parts += tile.parts;
        row->partsHelped += tile.partsHelped;
        row->partsTwice += tile.partsTwice;
    }
}

void Report::shown(const server_action::FrameShown& action) {
    lastShown_[action.host] = action.frame.value;
    if (action.frame.value < settledBefore_) return;
    const auto [it, isNew] =
        swapInstants_.try_emplace(action.frame.value, SwapInstants{action.shownAtNs, action.shownAtNs, action.host});
    SwapInstants& instants = it->second;
    instants.firstNs = std::min(instants.firstNs, action.shownAtNs);
    if (action.shownAtNs > instants.lastNs) instants.lastNs = action.shownAtNs, instants.last = action.host;
    // A frame's spread is settled once everybody is far on: under hold a host may say long after the others that it
    // shows.
    while (swapInstants_.size() > kUnsettledFrames) {
        const auto& [frame, oldest] = *swapInstants_.begin();
        swapSpreadMs_.add(oldest.spreadMs());
        note(worstSwap_, frame, oldest);
        settledBefore_ = frame + 1;
        swapInstants_.erase(swapInstants_.begin());
    }
}

void Report::note(WorstSwap& worst, std::uint64_t frame, const SwapInstants& instants) {
    if (instants.spreadMs() > worst.ms) worst = {frame, instants.spreadMs(), instants.last};
}

void Report::frameBegins() {
    if (lastShown_.size() < 2) return;
    std::uint64_t low = lastShown_.begin()->second, high = low;
    for (const auto& [host, frame] : lastShown_) {
        low = std::min(low, frame);
        high = std::max(high, frame);
    }
    worstSkew_ = std::max(worstSkew_, high - low);
}

void Report::fault(const server_action::Fault& action) {
    // The first say how it began, the last how it is.
    if (faults_.size() == kFirstFaults + kLastFaults) {
        faults_.erase(faults_.begin() + kFirstFaults);
        ++faultsLeftOut_;
    }
    faults_.push_back({.frame = action.frame,
                       .host = action.host,
                       .kind = std::string(nameOf(action.kind)),
                       .detail = action.detail,
                       .detectedMs = toMilliseconds(action.detectedAfter)});
    lastShown_.erase(action.host);  // what a lost host shows is no skew of those that are there
    if (action.kind == FaultKind::kStateMismatch) ++mismatches_;
}

void Report::entered(const server_action::HostEntered& action) {
    if (!action.rejoined) return;
    ++resnapshots_;
    for (auto row = faults_.rbegin(); row != faults_.rend(); ++row) {
        if (row->host != action.host || row->rejoinedMs >= 0) continue;
        row->rejoinedMs = toMilliseconds(action.awayFor);
        break;
    }
}

void Report::mismatch(const std::string& host, const std::string& object) {
    for (auto row = faults_.rbegin(); row != faults_.rend(); ++row) {
        if (row->host != host || row->kind != nameOf(FaultKind::kStateMismatch)) continue;
        row->detail = object;
        break;
    }
}

void Report::journal(const std::string& folder, std::uint64_t bytes, const std::optional<Error>& trouble) {
    journal_ = {.folder = folder, .bytes = bytes, .trouble = trouble ? trouble->message : std::string()};
}

void Report::describeWaits(answer::Status& status) const {
    constexpr std::size_t kMostRows = 64;
    const auto figures = [](const Series& series) {
        return answer::Figures{series.count(), series.quantile(0.5), series.quantile(0.99)};
    };
    status.frames = figures(frameMs_);
    status.barrier = figures(barrierMs_);
    status.waitFrames = waits_.recentFrames();
    for (const WaitStatistics::Row& row : waits_.recent()) {
        if (status.waits.size() == kMostRows) break;
        status.waits.push_back({row.tile, row.host, row.frames, row.ms, std::string(nameOf(row.reason()))});
    }
}

std::string Report::toJson(const Aspect& scene, const FrameBudget& budget, const ExposureMeter& exposure) const {
    const SceneCounts counts = countScene(scene);
    Series spread = swapSpreadMs_;
    WorstSwap worst = worstSwap_;
    for (const auto& [frame, instants] : swapInstants_) {
        spread.add(instants.spreadMs());
        note(worst, frame, instants);
    }

    Json report;
    report["wall"] = wall_.name;
    report["scene"] = {{"file", scene_},
                       {"nodes", counts.nodes},
                       {"cores", counts.cores},
                       {"triangles", counts.triangles},
                       {"triangles_stored", counts.trianglesStored}};
    if (counts.promised > 0)
        report["scene"]["promised"] = {
            {"proxies", counts.promised}, {"nodes", counts.promisedNodes}, {"triangles", counts.promisedTriangles}};
    report["frames"] = framesShown_;
    report["frame_ms"] = seriesJson(frameMs_);
    report["sync"] = {{"barrier_ms", seriesJson(barrierMs_)},
                      {"swap_spread_ms", seriesJson(spread)},
                      {"worst_skew_frames", worstSkew_},
                      {"waited_for", waitedFor_},
                      {"waits", waitsJson(waits_.all())}};
    if (worst.ms >= 0) report["sync"]["widest_swap"] = {{"frame", worst.frame}, {"ms", worst.ms}, {"last", worst.last}};
    report["detail"] = {{"budget_ms", budget.milliseconds()},
                        {"step", budget.step()},
                        {"frames_at", budget.framesAt()},
                        {"changes", budget.changes()},
                        {"late", budget.late()}};
    report["exposure"] = {
        {"metered", exposure.meters()}, {"stops", exposure.exposure().foundStops()}, {"changes", exposure.changes()}};
    report["helped"] = Json::object();
    for (const auto& [host, help] : helped_) report["helped"][host] = {{"parts", help.parts}, {"ms", help.ms}};
    report["replication"] = {{"lists", lists_},
                             {"changes", changes_},
                             {"bytes", bytes_},
                             {"state_hash_mismatches", mismatches_},
                             {"resnapshots", resnapshots_}};
    report["collision"] = collision_.toJson(scene);
    report["collision"]["ms"] = seriesJson(collisionMs_);
    report["tiles"] = Json::array();
    for (const TileRow& row : tiles_)
        report["tiles"].push_back({{"tile", row.tile},
                                   {"host", row.host},
                                   {"shown", row.shown},
                                   {"missed", row.missed},
                                   {"cull_ms", seriesJson(row.cullMs)},
                                   {"draw_ms", seriesJson(row.drawMs)},
                                   {"still_frames", row.still},
                                   {"in_frustum", row.last.inFrustum},
                                   {"drawn", row.last.drawn},
                                   {"triangles_drawn", row.last.trianglesDrawn},
                                   {"queries", row.last.queries},
                                   {"query_waits", row.last.waits},
                                   {"depth_triangles", row.last.depthTriangles},
                                   {"divided", row.divided},
                                   {"parts", row.parts},
                                   {"parts_helped", row.partsHelped},
                                   {"parts_twice", row.partsTwice}});
    report["faults_left_out"] = faultsLeftOut_;
    report["faults"] = Json::array();
    for (const FaultRow& row : faults_) {
        Json entry = {
            {"frame", row.frame.value}, {"host", row.host}, {"kind", row.kind}, {"detected_ms", row.detectedMs}};
        entry["rejoined_ms"] = row.rejoinedMs >= 0 ? Json(row.rejoinedMs) : Json(nullptr);
        entry["detail"] = row.detail;
        report["faults"].push_back(entry);
    }
    if (journal_)
        report["journal"] = {{"folder", journal_->folder}, {"bytes", journal_->bytes}, {"trouble", journal_->trouble}};
    return report.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace tessera

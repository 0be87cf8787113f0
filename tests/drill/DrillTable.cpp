#include "tests/drill/DrillTable.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/drill/DrillWall.h"
#include "tests/drill/FrameTimeline.h"

namespace tessera::drill {
namespace {

constexpr const char* kFormat = "{:<16} {:<42} {:>7} {:>7} {:>6}  {:>8} {:>6}  {:>8} {:>7}  {:>9}  {:<10} {}\n";

std::string number(double value) {
    return fmt::format("{:.0f}", value);
}
std::string milliseconds(const std::vector<double>& values) {
    return values.empty() ? "-" : number(quantile(values, 0.5));
}
std::string limit(const std::optional<double>& promised) {
    return promised ? number(*promised) : "-";
}
std::string bytes(const std::optional<std::uint64_t>& count) {
    if (!count) return "-";
    const auto value = static_cast<double>(*count);
    return value < 1e6 ? fmt::format("{:.0f} kB", value / 1e3) : fmt::format("{:.1f} MB", value / 1e6);
}

std::string_view nameOf(Verdict verdict) {
    switch (verdict) {
        case Verdict::kKept:
            return "pass";
        case Verdict::kBroken:
            return "FAIL";
        case Verdict::kSkipped:
            return "skipped";
        case Verdict::kNotAvailable:
            return "not available";
    }
    return "";
}

}  // namespace

void DrillTable::printHead() {
    fmt::print(
        "Frames missed: the longest time without a new one, in frames of a 60 Hz wall less one; undisturbed beside it "
        "in ().\n"
        "Times in ms, median. Limits in columns of their own; what the machine's own noise was is added to them.\n\n");
    fmt::print(fmt::runtime(kFormat), "row", "what was done", "missed", "max", "limit", "noticed", "limit", "back",
               "limit", "bytes", "state", "");
    std::fflush(stdout);
}

void DrillTable::print(const Line& line) {
    const Measurement& m = line.measured;
    std::string end(nameOf(line.verdict));
    if (line.tries > 1) end += fmt::format(" (try {})", line.tries);
    if (!m.remark.empty()) end += "; " + m.remark;
    for (const std::string& reason : line.reasons) end += "; " + reason.substr(0, reason.find('\n'));
    const bool measured = !m.missed.empty();
    const Promise& promise = line.row.promise;
    fmt::print(fmt::runtime(kFormat), line.row.name, line.row.deed,
               measured ? fmt::format("{:.0f} ({:.0f})", quantile(m.missed, 0.5), m.usualMissed) : "-",
               measured ? number(quantile(m.missed, 1)) : "-", limit(promise.missed), milliseconds(m.noticedMs),
               limit(promise.noticedMs), milliseconds(m.backMs), limit(promise.backMs), bytes(m.bytes),
               m.stateHash.empty() ? "-" : m.stateHash.substr(0, 8), end);
    std::fflush(stdout);
}

DrillTable::Line DrillTable::runOnce(const Row& row, const DrillOptions& options) {
    Line line{.row = row, .measured = {}, .reasons = {}};
    try {
        line.measured = row.run(options);
        line.reasons = judge(row.promise, line.measured);
        line.verdict = line.reasons.empty() ? Verdict::kKept : Verdict::kBroken;
    } catch (const RowSkipped& why) {
        line.verdict = Verdict::kSkipped;
        line.reasons = {why.what()};
    } catch (const RowNotAvailable& why) {
        line.verdict = Verdict::kNotAvailable;
        line.reasons = {why.what()};
    } catch (const std::exception& why) {  // RowBroken, and what else came in between
        line.verdict = Verdict::kBroken;
        line.reasons = {why.what()};
    }
    return line;
}

void DrillTable::run(const Row& row, const DrillOptions& options) {
    Line line = runOnce(row, options);
    const auto complain = [&] {  // in full; the table has the first line of each
        for (const std::string& reason : line.reasons) fmt::print(stderr, "tessera-drill: {}: {}\n", row.name, reason);
    };
    if (line.verdict == Verdict::kBroken) {
        complain();
        line = runOnce(row, options);
        line.tries = 2;
        if (line.verdict == Verdict::kBroken) complain();
    }
    print(line);
    lines_.push_back(std::move(line));
}

int DrillTable::broken() const {
    return static_cast<int>(std::ranges::count(lines_, Verdict::kBroken, &Line::verdict));
}

void DrillTable::printEnd() const {
    const auto count = [&](Verdict verdict) { return std::ranges::count(lines_, verdict, &Line::verdict); };
    fmt::print("\n{} rows: {} pass, {} fail, {} skipped, {} not available\n", lines_.size(), count(Verdict::kKept),
               count(Verdict::kBroken), count(Verdict::kSkipped), count(Verdict::kNotAvailable));
}

bool DrillTable::writeJson(const std::string& path) const {
    using Json = nlohmann::ordered_json;
    Json rows = Json::array();
    const auto median = [](const std::vector<double>& values) {
        return values.empty() ? Json() : Json(quantile(values, 0.5));
    };
    const auto most = [](const std::vector<double>& values) {
        return values.empty() ? Json() : Json(quantile(values, 1));
    };
    const auto maybe = [](const auto& value) { return value ? Json(*value) : Json(); };
    for (const Line& line : lines_) {
        const Measurement& m = line.measured;
        const Promise& promise = line.row.promise;
        rows.push_back({{"row", line.row.name},
                        {"deed", line.row.deed},
                        {"verdict", nameOf(line.verdict)},
                        {"reasons", line.reasons},
                        {"tries", line.tries},
                        {"missed_p50", median(m.missed)},
                        {"missed_max", most(m.missed)},
                        {"missed_undisturbed", m.usualMissed},
                        {"missed_limit", maybe(promise.missed)},
                        {"noticed_ms", median(m.noticedMs)},
                        {"noticed_limit_ms", maybe(promise.noticedMs)},
                        {"back_ms", median(m.backMs)},
                        {"back_limit_ms", maybe(promise.backMs)},
                        {"bytes", maybe(m.bytes)},
                        {"state_hash", m.stateHash},
                        {"remark", m.remark}});
    }
    std::ofstream out(path);
    out << Json{{"rows", rows}}.dump(1) << "\n";
    return out.good();
}

}  // namespace tessera::drill

#include "tests/bench/CollisionTable.h"

#include <fmt/format.h>

#include <fstream>
#include <nlohmann/json.hpp>

namespace tessera {
namespace {

std::string caseOf(const CollisionRow& row) {
    return row.pair + ": " + row.operation;
}

}  // namespace

double CollisionTable::ratioOfOlder(const CollisionRow& row) {
    const auto known = older_.find(caseOf(row));
    const std::size_t place = seen_[caseOf(row)]++;
    return known == older_.end() || place >= known->second.size() ? 0 : known->second[place];
}

void CollisionTable::add(CollisionRow row) {
    if (row.pair != lastPair_) {
        lastPair_ = row.pair;
        fmt::print("\n{}\n", row.pair);
        fmt::print("  {:<50}{:<26}{:>7}{:>7}{:>8}  {:>10}{:>10}{:>10}  {:>10}{:>10}{:>10}\n", "operation", "beside",
                   "limit", "aim", "ratio", "ours mean", "median", "p99", "theirs", "median", "p99");
    }
    olderRatios_.push_back(ratioOfOlder(row));
    const auto claim = [](double x) { return x > 0 ? fmt::format("{:.3g}", x) : std::string("-"); };
    const std::string verdict = row.atMost <= 0             ? ""
                                : row.ratio() <= row.aim    ? "aim"
                                : row.ratio() <= row.atMost ? "ok"
                                                            : "MISSED";
    fmt::print(
        "  {:<50}{:<26}{:>7}{:>7}{:>8.3f}  {:>10.2f}{:>10.2f}{:>10.2f}  {:>10.2f}{:>10.2f}{:>10.2f}  {} {}{}{}\n",
        row.operation, row.peer, claim(row.atMost), claim(row.aim), row.ratio(), row.ours.mean, row.ours.median,
        row.ours.p99, row.theirs.mean, row.theirs.median, row.theirs.p99, row.unit, verdict,
        olderRatios_.back() > 0 ? fmt::format("; sse41 {:.3f}", olderRatios_.back()) : "",
        row.remark.empty() ? "" : "; " + row.remark);
    std::fflush(stdout);
    rows_.push_back(std::move(row));
}

void CollisionTable::complain(const std::string& what) {
    ++complaints_;
    fmt::print("  ANSWERS DIFFER: {}\n", what);
}

bool CollisionTable::writeJson(const std::string& path) const {
    nlohmann::ordered_json cases = nlohmann::ordered_json::array();
    for (std::size_t i = 0; i < rows_.size(); ++i) {
        const CollisionRow& row = rows_[i];
        cases.push_back({{"case", caseOf(row)},
                         {"peer", row.peer},
                         {"ours", row.ours.mean},
                         {"theirs", row.theirs.mean},
                         {"unit", row.unit},
                         {"ratio", row.ratio()},
                         {"at_most", row.atMost},
                         {"aim", row.aim},
                         {"ours_median", row.ours.median},
                         {"ours_p99", row.ours.p99},
                         {"theirs_median", row.theirs.median},
                         {"theirs_p99", row.theirs.p99},
                         {"remark", row.remark}});
        if (olderRatios_[i] > 0) cases.back()["ratio_sse41"] = olderRatios_[i];
    }
    std::ofstream out(path);
    out << nlohmann::ordered_json{{"cases", cases}}.dump(1) << "\n";
    return out.good();
}

}  // namespace tessera

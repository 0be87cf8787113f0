#include "tests/bench/SceneTable.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>

namespace tessera::bench {

Median medianOf(std::vector<double> values, double factor) {
    if (values.empty()) return {};
    std::sort(values.begin(), values.end());
    const auto at = [&](double share) {
        return values[std::min(values.size() - 1,
                               static_cast<std::size_t>(share * static_cast<double>(values.size())))];
    };
    const double middle = at(0.5);
    return {middle * factor, middle > 0 ? (at(0.75) - at(0.25)) / middle : 0, values.size()};
}

namespace {

bool missed(const SceneRow& row) {
    return row.atMost > 0 && row.ratio() > row.atMost;
}

std::string number(double x) {
    return x <= 0 ? std::string("-") : x < 10 ? fmt::format("{:.3f}", x) : fmt::format("{:.1f}", x);
}

}  // namespace

void SceneTable::begin(const std::string& group) {
    group_ = group;
    fmt::print("\n{}\n  {:<54}{:<24}{:>6}{:>6}{:>9}  {:>11} {:>5}{:>12} {:>5}\n", group, "operation", "beside", "limit",
               "aim", "ratio", "ours", "+-%", "theirs", "+-%");
}

void SceneTable::add(SceneRow row) {
    const auto claim = [](double x) { return x > 0 ? fmt::format("{:.3g}", x) : std::string("-"); };
    const std::string verdict = row.atMost <= 0                         ? ""
                                : missed(row)                           ? " MISSED"
                                : row.aim > 0 && row.ratio() <= row.aim ? " aim"
                                                                        : " ok";
    fmt::print("  {:<54}{:<24}{:>6}{:>6}{:>9}  {:>11} {:>5.0f}{:>12} {:>5.0f}  {}{}{}{}\n", row.operation, row.peer,
               claim(row.atMost), claim(row.aim), number(row.ratio()), number(row.ours.value), 100 * row.ours.spread,
               number(row.theirs.value), 100 * row.theirs.spread, row.unit, verdict, row.remark.empty() ? "" : "; ",
               row.remark);
    std::fflush(stdout);
    rows_.emplace_back(group_, std::move(row));
}

void SceneTable::skip(const std::string& what) {
    fmt::print("  SKIPPED: {}\n", what);
    std::fflush(stdout);
    skipped_.push_back(what);
}

void SceneTable::complain(const std::string& what) {
    ++complaints_;
    fmt::print("  ANSWERS DIFFER: {}\n", what);
    std::fflush(stdout);
}

void SceneTable::summarise() const {
    std::size_t limited = 0, over = 0;
    for (const auto& [group, row] : rows_) {
        limited += row.atMost > 0 ? 1 : 0;
        over += missed(row) ? 1 : 0;
    }
    fmt::print("\n{} rows have a limit, {} of them miss it", limited, over);
    fmt::print("{}\n", skipped_.empty() ? "" : fmt::format("; {} skipped", skipped_.size()));
}

bool SceneTable::writeJson(const std::string& path) const {
    nlohmann::ordered_json cases = nlohmann::ordered_json::array();
    for (const auto& [group, row] : rows_)
        cases.push_back({{"case", group + ": " + row.operation},
                         {"peer", row.peer},
                         {"ours", row.ours.value},
                         {"theirs", row.theirs.value},
                         {"unit", row.unit},
                         {"ratio", row.ratio()},
                         {"at_most", row.atMost},
                         {"aim", row.aim},
                         {"ours_spread", row.ours.spread},
                         {"theirs_spread", row.theirs.spread},
                         {"remark", row.remark}});
    std::ofstream out(path);
    out << nlohmann::ordered_json{{"cases", cases}, {"skipped", skipped_}}.dump(1) << "\n";
    return out.good();
}

}  // namespace tessera::bench

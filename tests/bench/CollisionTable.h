/// The rows of the collision benchmark: measured ratios beside what they should be.
#pragma once

#include <cstdio>
#include <map>
#include <string>
#include <vector>

#include "tests/bench/CollisionTimer.h"

namespace tessera {

struct CollisionRow {
    std::string pair, operation, peer;
    Summary ours, theirs;
    std::string unit = "µs";
    double atMost = 0, aim = 0;  ///< of ours / theirs; 0: no such claim
    std::string remark;

    [[nodiscard]] double ratio() const { return theirs.mean > 0 ? ours.mean / theirs.mean : 0; }
};

class CollisionTable {
public:
    /// `older`: what the rows came to with sse41, by case, in their order; they get a column of it.
    explicit CollisionTable(std::map<std::string, std::vector<double>> older = {}) : older_(std::move(older)) {}

    /// Prints the row too, so that a long run can be watched.
    void add(CollisionRow row);
    /// A peer's or our own answers that do not agree; the run fails in the end.
    void complain(const std::string& what);
    [[nodiscard]] bool good() const { return complaints_ == 0; }
    /// {"cases":[{"case","peer","ours","theirs","unit","ratio",…}]}
    [[nodiscard]] bool writeJson(const std::string& path) const;

private:
    [[nodiscard]] double ratioOfOlder(const CollisionRow& row);

    std::map<std::string, std::vector<double>> older_;
    std::map<std::string, std::size_t> seen_;
    std::vector<double> olderRatios_;  ///< per row; 0: unknown
    std::vector<CollisionRow> rows_;
    std::string lastPair_;
    int complaints_ = 0;
};

}  // namespace tessera

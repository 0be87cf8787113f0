/// The rows of the scene benchmark: medians beside a peer, a limit or a smaller scene, and what the ratio should be.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace tessera::bench {

/// Of repeated measurements: the median, and how far apart the quartiles are in shares of it.
struct Median {
    double value = 0, spread = 0;
    std::size_t count = 0;
};
[[nodiscard]] Median medianOf(std::vector<double> values, double factor = 1);

struct SceneRow {
    std::string operation, peer;
    Median ours, theirs;  ///< theirs 0: nothing to compare with
    std::string unit;
    double atMost = 0, aim = 0;  ///< of ours / theirs; 0: no such claim
    std::string remark;

    [[nodiscard]] double ratio() const { return theirs.value > 0 ? ours.value / theirs.value : 0; }
};

class SceneTable {
public:
    /// Rows from here on belong to it.
    void begin(const std::string& group);
    /// Prints the row too, so that a long run can be watched.
    void add(SceneRow row);
    /// What was left out, and why.
    void skip(const std::string& what);
    /// Answers that should agree and do not; the run fails in the end.
    void complain(const std::string& what);
    [[nodiscard]] bool good() const { return complaints_ == 0; }
    /// {"cases":[{"case","peer","ours","theirs","unit","ratio",…}],"skipped":[…]}
    [[nodiscard]] bool writeJson(const std::string& path) const;
    /// How many rows have a limit, and how many of them miss it.
    void summarise() const;

private:
    std::string group_;
    std::vector<std::pair<std::string, SceneRow>> rows_;
    std::vector<std::string> skipped_;
    int complaints_ = 0;
};

}  // namespace tessera::bench

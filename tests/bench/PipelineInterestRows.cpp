/// A thousand objects with an interest each, beside a hundred: what one edit costs, at rest and with all on their way.
#include <algorithm>
#include <limits>

#include "server/collision/pipeline/ScenePicker.h"
#include "tests/bench/EditScenes.h"
#include "tests/bench/PipelineRows.h"

namespace tessera {

namespace {

/// Of each edit the least over the passes; the two scenes take turns.
template <typename Kind>
void interestRowsOf(const std::string& when, std::size_t count, int edits, int passes, CollisionTable& table) {
    Kind few(count / 10), many(count);
    for (const auto& [name, make] : Kind::edits()) {
        std::vector<double> best[2];
        for (int pass = 0; pass <= passes; ++pass) {  // the first one warms up
            const std::vector<double> taken[2] = {many.times(make, edits), few.times(make, edits)};
            if (pass == 0) continue;
            for (int side = 0; side < 2; ++side) {
                best[side].resize(taken[side].size(), std::numeric_limits<double>::infinity());
                for (std::size_t i = 0; i < taken[side].size(); ++i)
                    best[side][i] = std::min(best[side][i], 1e-6 * taken[side][i]);
            }
        }
        table.add({.pair = "an interest each: 1,000 objects beside 100, " + when,
                   .operation = name + ", told + step + pick",
                   .peer = "ours, a tenth of them",
                   .ours = summarise(best[0]),
                   .theirs = summarise(best[1])});
    }
}

}  // namespace

void interestRows(const PipelineOptions& options, CollisionTable& table) {
    const std::size_t count = options.quick ? 100 : 1'000;
    const int edits = options.quick ? 12 : 102;
    interestRowsOf<edits::Objects>("at rest", count, edits, options.passes, table);
    interestRowsOf<edits::MovingObjects>("all on their way", count, edits / 5 + 2, options.passes, table);
}

}  // namespace tessera

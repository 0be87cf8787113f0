/// What a frame asks of single pairs of bodies: the rows of bench_collision that the pipeline's limits speak of, in one
/// run with its own (distance along coherent motions, realigned k-DOPs, two threads, memory).
#include <fmt/format.h>

#include "tests/bench/CollisionPairs.h"
#include "tests/bench/PipelineRows.h"

namespace tessera {

void pairRows(const PipelineOptions& options, CollisionTable& table) {
    for (const ModelFiles& files : standardPairs()) {
        const Expected<BenchPair> pair = posedPair(files, {.poses = options.quick ? 40u : 400u, .motions = 20});
        if (!pair) {
            fmt::print("\npairs: left out: {}\n", pair.error().message);
            continue;
        }
        const FclPairs fcl(pair->a, pair->b);
        const BenchOptions rows{.passes = options.passes, .only = {}};
        distanceRows(*pair, fcl, rows, table);
        volumeRows(*pair, rows, table);
        threadRows(*pair, rows, table);
        memoryRows(*pair, table);
    }
}

}  // namespace tessera

/// The pairwise stage on several threads.
#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "common/base/Workers.h"
#include "server/collision/pipeline/PairMemory.h"

namespace tessera {

/// Runs query(state, work) for these pairs (indices into `states`), shared among the workers (which may be null). Each
/// may take what is left of the work at the start of its batch, and batches are cut by what their pairs are expected to
/// take, so results do not depend on the number of threads.
template <typename Query>
void forPairs(const ObjectHandler& handler, std::span<PairState> states, std::span<const std::uint32_t> pairs,
              Workers* workers, QueryWork& work, const Query& query) {
    constexpr std::size_t kPairsPerBatch = 2048, kPairsPerTask = 32;
    const auto faces = [&](std::uint32_t part) { return handler.parts()[part].shape->faceCount(); };
    const auto expected = [&](const PairState& pair) {
        return 64 + 16 * std::uint64_t{std::min(faces(pair.a), faces(pair.b))};
    };
    std::vector<QueryWork> works;
    for (std::size_t begin = 0, end = 0; begin < pairs.size(); begin = end) {
        const std::uint64_t used = work.boxTests + work.triangleTests;
        const std::uint64_t left = work.limit - std::min(work.limit, used);
        std::uint64_t promised = 0;
        for (end = begin; end < pairs.size() && end - begin < kPairsPerBatch && (end == begin || promised < left);
             ++end)
            promised += expected(states[pairs[end]]);
        works.assign(end - begin, QueryWork{.limit = left});
        const auto task = [&](std::size_t index) {
            const std::size_t first = begin + index * kPairsPerTask, last = std::min(end, first + kPairsPerTask);
            for (std::size_t i = first; i < last; ++i) query(states[pairs[i]], works[i - begin]);
        };
        const std::size_t tasks = (end - begin + kPairsPerTask - 1) / kPairsPerTask;
        if (workers != nullptr && tasks > 1) {
            workers->run(tasks, task);
        } else {
            for (std::size_t i = 0; i < tasks; ++i) task(i);
        }
        for (const QueryWork& w : works) {
            work.boxTests += w.boxTests;
            work.triangleTests += w.triangleTests;
        }
    }
}

}  // namespace tessera

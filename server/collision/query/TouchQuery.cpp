#include "server/collision/query/TouchQuery.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <memory>

#include "common/base/Workers.h"
#include "server/collision/query/TouchSearch.h"
#include "server/collision/tree/TreeStorage.h"

namespace tessera {
namespace {

using kernel::SlotPair;
using touch::kRoots;
using touch::Search;
using touch::TreePair;

/// To share less work than this (some ten microseconds) costs more than it saves.
constexpr std::uint64_t kAlone = 1600;
/// How deep a part is walked into before the next ones are put off.
constexpr unsigned kPartLevels = 2;
constexpr std::uint32_t kMostPutOff = 2048;
/// Few tasks leave threads waiting for the last; many have each its costs.
constexpr std::uint32_t kTasks = 64;

std::uint64_t sum(const QueryWork& work) { return work.boxTests + work.triangleTests; }

int bitsOf(std::size_t faces) { return static_cast<int>(std::bit_width(faces - 1)); }

/// What a task has found and done. The pairs lie in buckets by the highest bits of A's face.
struct Task {
    static constexpr int kBucketBits = 4;
    static constexpr std::size_t kBuckets = 1U << kBucketBits;

    std::vector<FacePair> pairs;
    std::array<std::uint32_t, kBuckets + 1> start{};
    QueryWork work;

    static int shift(int bitsOfA) { return std::max(0, bitsOfA - kBucketBits); }
    void keep(std::vector<FacePair>&& found, int bitsOfA) {
        pairs.resize(found.size());
        for (const FacePair& p : found) ++start[(p.a >> shift(bitsOfA)) + 1];
        for (std::size_t i = 1; i <= kBuckets; ++i) start[i] += start[i - 1];
        std::array<std::uint32_t, kBuckets + 1> next = start;
        for (const FacePair& p : found) pairs[next[p.a >> shift(bitsOfA)]++] = p;
    }
};

/// All tasks' pairs by ascending faces: a task for each bucket.
std::vector<FacePair> joined(const std::vector<Task>& tasks, int bitsOfA, Workers& workers) {
    std::array<std::size_t, Task::kBuckets + 1> start{};
    for (const Task& task : tasks)
        for (std::size_t i = 0; i < Task::kBuckets; ++i) start[i + 1] += task.start[i + 1] - task.start[i];
    for (std::size_t i = 0; i < Task::kBuckets; ++i) start[i + 1] += start[i];
    std::vector<FacePair> out(start.back());
    const auto bucket = [&](std::size_t i) {
        auto to = out.begin() + static_cast<std::ptrdiff_t>(start[i]);
        const auto first = to;
        for (const Task& task : tasks) to = std::copy(task.pairs.begin() + task.start[i], task.pairs.begin() + task.start[i + 1], to);
        touch::sort(std::span(first, to), Task::shift(bitsOfA));
    };
    constexpr std::size_t kManyPairs = 1024;
    if (out.size() >= kManyPairs) {
        workers.run(Task::kBuckets, bucket);
    } else {
        for (std::size_t i = 0; i < Task::kBuckets; ++i) bucket(i);
    }
    return out;
}

/// Begins alone, a part of the trees at a time; where that is not soon done, the parts that are left become tasks, which
/// do not depend on the number of threads. Each part adds to the counters what it would have added in a walk by one thread,
/// so their sum is that of such a walk. False: the work does not suffice, and where it ends is for one thread to find out.
bool allByMany(const TreePair& pair, Workers& workers, QueryWork& work, std::vector<FacePair>& found) {
    const auto room = std::make_unique_for_overwrite<SlotPair[]>(2 * kMostPutOff);
    SlotPair *now = room.get(), *next = now + kMostPutOff;
    std::uint32_t count = 1;
    now[0] = kRoots;
    Search top(pair, Search::For::kAll, work);
    while (count != 0 && top.sum() - sum(work) < kAlone) {
        const SlotPair part = now[--count];
        top.putOff(now + count, kMostPutOff - count);
        if (top.walk(part, kPartLevels)) return false;
        count += top.countPutOff();
    }
    for (int cut = 0; cut < 3 && count != 0 && count < kTasks; ++cut) {
        top.putOff(next, kMostPutOff);
        for (std::uint32_t i = 0; i < count; ++i)
            if (top.walk(now[i], 1)) return false;
        count = top.countPutOff();
        std::swap(now, next);
    }
    top.finish();
    top.take(work);
    const int bitsOfA = bitsOf(pair.meshA.faceCount());
    if (count == 0) {
        found = std::move(top.pairs());
        touch::sort(found, bitsOfA);
        return sum(work) < work.limit;
    }

    const std::uint32_t each = (count + kTasks - 1) / kTasks, tasks = (count + each - 1) / each;
    std::vector<Task> done(tasks + 1);
    done[tasks].keep(std::move(top.pairs()), bitsOfA);
    std::atomic<std::uint64_t> used = sum(work);
    workers.run(tasks, [&](std::size_t i) {
        const std::uint64_t before = used.load();
        if (before >= work.limit) return;
        Search search(pair, Search::For::kAll, {0, 0, work.limit - before});
        const std::uint32_t first = static_cast<std::uint32_t>(i) * each, end = std::min(count, first + each);
        for (std::uint32_t k = first; k < end; ++k)
            if (search.walk(now[k])) break;
        search.finish();
        search.take(done[i].work);
        used.fetch_add(sum(done[i].work));
        done[i].keep(std::move(search.pairs()), bitsOfA);
    });
    if (used.load() >= work.limit) return false;
    for (const Task& task : done) {
        work.boxTests += task.work.boxTests;
        work.triangleTests += task.work.triangleTests;
    }
    found = joined(done, bitsOfA, workers);
    return true;
}

}  // namespace

Touch anyTouching(const TriangleTree& a, const TriangleTree& b, const Affine3d& a_T_b, QueryWork& work,
                  const TouchOptions& options) {
    return firstTouching(a, b, a_T_b, work, options).touch;
}

TouchedPair firstTouching(const TriangleTree& a, const TriangleTree& b, const Affine3d& a_T_b, QueryWork& work,
                          const TouchOptions& options) {
    if (a.storage().empty() || b.storage().empty()) return {};
    if (work.exhausted()) return {Touch::kUnknown, {}};
    const TreePair pair(a, b, a_T_b, options);
    ++work.boxTests;
    if (!pair.rootsOverlap()) return {};
    Search search(pair, Search::For::kAny, work);
    search.walk(kRoots);
    search.finish();
    search.take(work);
    if (!search.pairs().empty()) return {Touch::kYes, search.pairs().front()};
    return {search.exhausted() ? Touch::kUnknown : Touch::kNo, {}};
}

FacePairs allTouching(const TriangleTree& a, const TriangleTree& b, const Affine3d& a_T_b, QueryWork& work,
                      const TouchOptions& options) {
    FacePairs out;
    if (a.storage().empty() || b.storage().empty()) return out;
    if (work.exhausted()) {
        out.complete = false;
        return out;
    }
    const TreePair pair(a, b, a_T_b, options);
    ++work.boxTests;
    if (!pair.rootsOverlap()) return out;

    const auto byOne = [&](QueryWork bounded) {
        Search search(pair, Search::For::kAll, bounded);
        search.walk(kRoots);
        search.finish();
        out.complete = !search.exhausted();
        out.pairs = std::move(search.pairs());
        touch::sort(out.pairs, bitsOf(a.mesh().faceCount()));
        search.take(bounded);
        return bounded;
    };
    QueryWork spent = work;
    const bool many = options.workers != nullptr && options.workers->threads() > 1;
    if (!many || !allByMany(pair, *options.workers, spent, out.pairs)) spent = byOne(work);
    work = spent;
    return out;
}

}  // namespace tessera

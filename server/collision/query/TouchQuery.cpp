#include "server/collision/query/TouchQuery.h"

#include <atomic>
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

/// What threads share is worth its making only above this much work (some microseconds).
constexpr std::uint64_t kSmallQuery = 600;
constexpr std::uint32_t kMostPutOff = 2048;
/// Few tasks leave threads waiting for the last; many have each its costs.
constexpr std::uint32_t kTasks = 64;

std::uint64_t sum(const QueryWork& work) {
    return work.boxTests + work.triangleTests;
}

void append(std::vector<FacePair>& to, const std::vector<FacePair>& from) {
    to.insert(to.end(), from.begin(), from.end());
}

/// The upper levels here, what they leave in tasks that do not depend on the number of threads. Each task adds to the
/// counters what it would have added in a walk by one thread, so their sum is that of such a walk. False: the work does
/// not suffice, and where it ends is for one thread to find out.
bool allByMany(const TreePair& pair, Workers& workers, QueryWork& work, std::vector<FacePair>& found) {
    const auto putOff = std::make_unique_for_overwrite<SlotPair[]>(2 * kMostPutOff);
    SlotPair *now = putOff.get(), *next = now + kMostPutOff;
    std::uint32_t count = 1;
    now[0] = kRoots;
    Search top(pair, Search::For::kAll, work);
    for (int cut = 0; cut < 4 && count != 0 && count < kTasks; ++cut) {
        top.putOff(next, kMostPutOff);
        for (std::uint32_t i = 0; i < count; ++i)
            if (top.walk(now[i], 1)) return false;
        count = top.countPutOff();
        std::swap(now, next);
    }
    top.finish();
    top.take(work);
    found = std::move(top.pairs());

    struct Task {
        std::vector<FacePair> pairs;
        std::uint64_t boxTests = 0, triangleTests = 0;
    };
    const std::uint32_t each = (count + kTasks - 1) / kTasks, tasks = each == 0 ? 0 : (count + each - 1) / each;
    std::vector<Task> done(tasks);
    std::atomic<std::uint64_t> used = sum(work);
    workers.run(tasks, [&](std::size_t i) {
        const std::uint64_t before = used.load();
        if (before >= work.limit) return;
        Search search(pair, Search::For::kAll, {0, 0, work.limit - before});
        const std::uint32_t first = static_cast<std::uint32_t>(i) * each, end = std::min(count, first + each);
        for (std::uint32_t k = first; k < end; ++k)
            if (search.walk(now[k])) break;
        search.finish();
        QueryWork own;
        search.take(own);
        used.fetch_add(sum(own));
        done[i] = {std::move(search.pairs()), own.boxTests, own.triangleTests};
    });
    if (used.load() >= work.limit) return false;
    for (const Task& task : done) {
        append(found, task.pairs);
        work.boxTests += task.boxTests;
        work.triangleTests += task.triangleTests;
    }
    return true;
}

}  // namespace

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
        search.take(bounded);
        return bounded;
    };
    QueryWork spent = work;
    const bool many = options.workers != nullptr && options.workers->threads() > 1;
    if (many) spent.limit = std::min(work.limit, sum(work) + kSmallQuery);
    spent = byOne(spent);
    if (!out.complete && spent.limit < work.limit) {
        spent = work;
        if (allByMany(pair, *options.workers, spent, out.pairs))
            out.complete = true;
        else
            spent = byOne(work);
    }
    spent.limit = work.limit;
    work = spent;
    touch::sort(out.pairs, a.mesh().faceCount());
    return out;
}

}  // namespace tessera

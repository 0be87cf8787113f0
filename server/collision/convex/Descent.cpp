#include "server/collision/convex/Descent.h"

#include <algorithm>
#include <vector>

#include "server/collision/convex/ExactDescent.h"

namespace tessera {

namespace {

/// Steps in double after which the exact descent takes over. Ordinary pairs need three to fifteen.
constexpr int kMaxSteps = 200;

Simplex startOf(const MinkowskiDifference& difference, ConvexWork& work, const ConvexCache* cache, VertexPair& last) {
    Simplex simplex;
    if (cache) {
        last = cache->last;
        for (std::size_t i = 0; i < std::min<std::size_t>(cache->size, 4); ++i)
            if (difference.has(cache->simplex[i]) && !simplex.has(cache->simplex[i]))
                simplex.push(difference.at(cache->simplex[i]));
    }
    if (simplex.size == 0) simplex.push(difference.lowest(difference.centre(), last, work));
    return simplex;
}

void remember(const DescentResult& result, const VertexPair& last, ConvexCache* cache) {
    if (!cache) return;
    cache->size = static_cast<std::uint8_t>(result.simplex.size);
    for (std::size_t i = 0; i < cache->size; ++i) cache->simplex[i] = result.simplex.points[i].from;
    cache->last = last;
}

enum class Step : std::uint8_t { kDone, kDoubt };

/// In double. kDoubt: rounding hides the answer.
Step descendRounded(const MinkowskiDifference& difference, bool nearest, ConvexWork& work, VertexPair& last,
                    DescentResult& result) {
    result.nearest = reduce(result.simplex);
    for (int step = 0; step < kMaxSteps; ++step) {
        if (result.nearest.inside) {
            result.end = DescentEnd::kMeet;
            return Step::kDone;
        }
        const double length = result.nearest.direction.stableNorm();
        if (!(length > 0) || !std::isfinite(length)) return Step::kDoubt;
        if (work.exhausted()) return Step::kDone;
        const Vec3d d = result.nearest.direction / length;
        const DifferencePoint lowest = difference.lowest(d, last, work);
        const double height = d.dot(lowest.w), margin = difference.margin(d);
        if (height > margin) {
            result.lowerBound = std::max(result.lowerBound, height - margin);
            if (!nearest || result.nearest.distance - height <= 1e-14 * result.nearest.distance + margin) {
                result.end = DescentEnd::kApart;
                return Step::kDone;
            }
        }
        if (result.simplex.has(lowest.from)) return Step::kDoubt;
        const Simplex before = result.simplex;
        result.simplex.push(lowest);
        const SimplexNearest next = reduce(result.simplex);
        if (!next.inside && !(next.distance < result.nearest.distance)) {
            result.simplex = before;
            return Step::kDoubt;
        }
        result.nearest = next;
    }
    return Step::kDoubt;
}

void descendInExact(const MinkowskiDifference& difference, bool nearest, ConvexWork& work, DescentResult& result) {
    ++work.exact;
    std::vector<Vec3d> mapped;
    mapped.reserve(difference.b().vertices().size());
    for (std::uint32_t v = 0; v < difference.b().vertices().size(); ++v) mapped.push_back(difference.mapped(v));
    std::vector<VertexPair> hints;
    for (int i = 0; i < result.simplex.size; ++i)
        hints.push_back(result.simplex.points[static_cast<std::size_t>(i)].from);
    const ExactDescent exact = descendExactly(difference.a().vertices(), mapped, hints, nearest);
    work.supports += exact.supports;
    work.looks += exact.supports * (difference.a().vertices().size() + mapped.size());
    result.exact = true;
    result.end = exact.gaveUp ? DescentEnd::kUnknown : exact.apart ? DescentEnd::kApart : DescentEnd::kMeet;
    result.simplex.size = 0;
    for (std::size_t i = 0; i < exact.simplex.size(); ++i) {
        result.simplex.push(difference.at(exact.simplex[i]));
        result.weights[i] = exact.weights[i];
    }
}

}  // namespace

DescentResult descend(const MinkowskiDifference& difference, bool nearest, ConvexWork& work, ConvexCache* cache) {
    DescentResult result;
    if (!difference.finite()) return result;
    VertexPair last;
    result.simplex = startOf(difference, work, cache, last);
    if (descendRounded(difference, nearest, work, last, result) == Step::kDoubt)
        descendInExact(difference, nearest, work, result);
    remember(result, last, cache);
    return result;
}

NearestPoints nearestOf(const Simplex& simplex) {
    // At most three points, so at most three corners on either side: triangles, where need be without area.
    Triangle a, b;
    for (std::size_t i = 0; i < 3; ++i) {
        const DifferencePoint& p = simplex.points[std::min<std::size_t>(i, static_cast<std::size_t>(simplex.size) - 1)];
        a[i] = p.a;
        b[i] = p.b;
    }
    return nearestPoints(a, b);
}

}  // namespace tessera

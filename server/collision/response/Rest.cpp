#include "server/collision/response/Rest.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "server/collision/mesh/TriangleContact.h"

namespace tessera {
namespace {

double longestEdge(const Triangle& t) {
    return std::sqrt(std::max({(t[1] - t[0]).squaredNorm(), (t[2] - t[1]).squaredNorm(), (t[0] - t[2]).squaredNorm()}));
}

double extentOf(const Triangle& t) {
    return std::max({t[0].cwiseAbs().maxCoeff(), t[1].cwiseAbs().maxCoeff(), t[2].cwiseAbs().maxCoeff()});
}

struct Candidate {
    Vec3d normal = Vec3d::Zero();
    Support::Turns turns = Support::Turns::kNo;
    double overlap = std::numeric_limits<double>::infinity();
};

/// Of the faces' normals, and of those that two edges share: along which they overlap least; the earlier where two are
/// as good but for `slack`. That faces look at each other goes before that they look away.
/// Balls part along the line between their centres.
Candidate leastOverlap(const WorldFaces& pair, double slack, bool edges) {
    Candidate best;
    const auto offer = [&](const Vec3d& n, Support::Turns turns) {
        if (n.isZero(0) || !n.allFinite()) return;
        const double overlap = pair.wayOut(n);
        if (overlap < best.overlap - slack) best = {n, turns, overlap};
    };
    const Vec3d outA = outside(pair.a), outB = outside(pair.b);
    offer(outA, Support::Turns::kWithA);
    offer(-outB, Support::Turns::kWithB);
    offer(-outA, Support::Turns::kWithA);
    offer(outB, Support::Turns::kWithB);
    if (pair.margin() > 0) offer(pair.meeting().normal, Support::Turns::kNo);
    if (!edges || best.overlap <= slack) return best;
    for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j) {
            const Vec3d e = (pair.a[(i + 1) % 3] - pair.a[i]).normalized(),
                        f = (pair.b[(j + 1) % 3] - pair.b[j]).normalized();
            const Vec3d across = e.cross(f);
            constexpr double kParallel = 1e-6;
            if (!(across.norm() > kParallel)) continue;
            offer(across.normalized(), Support::Turns::kNo);
            offer(-across.normalized(), Support::Turns::kNo);
        }
    return best;
}

}  // namespace

bool addRest(Rest& rest, std::vector<RestingFaces> touching, const RestTerms& terms) {
    const auto size = [](const RestingFaces& pair) {
        const WorldFaces& p = pair.placed;
        return std::min(longestEdge(p.a) + 2 * p.radiusA, longestEdge(p.b) + 2 * p.radiusB);
    };
    std::vector<std::pair<double, std::size_t>> order;
    for (std::size_t i = 0; i < touching.size(); ++i) order.emplace_back(-size(touching[i]), i);
    std::ranges::sort(order);
    const std::size_t before = rest.supports.size(), withinBefore = rest.within.size();
    // What is as good as the best.
    const double slack = 0.01 * terms.tolerance;
    for (const auto& [negative, i] : order) {
        const RestingFaces& pair = touching[i];
        double known = std::numeric_limits<double>::infinity();
        for (const Support& support : rest.supports)
            if (!support.parting) known = std::min(known, pair.placed.wayOut(support.normal));
        if (known <= slack) continue;
        const Candidate best = leastOverlap(pair.placed, slack, true);
        if (known <= terms.tolerance && known <= best.overlap + slack) continue;
        if (best.overlap <= terms.tolerance && rest.supports.size() < kMostSupports) {
            // A normal is as good as the corners that it is computed from.
            const double error = 4 * 0x1p-52 * std::max(extentOf(pair.placed.a), extentOf(pair.placed.b)) / -negative;
            const double rounding = terms.rounding + std::min(slack, error * terms.length);
            rest.supports.push_back({best.normal, Support::Turns::kNo, terms.tolerance, rounding});
            const bool turns = best.turns == Support::Turns::kWithA   ? terms.turnsA
                               : best.turns == Support::Turns::kWithB ? terms.turnsB
                                                                      : false;
            if (turns) rest.supports.push_back({best.normal, best.turns, terms.tolerance, rounding});
            continue;
        }
        if (known <= terms.tolerance) continue;
        rest.within.push_back(pair.faces);
        const Candidate out = leastOverlap(pair.placed, slack, false);
        if (!std::isfinite(out.overlap)) continue;
        constexpr double kSame = 0.999;
        const auto same = std::ranges::find_if(rest.supports, [&](const Support& support) {
            return support.parting && support.normal.dot(out.normal) > kSame;
        });
        if (same != rest.supports.end())
            same->overlap = std::max(same->overlap, out.overlap);
        else if (rest.supports.size() < kMostSupports)
            rest.supports.push_back({out.normal, Support::Turns::kNo, out.overlap, terms.rounding, true});
    }
    std::ranges::sort(rest.within);
    return rest.supports.size() > before || rest.within.size() > withinBefore;
}

}  // namespace tessera

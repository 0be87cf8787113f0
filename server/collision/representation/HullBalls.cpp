#include "server/collision/representation/HullBalls.h"

#include <algorithm>
#include <limits>

#include "server/collision/representation/PartPairs.h"

namespace tessera {

namespace {

Box hullIn(const ConvexHull& hull, const Affine3d& a_T_hull) {
    return BoxMap(a_T_hull, reachOf(hull.bounds()))(hull.bounds());
}

}  // namespace

HullBalls::HullBalls(const PointSet& points, const ConvexHull& hull, bool hullIsA, const Affine3d& a_T_b,
                     const BallRadii& radii)
    : points_(points),
      hull_(hull),
      hullIsA_(hullIsA),
      a_T_b_(a_T_b),
      radii_(radii),
      parts_(points, hullIsA ? a_T_b : Affine3d::Identity()),
      hullBox_(hullIn(hull, hullIsA ? Affine3d::Identity() : a_T_b)),
      rounding_(0) {
    PartBoxes whole;
    parts_.whole(whole);
    rounding_ =
        1e-13 * std::max(reachOf(hullBox_).maxCoeff(), whole.count == 0 ? 0.0 : reachOf(whole.box(0)).maxCoeff());
}

/// query(A, B, work) of the hull and the centre; its supports are counted as tests of triangles.
template <typename Query>
auto HullBalls::ask(std::uint32_t point, QueryWork& work, Query&& query) const {
    const Vec3d p = points_.point(point);
    const ConvexHull centre = *ConvexHull::make(std::span(&p, 1));
    ConvexWork supports;
    if (work.limit != ~std::uint64_t{0})
        supports.limit = work.limit - std::min(work.limit, work.boxTests + work.triangleTests);
    const auto answer = hullIsA_ ? query(hull_, centre, supports) : query(centre, hull_, supports);
    work.triangleTests += std::max<std::uint64_t>(supports.supports, 1);
    return answer;
}

HullDistance HullBalls::distanceTo(std::uint32_t point, QueryWork& work, ConvexCache& cache) const {
    return ask(point, work, [&](const ConvexHull& a, const ConvexHull& b, ConvexWork& supports) {
        return hullDistance(a, b, a_T_b_, supports, &cache);
    });
}

HullDepth HullBalls::depthOf(std::uint32_t point, QueryWork& work, ConvexCache& cache) const {
    return ask(point, work, [&](const ConvexHull& a, const ConvexHull& b, ConvexWork& supports) {
        return hullDepth(a, b, a_T_b_, supports, &cache);
    });
}

/// Whether the ball touches; kUnknown where that was not found out.
Touch HullBalls::touch(std::uint32_t point, QueryWork& work, ConvexCache& cache) const {
    if (radii_.sum() == 0)
        return ask(point, work, [&](const ConvexHull& a, const ConvexHull& b, ConvexWork& supports) {
            return hullsTouching(a, b, a_T_b_, supports, &cache);
        });
    const HullDistance found = distanceTo(point, work, cache);
    // What is not complete is a lower bound.
    if (found.distance > radii_.reach()) return Touch::kNo;
    return found.complete ? Touch::kYes : Touch::kUnknown;
}

/// visit(point) for the centres that may be within `within` of the hull, nearest boxes first; it may lower that, and
/// returns false to end the walk. The bound of what was not visited; infinity where all were.
template <typename Visit>
double HullBalls::eachNear(QueryWork& work, double& within, Visit&& visit) const {
    struct Open {
        double bound;
        std::uint32_t part;
        bool leaf;
        bool operator<(const Open& other) const {
            return bound != other.bound ? bound > other.bound : part > other.part;
        }
    };
    constexpr double kAll = std::numeric_limits<double>::infinity();
    std::vector<Open> open;
    PartBoxes boxes;
    const auto keep = [&] {
        ++work.boxTests;
        for (unsigned i = 0; i < boxes.count; ++i) {
            const double bound = gapBetween(boxes.box(i), hullBox_);
            if (bound > within + rounding_) continue;
            open.push_back({bound, boxes.part[i], boxes.leaf[i]});
            std::push_heap(open.begin(), open.end());
        }
    };
    if (points_.size() == 0) return kAll;
    if (work.exhausted()) return 0;
    parts_.whole(boxes);
    keep();
    while (!open.empty()) {
        std::pop_heap(open.begin(), open.end());
        const Open next = open.back();
        open.pop_back();
        if (next.bound > within + rounding_) return kAll;
        if (work.exhausted()) return std::max(0.0, next.bound - rounding_);
        if (!next.leaf) {
            parts_.open(next.part, boxes);
            keep();
            continue;
        }
        LeafFaces leaf;
        parts_.faces(next.part, leaf);
        for (unsigned i = 0; i < leaf.count; ++i)
            if (!visit(leaf.face[i])) return kAll;
    }
    return kAll;
}

FacePairs HullBalls::touching(bool any, QueryWork& work) const {
    FacePairs out;
    ConvexCache cache;
    double within = radii_.reach();
    const double left = eachNear(work, within, [&](std::uint32_t point) {
        const Touch found = touch(point, work, cache);
        if (found == Touch::kYes) out.pairs.push_back(facesOf(point));
        if (found == Touch::kUnknown) out.complete = false;
        return !any || out.pairs.empty();
    });
    if (left < std::numeric_limits<double>::infinity()) out.complete = false;
    std::ranges::sort(out.pairs);
    return out;
}

Distance HullBalls::nearest(QueryWork& work, const DistanceOptions& options, double enough) const {
    Distance best;
    double within = options.upperBound, unknownFrom = std::numeric_limits<double>::infinity();
    ConvexCache cache;
    const auto offer = [&](std::uint32_t point) {
        const HullDistance found = distanceTo(point, work, cache);
        if (!found.complete) unknownFrom = std::min(unknownFrom, found.distance);
        const FacePair faces = facesOf(point);
        const bool nearer = found.distance < best.distance || (found.distance == best.distance && faces < best.faces);
        if (found.complete && nearer) {
            best = {found.distance, faces, found.onA, found.onB};
            within = std::min(within, best.distance - options.tolerance);
        }
        return !(best.distance <= enough);
    };
    const std::uint32_t hint = options.start ? (hullIsA_ ? options.start->b : options.start->a) : ~0U;
    if (hint < points_.size() && !work.exhausted() && !offer(hint)) return best;
    unknownFrom = std::min(unknownFrom, eachNear(work, within, offer));
    if (best.distance <= enough) return best;
    if (unknownFrom < std::min(best.distance, options.upperBound)) {
        Distance unknown;
        unknown.distance = unknownFrom;
        unknown.complete = false;
        return unknown;
    }
    if (best.distance < options.upperBound) return best;
    Distance none;
    none.distance = options.upperBound;
    none.farther = true;
    return none;
}

namespace {

BallContact contactAt(const FacePair& faces, const HullDepth& found, const BallRadii& radii) {
    BallContact out;
    out.faces = faces;
    out.normal = found.normal;
    out.depth = radii.sum() + found.depth;
    out.point = 0.5 * (found.onA + radii.a * found.normal + found.onB - radii.b * found.normal);
    return out;
}

}  // namespace

BallContact HullBalls::contact(const FacePair& faces, QueryWork& work) const {
    ConvexCache cache;
    QueryWork own;
    const HullDepth found = depthOf(hullIsA_ ? faces.b : faces.a, own, cache);
    work.triangleTests += own.triangleTests;
    return contactAt(faces, found, radii_);
}

BallDepth HullBalls::depth(QueryWork& work) const {
    BallDepth out;
    out.known = false;
    ConvexCache cache;
    double within = std::numeric_limits<double>::infinity();
    const double left = eachNear(work, within, [&](std::uint32_t point) {
        const HullDepth found = depthOf(point, work, cache);
        out.complete = out.complete && found.complete;
        const BallContact here = contactAt(facesOf(point), found, radii_);
        if (out.known &&
            !(here.depth > out.deepest.depth || (here.depth == out.deepest.depth && here.faces < out.deepest.faces)))
            return true;
        out.known = true;
        out.deepest = here;
        out.touching = radii_.sum() > 0 ? -found.depth <= radii_.reach() : found.touching;
        within = std::min(within, std::max(0.0, -found.depth));
        return true;
    });
    if (left < std::numeric_limits<double>::infinity()) out.complete = false;
    if (!out.complete) out.known = out.touching = false;
    return out;
}

}  // namespace tessera

// Balls against surfaces and against each other.
#include "server/collision/representation/PointSetQueries.h"

#include <algorithm>

#include "server/collision/representation/BallPairs.h"
#include "server/collision/representation/BlockDistance.h"
#include "server/collision/representation/HullBalls.h"
#include "server/collision/representation/PartPairs.h"
#include "server/collision/representation/PartsOf.h"

namespace tessera {

namespace {

/// Both bodies in A's frame.
template <typename A, typename B>
class Pair {
    static constexpr bool kPointsA = std::same_as<A, PointSet>, kPointsB = std::same_as<B, PointSet>;

public:
    Pair(const A& a, const B& b, const Affine3d& a_T_b)
        : a_(a),
          b_(b),
          a_T_b_(a_T_b),
          radii_(radiiOf(a, b, a_T_b)),
          partsA_(partsOf(a, Affine3d::Identity())),
          partsB_(partsOf(b, a_T_b)),
          parts_(partsA_, partsB_, a_T_b_) {}
    Pair(const Pair&) = delete;
    Pair& operator=(const Pair&) = delete;

    [[nodiscard]] const BallRadii& radii() const { return radii_; }

    /// `any`: the first that is found; else all, ascending.
    [[nodiscard]] FacePairs touching(bool any, QueryWork& work) const {
        FacePairs out;
        out.complete =
            eachNearPair(parts_, radii_.reach(), work,
                         [&](std::uint32_t faceA, std::uint32_t faceB, const Triangle& x, const Triangle& y) {
                             if (meets(x, y)) out.pairs.push_back({faceA, faceB});
                             return !any || out.pairs.empty();
                         });
        std::ranges::sort(out.pairs);
        return out;
    }

    /// Of the centres.
    [[nodiscard]] Distance nearest(QueryWork& work, const DistanceOptions& options, double enough) const {
        if constexpr (std::same_as<A, TriangleTree>) {
            if (small(b_, a_))
                return nearestToTree({PointParts(b_), b_.centres()}, a_, true, a_T_b_, work, options, enough, measure);
        } else if constexpr (std::same_as<B, TriangleTree>) {
            if (small(a_, b_))
                return nearestToTree({PointParts(a_), a_.centres()}, b_, false, a_T_b_, work, options, enough, measure);
        }
        return nearestPair(parts_, work, options, enough, measure);
    }

    [[nodiscard]] BallContact contact(const FacePair& faces, QueryWork&) const {
        const Triangle a = partsA_.triangle(faces.a), b = transformed(a_T_b_, partsB_.triangle(faces.b));
        Vec3d along = kPointsB ? outside(a) : Vec3d(-outside(b));
        if (along.isZero(0)) along = Vec3d::UnitX();
        return contactOfBalls(faces, measure(a, b), radii_, along, parts_.rounding());
    }

    [[nodiscard]] BallDepth depth(QueryWork& work) const {
        BallDepth out;
        Distance near = nearest(work, {}, -1);
        out.touching = !near.farther && near.distance <= radii_.reach();
        if (near.complete && !near.farther && radii_.sum() == 0) {
            const FacePairs touched = touching(true, work);
            out.touching = !touched.pairs.empty();
            near.complete = out.touching || touched.complete;
            if (out.touching) near.faces = touched.pairs.front();
        }
        out.complete = near.complete;
        out.known = near.complete && !near.farther;
        if (out.known)
            out.deepest = contact(near.faces, work);
        else
            out.touching = false;
        return out;
    }

private:
    /// Their blocks can be made small trees.
    static bool small(const PointSet& points, const TriangleTree& tree) {
        return points.size() > 0 && tree.mesh().faceCount() > 0 && canBeNearestTo(tree);
    }
    static NearestPoints measure(const Triangle& a, const Triangle& b) {
        NearestPoints near{a[0], b[0], 0};
        if constexpr (!kPointsB)
            near.onB = nearestOnTriangle(b, a[0]);
        else if constexpr (!kPointsA)
            near.onA = nearestOnTriangle(a, b[0]);
        near.distance = (near.onB - near.onA).norm();
        return near;
    }
    [[nodiscard]] bool meets(const Triangle& a, const Triangle& b) const {
        return radii_.sum() > 0 ? measure(a, b).distance <= radii_.reach() : trianglesIntersect(a, b);
    }

    const A& a_;
    const B& b_;
    const Affine3d& a_T_b_;
    BallRadii radii_;
    decltype(partsOf(std::declval<const A&>(), Affine3d())) partsA_;
    decltype(partsOf(std::declval<const B&>(), Affine3d())) partsB_;
    PartPair parts_;
};

template <typename A, typename B>
auto pairOf(const A& a, const B& b, const Affine3d& a_T_b) {
    if constexpr (std::same_as<A, ConvexHull>)
        return HullBalls(b, a, true, a_T_b);
    else if constexpr (std::same_as<B, ConvexHull>)
        return HullBalls(a, b, false, a_T_b);
    else
        return Pair<A, B>(a, b, a_T_b);
}

}  // namespace

template <typename A, typename B>
requires WithBalls<A, B> TouchedPair firstTouching(const A& a, const B& b, const Affine3d& a_T_b, QueryWork& work) {
    const FacePairs found = pairOf(a, b, a_T_b).touching(true, work);
    if (!found.pairs.empty()) return {Touch::kYes, found.pairs.front()};
    return {found.complete ? Touch::kNo : Touch::kUnknown, {}};
}

template <typename A, typename B>
requires WithBalls<A, B> FacePairs allTouching(const A& a, const B& b, const Affine3d& a_T_b, QueryWork& work) {
    return pairOf(a, b, a_T_b).touching(false, work);
}

template <typename A, typename B>
requires WithBalls<A, B> BallContacts contactsBetween(const A& a, const B& b, const Affine3d& a_T_b, QueryWork& work,
                                                      std::size_t most) {
    const auto pair = pairOf(a, b, a_T_b);
    const FacePairs found = pair.touching(false, work);
    BallContacts out;
    out.complete = found.complete && found.pairs.size() <= most;
    for (std::size_t i = 0; i < std::min(most, found.pairs.size()); ++i)
        out.contacts.push_back(pair.contact(found.pairs[i], work));
    return out;
}

template <typename A, typename B>
requires WithBalls<A, B> Distance distanceBetween(const A& a, const B& b, const Affine3d& a_T_b, QueryWork& work,
                                                  const DistanceOptions& options) {
    const auto pair = pairOf(a, b, a_T_b);
    const BallRadii& radii = pair.radii();
    if (radii.sum() > 0) {
        DistanceOptions bare = options;
        bare.upperBound += radii.sum();
        return distanceOfBalls(pair.nearest(work, bare, radii.reach()), radii, options);
    }
    // Whether points touch is for the exact predicates to say.
    const FacePairs touched = pair.touching(true, work);
    if (!touched.pairs.empty()) {
        const Vec3d point = pair.contact(touched.pairs.front(), work).point;
        return {0, touched.pairs.front(), point, point};
    }
    if (touched.complete) return pair.nearest(work, options, -1);
    Distance unknown;
    unknown.distance = 0;
    unknown.complete = false;
    return unknown;
}

template <typename A, typename B>
requires WithBalls<A, B> BallDepth depthBetween(const A& a, const B& b, const Affine3d& a_T_b, QueryWork& work) {
    return pairOf(a, b, a_T_b).depth(work);
}

bool facesNear(const PointSet& points, const Box& box, QueryWork& work, std::vector<std::uint32_t>& faces) {
    if (points.size() == 0) return true;
    Box near = box;
    near.lower.array() -= points.radius();
    near.upper.array() += points.radius();
    const auto before = static_cast<std::ptrdiff_t>(faces.size());
    std::vector<std::uint32_t> open{0};
    while (!open.empty()) {
        if (work.exhausted()) return false;
        const std::uint32_t node = open.back();
        open.pop_back();
        ++work.boxTests;
        if (!points.box(node).overlaps(near)) continue;
        const PointSet::Children of = points.children(node);
        for (std::uint32_t child = of.first; child < of.end; ++child) {
            if (child < points.firstLeaf()) {
                open.push_back(child);
                continue;
            }
            for (const std::uint32_t number : points.pointsOf(child))
                if (near.contains(points.point(number))) faces.push_back(number);
        }
    }
    std::sort(faces.begin() + before, faces.end());
    return true;
}

#define TESSERA_WITH_BALLS(A, B)                                                                                \
    template TouchedPair firstTouching(const A&, const B&, const Affine3d&, QueryWork&);                        \
    template FacePairs allTouching(const A&, const B&, const Affine3d&, QueryWork&);                            \
    template BallContacts contactsBetween(const A&, const B&, const Affine3d&, QueryWork&, std::size_t);        \
    template Distance distanceBetween(const A&, const B&, const Affine3d&, QueryWork&, const DistanceOptions&); \
    template BallDepth depthBetween(const A&, const B&, const Affine3d&, QueryWork&);

TESSERA_BALL_PAIRS(TESSERA_WITH_BALLS)

#undef TESSERA_WITH_BALLS

}  // namespace tessera

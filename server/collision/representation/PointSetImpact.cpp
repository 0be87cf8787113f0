// When moving balls first touch something.
#include <algorithm>

#include "server/collision/representation/BallPairs.h"
#include "server/collision/representation/BlockImpactBody.h"
#include "server/collision/representation/HullBalls.h"
#include "server/collision/representation/PartsOf.h"

namespace tessera {

namespace {

/// A body on its way, as the search sees it.
template <typename Body>
class SetSide {
public:
    SetSide(const Body& body, const BodyMotion& motion) : parts_(body), way_(parts_, boundsOf(body), motion) {}
    SetSide(const SetSide&) = delete;
    SetSide& operator=(const SetSide&) = delete;
    [[nodiscard]] const BlockImpactBody& way() const { return way_; }

private:
    static const Box& boundsOf(const HeightField& field) { return field.bounds(); }
    static const Box& boundsOf(const PointSet& points) { return points.centres(); }
    std::conditional_t<std::same_as<Body, PointSet>, PointParts, FieldParts> parts_;
    BlockImpactBody way_;
};
template <>
class SetSide<TriangleTree> {
public:
    SetSide(const TriangleTree& tree, const BodyMotion& motion) : way_(tree, motion) {}
    [[nodiscard]] const TreeImpactBody& way() const { return way_; }

private:
    TreeImpactBody way_;
};

/// A ball's stretch is the norm of a matrix that changes linearly, but for a turn: never above the line between its
/// ends. Where it is carried the stretches multiply, and the line is raised where their product may be above it.
template <typename Body>
double radiusAt(const Body& body, const BodyMotion& motion, double t) {
    const double radius = radiusOf(body);
    if (radius == 0) return 0;
    if (const BodyWay way(motion); way.carried()) {
        const double start = way.stretchAt(0), end = way.stretchAt(1);
        return radius * (start + t * (end - start) + way.stretchAboveChord());
    }
    const double start = largestStretch(motion.placeAt(0).linear()), end = largestStretch(motion.placeAt(1).linear());
    return radius * (start + t * (end - start));
}

template <typename A, typename B>
Impact contact(const A& a, const BodyMotion& motionA, const B& b, const BodyMotion& motionB, QueryWork& work,
               const ImpactOptions& options) {
    if (isEmpty(a) || isEmpty(b)) return {};
    const SetSide<A> sideA(a, motionA);
    const SetSide<B> sideB(b, motionB);
    if (!sideA.way().way.valid() || !sideB.way().way.valid() || !Thickness(options).valid())
        return {.t = 0, .complete = false};
    const auto radii = [&](double t) { return BallRadii{radiusAt(a, motionA, t), radiusAt(b, motionB, t)}; };
    ImpactOptions thick = options;
    const double start = radii(0).sum(), end = radii(1).sum();
    thick.margin += start;
    // No radius is below 0, whatever rounding says.
    thick.marginGrowth = std::max(thick.marginGrowth + (end - start), -thick.margin);
    Impact found = RigidImpactSearch(sideA.way(), sideB.way(), thick, work).run();
    if (!found.hit) return found;
    // The search is of the bare centres and faces.
    const NearestPoints near =
        nearestPoints(transformed(motionA.placeAt(found.t), sideA.way().triangle(found.faces.a)),
                      transformed(motionB.placeAt(found.t), sideB.way().triangle(found.faces.b)));
    const BallRadii at = radii(found.t);
    found.point = 0.5 * (near.onA + at.a * found.normal + near.onB - at.b * found.normal);
    return found;
}

/// A hull's sides, or the segment or point that one without sides is.
TriangleTree surfaceOf(const ConvexHull& hull) {
    std::vector<double> positions;
    std::vector<std::uint32_t> indices;
    for (const Vec3d& p : hull.vertices()) positions.insert(positions.end(), {p.x(), p.y(), p.z()});
    for (const ConvexHull::Face& face : hull.faces()) indices.insert(indices.end(), face.begin(), face.end());
    const auto last = static_cast<std::uint32_t>(hull.vertices().size() - 1);
    if (indices.empty()) indices = {0, last, last};
    return TriangleTree(*TriangleMesh::make(std::span<const double>(positions), indices));
}

/// The pairs to be left out, with the hull's one face replaced by all its sides.
std::vector<FacePair> withSides(std::span<const FacePair> within, bool hullIsA, std::size_t sides) {
    std::vector<FacePair> out;
    for (const FacePair& pair : within)
        for (std::uint32_t side = 0; side < sides; ++side)
            out.push_back(hullIsA ? FacePair{side, pair.b} : FacePair{pair.a, side});
    std::ranges::sort(out);
    return out;
}

/// A centre within the hull touches from the start on; all others come through the surface.
Impact hullContact(const PointSet& points, const BodyMotion& pointsMotion, const ConvexHull& hull,
                   const BodyMotion& hullMotion, bool hullIsA, QueryWork& work, const ImpactOptions& options) {
    if (points.size() == 0) return {};
    if (!BodyWay(pointsMotion).valid() || !BodyWay(hullMotion).valid() || !Thickness(options).valid())
        return {.t = 0, .complete = false};
    const Affine3d shared_T_hull = hullMotion.placeAt(0), hull_T_shared = shared_T_hull.inverse(Eigen::Affine);
    // What is flattened has no inside.
    if (hull_T_shared.matrix().allFinite()) {
        const Affine3d hull_T_points = hull_T_shared * pointsMotion.placeAt(0);
        const HullBalls centres(points, hull, true, hull_T_points, BallRadii{});
        const FacePairs inside = centres.touching(false, work);
        if (!inside.complete) return {.t = 0, .complete = false};
        for (const FacePair& pair : inside.pairs) {
            const FacePair faces = hullIsA ? pair : FacePair{pair.b, pair.a};
            if (std::ranges::binary_search(options.within, faces)) continue;
            const BallContact at = centres.contact(pair, work);
            Impact out{.hit = true, .t = 0, .faces = faces};
            out.point = shared_T_hull * at.point;
            out.normal = (hull_T_shared.linear().transpose() * at.normal).normalized() * (hullIsA ? 1 : -1);
            return out;
        }
    }
    const TriangleTree surface = surfaceOf(hull);
    const std::vector<FacePair> within = withSides(options.within, hullIsA, surface.mesh().faceCount());
    ImpactOptions bySides = options;
    bySides.within = within;
    Impact found = hullIsA ? contact(surface, hullMotion, points, pointsMotion, work, bySides)
                           : contact(points, pointsMotion, surface, hullMotion, work, bySides);
    (hullIsA ? found.faces.a : found.faces.b) = 0;
    return found;
}

}  // namespace

template <typename A, typename B>
requires WithBalls<A, B> Impact timeOfImpact(const A& a, const BodyMotion& motionA, const B& b,
                                             const BodyMotion& motionB, QueryWork& work, const ImpactOptions& options) {
    if constexpr (std::same_as<A, ConvexHull>)
        return hullContact(b, motionB, a, motionA, true, work, options);
    else if constexpr (std::same_as<B, ConvexHull>)
        return hullContact(a, motionA, b, motionB, false, work, options);
    else
        return contact(a, motionA, b, motionB, work, options);
}

#define TESSERA_WITH_BALLS(A, B)                                                                       \
    template Impact timeOfImpact(const A&, const BodyMotion&, const B&, const BodyMotion&, QueryWork&, \
                                 const ImpactOptions&);

TESSERA_BALL_PAIRS(TESSERA_WITH_BALLS)

#undef TESSERA_WITH_BALLS

}  // namespace tessera

#include "server/collision/pipeline/MotionTrial.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tessera {

MotionTrial::MotionTrial(const ObjectHandler& handler, ObjectId transform, const Way& way, std::vector<Obstacle> obstacles,
                         const MotionLimits& limits, QueryWork& work, std::uint64_t& queries)
    : handler_(handler), way_(way), obstacles_(std::move(obstacles)), limits_(limits), work_(work), queries_(queries) {
    const WayLookup wayOf = [&](ObjectId id) { return id == transform ? &way_ : nullptr; };
    pairs_.reserve(obstacles_.size());
    for (const Obstacle& o : obstacles_) {
        Pair pair{PartOnTheWay(handler, o.partA, transform), PartOnTheWay(handler, o.partB, transform), {}, {}};
        double size = std::numeric_limits<double>::infinity();
        double thickness = size;
        const auto measure = [&](std::uint32_t part, WayBound& bound) {
            bound = boundWay(handler, part, wayOf);
            const Vec3d extent = handler.parts()[part].worldBox.size();
            size = std::min(size, extent.norm());
            thickness = std::min(thickness, extent.minCoeff());
        };
        if (pair.a.moves()) measure(o.partA, pair.boundA);
        if (pair.b.moves()) measure(o.partB, pair.boundB);
        pair.size = std::max(size, 1e-300);  // a single point still has a tolerance
        pair.thickness = thickness;
        pairs_.push_back(std::move(pair));
    }
}

double MotionTrial::length(std::size_t obstacle) const {
    return pairs_[obstacle].boundA.length + pairs_[obstacle].boundB.length;
}

Affine3d MotionTrial::worldOfA(std::size_t obstacle, double fraction) const {
    const PartOnTheWay& part = pairs_[obstacle].a;
    return part.moves() ? part.world(localOf(way_.at(fraction))) : handler_.parts()[obstacles_[obstacle].partA].world;
}

Affine3d MotionTrial::worldOfB(std::size_t obstacle, double fraction) const {
    const PartOnTheWay& part = pairs_[obstacle].b;
    return part.moves() ? part.world(localOf(way_.at(fraction))) : handler_.parts()[obstacles_[obstacle].partB].world;
}

Touch MotionTrial::touching(std::size_t obstacle, double fraction) const {
    const Obstacle& o = obstacles_[obstacle];
    ++queries_;
    const Affine3d a_T_b = worldOfA(obstacle, fraction).inverse() * worldOfB(obstacle, fraction);
    return anyTouching(*handler_.parts()[o.partA].shape, *handler_.parts()[o.partB].shape, a_T_b, work_);
}

FacePairs MotionTrial::facesTouching(std::size_t obstacle, double fraction) const {
    const Obstacle& o = obstacles_[obstacle];
    ++queries_;
    const Affine3d a_T_b = worldOfA(obstacle, fraction).inverse() * worldOfB(obstacle, fraction);
    return allTouching(*handler_.parts()[o.partA].shape, *handler_.parts()[o.partB].shape, a_T_b, work_);
}

template <typename Visit>
void MotionTrial::forFaces(std::size_t obstacle, std::span<const FacePair> faces, double fraction, Visit&& visit) const {
    const Obstacle& o = obstacles_[obstacle];
    const Affine3d worldA = worldOfA(obstacle, fraction), worldB = worldOfB(obstacle, fraction);
    const TriangleMesh& meshA = handler_.parts()[o.partA].shape->mesh();
    const TriangleMesh& meshB = handler_.parts()[o.partB].shape->mesh();
    const bool mirroredA = worldA.linear().determinant() < 0, mirroredB = worldB.linear().determinant() < 0;
    for (const FacePair& f : faces) {
        Triangle a = transformed(worldA, meshA.triangle(f.a)), b = transformed(worldB, meshB.triangle(f.b));
        if (mirroredA) std::swap(a[1], a[2]);
        if (mirroredB) std::swap(b[1], b[2]);
        visit(f, a, b);
    }
}

double MotionTrial::depth(std::size_t obstacle, std::span<const FacePair> faces, double fraction) const {
    double deepest = 0;
    forFaces(obstacle, faces, fraction, [&](const FacePair&, const Triangle& a, const Triangle& b) {
        deepest = std::max(deepest, penetration(a, b));
    });
    return deepest;
}

std::vector<FacePair> MotionTrial::facing(std::size_t obstacle, std::span<const FacePair> faces) const {
    std::vector<FacePair> out;
    const double thin = limits_.stopTolerance * pairs_[obstacle].size;
    forFaces(obstacle, faces, 0, [&](const FacePair& f, const Triangle& a, const Triangle& b) {
        constexpr double kNearlyOpposite = -0.999;
        if (outside(a).dot(outside(b)) < kNearlyOpposite && std::abs(wayOut(a, b, outside(a))) <= thin) out.push_back(f);
    });
    return out;
}

double MotionTrial::overlap(std::size_t obstacle, std::span<const FacePair> facing, double fraction) const {
    double most = -std::numeric_limits<double>::infinity();
    forFaces(obstacle, facing, fraction, [&](const FacePair&, const Triangle& a, const Triangle& b) {
        most = std::max(most, wayOut(a, b, outside(a)));
    });
    return most;
}

/// How many pieces keep every arc near its chord.
int MotionTrial::pieces(const Pair& pair, double interval) const {
    double wanted = interval * std::sqrt((pair.boundA.curvature + pair.boundB.curvature) / (8 * limits_.arcTolerance * pair.size));
    // Two parts on ways of their own (one Transform core at two places) have no straight relative motion to begin with.
    if (pair.a.moves() && pair.b.moves())
        wanted = std::max(wanted, interval * (pair.boundA.length + pair.boundB.length) / (0.05 * pair.size));
    return std::clamp(static_cast<int>(std::ceil(std::min(wanted, 1e6))), 1, limits_.maxPieces);
}

bool MotionTrial::boxesMeet(const Pair& pair, const Obstacle& obstacle, double from, double to) const {
    const auto swept = [&](const PartOnTheWay& onTheWay, const Part& part, const WayBound& bound) {
        if (!onTheWay.moves()) return part.worldBox;
        Box box = conservativeBox(onTheWay.world(localOf(way_.at(from))), part.shape->mesh().bounds());
        box.extend(conservativeBox(onTheWay.world(localOf(way_.at(to))), part.shape->mesh().bounds()));
        const Vec3d margin = Vec3d::Constant(bound.curvature * (to - from) * (to - from) / 8);
        box.lower -= margin;
        box.upper += margin;
        return box;
    };
    return swept(pair.a, handler_.parts()[obstacle.partA], pair.boundA)
        .overlaps(swept(pair.b, handler_.parts()[obstacle.partB], pair.boundB));
}

/// A as seen from B where only A moves, else B as seen from A.
StraightMotion MotionTrial::straight(const Pair& pair, const Obstacle& obstacle, double from, double to) const {
    const Affine3d localFrom = localOf(way_.at(from)), localTo = localOf(way_.at(to));
    const auto pose = [](const PartOnTheWay& onTheWay, const Part& part, const Affine3d& local) {
        return onTheWay.moves() ? onTheWay.world(local) : part.world;
    };
    const bool fixedIsB = pair.a.moves();
    const PartOnTheWay& fixed = fixedIsB ? pair.b : pair.a;
    const PartOnTheWay& moving = fixedIsB ? pair.a : pair.b;
    const Part& fixedPart = handler_.parts()[fixedIsB ? obstacle.partB : obstacle.partA];
    const Part& movingPart = handler_.parts()[fixedIsB ? obstacle.partA : obstacle.partB];
    const Affine3d fixedFrom_T_world = pose(fixed, fixedPart, localFrom).inverse();
    const Affine3d fixedTo_T_world = pose(fixed, fixedPart, localTo).inverse();

    const double interval = to - from;
    double stray = (pair.boundA.curvature + pair.boundB.curvature) * interval * interval / 8;
    if (fixed.moves()) stray += 0.5 * (pair.boundA.length + pair.boundB.length) * interval;
    StraightMotion motion;
    motion.fixed_T_start = fixedFrom_T_world * pose(moving, movingPart, localFrom);
    motion.fixed_T_end = fixedTo_T_world * pose(moving, movingPart, localTo);
    motion.deviation = stray * std::max(stretchOf(fixedFrom_T_world.linear()), stretchOf(fixedTo_T_world.linear()));
    return motion;
}

Touch MotionTrial::touchingOnTheWay(std::size_t obstacle, double from, double to) const {
    const Obstacle& o = obstacles_[obstacle];
    const Pair& pair = pairs_[obstacle];
    const AabbTree& shapeA = *handler_.parts()[o.partA].shape;
    const AabbTree& shapeB = *handler_.parts()[o.partB].shape;
    const bool fixedIsB = pair.a.moves();
    const int n = pieces(pair, to - from);
    double begin = from;
    for (int i = 1; i <= n; ++i) {
        const double end = i == n ? to : from + (to - from) * i / n;
        if (boxesMeet(pair, o, begin, end)) {
            ++queries_;
            const Touch onTheWay = anyTouchingOnTheWay(fixedIsB ? shapeB : shapeA, fixedIsB ? shapeA : shapeB,
                                                       straight(pair, o, begin, end), work_);
            if (onTheWay != Touch::kNo) return onTheWay;
            // The sweep is seen from the fixed part; the answer that counts, at rest, is the one seen from A.
            const Touch atEnd = touching(obstacle, end);
            if (atEnd != Touch::kNo) return atEnd;
        }
        begin = end;
    }
    return Touch::kNo;
}

FacePairs MotionTrial::facesTouchingOnTheWay(std::size_t obstacle, double from, double to) const {
    const Obstacle& o = obstacles_[obstacle];
    const Pair& pair = pairs_[obstacle];
    const AabbTree& shapeA = *handler_.parts()[o.partA].shape;
    const AabbTree& shapeB = *handler_.parts()[o.partB].shape;
    ++queries_;
    const StraightMotion motion = straight(pair, o, from, to);
    if (!pair.a.moves()) return allTouchingOnTheWay(shapeA, shapeB, motion, work_);
    FacePairs faces = allTouchingOnTheWay(shapeB, shapeA, motion, work_);
    for (FacePair& f : faces.pairs) std::swap(f.a, f.b);
    std::sort(faces.pairs.begin(), faces.pairs.end());
    return faces;
}

}  // namespace tessera

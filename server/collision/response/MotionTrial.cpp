#include "server/collision/response/MotionTrial.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tessera {

namespace {

/// Narrows `span` to where low(f) <= high(f), both linear between their values at 0 and at 1.
void narrow(MotionTrial::Span& span, double low0, double low1, double high0, double high1) {
    const double gap0 = low0 - high0, gap1 = low1 - high1;
    if (gap0 <= 0 && gap1 <= 0) return;
    if (gap0 > 0 && gap1 > 0) {
        span = {2, -1};
        return;
    }
    const double crossing = gap0 / (gap0 - gap1);
    // Rounding of the quotient must not cut into the time of meeting.
    constexpr double kSlack = 1e-12;
    if (gap0 > 0)
        span.first = std::max(span.first, crossing - kSlack);
    else
        span.last = std::min(span.last, crossing + kSlack);
}

Box blend(const Box& start, const Box& end, double f) {
    Box box;
    box.lower = start.lower + f * (end.lower - start.lower);
    box.upper = start.upper + f * (end.upper - start.upper);
    return box;
}

}  // namespace

MotionTrial::MotionTrial(const ObjectHandler& handler, ObjectId transform, const Way& way,
                         std::span<const std::pair<std::uint32_t, std::uint32_t>> pairs,
                         const std::function<std::uint64_t(std::uint32_t, std::uint32_t)>& touchingAtStart,
                         const MotionLimits& limits, QueryWork& work, std::uint64_t& queries)
    : handler_(handler), way_(way), limits_(limits), work_(work), queries_(queries) {
    struct Candidate {
        Obstacle obstacle;
        Pair pair;
    };
    std::vector<Candidate> candidates;
    for (const auto& [a, b] : pairs) {
        Candidate candidate{{a, b, 0}, pairOf(a, b, transform)};
        if (candidate.pair.meet.first <= candidate.pair.meet.last) candidates.push_back(candidate);
    }
    std::stable_sort(candidates.begin(), candidates.end(),
                     [](const Candidate& x, const Candidate& y) { return x.pair.meet.first < y.pair.meet.first; });
    for (Candidate& c : candidates) {
        c.obstacle.touchingAtStart = touchingAtStart(c.obstacle.partA, c.obstacle.partB);
        obstacles_.push_back(c.obstacle);
        pairs_.push_back(c.pair);
    }
}

/// A part's box on its way lies between `start` and `end`, but for the curvature/8 by which paths leave their chords.
const MotionTrial::Traveller& MotionTrial::traveller(std::uint32_t number, ObjectId transform) {
    if (const auto known = travellers_.find(number); known != travellers_.end()) return known->second;
    const Part& part = handler_.parts()[number];
    Traveller t{PartOnTheWay(handler_, number, transform), &part.shape->mesh(), {}, part.worldBox, part.worldBox};
    if (t.path.moves()) {
        t.bound = boundWay(handler_, number, [&](ObjectId id) { return id == transform ? &way_ : nullptr; });
        t.end = conservativeBox(t.path.world(localOf(way_.end)), t.mesh->bounds());
    }
    return travellers_.emplace(number, std::move(t)).first->second;
}

MotionTrial::Pair MotionTrial::pairOf(std::uint32_t partA, std::uint32_t partB, ObjectId transform) {
    Pair pair;
    pair.a = &traveller(partA, transform);
    pair.b = &traveller(partB, transform);
    pair.size = pair.thickness = std::numeric_limits<double>::infinity();
    for (const Traveller* t : {pair.a, pair.b}) {
        if (!t->path.moves()) continue;
        pair.size = std::min(pair.size, t->start.size().norm());
        pair.thickness = std::min(pair.thickness, t->start.size().minCoeff());
    }
    pair.size = std::max(pair.size, 1e-300);  // a single point still has a tolerance
    const double margin = (pair.a->bound.curvature + pair.b->bound.curvature) / 8;
    for (int axis = 0; axis < 3; ++axis) {
        narrow(pair.meet, pair.a->start.lower[axis] - margin, pair.a->end.lower[axis] - margin,
               pair.b->start.upper[axis], pair.b->end.upper[axis]);
        narrow(pair.meet, pair.b->start.lower[axis] - margin, pair.b->end.lower[axis] - margin,
               pair.a->start.upper[axis], pair.a->end.upper[axis]);
    }
    return pair;
}

double MotionTrial::length(std::size_t obstacle) const {
    return pairs_[obstacle].a->bound.length + pairs_[obstacle].b->bound.length;
}

Affine3d MotionTrial::worldOfA(std::size_t obstacle, double fraction) const {
    const PartOnTheWay& part = pairs_[obstacle].a->path;
    return part.moves() ? part.world(localOf(way_.at(fraction))) : handler_.parts()[obstacles_[obstacle].partA].world;
}

Affine3d MotionTrial::worldOfB(std::size_t obstacle, double fraction) const {
    const PartOnTheWay& part = pairs_[obstacle].b->path;
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
void MotionTrial::forFaces(std::size_t obstacle, std::span<const FacePair> faces, double fraction,
                           Visit&& visit) const {
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
        if (outside(a).dot(outside(b)) < kNearlyOpposite && std::abs(wayOut(a, b, outside(a))) <= thin)
            out.push_back(f);
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
    double wanted = interval * std::sqrt((pair.a->bound.curvature + pair.b->bound.curvature) /
                                         (8 * limits_.arcTolerance * pair.size));
    // Two parts on ways of their own (one Transform core at two places) have no straight relative motion to begin with.
    if (pair.a->path.moves() && pair.b->path.moves())
        wanted = std::max(wanted, interval * (pair.a->bound.length + pair.b->bound.length) / (0.05 * pair.size));
    return std::clamp(static_cast<int>(std::ceil(std::min(wanted, 1e6))), 1, limits_.maxPieces);
}

bool MotionTrial::boxesMeetBetween(const Pair& pair, double from, double to) const {
    if (from > pair.meet.last || to < pair.meet.first) return false;
    const auto swept = [&](const Traveller& t) {
        if (!t.path.moves()) return t.start;
        // Without a bend the boxes between lie between the boxes at the ends; else it pays to look where it is.
        const bool straight = t.bound.curvature == 0;
        const auto at = [&](double f) {
            if (straight) return blend(t.start, t.end, f);
            return conservativeBox(t.path.world(localOf(way_.at(f))), t.mesh->bounds());
        };
        Box box = at(from);
        box.extend(at(to));
        const Vec3d margin = Vec3d::Constant(t.bound.curvature * (to - from) * (to - from) / 8);
        box.lower -= margin;
        box.upper += margin;
        return box;
    };
    return swept(*pair.a).overlaps(swept(*pair.b));
}

/// A as seen from B where only A moves, else B as seen from A.
StraightMotion MotionTrial::straight(const Pair& pair, const Obstacle& obstacle, double from, double to) const {
    const Affine3d localFrom = localOf(way_.at(from)), localTo = localOf(way_.at(to));
    const auto pose = [](const PartOnTheWay& onTheWay, const Part& part, const Affine3d& local) {
        return onTheWay.moves() ? onTheWay.world(local) : part.world;
    };
    const bool fixedIsB = pair.a->path.moves();
    const PartOnTheWay& fixed = (fixedIsB ? pair.b : pair.a)->path;
    const PartOnTheWay& moving = (fixedIsB ? pair.a : pair.b)->path;
    const Part& fixedPart = handler_.parts()[fixedIsB ? obstacle.partB : obstacle.partA];
    const Part& movingPart = handler_.parts()[fixedIsB ? obstacle.partA : obstacle.partB];
    const Affine3d fixedFrom_T_world = pose(fixed, fixedPart, localFrom).inverse();
    const Affine3d fixedTo_T_world = pose(fixed, fixedPart, localTo).inverse();

    const double interval = to - from;
    double stray = (pair.a->bound.curvature + pair.b->bound.curvature) * interval * interval / 8;
    if (fixed.moves()) stray += 0.5 * (pair.a->bound.length + pair.b->bound.length) * interval;
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
    const bool fixedIsB = pair.a->path.moves();
    const int n = pieces(pair, to - from);
    double begin = from;
    for (int i = 1; i <= n; ++i) {
        const double end = i == n ? to : from + (to - from) * i / n;
        if (boxesMeetBetween(pair, begin, end)) {
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
    if (!pair.a->path.moves()) return allTouchingOnTheWay(shapeA, shapeB, motion, work_);
    FacePairs faces = allTouchingOnTheWay(shapeB, shapeA, motion, work_);
    for (FacePair& f : faces.pairs) std::swap(f.a, f.b);
    std::sort(faces.pairs.begin(), faces.pairs.end());
    return faces;
}

}  // namespace tessera

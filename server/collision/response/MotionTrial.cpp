#include "server/collision/response/MotionTrial.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "server/collision/convex/ConvexQuery.h"
#include "server/collision/pairwise/ConservativeBox.h"
#include "server/collision/pairwise/PairTable.h"
#include "server/collision/response/PairImpact.h"
#include "server/collision/response/RestingImpact.h"

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

}  // namespace

MotionTrial::MotionTrial(const ObjectHandler& handler, ObjectId transform, const Way& way,
                         std::span<const ObstaclePair> pairs, const TouchingAtStart& touchingAtStart,
                         double stopTolerance, QueryWork& work, std::uint64_t& queries)
    : handler_(handler),
      transform_(transform),
      way_(way),
      all_(pairs.begin(), pairs.end()),
      stopTolerance_(stopTolerance),
      work_(work),
      queries_(queries) {
    struct Candidate {
        ObstaclePair parts;
        Pair pair;
        [[nodiscard]] bool met() const { return pair.meet.first <= pair.meet.last; }
    };
    const bool slides = std::any_of(all_.begin(), all_.end(), [](const ObstaclePair& p) { return p.slide; }) &&
                        way.start.translation != way.end.translation;
    std::vector<Candidate> candidates;
    for (const ObstaclePair& parts : all_) {
        if (!handler.parts()[parts.partA].solid() || !handler.parts()[parts.partB].solid()) continue;
        Candidate candidate{parts, pairOf(parts)};
        if (candidate.met() || slides) candidates.push_back(candidate);
    }
    std::stable_sort(candidates.begin(), candidates.end(),
                     [](const Candidate& x, const Candidate& y) { return x.pair.meet.first < y.pair.meet.first; });
    for (const Candidate& c : candidates) {
        const std::size_t index = obstacles_.size();
        obstacles_.push_back({c.parts.partA, c.parts.partB, c.parts.slide, 0});
        pairs_.push_back(c.pair);
        if (!c.met()) continue;
        Obstacle& o = obstacles_.back();
        o.touchingAtStart = touchingAtStart(o.partA, o.partB);
        if (smooth(index)) {
            o.touchingAtStart = 0;  // told to, within the tolerance
            continue;
        }
        if (o.touchingAtStart != 0 || !c.pair.meet.holds(0)) continue;
        if (Touch touch = Touch::kNo; hullsOverlap(index, 0, touch) && touch != Touch::kNo)
            o.touchingAtStart = 1;
        else if (withinHull(index)) {
            // Swallowed by a solid thing: its surface is no obstacle on the way out.
            obstacles_.pop_back();
            pairs_.pop_back();
            smoothGaps_.resize(std::min(smoothGaps_.size(), index));
        }
    }
    rests_.resize(obstacles_.size());
}

MotionTrial MotionTrial::leg(const Way& way) const {
    const auto touchingNow = [&](std::uint32_t partA, std::uint32_t partB) -> std::uint64_t {
        const auto known = std::find_if(obstacles_.begin(), obstacles_.end(),
                                        [&](const Obstacle& o) { return o.partA == partA && o.partB == partB; });
        if (known == obstacles_.end()) return 0;
        if (known->touchingAtStart == 0 && !rests(static_cast<std::size_t>(known - obstacles_.begin()))) return 0;
        const auto pose = [&](const Traveller& t, std::uint32_t part) {
            return t.path.moves() ? t.path.world(localOf(way.start)) : handler_.parts()[part].world;
        };
        const Pair& pair = pairs_[static_cast<std::size_t>(known - obstacles_.begin())];
        const Affine3d worldA = pose(*pair.a, partA), worldB = pose(*pair.b, partB);
        ++queries_;
        const FacePairs faces = surfaceFacesTouching({*handler_.parts()[partA].shape, worldA},
                                                     {*handler_.parts()[partB].shape, worldB}, work_);
        return faces.complete ? faces.pairs.size() : known->touchingAtStart;
    };
    return {handler_, transform_, way, all_, touchingNow, stopTolerance_, work_, queries_};
}

/// A part's box on its way lies between `start` and `end`, but for the curvature/8 by which paths leave their chords.
const MotionTrial::Traveller& MotionTrial::traveller(std::uint32_t number) {
    std::unique_ptr<const Traveller>& known = travellers_[number];
    if (known) return *known;
    const Part& part = handler_.parts()[number];
    Traveller t{PartOnTheWay(handler_, number, transform_), part.shape.get(), {}, part.worldBox, part.worldBox};
    if (t.path.moves()) {
        t.bound = boundWay(handler_, number, [&](ObjectId id) { return id == transform_ ? &way_ : nullptr; });
        t.start = boxAround(t.path.world(localOf(way_.start)), t.shape->bounds());
        t.end = boxAround(t.path.world(localOf(way_.end)), t.shape->bounds());
    }
    known = std::make_unique<const Traveller>(std::move(t));
    return *known;
}

MotionTrial::Pair MotionTrial::pairOf(const ObstaclePair& parts) {
    Pair pair;
    pair.a = &traveller(parts.partA);
    pair.b = &traveller(parts.partB);
    pair.bothHulls = handler_.parts()[parts.partA].shape->hull() && handler_.parts()[parts.partB].shape->hull();
    pair.size = std::numeric_limits<double>::infinity();
    for (const Traveller* t : {pair.a, pair.b}) {
        if (!t->path.moves()) continue;
        pair.size = std::min(pair.size, t->start.size().norm());
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

/// What is nearer than a hundredth of the stop tolerance matters: a motion begins to close up to half of what is left,
/// so that it is never used up.
double MotionTrial::smoothGap(std::size_t obstacle) const {
    smoothGaps_.resize(std::max(smoothGaps_.size(), obstacle + 1));
    std::optional<double>& known = smoothGaps_[obstacle];
    if (known) return *known;
    known = 0;
    if (!freeform_pairs::answersFor(shapeA(obstacle), shapeB(obstacle))) return 0;
    ++queries_;
    const Affine3d worldA = worldOfA(obstacle, 0), worldB = worldOfB(obstacle, 0);
    known = freeform_pairs::provenGap({shapeA(obstacle), worldA}, {shapeB(obstacle), worldB},
                                      0.02 * tolerance(obstacle), work_);
    return *known;
}

std::optional<freeform_pairs::NearestPlaces> MotionTrial::nearestPlaces(std::size_t obstacle, double fraction) const {
    ++queries_;
    const Affine3d worldA = worldOfA(obstacle, fraction), worldB = worldOfB(obstacle, fraction);
    return freeform_pairs::nearestPlaces({shapeA(obstacle), worldA}, {shapeB(obstacle), worldB}, work_);
}

double MotionTrial::length(std::size_t obstacle) const {
    return pairs_[obstacle].a->bound.length + pairs_[obstacle].b->bound.length;
}

bool MotionTrial::leadsNowhere(std::size_t obstacle, const Pose& pose) const {
    constexpr double kGrain = 16 * std::numeric_limits<double>::epsilon();
    for (const Traveller* t : {pairs_[obstacle].a, pairs_[obstacle].b}) {
        if (!t->path.moves()) continue;
        const Affine3d from = t->path.world(localOf(way_.start)), to = t->path.world(localOf(pose));
        const Box& bounds = t->shape->bounds();
        const double coordinates = std::max({t->start.lower.cwiseAbs().maxCoeff(), t->start.upper.cwiseAbs().maxCoeff(),
                                             way_.start.translation.cwiseAbs().maxCoeff()});
        const double least = std::max(kTogether * tolerance(obstacle), kGrain * coordinates);
        for (unsigned corner = 0; corner < 8; ++corner) {
            const Vec3d p(corner & 1U ? bounds.upper.x() : bounds.lower.x(),
                          corner & 2U ? bounds.upper.y() : bounds.lower.y(),
                          corner & 4U ? bounds.upper.z() : bounds.lower.z());
            if (!((to * p - from * p).norm() <= least)) return false;
        }
    }
    return true;
}

Affine3d MotionTrial::worldOfA(std::size_t obstacle, double fraction) const {
    const PartOnTheWay& part = pairs_[obstacle].a->path;
    return part.moves() ? part.world(localOf(way_.at(fraction))) : handler_.parts()[obstacles_[obstacle].partA].world;
}

Affine3d MotionTrial::worldOfB(std::size_t obstacle, double fraction) const {
    const PartOnTheWay& part = pairs_[obstacle].b->path;
    return part.moves() ? part.world(localOf(way_.at(fraction))) : handler_.parts()[obstacles_[obstacle].partB].world;
}

/// False, and no answer, for what is no pair of hulls.
bool MotionTrial::hullsOverlap(std::size_t obstacle, double fraction, Touch& touch) const {
    if (!pairs_[obstacle].bothHulls) return false;
    const Affine3d worldA = worldOfA(obstacle, fraction), worldB = worldOfB(obstacle, fraction);
    ++queries_;
    touch = touchOf({shapeA(obstacle), worldA}, {shapeB(obstacle), worldB}, {work_}).touch;
    return true;
}

/// Of a hull and a surface that do not meet at the start: is (some of) the surface inside?
bool MotionTrial::withinHull(std::size_t obstacle) const {
    if (pairs_[obstacle].bothHulls) return false;
    if (shapeA(obstacle).hull() == nullptr && shapeB(obstacle).hull() == nullptr) return false;
    const Affine3d worldA = worldOfA(obstacle, 0), worldB = worldOfB(obstacle, 0);
    return drawnTouching({shapeA(obstacle), worldA}, {shapeB(obstacle), worldB}, work_) != Touch::kNo;
}

Touch MotionTrial::touching(std::size_t obstacle, double fraction) const {
    ++queries_;
    const Affine3d worldA = worldOfA(obstacle, fraction), worldB = worldOfB(obstacle, fraction);
    if (smooth(obstacle)) return freeform_pairs::meeting({shapeA(obstacle), worldA}, {shapeB(obstacle), worldB}, work_);
    const Touch surfaces = surfacesTouching({shapeA(obstacle), worldA}, {shapeB(obstacle), worldB}, work_);
    if (Touch solid = Touch::kNo; surfaces == Touch::kNo && hullsOverlap(obstacle, fraction, solid)) return solid;
    return surfaces;
}

FacePairs MotionTrial::facesTouching(std::size_t obstacle, double fraction) const {
    ++queries_;
    const Affine3d worldA = worldOfA(obstacle, fraction), worldB = worldOfB(obstacle, fraction);
    return surfaceFacesTouching({shapeA(obstacle), worldA}, {shapeB(obstacle), worldB}, work_);
}

Impact MotionTrial::firstContact(std::size_t obstacle, double upTo) const {
    const Obstacle& o = obstacles_[obstacle];
    const Way cut{way_.start, way_.at(upTo)};
    const auto wayOf = [&](ObjectId id) { return id == transform_ ? &cut : nullptr; };
    if (smooth(obstacle)) {
        ++queries_;
        Impact found = firstSmoothContact(handler_, o.partA, o.partB, wayOf, 0.5 * smoothGap(obstacle), work_);
        found.t *= upTo;
        return found;
    }
    // Far less than the gap in which motions stop: what slides along at that gap must not be taken for touching.
    const double near = 1e-6 * tolerance(obstacle);
    for (;;) {
        ++queries_;
        const std::vector<Support> supports = supportsOf(obstacle);
        Impact found = firstNewContact(handler_, o.partA, o.partB, wayOf, near, ownRest(obstacle), supports,
                                       restTerms(obstacle), work_);
        if (found.hit && found.support < 0 && addNearRests()) continue;
        found.t *= upTo;
        return found;
    }
}

/// What is as near at the start as rounding can tell rests, too, though it does not touch. Asked once, when something
/// is met. Says whether there is any.
bool MotionTrial::addNearRests() const {
    if (std::exchange(lookedNear_, true)) return false;
    bool added = false;
    for (std::size_t k = 0; k < obstacles_.size(); ++k) {
        const double together = kTogether * tolerance(k);
        if (obstacles_[k].touchingAtStart != 0 || smooth(k) || !(pairs_[k].meet.first * length(k) <= together))
            continue;
        const Affine3d worldA = worldOfA(k, 0), worldB = worldOfB(k, 0), a_T_world = worldA.inverse();
        if (!a_T_world.matrix().allFinite()) continue;
        ++queries_;
        DistanceOptions options;
        options.upperBound = together * stretchOf(a_T_world.linear());
        const Distance d =
            surfaceMethods(shapeA(k), shapeB(k)).distance(shapeA(k), shapeB(k), a_T_world * worldB, work_, options);
        if (!d.complete || d.farther || gapOf(k, d.faces, 0) > together) continue;
        const Obstacle& o = obstacles_[k];
        added = addRest(ownRest(k), handler_.parts()[o.partA], worldA, handler_.parts()[o.partB], worldB,
                        std::span(&d.faces, 1), restTerms(k)) ||
                added;
    }
    return added;
}

Rest& MotionTrial::ownRest(std::size_t obstacle) const {
    std::optional<Rest>& known = rests_[obstacle];
    if (known) return *known;
    known.emplace();
    if (obstacles_[obstacle].touchingAtStart == 0) return *known;
    const Obstacle& o = obstacles_[obstacle];
    addRest(*known, handler_.parts()[o.partA], worldOfA(obstacle, 0), handler_.parts()[o.partB], worldOfB(obstacle, 0),
            facesTouching(obstacle, 0).pairs, restTerms(obstacle));
    if (pairs_[obstacle].bothHulls)
        if (const std::optional<HullOverlap> overlap = hullOverlap(obstacle, 0);
            overlap && overlap->depth <= tolerance(obstacle) && !overlap->normal.isZero())
            known->supports.push_back(
                {overlap->normal, Support::Turns::kNo, tolerance(obstacle), restTerms(obstacle).rounding});
    return *known;
}

RestTerms MotionTrial::restTerms(std::size_t obstacle) const {
    const bool turns = way_.start.rotation.coeffs() != way_.end.rotation.coeffs();
    return restingTerms(tolerance(obstacle), length(obstacle), turns && pairs_[obstacle].a->path.moves(),
                        turns && pairs_[obstacle].b->path.moves());
}

std::vector<Support> MotionTrial::supportsOf(std::size_t obstacle) const {
    if (smooth(obstacle)) return {};
    std::vector<Support> supports = ownRest(obstacle).supports;
    const Pair& own = pairs_[obstacle];
    if (own.a->path.moves() && own.b->path.moves()) return supports;
    for (std::size_t k = 0; k < obstacles_.size(); ++k) {
        const Pair& other = pairs_[k];
        if (k == obstacle || ownRest(k).supports.empty()) continue;
        if (other.a->path.moves() && other.b->path.moves()) continue;
        const bool reversed = own.a->path.moves() != other.a->path.moves();
        shareSupports(supports, ownRest(k).supports, reversed, tolerance(obstacle));
    }
    return supports;
}

bool MotionTrial::rests(std::size_t obstacle) const {
    return !ownRest(obstacle).within.empty() || !supportsOf(obstacle).empty();
}

Touch MotionTrial::touchingAnew(std::size_t obstacle, double fraction) const {
    if (!rests(obstacle)) return touching(obstacle, fraction);
    const std::vector<Support> supports = supportsOf(obstacle);
    const std::vector<FacePair>& within = ownRest(obstacle).within;
    const FacePairs faces = facesTouching(obstacle, fraction);
    if (!faces.complete) return Touch::kUnknown;
    const auto turnOf = [&](const Affine3d& start, const Affine3d& now) {
        return Mat3d(now.linear() * start.linear().inverse());
    };
    const Mat3d turnA = turnOf(worldOfA(obstacle, 0), worldOfA(obstacle, fraction)),
                turnB = turnOf(worldOfB(obstacle, 0), worldOfB(obstacle, fraction));
    Touch touch = Touch::kNo;
    forFaces(obstacle, faces.pairs, fraction, [&](const FacePair& f, const WorldFaces& placed) {
        if (touch != Touch::kNo || std::ranges::binary_search(within, f)) return;
        const bool held = std::ranges::any_of(supports, [&](const Support& support) {
            const Vec3d n = support.turns == Support::Turns::kWithA   ? (turnA * support.normal).normalized()
                            : support.turns == Support::Turns::kWithB ? (turnB * support.normal).normalized()
                                                                      : support.normal;
            return placed.wayOut(n) <= support.overlap + 2 * support.rounding;
        });
        if (!held) touch = Touch::kYes;
    });
    return touch;
}

template <typename Visit>
void MotionTrial::forFaces(std::size_t obstacle, std::span<const FacePair> faces, double fraction,
                           Visit&& visit) const {
    const Affine3d worldA = worldOfA(obstacle, fraction), worldB = worldOfB(obstacle, fraction);
    for (const FacePair& f : faces) visit(f, worldFaces({shapeA(obstacle), worldA}, {shapeB(obstacle), worldB}, f));
}

std::optional<MotionTrial::HullOverlap> MotionTrial::hullOverlap(std::size_t obstacle, double fraction) const {
    const Affine3d worldA = worldOfA(obstacle, fraction);
    ConvexWork work;
    ++queries_;
    const HullDepth found = hullDepth(*shapeA(obstacle).hull(), *shapeB(obstacle).hull(),
                                      worldA.inverse() * worldOfB(obstacle, fraction), work);
    work_.boxTests += work.supports;
    if (!found.complete) return std::nullopt;
    if (!found.touching) return HullOverlap{};
    const Vec3d way = worldA.linear() * found.normal;
    return HullOverlap{std::max(0.0, found.depth) * way.norm(), way.normalized()};
}

std::optional<WorldFaces> MotionTrial::nearest(std::size_t obstacle, double fraction) const {
    ++queries_;
    const Affine3d worldA = worldOfA(obstacle, fraction), worldB = worldOfB(obstacle, fraction);
    const CollisionShape &a = shapeA(obstacle), &b = shapeB(obstacle);
    const Distance d = surfaceMethods(a, b).distance(a, b, worldA.inverse() * worldB, work_, {});
    if (!d.complete || d.farther) return std::nullopt;
    return worldFaces({a, worldA}, {b, worldB}, d.faces);
}

WorldFaces MotionTrial::placed(std::size_t obstacle, const FacePair& faces, double fraction) const {
    const Affine3d worldA = worldOfA(obstacle, fraction), worldB = worldOfB(obstacle, fraction);
    return worldFaces({shapeA(obstacle), worldA}, {shapeB(obstacle), worldB}, faces);
}

double MotionTrial::gapOf(std::size_t obstacle, const FacePair& faces, double fraction) const {
    return placed(obstacle, faces, fraction).nearest().distance;
}

Vec3d MotionTrial::wayOfMover(std::size_t obstacle, const Vec3d& normal) const {
    return pairs_[obstacle].a->path.moves() ? Vec3d(-normal) : normal;
}

Vec3d MotionTrial::wayOutOf(std::size_t obstacle, const FacePair& faces, double fraction, const Vec3d& wanted) const {
    const WorldFaces near = placed(obstacle, faces, fraction);
    Vec3d best = wayOfMover(obstacle, near.meeting().normal);
    // The nearest points of an edge and the foot of a slope lie before each other as if it were a wall.
    for (const Vec3d& normal : {outside(near.a), Vec3d(-outside(near.b))}) {
        const Vec3d way = wayOfMover(obstacle, normal);
        if (!normal.isZero(0) && near.wayOut(normal) <= 0 && way.dot(wanted) > best.dot(wanted)) best = way;
    }
    return best;
}

double MotionTrial::gap(std::size_t obstacle, double fraction) const {
    if (smooth(obstacle)) {
        const auto near = nearestPlaces(obstacle, fraction);
        return near ? near->distance : 0;
    }
    const std::optional<WorldFaces> near = nearest(obstacle, fraction);
    return near ? near->nearest().distance : 0;
}

std::optional<Mat3d> MotionTrial::frameAbove(std::size_t obstacle) const {
    const Pair& pair = pairs_[obstacle];
    if (pair.a->path.moves() && pair.b->path.moves()) return std::nullopt;
    return (pair.a->path.moves() ? pair.a : pair.b)->path.frameAbove();
}

std::vector<Vec3d> MotionTrial::waysOut(std::size_t obstacle, double fraction) const {
    const double out = pairs_[obstacle].a->path.moves() ? -1 : 1;  // normals are from A to B
    std::vector<Vec3d> ways;
    if (smooth(obstacle)) {
        if (const auto near = nearestPlaces(obstacle, fraction)) ways.push_back(out * near->place.normal);
        return ways;
    }
    if (obstacles_[obstacle].touchingAtStart == 0) {
        const std::optional<WorldFaces> near = nearest(obstacle, fraction);
        if (near) ways.push_back(out * near->meeting().normal);
        return ways;
    }
    if (pairs_[obstacle].bothHulls) {
        if (const std::optional<HullOverlap> overlap = hullOverlap(obstacle, fraction);
            overlap && !overlap->normal.isZero())
            ways.push_back(out * overlap->normal);
        return ways;
    }
    const FacePairs faces = facesTouching(obstacle, fraction);
    if (!faces.complete) return ways;
    forFaces(obstacle, faces.pairs, fraction, [&](const FacePair&, const WorldFaces& placed) {
        const Vec3d way = out * placed.contactNormal();
        constexpr double kSame = 1 - 1e-12;
        const bool known = std::any_of(ways.begin(), ways.end(), [&](const Vec3d& w) { return w.dot(way) > kSame; });
        if (!known) ways.push_back(way);
    });
    return ways;
}

}  // namespace tessera

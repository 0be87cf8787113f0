#include "server/collision/pairwise/FreeformPairs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

#include "server/collision/freeform/FreeformQuery.h"
#include "server/collision/mesh/TriangleContact.h"
#include "server/collision/pairwise/ConservativeBox.h"
#include "server/collision/pairwise/SurfacePairs.h"
#include "server/collision/query/FacesNear.h"
#include "server/collision/representation/BallPairs.h"

namespace tessera::freeform_pairs {
namespace {

/// Of the triangles that are drawn the nearest to a point of the surface, in its frame: boxes around it that grow until
/// one has some, then as far as the nearest of these.
std::uint32_t nearestDrawn(const CollisionShape& shape, const Vec3d& point) {
    const TriangleTree& tree = shape.tree();
    const Box bounds = shape.mesh().bounds();
    const double size = bounds.size().norm(), farthest = size + (point - bounds.center()).norm();
    const auto around = [&](double reach) {
        return Box{point - Vec3d::Constant(reach), point + Vec3d::Constant(reach)};
    };
    std::vector<std::uint32_t> faces;
    double reach = 1e-3 * size;
    for (; faces.empty(); reach *= 4) {
        QueryWork work;
        (void)facesNear(tree, around(std::min(reach, farthest)), work, faces);
        if (reach > farthest) break;
    }
    const auto nearest = [&] {
        std::pair<double, std::uint32_t> best{std::numeric_limits<double>::infinity(), 0};
        for (const std::uint32_t face : faces) {
            const Triangle t = shape.mesh().triangle(face);
            best = std::min(best, {(nearestOnTriangle(t, point) - point).squaredNorm(), face});
        }
        return best;
    };
    const double within = std::sqrt(nearest().first);
    if (!std::isfinite(within)) return 0;
    faces.clear();
    QueryWork work;
    (void)facesNear(tree, around(within * (1 + 1e-9) + 1e-300), work, faces);
    return nearest().second;
}

/// `point` in the shape's frame.
std::uint32_t faceAt(const CollisionShape& shape, const FreeformPlace& place, const Vec3d& point) {
    return shape.smoothSurface() != nullptr ? nearestDrawn(shape, point) : place.face;
}

FacePair facesAt(const CollisionShape& a, const CollisionShape& b, const FreeformPlace& onA, const FreeformPlace& onB,
                 const Affine3d& a_T_shared, const Affine3d& b_T_shared) {
    return {faceAt(a, onA, a_T_shared * onA.point), faceAt(b, onB, b_T_shared * onB.point)};
}

PatchPlace patchOf(const CollisionShape& shape, const FreeformPlace& place) {
    if (shape.smoothSurface() == nullptr || place.face == kNoIndex) return {};
    return {place.face, {place.u, place.v}};
}

/// As PartChoice.h: along the difference of the normals, else A's, else the way between.
Vec3d normalBetween(const FreeformPlace& a, const FreeformPlace& b) {
    const Vec3d difference = a.normal - b.normal, between = b.point - a.point;
    if (difference.norm() > 1e-6) return difference.normalized();
    if (!a.normal.isZero()) return a.normal;
    return between.norm() > 0 ? Vec3d(between.normalized()) : Vec3d::UnitX();
}

/// Of what two that touch along a whole area have for a normal, any will do.
constexpr std::uint64_t kMostTestsOfANormal = 20'000;

PairTouch asWholes(Touch touch) {
    PairTouch out;
    out.touch = touch;
    out.complete = touch != Touch::kUnknown;
    out.count = touch == Touch::kYes ? 1 : 0;
    return out;
}

constexpr std::uint64_t kMostTestsOfAPlace = 20'000;

/// An empty mesh is no body to ../freeform; to trees it meets nothing.
bool anyIsEmpty(const CollisionShape& a, const CollisionShape& b) {
    return a.faceCount() == 0 || b.faceCount() == 0;
}

/// What one question may do of the work that is left. A test of parts takes as long as some tests of boxes, and leaves
/// parts behind: a question that never ends, as that of two coaxial cylinders, is not to take all memory.
class ShareOfWork {
public:
    explicit ShareOfWork(QueryWork& whole, std::uint64_t most = kMostTestsOfAQuestion) : whole_(whole) {
        const std::uint64_t left =
            (whole.limit - std::min(whole.limit, whole.boxTests + whole.triangleTests)) / kBoxesOfATest;
        own_.limit = std::min(most, left);
        takesAll_ = left <= most;
    }
    ShareOfWork(const ShareOfWork&) = delete;
    ShareOfWork& operator=(const ShareOfWork&) = delete;
    ~ShareOfWork() {
        whole_.boxTests += kBoxesOfATest * (own_.boxTests + own_.triangleTests);
        if (takesAll_ && own_.exhausted()) whole_.boxTests = std::max(whole_.boxTests, whole_.limit);
    }
    operator QueryWork&() { return own_; }

private:
    static constexpr std::uint64_t kBoxesOfATest = 16, kMostTestsOfAQuestion = 500'000;
    QueryWork& whole_;
    QueryWork own_;
    bool takesAll_ = false;  ///< it ends where the whole does
};

/// Where B stands after it has gone some way in the world.
Affine3d gone(const Affine3d& world, const Vec3d& way) {
    Affine3d out = world;
    out.translation() += way;
    return out;
}

}  // namespace

double toleranceOf(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b) {
    const double ofA = a.freeformTolerance(), ofB = b.freeformTolerance() * largestStretch(a_T_b.linear());
    if (a.smoothSurface() == nullptr) return ofB;
    return b.smoothSurface() == nullptr ? ofA : std::min(ofA, ofB);
}

PairTouch touch(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b, const PairEffort& effort) {
    if (anyIsEmpty(a, b)) return surface_pairs::touch(a, b, a_T_b, effort);
    FreeformPair pair(a.freeform(), b.freeform());
    const FreeformTouch found = pair.touch(a_T_b, toleranceOf(a, b, a_T_b), ShareOfWork(effort.work));
    PairTouch out = asWholes(found.touch);
    if (found.touch != Touch::kYes || found.inside) return out;
    out.faces = {facesAt(a, b, found.a, found.b, Affine3d::Identity(), a_T_b.inverse())};
    out.places = {{0.5 * (found.a.point + found.b.point), normalBetween(found.a, found.b), patchOf(a, found.a),
                   patchOf(b, found.b)}};
    return out;
}

PairTouch contacts(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b, std::size_t most,
                   const PairEffort& effort) {
    if (anyIsEmpty(a, b)) return surface_pairs::contacts(a, b, a_T_b, most, effort);
    FreeformPair pair(a.freeform(), b.freeform());
    const double tolerance = toleranceOf(a, b, a_T_b);
    FreeformContacts found = pair.contacts(a_T_b, ShareOfWork(effort.work), {.tolerance = tolerance});
    if (found.contacts.empty()) {
        if (!found.complete) return asWholes(Touch::kUnknown);
        // Within a hull, or so far apart as the tolerance lets be told.
        return touch(a, b, a_T_b, effort);
    }
    const Affine3d b_T_a = a_T_b.inverse();
    std::vector<std::pair<FacePair, std::size_t>> named;
    for (std::size_t i = 0; i < found.contacts.size(); ++i)
        named.emplace_back(facesAt(a, b, found.contacts[i].a, found.contacts[i].b, Affine3d::Identity(), b_T_a), i);
    std::ranges::sort(named);
    named.erase(std::unique(named.begin(), named.end(),
                            [](const auto& one, const auto& other) { return one.first == other.first; }),
                named.end());
    PairTouch out;
    out.touch = Touch::kYes;
    out.complete = found.complete;
    out.count = named.size();
    named.resize(std::min(named.size(), most));
    for (const auto& [faces, i] : named) {
        out.faces.push_back(faces);
        const FreeformContact& at = found.contacts[i];
        out.places.push_back({at.point, at.normal, patchOf(a, at.a), patchOf(b, at.b)});
    }
    return out;
}

PatchPlace patchAt(const CollisionShape& shape, const Vec3d& point) {
    if (shape.smoothSurface() == nullptr) return {};
    const std::array<double, 9> corners{point.x(), point.y(), point.z(), point.x(), point.y(),
                                        point.z(), point.x(), point.y(), point.z()};
    const std::array<std::uint32_t, 3> face{0, 1, 2};
    Expected<TriangleMesh> alone = TriangleMesh::make(std::span<const double>(corners), face);
    if (!alone) return {};
    const Expected<FreeformShape> place = FreeformShape::ofTriangles(*std::move(alone));
    if (!place) return {};
    FreeformPair pair(*shape.smoothSurface(), *place);
    QueryWork work{.limit = kMostTestsOfAPlace};
    const FreeformDistance near =
        pair.distance(Affine3d::Identity(), work, {.tolerance = 1e-3 * shape.freeformTolerance()});
    // What is as near everywhere, the middle of a sphere, has no place.
    return std::isfinite(near.distance) ? patchOf(shape, near.a) : PatchPlace{};
}

Distance distance(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b, QueryWork& work,
                  const DistanceOptions& options) {
    if (anyIsEmpty(a, b)) return surface_pairs::distance(a, b, a_T_b, work, options);
    FreeformPair pair(a.freeform(), b.freeform());
    const double tolerance = toleranceOf(a, b, a_T_b);
    const FreeformDistance found =
        pair.distance(a_T_b, ShareOfWork(work),
                      {.tolerance = std::max(tolerance, options.tolerance), .upperBound = options.upperBound});
    Distance out;
    out.faces = {kWhole, kWhole};
    out.onA = found.a.point;
    out.onB = found.b.point;
    // What could not be told within the tolerance is told with a larger error, as long as it is known to be more than
    // nothing.
    if (!found.complete &&
        (found.farther || !std::isfinite(found.distance) || !(found.distance > 0) || !(found.least > 0))) {
        out.complete = false;
        out.distance = std::isfinite(found.least) ? found.least : 0;
        return out;
    }
    out.farther = found.farther;
    out.distance = found.farther ? options.upperBound : found.distance;
    if (found.farther) return out;
    // What is told to touch is at 0, and nothing else is.
    if (found.distance <= tolerance && pair.touch(a_T_b, tolerance, ShareOfWork(work)).touch == Touch::kYes) {
        out.distance = 0;
        out.error = found.distance;
    } else {
        out.error = found.distance - found.least;
    }
    return out;
}

Impact firstContact(const CollisionShape& a, const BodyMotion& motionA, const CollisionShape& b,
                    const BodyMotion& motionB, QueryWork& work, const ImpactOptions& options) {
    if (anyIsEmpty(a, b) || !options.supports.empty() || !options.within.empty() || options.margin != 0 ||
        options.marginGrowth != 0)
        return surface_pairs::firstContact(a, motionA, b, motionB, work, options);
    FreeformPair pair(a.freeform(), b.freeform());
    const FreeformImpact found = pair.firstContact(motionA, motionB, options.tolerance, ShareOfWork(work));
    Impact out;
    out.hit = found.hit;
    out.t = found.t;
    out.distance = found.distance;
    out.complete = found.complete;
    if (!found.hit) return out;
    out.point = 0.5 * (found.a.point + found.b.point);
    out.normal = found.normal;
    out.faces = {kWhole, kWhole};
    if (found.a.face == kNoIndex || found.b.face == kNoIndex) return out;
    const Affine3d worldA = motionA.placeAt(found.t), worldB = motionB.placeAt(found.t);
    if (!invertible(worldA) || !invertible(worldB)) return out;
    FreeformPlace onA = found.a, onB = found.b;
    // Places within the tolerance need not be the nearest; the way between those is the normal.
    const std::optional<double> scale = similarityScale(worldA);
    if (scale && found.distance > 0) {
        const double apart = found.distance / *scale;
        const FreeformDistance near = pair.distance(worldA.inverse() * worldB, ShareOfWork(work, kMostTestsOfANormal),
                                                    {.tolerance = 1e-6 * apart, .upperBound = apart * (1 + 1e-9)});
        const double rounding = 1e-12 * (std::abs(near.a.point.cwiseAbs().maxCoeff()) + a.bounds().size().norm());
        if (near.complete && !near.farther && near.a.face != kNoIndex && near.b.face != kNoIndex &&
            near.distance > rounding) {
            for (const auto& [place, of] : {std::pair(&onA, &near.a), std::pair(&onB, &near.b)}) {
                *place = *of;
                place->point = worldA * of->point;
            }
            out.distance = near.distance * *scale;
            out.point = 0.5 * (onA.point + onB.point);
            out.normal = (onB.point - onA.point).normalized();
        }
    }
    out.faces = facesAt(a, b, onA, onB, worldA.inverse(), worldB.inverse());
    return out;
}

PairDepth depth(const PlacedShape& a, const PlacedShape& b, QueryWork& work) {
    PairDepth out;
    if (anyIsEmpty(a.shape, b.shape)) return surface_pairs::depth(a, b, work);
    if (!invertible(a.world) || !invertible(b.world)) return out;
    if (!a.shape.topology().closed() || !b.shape.topology().closed()) return out;
    const Affine3d a_T_b = a.world.inverse() * b.world;
    const double tolerance = largestStretch(a.world.linear()) * toleranceOf(a.shape, b.shape, a_T_b);
    const PairTouch meeting = contacts(a.shape, b.shape, a_T_b, 256, {work});
    if (meeting.touch == Touch::kUnknown || work.exhausted()) return out;
    if (meeting.touch == Touch::kNo) {
        out.depth = 0;
        return out;
    }
    const PairDepth drawn = surface_pairs::depth(a, b, work);
    Vec3d normal = drawn.depth && *drawn.depth > 0 ? drawn.normal : Vec3d::Zero();
    Vec3d middle = Vec3d::Zero(), sum = Vec3d::Zero();
    const Mat3d forms = a.world.linear().inverse().transpose();
    for (const MeetingPlace& place : meeting.places) {
        sum += Vec3d(forms * place.normal).stableNormalized();
        middle += a.world * place.point / static_cast<double>(meeting.places.size());
    }
    if (normal.isZero()) normal = sum;
    if (!(normal.norm() > 0)) return out;
    normal.normalize();

    // From beyond all of A back to where B is: never late, so that what is farther than the first contact is free.
    const Box boxA = a.shape.boxIn(a.world), boxB = b.shape.boxIn(b.world);
    const double far = (boxA.size() + boxB.size()).norm() + (boxA.center() - boxB.center()).norm();
    const BodyMotion rest{.start = {}, .end = {}, .body_T_mesh = a.world};
    BodyMotion back{.start = {}, .end = {}, .body_T_mesh = b.world};
    back.start.translation = far * normal;
    FreeformPair pair(a.shape.freeform(), b.shape.freeform());
    const FreeformImpact found = pair.firstContact(rest, back, tolerance, ShareOfWork(work));
    if (!found.complete) return out;
    out.depth = found.hit ? (1 - found.t) * far : 0;
    out.normal = normal;
    out.point = drawn.depth && *drawn.depth > 0 ? drawn.point : middle;
    // Where do they still meet? Told to touch by rounding alone they do.
    for (double less = std::max(tolerance, 1e-12 * far);; less *= 2) {
        out.error = std::min(less, *out.depth);
        if (less >= *out.depth) return out;
        const FreeformTouch still =
            pair.touch(a.world.inverse() * gone(b.world, (*out.depth - less) * normal), 0, ShareOfWork(work));
        if (still.touch == Touch::kUnknown) return PairDepth{};
        if (still.touch == Touch::kYes) return out;
    }
}

bool answersFor(const CollisionShape& a, const CollisionShape& b) {
    return pairMethods(a, b).touch == touch && !anyIsEmpty(a, b);
}

double provenGap(const PlacedShape& a, const PlacedShape& b, double most, QueryWork& work) {
    if (!invertible(a.world) || !invertible(b.world)) return 0;
    const Mat3d a_T_world = a.world.linear().inverse();
    const double shrinks = largestStretch(a_T_world);  // a length of A's frame is at least 1/so much of the world's
    FreeformPair pair(a.shape.freeform(), b.shape.freeform());
    // Half of what there is will do.
    const FreeformDistance found =
        pair.distance(a.world.inverse() * b.world, ShareOfWork(work),
                      {.tolerance = 0, .relative = 0.5, .upperBound = most * shrinks * (1 + 1e-12)});
    if (found.farther) return most;
    if (!(found.least > 0)) return 0;
    return std::min(most, found.least / shrinks * (1 - 1e-12));
}

Touch meeting(const PlacedShape& a, const PlacedShape& b, QueryWork& work) {
    if (!invertible(a.world) || !invertible(b.world)) return Touch::kUnknown;
    FreeformPair pair(a.shape.freeform(), b.shape.freeform());
    return pair.touch(a.world.inverse() * b.world, 0, ShareOfWork(work)).touch;
}

std::optional<NearestPlaces> nearestPlaces(const PlacedShape& a, const PlacedShape& b, QueryWork& work) {
    if (anyIsEmpty(a.shape, b.shape) || !invertible(a.world) || !invertible(b.world)) return std::nullopt;
    if (!similarityScale(a.world) && similarityScale(b.world)) {
        std::optional<NearestPlaces> out = nearestPlaces(b, a, work);
        if (!out) return out;
        out->place.normal = -out->place.normal;
        std::swap(out->place.onA, out->place.onB);
        std::swap(out->faces.a, out->faces.b);
        return out;
    }
    const Affine3d a_T_b = a.world.inverse() * b.world;
    FreeformPair pair(a.shape.freeform(), b.shape.freeform());
    const FreeformDistance near =
        pair.distance(a_T_b, ShareOfWork(work, kMostTestsOfANormal), {.tolerance = 0, .relative = 1e-6});
    if (!std::isfinite(near.distance) || near.a.face == kNoIndex || near.b.face == kNoIndex) return std::nullopt;
    const Vec3d pointA = a.world * near.a.point, pointB = a.world * near.b.point, between = pointB - pointA;
    NearestPlaces out;
    out.distance = between.norm();
    const double rounding = 1e-12 * (pointA.cwiseAbs().maxCoeff() + a.shape.boxIn(a.world).size().norm());
    const bool unique = near.complete && out.distance > rounding && similarityScale(a.world).has_value();
    const Vec3d normal =
        unique ? between : Vec3d(a.world.linear().inverse().transpose() * normalBetween(near.a, near.b));
    out.place = {0.5 * (pointA + pointB), normal.stableNormalized(), patchOf(a.shape, near.a),
                 patchOf(b.shape, near.b)};
    out.faces = facesAt(a.shape, b.shape, near.a, near.b, Affine3d::Identity(), a_T_b.inverse());
    return out;
}

}  // namespace tessera::freeform_pairs

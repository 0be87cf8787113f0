/// Where the bodies are after the solver has moved them: as far as their surroundings were looked at, and through no
/// face.
#include <algorithm>
#include <cmath>
#include <optional>

#include "server/collision/dynamics/RigidBodyState.h"
#include "server/collision/query/RayQuery.h"

namespace tessera {

using namespace dynamics;

namespace {

/// Deeper than so many sizes is no contact of bodies that keep apart.
constexpr double kDeepSizes = 0.03;
/// In sizes: a centre nearer to a face lies in it; one that is stopped stays farther from it by far.
constexpr double kInFace = 1e-9, kKeepAway = 1e-6;

struct FaceHit {
    double t = 0;  ///< of the way
    Vec3d normal;  ///< on the side from which it comes
};

/// What is met within the first `inFace` of the way does not count: a centre that lies in a face is on neither side of
/// it, and may leave to both.
std::optional<FaceHit> firstFace(const TriangleTree& tree, const Affine3d& world, const Vec3d& from, const Vec3d& way,
                                 double inFace) {
    const Affine3d back = world.inverse();
    const Ray ray{back * from, back.linear() * way};
    double start = 0;
    std::optional<RayHit> hit = castRay(tree, ray, 1);
    if (hit && hit->t <= inFace) {
        start = inFace;
        hit = castRay(tree, {ray.origin + start * ray.direction, ray.direction}, 1 - start);
    }
    if (!hit) return std::nullopt;
    const Triangle face = tree.mesh().triangle(hit->face);
    const Vec3d a = world * face[0];
    const Vec3d normal = (world * face[1] - a).cross(world * face[2] - a).normalized();
    return FaceHit{start + hit->t, normal.dot(way) > 0 ? Vec3d(-normal) : normal};
}

}  // namespace

/// Where a body went is only true as far as its surroundings were looked at.
void RigidBodyStage::State::finish(RigidFrame& out) {
    std::vector<double> share(solver.size(), 1);
    for (std::size_t i = 0; i < solver.size(); ++i) {
        SolverBody& body = solver[i];
        const FrameBody& from = frame.bodies[i];
        if (body.inverseMass == 0) continue;
        if (!body.velocity.allFinite() || !body.spin.allFinite() || !body.moved.allFinite() ||
            !body.turned.coeffs().allFinite()) {
            body.velocity = body.spin = body.moved = Vec3d::Zero();
            body.turned = Quatd::Identity();
        }
        const double way = body.moved.norm() + 2 * body.turned.vec().norm() * from.size;
        if (way > from.reach) share[i] = from.reach / way;
    }
    calmDown();
    guard(share);
    for (std::size_t i = 0; i < solver.size(); ++i) {
        SolverBody& body = solver[i];
        const FrameBody& from = frame.bodies[i];
        if (!from.free) continue;
        RigidMotion& motion = out.motions[from.index];
        if (from.frozen && from.usable && !from.asleep) {
            motion.velocity = from.velocity;
            motion.spin = from.spin;
        }
        if (body.inverseMass == 0) continue;
        if (share[i] < 1) {
            body.moved *= share[i];
            body.turned.vec() *= share[i];
            body.turned.normalize();
        }
        motion.velocity = body.velocity;
        motion.spin = body.spin;
        motion.world_T_before.linear() = body.turned.toRotationMatrix();
        motion.world_T_before.translation() =
            from.mass.centre + body.moved - motion.world_T_before.linear() * from.mass.centre;
    }
}

/// Many bodies in one place push each other apart all at once, and few passes do not take back all of the speed that
/// this gives. What is deep in another leaves no faster than it came, or than the push alone.
void RigidBodyStage::State::calmDown() {
    std::vector<double> push(solver.size(), 0);
    for (const SolverPoint& p : points)
        if (p.gap < -kDeepSizes / kPushSizes * p.push)
            for (const std::uint32_t b : {p.bodyA, p.bodyB}) push[b] = std::max(push[b], p.push);
    for (std::size_t i = 0; i < solver.size(); ++i) {
        SolverBody& body = solver[i];
        if (push[i] == 0 || body.inverseMass == 0) continue;
        const FrameBody& from = frame.bodies[i];
        const auto cut = [](Vec3d& v, double most) {
            const double length = v.norm();
            if (length > most) v *= most / length;
        };
        cut(body.velocity, std::max(push[i], from.velocity.norm() + seconds * gravity.norm()));
        cut(body.spin, std::max(push[i] / from.size, from.spin.norm()));
    }
}

/// The centre of a solid does not pass through a face, wherever others have pushed it: beyond what was foreseen, where
/// no faces were looked for, the way that it went is looked at itself.
void RigidBodyStage::State::guard(std::vector<double>& share) {
    const auto placeAfter = [&](std::uint32_t rank, const Vec3d& x) {
        const SolverBody& body = solver[rank];
        const FrameBody& from = frame.bodies[rank];
        if (!from.free) return Vec3d(x + seconds * (body.velocity + body.spin.cross(x - from.mass.centre)));
        Quatd turned = body.turned;
        turned.vec() *= share[rank];
        turned.normalize();
        return Vec3d(from.mass.centre + share[rank] * body.moved + turned * (x - from.mass.centre));
    };
    for (const FrameEncounter& e : looked) {
        const bool solidIsA = frame.parts[e.partA].surface->solid.has_value();
        const std::uint32_t solidPart = solidIsA ? e.partA : e.partB, facePart = solidIsA ? e.partB : e.partA;
        const std::uint32_t rank = frame.parts[solidPart].body, other = frame.parts[facePart].body;
        if (!e.known || solidIsA == frame.parts[e.partB].surface->solid.has_value() || solver[rank].inverseMass == 0)
            continue;
        const Vec3d from = narrow.solid(solidPart).centre;
        const RigidPart& surface = *frame.parts[facePart].given;
        for (int attempt = 0; attempt < 3; ++attempt) {
            // Seen from the faces: less what they do themselves.
            const Vec3d end = placeAfter(rank, from);
            const Vec3d way = end - (placeAfter(other, end) - end) - from;
            const double length = way.norm(), size = frame.bodies[rank].size;
            if (length < e.clear || length <= kInFace * size) break;
            const std::optional<FaceHit> hit =
                firstFace(*surface.tree, surface.world, from, way, kInFace * size / length);
            if (!hit) break;
            share[rank] *= attempt < 2 && hit->t * length > kKeepAway * size ? 0.9 * hit->t : 0;
            const double into = hit->normal.dot(solver[rank].velocity);
            if (into < 0) solver[rank].velocity -= into * hit->normal;
        }
    }
}

}  // namespace tessera

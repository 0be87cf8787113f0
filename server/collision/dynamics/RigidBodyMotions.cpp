/// Where the bodies are after the solver has moved them: as far as their surroundings were looked at, and through no
/// face.
#include <algorithm>
#include <cmath>

#include "server/collision/dynamics/RigidBodyState.h"

namespace tessera {

using namespace dynamics;

namespace {

/// Deeper than so many sizes is no contact of bodies that keep apart.
constexpr double kDeepSizes = 0.03;

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

/// The centre of a solid does not pass through a face that was looked at.
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
        if (!e.known || e.faces == 0) continue;
        const bool solidIsA = frame.parts[e.partA].surface->solid.has_value();
        const std::uint32_t solidPart = solidIsA ? e.partA : e.partB, facePart = solidIsA ? e.partB : e.partA;
        const std::uint32_t rank = frame.parts[solidPart].body, other = frame.parts[facePart].body;
        if (solver[rank].inverseMass == 0) continue;
        const Vec3d from = narrow.solid(solidPart).centre;
        for (int attempt = 0; attempt < 3; ++attempt) {
            // Seen from the faces: less what they do themselves.
            const Vec3d end = placeAfter(rank, from);
            const Vec3d way = end - (placeAfter(other, end) - end) - from;
            if (way.norm() < e.leastPlane) break;
            const FramePart& surface = frame.parts[facePart];
            const TriangleMesh& mesh = surface.given->tree->mesh();
            double first = 2;
            Vec3d normal = Vec3d::Zero();
            for (const std::uint32_t face : narrow.facesOf(e)) {
                const Vec3d a = surface.given->world * mesh.corner(face, 0),
                            b = surface.given->world * mesh.corner(face, 1),
                            c = surface.given->world * mesh.corner(face, 2);
                Vec3d n = (b - a).cross(c - a);
                double height = n.dot(from - a), after = n.dot(from + way - a);
                if (height < 0) {
                    n = -n;
                    height = -height;
                    after = -after;
                }
                if (!(after < 0) || !(height > after)) continue;
                const double t = height / (height - after);
                const Vec3d at = from + t * way;
                const auto inside = [&](const Vec3d& p, const Vec3d& q) {
                    return (q - p).cross(at - p).dot((b - a).cross(c - a)) >= 0;
                };
                if (t < first && inside(a, b) && inside(b, c) && inside(c, a)) {
                    first = t;
                    normal = n.normalized();
                }
            }
            if (first > 1) break;
            share[rank] *= attempt < 2 ? 0.9 * first : 0;
            const double into = normal.dot(solver[rank].velocity);
            if (into < 0) solver[rank].velocity -= into * normal;
        }
    }
}

}  // namespace tessera

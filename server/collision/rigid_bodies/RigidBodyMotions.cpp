/// Where the bodies are after the solver has moved them: as far as their surroundings were looked at, and through no
/// face.
#include <algorithm>
#include <cmath>

#include "server/collision/rigid_bodies/RigidBodyState.h"

namespace tessera {

using namespace rigid;

namespace {

/// Deeper than so many sizes is no contact of bodies that keep apart.
constexpr double kDeepSizes = 0.03;
}  // namespace

/// Where a body went is only true as far as its surroundings were looked at.
void RigidBodyStage::State::limitReach(std::size_t rank) {
    SolverBody& body = solver[rank];
    const FrameBody& from = frame.bodies[rank];
    if (body.inverseMass == 0) return;
    if (!body.velocity.allFinite() || !body.spin.allFinite() || !body.moved.allFinite() ||
        !body.turned.coeffs().allFinite()) {
        body.velocity = body.spin = body.moved = Vec3d::Zero();
        body.turned = Quatd::Identity();
    }
    const double way = body.moved.norm() + 2 * body.turned.vec().norm() * from.size;
    if (way <= from.reach) return;
    BodyPath path(from.mass.centre, body.moved, body.turned);
    path.cut(from.reach / way);
    body.moved = path.moved;
    body.turned = path.turned;
}

void RigidBodyStage::State::finish(RigidFrame& out) {
    calmDown();
    for (std::size_t i = 0; i < solver.size(); ++i) {
        const SolverBody& body = solver[i];
        const FrameBody& from = frame.bodies[i];
        if (!from.free) continue;
        RigidMotion& motion = out.motions[from.index];
        if (from.frozen && from.usable && !from.asleep) {
            motion.velocity = from.velocity;
            motion.spin = from.spin;
        }
        if (body.inverseMass == 0) continue;
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

}  // namespace tessera

#include "server/collision/dynamics/ContactSolver.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace tessera::dynamics {

namespace {

constexpr int kBouncePasses = 8;
/// Of the spring that undoes overlap, per sub-step: as stiff as the sub-steps can follow, so that what lies at the
/// bottom of a heap is not pressed deep into what it lies on. Hard: where one of the two does not give way.
constexpr double kSoftHertz = 0.25, kHardHertz = 0.25, kDamping = 10;

/// How overlap is undone: as by an overdamped spring, whatever the masses (E. Catto, "Soft Constraints", GDC 2011).
struct Softness {
    double biasRate = 0, massScale = 1, impulseScale = 0;
};

Softness softness(double hertz, double dampingRatio, double seconds) {
    const double omega = 2 * 3.14159265358979323846 * hertz;
    const double a1 = 2 * dampingRatio + seconds * omega, a2 = seconds * omega * a1, a3 = 1 / (1 + a2);
    return {omega / a1, a2 * a3, a3};
}

Vec3d velocityAt(const SolverBody& body, const Vec3d& arm) {
    return body.velocity + body.spin.cross(arm);
}

class Island {
public:
    Island(std::span<SolverBody> all, std::span<const std::uint32_t> bodies, std::span<SolverPoint> points,
           const SolverStep& step)
        : all_(all), bodies_(bodies), points_(points), step_(step), seconds_(step.seconds / step.substeps) {
        soft_ = softness(kSoftHertz / seconds_, kDamping, seconds_);
        hard_ = softness(kHardHertz / seconds_, kDamping, seconds_);
    }

    void solve() {
        for (SolverPoint& p : points_) prepare(p);
        const double before = energy(false);
        for (int i = 0; i < step_.substeps; ++i) {
            for (const std::uint32_t b : bodies_) all_[b].velocity += seconds_ * step_.gravity;
            // Before any impulse of this sub-step: those of the neighbours would look like an approach.
            for (SolverPoint& p : points_)
                if (p.most == 0) p.approach = p.normal.dot(relative(p));
            for (SolverPoint& p : points_) start(p);
            pass(true, i * seconds_);
            for (const std::uint32_t b : bodies_) {
                all_[b].moved += seconds_ * all_[b].velocity;
                turnBody(all_[b], seconds_);
            }
            pass(false, (i + 1) * seconds_);
        }
        bounce(before);
    }

private:
    void prepare(SolverPoint& p) const {
        const SolverBody &a = all_[p.bodyA], &b = all_[p.bodyB];
        const auto row = [&](const Vec3d& n, Vec3d& turnA, Vec3d& turnB) {
            const Vec3d ra = p.armA.cross(n), rb = p.armB.cross(n);
            turnA = a.inverseInertia * ra;
            turnB = b.inverseInertia * rb;
            const double k = a.inverseMass + b.inverseMass + ra.dot(turnA) + rb.dot(turnB);
            return k > 0 ? 1 / k : 0.0;
        };
        p.mass = row(p.normal, p.angularA, p.angularB);
        for (int k = 0; k < 2; ++k) p.tangentMass[k] = row(p.tangent[k], p.tangentA[k], p.tangentB[k]);
        p.most = 0;
    }

    void apply(SolverPoint& p, double impulse, const Vec3d& direction, const Vec3d& turnA, const Vec3d& turnB) {
        SolverBody &a = all_[p.bodyA], &b = all_[p.bodyB];
        // Bodies that do not give way are not written to: other islands read them.
        if (a.inverseMass > 0) {
            a.velocity -= impulse * a.inverseMass * direction;
            a.spin -= impulse * turnA;
        }
        if (b.inverseMass > 0) {
            b.velocity += impulse * b.inverseMass * direction;
            b.spin += impulse * turnB;
        }
    }

    [[nodiscard]] Vec3d relative(const SolverPoint& p) const {
        return velocityAt(all_[p.bodyB], p.armB) - velocityAt(all_[p.bodyA], p.armA);
    }

    void start(SolverPoint& p) {
        if (p.impulse > 0) apply(p, p.impulse, p.normal, p.angularA, p.angularB);
        for (int k = 0; k < 2; ++k)
            if (p.rubbing[k] != 0) apply(p, p.rubbing[k], p.tangent[k], p.tangentA[k], p.tangentB[k]);
    }

    /// Of a point of the body, since the frame began.
    [[nodiscard]] Vec3d displacement(const SolverBody& body, const Vec3d& arm, double time) const {
        if (body.inverseMass > 0) return body.moved + body.turn * arm;
        return time * velocityAt(body, arm);
    }

    void pass(bool lift, double time) {
        for (SolverPoint& p : points_) {
            const Vec3d way = displacement(all_[p.bodyB], p.armB, time) - displacement(all_[p.bodyA], p.armA, time);
            const double gap = p.gap + p.normal.dot(way);
            double bias = 0, massScale = 1, impulseScale = 0;
            if (gap > 0) {
                bias = gap / seconds_;
            } else if (lift) {
                const Softness& s = p.hard ? hard_ : soft_;
                bias = std::max(s.biasRate * gap, -p.push);
                massScale = s.massScale;
                impulseScale = s.impulseScale;
            }
            const double speed = p.normal.dot(relative(p));
            const double change =
                std::max(p.impulse - p.mass * massScale * (speed + bias) - impulseScale * p.impulse, 0.0) - p.impulse;
            p.impulse += change;
            p.most = std::max(p.most, p.impulse);
            apply(p, change, p.normal, p.angularA, p.angularB);
            rub(p);
        }
    }

    /// Coulomb's cone.
    void rub(SolverPoint& p) {
        const double limit = p.friction * p.impulse;
        if (limit == 0 && p.rubbing[0] == 0 && p.rubbing[1] == 0) return;
        const Vec3d slip = relative(p);
        double wanted[2];
        for (int k = 0; k < 2; ++k) wanted[k] = p.rubbing[k] - p.tangentMass[k] * p.tangent[k].dot(slip);
        const double length = std::sqrt(wanted[0] * wanted[0] + wanted[1] * wanted[1]);
        const double scale = length > limit ? limit / length : 1;
        for (int k = 0; k < 2; ++k) {
            const double change = wanted[k] * scale - p.rubbing[k];
            p.rubbing[k] += change;
            apply(p, change, p.tangent[k], p.tangentA[k], p.tangentB[k]);
        }
    }

    /// Kinetic, as the frame begins or as it ends; inertia turns with the body.
    [[nodiscard]] double energy(bool end) const {
        double sum = 0;
        for (const std::uint32_t b : bodies_)
            sum += product(all_[b], all_[b].velocity, all_[b].spin, all_[b].velocity, all_[b].spin, end);
        return 0.5 * sum;
    }

    /// Of momentum and motion: v · m w + s · I t.
    [[nodiscard]] static double product(const SolverBody& body, const Vec3d& v, const Vec3d& s, const Vec3d& w,
                                        const Vec3d& t, bool end) {
        const Mat3d turn = end ? Mat3d(body.turn + Mat3d::Identity()) : Mat3d(Mat3d::Identity());
        return v.dot(w) / body.inverseMass + (turn.transpose() * s).dot(body.inertia * (turn.transpose() * t));
    }

    /// Newton's law, for what came fast and met: leaves with so much of the speed that it came with.
    void bounce(double before) {
        const auto bounces = [&](const SolverPoint& p) {
            return p.restitution > 0 && p.most > 0 && p.approach < -step_.bounceSpeed;
        };
        if (std::none_of(points_.begin(), points_.end(), bounces)) return;
        std::vector<std::pair<Vec3d, Vec3d>> motions;
        motions.reserve(bodies_.size());
        for (const std::uint32_t b : bodies_) motions.emplace_back(all_[b].velocity, all_[b].spin);
        for (int i = 0; i < kBouncePasses; ++i)
            for (SolverPoint& p : points_) {
                if (!bounces(p)) continue;
                const double speed = p.normal.dot(relative(p));
                const double change =
                    std::max(p.impulse - p.mass * (speed + p.restitution * p.approach), 0.0) - p.impulse;
                p.impulse += change;
                apply(p, change, p.normal, p.angularA, p.angularB);
            }
        // They part: nothing to start the next frame from.
        for (SolverPoint& p : points_)
            if (bounces(p)) p.impulse = p.rubbing[0] = p.rubbing[1] = 0;
        limitEnergy(before, motions);
    }

    /// Newton's law for many points at once can give more than it took (D. Stewart, "Rigid-Body Dynamics with Friction
    /// and Impact", 2000). Of what the bounce did, all bodies keep so much that there is no more energy than before;
    /// that share changes no sum of momenta. Where something pushes from outside there is no such limit.
    void limitEnergy(double before, const std::vector<std::pair<Vec3d, Vec3d>>& motions) {
        for (const SolverPoint& p : points_)
            for (const std::uint32_t b : {p.bodyA, p.bodyB})
                if (all_[b].inverseMass == 0 && (!all_[b].velocity.isZero(0) || !all_[b].spin.isZero(0))) return;
        double limit = before, linear = 0, square = 0, start = 0;
        for (std::size_t i = 0; i < bodies_.size(); ++i) {
            const SolverBody& body = all_[bodies_[i]];
            limit += step_.gravity.dot(body.moved) / body.inverseMass;
            const auto& [v, s] = motions[i];
            const Vec3d dv = body.velocity - v, ds = body.spin - s;
            start += 0.5 * product(body, v, s, v, s, true);
            linear += product(body, v, s, dv, ds, true);
            square += 0.5 * product(body, dv, ds, dv, ds, true);
        }
        if (start + linear + square <= limit || !(square > 0)) return;
        const double room = limit - start;
        const double share = room > 0 ? (-linear + std::sqrt(linear * linear + 4 * square * room)) / (2 * square) : 0;
        for (std::size_t i = 0; i < bodies_.size(); ++i) {
            SolverBody& body = all_[bodies_[i]];
            body.velocity = motions[i].first + share * (body.velocity - motions[i].first);
            body.spin = motions[i].second + share * (body.spin - motions[i].second);
        }
    }

    std::span<SolverBody> all_;
    std::span<const std::uint32_t> bodies_;
    std::span<SolverPoint> points_;
    const SolverStep& step_;
    double seconds_;
    Softness soft_, hard_;
};

}  // namespace

void setNormal(SolverPoint& point, const Vec3d& n) {
    point.normal = n;
    point.tangent[0] = std::abs(n.x()) < 0.6 ? Vec3d(0, n.z(), -n.y()) : Vec3d(-n.z(), 0, n.x());
    point.tangent[0].normalize();
    point.tangent[1] = n.cross(point.tangent[0]);
}

void turnBody(SolverBody& body, double seconds) {
    // Of unit length, and turned by the angle to the fifth order: no library's sine, whose last digit depends on the
    // processor.
    const Vec3d half = 0.5 * seconds * body.spin;
    const double square = half.squaredNorm();
    if (square == 0) return;
    const double tangent = square < 0.25 ? 1 + square * (1.0 / 3 + square * (2.0 / 15 + square * (17.0 / 315))) : 1;
    const Vec3d axis = tangent * half;
    body.turned = Quatd(1, axis.x(), axis.y(), axis.z()) * body.turned;
    body.turned.normalize();
    body.turn = body.turned.toRotationMatrix() - Mat3d::Identity();
}

void solveIsland(std::span<SolverBody> all, std::span<const std::uint32_t> bodies, std::span<SolverPoint> points,
                 const SolverStep& step) {
    Island(all, bodies, points, step).solve();
}

}  // namespace tessera::dynamics

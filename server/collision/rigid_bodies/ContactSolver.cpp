#include "server/collision/rigid_bodies/ContactSolver.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "server/collision/rigid_bodies/Islands.h"

namespace tessera::rigid {

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

/// Of turning: how far (angular momentum over the least inertia, a bound on all that happens within a step) a step
/// goes at most, how far it goes by plain iteration, and how often either is repeated.
constexpr double kTurnStep = 0.25, kMostTurnSteps = 64, kStiff = 0.02;
constexpr int kMostNewton = 8;

/// Masses that differ by more than this: few passes do not tell the light one what lies on it.
constexpr double kUnlike = 3, kPassesOfUnlike = 3, kMostPasses = 100;
/// Points gone through in one go, in all passes: in large islands a frame must come to an end.
constexpr double kMostLooks = 10'000;
/// Slower than what gravity gives in so many frames: towers and heaps that come to rest.
constexpr double kSlowFrames = 4;
constexpr int kPassesOfSlow = 4;
constexpr std::size_t kMostSlow = 200;  ///< bodies: large heaps are wide, and come to rest without
/// Of the square of what gravity gives in a sub-step: what is corrected by less is good enough.
constexpr double kEnough = 1e-4;

Mat3d cross(const Vec3d& v) {
    Mat3d out;
    out << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
    return out;
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
        energies_.clear();
        for (const std::uint32_t b : bodies_)
            energies_.push_back(0.5 * product(all_[b], all_[b].velocity, all_[b].spin, all_[b].velocity, all_[b].spin));
        passes_ = mostPasses();
        if (passes_ > 1) {
            last_.assign(points_.size(), Vec3d::Zero());
            going_ = last_;
        }
        for (int i = 0; i < step_.substeps; ++i) {
            for (const std::uint32_t b : bodies_) all_[b].velocity += seconds_ * step_.gravity;
            // Before any impulse of this sub-step: those of the neighbours would look like an approach.
            for (SolverPoint& p : points_)
                if (p.most == 0) p.approach = p.normal.dot(relative(p));
            for (SolverPoint& p : points_) start(p);
            settle(true, i * seconds_);
            for (const std::uint32_t b : bodies_) {
                all_[b].moved += seconds_ * all_[b].velocity;
                turnBody(all_[b], seconds_);
            }
            settle(false, (i + 1) * seconds_);
        }
        bounce();
        for (const std::uint32_t b : bodies_) {
            SolverBody& body = all_[b];
            const Vec3d own = body.turned.conjugate() * Vec3d(body.inertia * body.spin);
            body.spin = body.turned * Vec3d(body.inverseInertia * own);
        }
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

    /// How often the points are gone through at most in one go: more where they are slow to agree.
    [[nodiscard]] int mostPasses() {
        double ratio = 1;
        for (const SolverPoint& p : points_) {
            const double a = all_[p.bodyA].inverseMass, b = all_[p.bodyB].inverseMass;
            if (a > 0 && b > 0) ratio = std::max({ratio, a / b, b / a});
        }
        // As a share of what holds the light one, the spring under a heavy one would be too soft.
        unlike_ = ratio > kUnlike;
        if (unlike_) {
            const double affordable =
                std::max<double>(kPassesOfSlow, kMostLooks / static_cast<double>(points_.size() + 1));
            return static_cast<int>(std::min({kMostPasses, kPassesOfUnlike * std::sqrt(ratio), affordable}));
        }
        if (bodies_.size() > kMostSlow) return 1;
        const double slow = kSlowFrames * step_.gravity.norm() * step_.seconds;
        for (const std::uint32_t b : bodies_)
            if (all_[b].velocity.squaredNorm() > slow * slow) return 1;
        return kPassesOfSlow;
    }

    /// Passes until little changes. From the second on each is also carried on in the direction in which the passes
    /// have been going, as conjugate gradients do (M. Silcowitz-Hansen, S. Niebe, K. Erleben, "A Nonsmooth Nonlinear
    /// Conjugate Gradient Method for Interactive Contact Force Problems", 2010).
    void settle(bool lift, double time) {
        if (passes_ == 1) {
            pass(lift, time);
            return;
        }
        double before = 0;
        const double enough = kEnough * step_.gravity.squaredNorm() * seconds_ * seconds_;
        for (int k = 0; k < passes_; ++k) {
            for (std::size_t i = 0; i < points_.size(); ++i) {
                const SolverPoint& p = points_[i];
                last_[i] = {p.impulse, p.rubbing[0], p.rubbing[1]};
            }
            pass(lift, time);
            double square = 0, fastest = 0;
            for (std::size_t i = 0; i < points_.size(); ++i) {
                const SolverPoint& p = points_[i];
                const double mass[3] = {p.mass, p.tangentMass[0], p.tangentMass[1]},
                             now[3] = {p.impulse, p.rubbing[0], p.rubbing[1]};
                for (int c = 0; c < 3; ++c) {
                    last_[i][c] = now[c] - last_[i][c];
                    if (!(mass[c] > 0)) continue;
                    square += last_[i][c] * last_[i][c] / mass[c];
                    fastest = std::max(fastest, std::abs(last_[i][c]) / mass[c]);
                }
            }
            if (fastest * fastest <= enough || k + 1 == passes_) return;
            const double share = k > 0 && before > 0 ? square / before : 2;
            before = square;
            for (std::size_t i = 0; i < points_.size(); ++i) {
                if (k == 0 || share > 1) {
                    going_[i] = last_[i];
                    continue;
                }
                SolverPoint& p = points_[i];
                const Vec3d by = share * going_[i];
                going_[i] = by + last_[i];
                const double change = std::max(p.impulse + by[0], 0.0) - p.impulse;
                p.impulse += change;
                apply(p, change, p.normal, p.angularA, p.angularB);
                for (int c = 0; c < 2; ++c) {
                    p.rubbing[c] += by[c + 1];
                    apply(p, by[c + 1], p.tangent[c], p.tangentA[c], p.tangentB[c]);
                }
            }
        }
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
                if (!unlike_) {
                    massScale = s.massScale;
                    impulseScale = s.impulseScale;
                }
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

    /// Of momentum and motion: v · m w, and the like of two angular momenta I s and I t where the body has turned to.
    [[nodiscard]] static double product(const SolverBody& body, const Vec3d& v, const Vec3d& s, const Vec3d& w,
                                        const Vec3d& t) {
        const Quatd back = body.turned.conjugate();
        return v.dot(w) / body.inverseMass +
               (back * Vec3d(body.inertia * s)).dot(body.inverseInertia * (back * Vec3d(body.inertia * t)));
    }

    /// Newton's law, for what came fast and met: leaves with so much of the speed that it came with.
    void bounce() {
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
        limitEnergy(motions, bounces);
        // They part: nothing to start the next frame from.
        for (SolverPoint& p : points_)
            if (bounces(p)) p.impulse = p.rubbing[0] = p.rubbing[1] = 0;
    }

    /// Newton's law for many points at once can give more than it took (D. Stewart, "Rigid-Body Dynamics with Friction
    /// and Impact", 2000). Bodies that hang together by what bounced keep so much of the bounce that they have no more
    /// energy than before it, or than they came with; others are not asked. That share changes no sum of momenta. Where
    /// something pushes from outside there is no such limit.
    template <typename Bounces>
    void limitEnergy(const std::vector<std::pair<Vec3d, Vec3d>>& motions, const Bounces& bounces) {
        // Points name bodies of the frame; here they go by their place in the island.
        const auto placeOf = [&](std::uint32_t body) {
            return static_cast<std::uint32_t>(std::lower_bound(bodies_.begin(), bodies_.end(), body) - bodies_.begin());
        };
        Islands groups(bodies_.size());
        std::vector<bool> bounced(bodies_.size(), false), pushed(bodies_.size(), false);
        for (const SolverPoint& p : points_) {
            if (!bounces(p)) continue;
            const bool freeA = all_[p.bodyA].inverseMass > 0, freeB = all_[p.bodyB].inverseMass > 0;
            if (freeA && freeB) groups.join(placeOf(p.bodyA), placeOf(p.bodyB));
            for (const std::uint32_t b : {p.bodyA, p.bodyB}) {
                const SolverBody& body = all_[b];
                if (body.inverseMass > 0)
                    bounced[placeOf(b)] = true;
                else if (!body.velocity.isZero(0) || !body.spin.isZero(0))
                    pushed[placeOf(freeA ? p.bodyA : p.bodyB)] = true;
            }
        }
        struct Sum {
            double came = 0, start = 0, linear = 0, square = 0, share = 1;
            bool pushed = false;

            /// By what the bounce did, or a share of it.
            [[nodiscard]] double gain() const { return share * (linear + share * square); }
            void limit(double room) {
                if (!(square > 0) || gain() <= room) return;
                share =
                    std::clamp((-linear + std::sqrt(linear * linear + 4 * square * room)) / (2 * square), 0.0, share);
            }
        };
        std::vector<Sum> sums(bodies_.size());
        for (std::size_t i = 0; i < bodies_.size(); ++i) {
            if (!bounced[i]) continue;
            const SolverBody& body = all_[bodies_[i]];
            Sum& sum = sums[groups.find(static_cast<std::uint32_t>(i))];
            const auto& [v, s] = motions[i];
            const Vec3d dv = body.velocity - v, ds = body.spin - s;
            sum.pushed = sum.pushed || pushed[i];
            sum.came += energies_[i] + step_.gravity.dot(body.moved) / body.inverseMass;
            sum.start += 0.5 * product(body, v, s, v, s);
            sum.linear += product(body, v, s, dv, ds);
            sum.square += 0.5 * product(body, dv, ds, dv, ds);
        }
        for (Sum& sum : sums) {
            const double room = std::max(sum.came - sum.start, 0.0);
            if (!sum.pushed) sum.limit(room);
        }
        // What they lost to others in this frame they must not have twice: where all together have gained, those who
        // gained give it back.
        double excess = 0, gained = 0;
        for (std::size_t i = 0; i < bodies_.size(); ++i) {
            const SolverBody& body = all_[bodies_[i]];
            const auto& [v, s] = motions[i];
            excess += 0.5 * product(body, v, s, v, s) - energies_[i] - step_.gravity.dot(body.moved) / body.inverseMass;
        }
        for (const Sum& sum : sums) {
            excess += sum.gain();
            gained += std::max(sum.gain(), 0.0);
        }
        if (excess > 0 && gained > 0 && !pushedFromOutside())
            for (Sum& sum : sums)
                if (sum.gain() > 0) sum.limit(sum.gain() * std::max(0.0, 1 - excess / gained));
        for (std::size_t i = 0; i < bodies_.size(); ++i) {
            if (!bounced[i]) continue;
            const double share = sums[groups.find(static_cast<std::uint32_t>(i))].share;
            if (share >= 1) continue;
            SolverBody& body = all_[bodies_[i]];
            body.velocity = motions[i].first + share * (body.velocity - motions[i].first);
            body.spin = motions[i].second + share * (body.spin - motions[i].second);
        }
    }

    [[nodiscard]] bool pushedFromOutside() const {
        return std::any_of(points_.begin(), points_.end(), [&](const SolverPoint& p) {
            const auto moves = [&](const SolverBody& b) {
                return b.inverseMass == 0 && (!b.velocity.isZero(0) || !b.spin.isZero(0));
            };
            return moves(all_[p.bodyA]) || moves(all_[p.bodyB]);
        });
    }

    std::span<SolverBody> all_;
    std::span<const std::uint32_t> bodies_;
    std::span<SolverPoint> points_;
    const SolverStep& step_;
    double seconds_;
    Softness soft_, hard_;
    std::vector<double> energies_;  ///< per body, as the frame begins
    int passes_ = 1;
    bool unlike_ = false;
    std::vector<Vec3d> last_, going_;  ///< per point: along the normal and the tangents
};

}  // namespace

void setNormal(SolverPoint& point, const Vec3d& n) {
    point.normal = n;
    point.tangent[0] = std::abs(n.x()) < 0.6 ? Vec3d(0, n.z(), -n.y()) : Vec3d(-n.z(), 0, n.x());
    point.tangent[0].normalize();
    point.tangent[1] = n.cross(point.tangent[0]);
}

void turnBody(SolverBody& body, double seconds) {
    if (body.spin.isZero(0)) return;
    const Vec3d momentum = body.inertia * body.spin;
    // In body axes; as the frame begins they are the world's.
    double stiff = seconds * momentum.norm() * body.inverseInertia.norm();
    // The square of its inertia may be no number.
    if (!std::isfinite(stiff)) stiff = seconds * momentum.stableNorm() * body.inverseInertia.stableNorm();
    // One where it is not a number: the order of these arguments says so.
    const int steps = static_cast<int>(std::min(kMostTurnSteps, std::max(1.0, std::ceil(stiff / kTurnStep))));
    for (int i = 0; i < steps; ++i) {
        const Vec3d start = body.turned.conjugate() * momentum, spin = body.inverseInertia * start;
        // A longer step of the rational map turns by the angle itself, not by twice the arc of half its tangent.
        const double square = 0.25 * seconds * seconds / (steps * steps) * spin.squaredNorm();
        const double half = 0.5 * seconds / steps *
                            (square < 0.25 ? 1 + square * (1.0 / 3 + square * (2.0 / 15 + square * (17.0 / 315))) : 1);
        Vec3d middle = start, middleSpin = spin;
        for (int k = 0; k < kMostNewton; ++k) {
            const Vec3d off = middle - start - half * middle.cross(middleSpin);
            if (!(off.squaredNorm() > 1e-33 * start.squaredNorm())) break;
            if (stiff < kStiff * steps) {
                middle -= off;
            } else {
                const Mat3d slope =
                    Mat3d::Identity() - half * (cross(middle) * body.inverseInertia - cross(middleSpin));
                middle -= slope.inverse() * off;
            }
            middleSpin = body.inverseInertia * middle;
        }
        const Vec3d axis = half * middleSpin;
        body.turned = body.turned * Quatd(1, axis.x(), axis.y(), axis.z());
        body.turned.normalize();
    }
    body.turn = body.turned.toRotationMatrix() - Mat3d::Identity();
}

void solveIsland(std::span<SolverBody> all, std::span<const std::uint32_t> bodies, std::span<SolverPoint> points,
                 const SolverStep& step) {
    Island(all, bodies, points, step).solve();
}

}  // namespace tessera::rigid

#include "server/collision/rigid_bodies/RigidBodyStage.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "common/base/Workers.h"
#include "server/collision/rigid_bodies/Islands.h"
#include "server/collision/rigid_bodies/RigidBodyState.h"

namespace tessera {

using namespace rigid;

namespace {

constexpr int kPassesPerSubstep = 2;
/// Approaches slower than what gravity gives in so many frames do not bounce: they are resting.
constexpr double kRestingFrames = 3;
constexpr double kSameContact = 0.05;  ///< of the smaller body's size: a point that moved less is the same
constexpr double kStickFriction = 1e6;
constexpr std::size_t kPointsPerTask = 256;

std::uint64_t keyOf(const FrameEncounter& e) {
    return std::uint64_t{e.partA} << 32 | e.partB;
}
bool before(const FrameEncounter& x, const FrameEncounter& y) {
    return keyOf(x) < keyOf(y);
}
/// Of two encounters of one pair with different laws the first in the order of laws counts, whoever was passed first.
bool lawBefore(const FrameEncounter& x, const FrameEncounter& y) {
    return keyOf(x) != keyOf(y) ? before(x, y) : x.law < y.law;
}
bool samePair(const FrameEncounter& x, const FrameEncounter& y) {
    return keyOf(x) == keyOf(y);
}

}  // namespace

RigidBodyStage::RigidBodyStage(RigidOptions options, Workers* workers) : state_(std::make_unique<State>()) {
    state_->options = options;
    state_->options.iterations = std::clamp(options.iterations, 1, 1000);
    state_->workers = workers;
}
RigidBodyStage::~RigidBodyStage() = default;
RigidBodyStage::RigidBodyStage(RigidBodyStage&&) noexcept = default;
RigidBodyStage& RigidBodyStage::operator=(RigidBodyStage&&) noexcept = default;

double RigidBodyStage::reach(const RigidBody& body, double size, const Vec3d& gravity, double seconds) {
    const auto finite = [](double x, double most) { return std::isfinite(x) ? std::min(x, most) : 0.0; };
    const double speed = finite(body.velocity.norm(), kMostSpeed), turn = finite(body.spin.norm() * seconds, 2.0);
    const double fall = body.mass > 0 ? 2 * finite(gravity.norm(), kMostSpeed) * seconds * seconds : 0;
    return speed * seconds + fall + (turn + kUnforeseen) * size;
}

bool RigidBodyStage::asleep(std::uint64_t body) const {
    return state_->sleepers.asleep(body);
}

bool RigidBodyStage::supports(std::uint64_t part) const {
    return state_->sleepers.supports(part);
}

std::vector<std::uint64_t> RigidBodyStage::supports() const {
    return state_->sleepers.supports();
}

void RigidBodyStage::gone(std::uint64_t id) {
    state_->sleepers.gone(id);
}

RigidFrame RigidBodyStage::advance(std::span<const RigidBody> bodies, std::span<const RigidPart> parts,
                                   std::span<const RigidEncounter> encounters, const Vec3d& gravity, double seconds,
                                   QueryWork& work, RigidSource* source) {
    State& s = *state_;
    RigidFrame out;
    out.motions.resize(bodies.size());
    if (!std::isfinite(seconds) || seconds <= 0) {
        for (std::size_t i = 0; i < bodies.size(); ++i)
            if (bodies[i].velocity.allFinite() && bodies[i].spin.allFinite())
                out.motions[i] = {
                    .velocity = bodies[i].velocity, .spin = bodies[i].spin, .asleep = asleep(bodies[i].id)};
        return out;
    }
    ++s.frameNumber;
    s.gravity = gravity.allFinite() ? gravity : Vec3d(Vec3d::Zero());
    s.seconds = seconds;
    s.frame.gather(bodies, parts, s.gravity, seconds, s.shapes, s.frameNumber);
    s.source = source;
    s.fetched.clear();
    s.open.clear();
    s.idle.clear();
    s.looked.clear();
    s.woken.clear();
    s.wokenPairs.clear();
    for (FrameBody& body : s.frame.bodies) body.asleep = s.sleepers.asleep(body.given->id);
    s.narrow.begin(s.frame, {s.gravity, seconds, s.options.slop, s.options.maxTestsPerEncounter, s.workers});
    s.wake(s.sleepers.takeDisturbed(s.frame, s.gravity, s.shapes));
    s.collect(encounters);
    do {
        s.look(work, out);
        s.makePoints();
        s.solve(nullptr);
    } while (!s.goSafely());
    out.fetched = s.fetched;
    out.motions.resize(bodies.size() + out.fetched.size());
    s.finish(out);
    s.remember();
    s.sleep(out);
    s.shapes.forget(s.frameNumber);
    s.lastSeconds = seconds;
    out.contactPoints = s.points.size();
    return out;
}

bool RigidBodyStage::State::mayMeet(std::uint32_t partA, std::uint32_t partB) const {
    const std::uint32_t a = frame.parts[partA].body, b = frame.parts[partB].body;
    return a != kNoBody && b != kNoBody && a != b && (frame.bodies[a].free || frame.bodies[b].free);
}

void RigidBodyStage::State::collect(std::span<const RigidEncounter> encounters) {
    for (const RigidEncounter& from : encounters) {
        if (from.partA >= frame.partRank.size() || from.partB >= frame.partRank.size()) continue;
        FrameEncounter e;
        e.partA = frame.partRank[from.partA];
        e.partB = frame.partRank[from.partB];
        if (e.partA > e.partB) std::swap(e.partA, e.partB);
        e.law = from.law;
        if (mayMeet(e.partA, e.partB)) open.push_back(e);
    }
}

bool RigidBodyStage::State::active(const FrameEncounter& e) const {
    const auto acts = [](const FrameBody& b) { return (b.free && !b.asleep) || b.moving; };
    return acts(bodyOf(e.partA)) || acts(bodyOf(e.partB));
}

std::span<const PointMemory> RigidBodyStage::State::remembered(const FrameEncounter& e) const {
    const std::pair<std::uint64_t, std::uint64_t> key{frame.parts[e.partA].given->id, frame.parts[e.partB].given->id};
    const auto less = [](const PairMemory& p, const std::pair<std::uint64_t, std::uint64_t>& k) {
        return std::pair(p.partA, p.partB) < k;
    };
    const auto at = std::lower_bound(memory.pairs.begin(), memory.pairs.end(), key, less);
    if (at != memory.pairs.end() && at->partA == key.first && at->partB == key.second) return memory.pointsOf(*at);
    const auto old = std::lower_bound(wokenPairs.begin(), wokenPairs.end(), key, less);
    if (old != wokenPairs.end() && old->partA == key.first && old->partB == key.second)
        return std::span(woken).subspan(old->firstPoint, old->points);
    return {};
}

/// Both ascend: one walk through both.
void RigidBodyStage::State::recallHints(std::vector<FrameEncounter>& encounters) {
    auto at = memory.pairs.begin();
    for (FrameEncounter& e : encounters) {
        const std::pair key{frame.parts[e.partA].given->id, frame.parts[e.partB].given->id};
        while (at != memory.pairs.end() && std::pair(at->partA, at->partB) < key) ++at;
        if (at != memory.pairs.end() && std::pair(at->partA, at->partB) == key) e.memory = at->memory;
    }
}

bool RigidBodyStage::State::presses(const FrameEncounter& e, const FrameBody& awake) const {
    const FrameBody &a = bodyOf(e.partA), &b = bodyOf(e.partB);
    for (const ContactPoint& p : narrow.pointsOf(e)) {
        const Vec3d at = awake.velocity + awake.spin.cross(p.position - awake.mass.centre) +
                         (awake.free ? Vec3d(seconds * gravity) : Vec3d(Vec3d::Zero()));
        const double parting = (&awake == &a ? -1 : 1) * p.normal.dot(at);
        if (p.gap <= 0.5 * narrow.slopOf(a, b) && (awake.free || parting < 0)) return true;
        if (p.gap + seconds * parting < 0) return true;
    }
    return false;
}

/// Finds contacts; what is awake wakes what it touches, whose contacts are then wanted too, and so on.
void RigidBodyStage::State::look(QueryWork& work, RigidFrame& out) {
    while (true) {
        std::sort(open.begin(), open.end(), lawBefore);
        open.erase(std::unique(open.begin(), open.end(), samePair), open.end());
        std::erase_if(open, [&](const FrameEncounter& e) {
            if (std::binary_search(looked.begin(), looked.end(), e, before)) return true;
            if (active(e)) return false;
            idle.push_back(e);
            return true;
        });
        if (open.empty()) break;
        recallHints(open);
        narrow.find(open, work);
        std::vector<std::uint64_t> toWake;
        for (const FrameEncounter& e : open) {
            FrameBody &a = bodyOf(e.partA), &b = bodyOf(e.partB);
            if (!e.known) {
                if (a.free) a.frozen = true;
                if (b.free) b.frozen = true;
                out.notLookedAt.push_back({frame.parts[e.partA].given->id, frame.parts[e.partB].given->id});
            } else if (a.asleep != b.asleep && presses(e, a.asleep ? b : a)) {
                toWake.push_back((a.asleep ? a : b).given->id);
            }
        }
        const auto middle = static_cast<std::ptrdiff_t>(looked.size());
        looked.insert(looked.end(), open.begin(), open.end());
        std::inplace_merge(looked.begin(), looked.begin() + middle, looked.end(), before);
        open.clear();
        wake(toWake);
        std::erase_if(idle, [&](const FrameEncounter& e) {
            if (!active(e)) return false;
            open.push_back(e);
            return true;
        });
    }
    std::sort(wokenPairs.begin(), wokenPairs.end(), [](const PairMemory& x, const PairMemory& y) {
        return std::pair(x.partA, x.partB) < std::pair(y.partA, y.partB);
    });
}

void RigidBodyStage::State::makePoints() {
    solver.assign(frame.bodies.size(), {});
    for (std::size_t i = 0; i < solver.size(); ++i) {
        const FrameBody& body = frame.bodies[i];
        SolverBody& to = solver[i];
        if (!body.usable || body.asleep || body.frozen) continue;
        to.velocity = body.velocity;
        to.spin = body.spin;
        if (!body.free) continue;
        to.inverseMass = 1 / body.mass.mass;
        to.inverseInertia = body.mass.inverseInertia;
        to.inertia = body.mass.inertia;
    }
    points.clear();
    pointEncounter.clear();
    for (std::uint32_t i = 0; i < looked.size(); ++i) {
        const FrameEncounter& e = looked[i];
        const std::uint32_t rankA = frame.parts[e.partA].body, rankB = frame.parts[e.partB].body;
        const FrameBody &a = frame.bodies[rankA], &b = frame.bodies[rankB];
        if (!e.known || e.points == 0 || (solver[rankA].inverseMass == 0 && solver[rankB].inverseMass == 0)) continue;
        const std::span<const PointMemory> old = remembered(e);
        const double size = std::min(a.size, b.size), slop = narrow.slopOf(a, b);
        const double scale = lastSeconds > 0 ? seconds / lastSeconds : 0;
        const SolverPoint common = pointFor(e);
        for (const ContactPoint& from : narrow.pointsOf(e)) {
            SolverPoint& p = points.emplace_back(common);
            setNormal(p, from.normal);
            p.armA = from.position - a.mass.centre;
            p.armB = from.position - b.mass.centre;
            p.gap = from.gap + slop;
            if (const PointMemory* known = recall(old, from.position, from.normal, kSameContact * size)) {
                p.impulse = scale * known->impulse;
                for (int k = 0; k < 2; ++k) p.rubbing[k] = scale * known->rubbing.dot(p.tangent[k]);
            }
            pointEncounter.push_back(i);
        }
    }
    unsolved = solver;
    pointStarts.clear();
    for (const SolverPoint& p : points) pointStarts.push_back({p.impulse, p.rubbing[0], p.rubbing[1]});
}

/// What all points of an encounter have in common.
SolverPoint RigidBodyStage::State::pointFor(const FrameEncounter& e) const {
    SolverPoint p;
    p.bodyA = frame.parts[e.partA].body;
    p.bodyB = frame.parts[e.partB].body;
    const FrameBody &a = frame.bodies[p.bodyA], &b = frame.bodies[p.bodyB];
    p.hard = solver[p.bodyA].inverseMass == 0 || solver[p.bodyB].inverseMass == 0;
    p.push = kPushSizes * std::min(a.size, b.size);
    if (e.law == ContactLaw::kBounce) {
        p.friction = std::sqrt(a.friction * b.friction);
        p.restitution = std::max(a.restitution, b.restitution);
    } else if (e.law == ContactLaw::kStick) {
        p.friction = kStickFriction;
    }
    return p;
}

std::vector<bool> RigidBodyStage::State::solve(const std::vector<bool>* touched) {
    Islands islands(solver.size());
    for (const SolverPoint& p : points)
        if (solver[p.bodyA].inverseMass > 0 && solver[p.bodyB].inverseMass > 0) islands.join(p.bodyA, p.bodyB);
    // Islands in the order of their first bodies; points of one in the order of encounters.
    const auto count = static_cast<std::uint32_t>(solver.size());
    std::vector<std::uint32_t> island(count, kNoBody), firstBody(1, 0), firstPoint(1, 0), bodies;
    std::uint32_t islandCount = 0;
    for (std::uint32_t i = 0; i < count; ++i) {
        if (solver[i].inverseMass == 0) continue;
        const std::uint32_t root = islands.find(i);
        if (island[root] == kNoBody) {
            island[root] = islandCount++;
            firstBody.push_back(0);
            firstPoint.push_back(0);
        }
        island[i] = island[root];
        ++firstBody[island[i] + 1];
    }
    const auto islandOf = [&](const SolverPoint& p) {
        return island[solver[p.bodyA].inverseMass > 0 ? p.bodyA : p.bodyB];
    };
    for (const SolverPoint& p : points) ++firstPoint[islandOf(p) + 1];
    for (std::uint32_t i = 0; i < islandCount; ++i) {
        firstBody[i + 1] += firstBody[i];
        firstPoint[i + 1] += firstPoint[i];
    }
    islandSize.resize(count);
    std::vector<bool> again(islandCount, touched == nullptr), changed(count, false);
    for (std::uint32_t i = 0; i < count; ++i)
        if (touched != nullptr && (*touched)[i]) again[island[i]] = true;
    for (std::uint32_t i = 0; i < count; ++i)
        if (island[i] != kNoBody && again[island[i]]) {
            changed[i] = true;
            solver[i] = unsolved[i];
            islandSize[i] = firstBody[island[i] + 1] - firstBody[island[i]];
        }
    bodies.resize(firstBody.back());
    order.resize(points.size());
    sorted.resize(points.size());
    std::vector<std::uint32_t> nextBody(firstBody.begin(), firstBody.end() - 1),
        nextPoint(firstPoint.begin(), firstPoint.end() - 1);
    for (std::uint32_t i = 0; i < count; ++i)
        if (island[i] != kNoBody) bodies[nextBody[island[i]]++] = i;
    for (std::uint32_t i = 0; i < points.size(); ++i) {
        const std::uint32_t at = nextPoint[islandOf(points[i])]++;
        order[i] = at;
        if (!again[islandOf(points[i])]) continue;
        SolverPoint& p = sorted[at] = points[i];
        p.impulse = pointStarts[i][0];
        for (int k = 0; k < 2; ++k) p.rubbing[k] = pointStarts[i][k + 1];
    }
    std::vector<std::uint32_t> tasks(1, 0);
    std::size_t load = 0;
    for (std::uint32_t i = 0; i < islandCount; ++i) {
        load += firstPoint[i + 1] - firstPoint[i] + firstBody[i + 1] - firstBody[i];
        if (load >= kPointsPerTask || i + 1 == islandCount) {
            tasks.push_back(i + 1);
            load = 0;
        }
    }
    SolverStep step;
    step.gravity = gravity;
    step.seconds = seconds;
    step.substeps = std::max(1, options.iterations / kPassesPerSubstep);
    step.bounceSpeed = kRestingFrames * gravity.norm() * seconds;
    const auto task = [&](std::size_t t) {
        for (std::uint32_t i = tasks[t]; i < tasks[t + 1]; ++i)
            if (again[i])
                solveIsland(solver, std::span(bodies).subspan(firstBody[i], firstBody[i + 1] - firstBody[i]),
                            std::span(sorted).subspan(firstPoint[i], firstPoint[i + 1] - firstPoint[i]), step);
    };
    if (workers == nullptr || tasks.size() < 3) {
        for (std::size_t t = 0; t + 1 < tasks.size(); ++t) task(t);
    } else {
        workers->run(tasks.size() - 1, std::cref(task));
    }
    for (std::uint32_t i = 0; i < points.size(); ++i)
        if (again[islandOf(points[i])]) points[i] = sorted[order[i]];
    return changed;
}

}  // namespace tessera

/// Who wakes at the beginning of a frame, and who falls asleep at its end.
#include <algorithm>
#include <unordered_set>
#include <utility>

#include "server/collision/rigid_bodies/Islands.h"
#include "server/collision/rigid_bodies/RigidBodyState.h"

namespace tessera {

using namespace rigid;

namespace {

/// A body is calm while no point of it gets farther than so many sizes from where it began to be, and it is slower than
/// what gravity gives in a frame. (By the way rather than by the speed: what trembles in place may sleep, what creeps
/// may not.)
constexpr double kCalmWay = 0.01, kCalmFrames = 1;

}  // namespace

/// What of them, and of what they touch, nobody has passed.
void RigidBodyStage::State::fetch(std::span<const SleepingGroup> groups) {
    if (source == nullptr) return;
    std::vector<FrameBodies::Fetched> some;
    std::vector<std::uint64_t> ids, supports, mayHaveStopped;
    for (const SleepingGroup& group : groups) {
        ids.insert(ids.end(), group.bodies.begin(), group.bodies.end());
        for (const SleepingGroup::Pair& pair : group.pairs) {
            // Of a body without mass the part is a support.
            if (pair.bodyA != 0) ids.push_back(pair.bodyA);
            if (pair.bodyB != 0) ids.push_back(pair.bodyB);
            // What was free may have lost its mass since.
            if (pair.bodyA != 0) mayHaveStopped.push_back(pair.partA);
            if (pair.bodyB != 0) mayHaveStopped.push_back(pair.partB);
        }
        supports.insert(supports.end(), group.supports.begin(), group.supports.end());
    }
    const auto sortOnce = [](std::vector<std::uint64_t>& all) {
        std::sort(all.begin(), all.end());
        all.erase(std::unique(all.begin(), all.end()), all.end());
    };
    sortOnce(ids);
    sortOnce(supports);
    std::vector<std::uint64_t> come;
    std::unordered_set<std::uint64_t> known;
    const auto add = [&](FrameBodies::Fetched&& one) {
        if (frame.findBody(one.body.id) != kNoBody || !known.insert(one.body.id).second) return;
        come.push_back(one.body.id);
        some.push_back(std::move(one));
    };
    for (const std::uint64_t id : ids) {
        FrameBodies::Fetched one;
        if (frame.findBody(id) == kNoBody && source->body(id, one.body, one.parts)) add(std::move(one));
    }
    std::unordered_set<std::uint64_t> comingParts;
    for (const FrameBodies::Fetched& one : some)
        for (const RigidPart& part : one.parts) comingParts.insert(part.id);
    for (const std::uint64_t part : mayHaveStopped)
        if (frame.findPart(part) == kNoBody && !comingParts.contains(part)) supports.push_back(part);
    sortOnce(supports);
    for (const std::uint64_t part : supports) {
        FrameBodies::Fetched one;
        if (frame.findPart(part) == kNoBody && source->support(part, one.body, one.parts)) add(std::move(one));
    }
    if (some.empty()) return;
    fetched.insert(fetched.end(), come.begin(), come.end());
    const FrameBodies::Ranks ranks = frame.insert(std::move(some), gravity, seconds, shapes, frameNumber);
    narrow.follow(ranks);
    for (std::vector<FrameEncounter>* encounters : {&open, &idle, &looked})
        for (FrameEncounter& e : *encounters) {
            e.partA = ranks.part[e.partA];
            e.partB = ranks.part[e.partB];
        }
    for (const std::uint64_t id : come) {
        FrameBody& body = frame.bodies[frame.findBody(id)];
        body.asleep = sleepers.asleep(id);
    }
}

void RigidBodyStage::State::wake(std::vector<SleepingGroup> groups) {
    if (groups.empty()) return;
    fetch(groups);
    for (SleepingGroup& group : groups) {
        for (const std::uint64_t id : group.bodies)
            if (const std::uint32_t rank = frame.findBody(id); rank != kNoBody) frame.bodies[rank].asleep = false;
        const auto shift = static_cast<std::uint32_t>(woken.size());
        woken.insert(woken.end(), group.points.begin(), group.points.end());
        for (SleepingGroup::Pair& pair : group.pairs) {
            const std::uint32_t a = frame.findPart(pair.partA), b = frame.findPart(pair.partB);
            // Since they fell asleep they may have become one body, and both may have ceased to be free.
            if (a == kNoBody || b == kNoBody || !mayMeet(a, b)) continue;
            FrameEncounter e;
            e.partA = a;
            e.partB = b;
            e.law = pair.law;
            e.memory = pair.memory.memory;
            open.push_back(e);
            pair.memory.firstPoint += shift;
            pair.memory.partA = pair.partA;
            pair.memory.partB = pair.partB;
            wokenPairs.push_back(pair.memory);
        }
    }
}

bool RigidBodyStage::State::wake(std::span<const std::uint64_t> bodies) {
    std::vector<SleepingGroup> groups;
    for (const std::uint64_t id : bodies)
        if (sleepers.asleep(id)) groups.push_back(sleepers.take(id, shapes));
    const bool any = !groups.empty();
    wake(std::move(groups));
    return any;
}

void RigidBodyStage::State::remember() {
    next.clear();
    std::size_t p = 0;
    for (std::uint32_t i = 0; i < looked.size(); ++i) {
        const FrameEncounter& e = looked[i];
        PairMemory pair{frame.parts[e.partA].given->id, frame.parts[e.partB].given->id, e.memory,
                        static_cast<std::uint32_t>(next.points.size()), 0};
        for (; p < points.size() && pointEncounter[p] == i; ++p) {
            const SolverPoint& from = points[p];
            const SolverBody &a = solver[from.bodyA], &b = solver[from.bodyB];
            const Vec3d moved = 0.5 * (a.moved + a.turn * from.armA + b.moved + b.turn * from.armB);
            next.points.push_back({frame.bodies[from.bodyA].mass.centre + from.armA + moved, from.normal, from.impulse,
                                   from.rubbing[0] * from.tangent[0] + from.rubbing[1] * from.tangent[1]});
            ++pair.points;
        }
        next.pairs.push_back(pair);
    }
    std::swap(memory, next);
}

void RigidBodyStage::State::sleep(RigidFrame& out) {
    const std::size_t count = frame.bodies.size();
    Islands groups(count);
    std::vector<bool> held(count, false), restless(count, false);
    for (const SolverPoint& p : points) {
        if (!(p.most > 0)) continue;
        const bool freeA = solver[p.bodyA].inverseMass > 0, freeB = solver[p.bodyB].inverseMass > 0;
        if (freeA && freeB) groups.join(p.bodyA, p.bodyB);
        held[p.bodyA] = held[p.bodyB] = true;
        if (frame.bodies[p.bodyA].moving || frame.bodies[p.bodyB].moving) restless[p.bodyA] = restless[p.bodyB] = true;
        if (frame.bodies[p.bodyA].frozen || frame.bodies[p.bodyB].frozen) restless[p.bodyA] = restless[p.bodyB] = true;
    }
    std::vector<Calm> now;
    std::vector<bool> awake(count, false);  // per representative: somebody in the group is
    std::size_t old = 0;
    for (std::uint32_t i = 0; i < count; ++i) {
        const FrameBody& body = frame.bodies[i];
        if (!body.usable || !body.free || body.asleep) continue;
        while (old < calm.size() && calm[old].body < body.given->id) ++old;
        Calm quiet;
        if (old < calm.size() && calm[old].body == body.given->id) quiet = calm[old];
        quiet.body = body.given->id;
        const double speed = solver[i].velocity.norm() + 0.5 * body.size * solver[i].spin.norm();
        const double slow = std::max(kCalmFrames * gravity.norm() * seconds, kCalmWay * body.size);
        quiet.moved += solver[i].moved;
        quiet.turned = (solver[i].turned * quiet.turned).normalized();
        const double way = quiet.moved.norm() + body.size * quiet.turned.vec().norm();
        const bool still = !body.frozen && !restless[i] && !body.given->disturbed &&
                           (held[i] ? speed < slow && way < kCalmWay * body.size : speed == 0);
        if (still)
            quiet.seconds += seconds;
        else
            quiet = {body.given->id};
        if (quiet.seconds < options.secondsToSleep) awake[groups.find(i)] = true;
        now.push_back(quiet);
    }
    calm = std::move(now);
    std::vector<std::uint32_t> slot(count, kNoBody);
    std::vector<SleepingGroup> asleep;
    for (std::uint32_t i = 0; i < count; ++i) {
        FrameBody& body = frame.bodies[i];
        if (!body.usable || !body.free || body.asleep || awake[groups.find(i)]) continue;
        std::uint32_t& to = slot[groups.find(i)];
        if (to == kNoBody) {
            to = static_cast<std::uint32_t>(asleep.size());
            asleep.emplace_back();
        }
        asleep[to].bodies.push_back(body.given->id);
        slot[i] = to;
        out.motions[body.index] = {};
    }
    if (!asleep.empty()) {
        for (const FramePart& part : frame.parts)
            if (part.body != kNoBody && slot[part.body] != kNoBody)
                asleep[slot[part.body]].surfaces.push_back(part.given->tree);
        for (std::uint32_t i = 0; i < looked.size(); ++i) {
            const FrameEncounter& e = looked[i];
            const PairMemory& pair = memory.pairs[i];
            const std::uint32_t a = frame.parts[e.partA].body, b = frame.parts[e.partB].body;
            // Those that just do not touch may do so for a frame that looks a little farther.
            if (pair.points == 0 && !(frame.bodies[a].free && frame.bodies[b].free)) continue;
            const auto freeId = [&](std::uint32_t body) {
                return frame.bodies[body].free ? frame.bodies[body].given->id : 0;
            };
            for (const std::uint32_t one : {a, b}) {
                if (!frame.bodies[one].free || slot[one] == kNoBody) continue;
                SleepingGroup& group = asleep[slot[one]];
                const std::uint32_t other = one == a ? b : a;
                if (frame.bodies[other].free && one == b && slot[a] == slot[b]) continue;  // once is enough
                SleepingGroup::Pair kept{pair.partA, pair.partB, freeId(a), freeId(b), e.law, pair};
                kept.memory.firstPoint = static_cast<std::uint32_t>(group.points.size());
                const std::span<const PointMemory> from = memory.pointsOf(pair);
                group.points.insert(group.points.end(), from.begin(), from.end());
                group.pairs.push_back(kept);
                if (!frame.bodies[other].free)
                    group.supports.push_back(frame.parts[one == a ? e.partB : e.partA].given->id);
            }
        }
        for (SleepingGroup& group : asleep) {
            std::sort(group.supports.begin(), group.supports.end());
            group.supports.erase(std::unique(group.supports.begin(), group.supports.end()), group.supports.end());
            std::vector<const RigidPart*> supports;
            for (const std::uint64_t part : group.supports) supports.push_back(frame.parts[frame.findPart(part)].given);
            const std::vector<std::uint64_t> fresh = sleepers.add(std::move(group), supports, shapes);
            out.supports.insert(out.supports.end(), fresh.begin(), fresh.end());
        }
    }
    for (const FrameBody& body : frame.bodies)
        if (body.usable && body.free && sleepers.asleep(body.given->id)) out.motions[body.index].asleep = true;
    out.asleep = sleepers.size();
}

}  // namespace tessera

/// The stages of a step in which things move: wishes, rollback, one motion after the other, free bodies.
#include <algorithm>
#include <unordered_map>
#include <utility>

#include "server/collision/pipeline/PipelineState.h"
#include "server/collision/pipeline/Rollback.h"

namespace tessera {
namespace {

/// The latest time of what stops a motion: at 1 a contact would be told as one of where things stand.
constexpr double kBeforeTheEnd = 1 - 0x1p-53;

}  // namespace

void CollisionPipeline::Impl::noteStart(const Mover& mover, Step& step) const {
    handler.forPartsCarried(mover.number,
                            [&](std::uint32_t i, std::uint32_t) { step.startWorlds.try_emplace(i, part(i).world); });
}

/// What nothing can be in the way of goes where it is wanted, at once.
void CollisionPipeline::Impl::admitWishes(const Aspect& committed, std::span<const TentativeTransform> wanted,
                                          std::span<const Reply> replies, Step& step) {
    std::vector<TentativeTransform> wishes = questions.take(replies);
    if (!wishes.empty()) {
        wishes.insert(wishes.end(), wanted.begin(), wanted.end());
        wanted = wishes;
    }
    admit(committed, handler, wanted, step.result, admitted);
    std::vector<std::uint32_t> held;
    for (const Mover& mover : admitted)
        if (const std::uint32_t body = handler.freeBodyOf(mover.number); body != kNobody) held.push_back(body);
    bodies.begin(handler, std::move(held));
    for (const Mover& mover : admitted) {
        const PartTraits& traits = neighbourhood.traitsCarried(handler, mover.number);
        if (traits.obstructed || traits.dynamic) {
            step.movers.push_back(mover);
            continue;
        }
        step.result.accepted.push_back(mover.wish);
        handler.overlay(mover.number, localOf(mover.way.end));
        if (handler.freeBodyOf(mover.number) != kNobody) step.plain.push_back(mover);
    }
}

/// All pairs of parts that some transforms carry, in order.
std::vector<std::uint32_t> CollisionPipeline::Impl::pairsCarried(std::span<const Mover> movers) const {
    std::vector<std::uint32_t> pairs;
    for (const Mover& mover : movers)
        handler.forPartsCarried(mover.number, [&](std::uint32_t i, std::uint32_t) {
            const std::span<const std::uint32_t> mine = memory.pairsOf(i);
            pairs.insert(pairs.end(), mine.begin(), mine.end());
        });
    memory.sortOnce(pairs, handler);
    return pairs;
}

/// Whether a pair stands in the way of a transform that carries one of its parts.
bool CollisionPipeline::Impl::obstacle(std::uint32_t a, std::uint32_t b, const Relation& relation,
                                       ObjectId transform) const {
    switch (relation.response) {
        case InterestWords::kReport:
            return false;
        case InterestWords::kBounce:
            // What can be pushed is.
            return !bodies.isFree(part(a).body) && !bodies.isFree(part(b).body);
        case InterestWords::kAsk:
            return !questions.passes({transform, bodyOf(a).node, bodyOf(b).node});
        default:
            return true;
    }
}

/// All that takes part in a rollback goes back to the first time at which any of its pairs touch, everything being on
/// its way as it is wished.
void CollisionPipeline::Impl::rollBack(Step& step) {
    const auto rollsBack = [&](const Mover& mover) {
        return neighbourhood.traitsCarried(handler, mover.number).rollback;
    };
    if (std::ranges::none_of(step.movers, rollsBack)) return;
    const WayLookup lookup = [&](ObjectId transform) { return wayOf(step.movers, transform); };
    double earliest = 1;
    bool blocked = false;
    std::vector<Touching> hits;
    std::vector<RollbackPair> pairs;
    for (const std::uint32_t k : pairsCarried(step.movers)) {
        const PairState& pair = memory.states()[k];
        if (relationOf(pair).response != InterestWords::kRollback) continue;
        askAllFaces(k, step.work);
        pairs.push_back({k, pair.a, pair.b, pair.touch.touching});
    }
    step.result.counters.pairsTested += pairs.size();
    for (const auto& contact : firstRollbackContacts(handler, pairs, lookup, limits.stopTolerance, step.work)) {
        const PairState& pair = memory.states()[contact.pair.state];
        const Impact& impact = contact.impact;
        if (!impact.complete) notLookedAt(pair.nodeA, pair.nodeB, NotLookedAt::Reason::kWork, step);
        // Where the work was not enough nobody goes further than is known to be free, and nothing is told to touch.
        earliest = std::min(earliest, impact.t);
        blocked = blocked || impact.hit || !impact.complete;
        if (impact.hit && impact.support < 0)
            hits.push_back({pair.nodeA,
                            pair.nodeB,
                            pair.a,
                            pair.b,
                            {impact.faces},
                            1,
                            {},
                            {},
                            interestOf(relationOf(pair)),
                            std::min(impact.t, kBeforeTheEnd)});
    }
    if (!blocked) return;
    for (Touching& touching : hits)
        if (touching.time == std::min(earliest, kBeforeTheEnd)) step.rolledBack.push_back(std::move(touching));
    for (Mover& mover : step.movers) {
        if (!rollsBack(mover)) continue;
        mover.way.end = mover.way.at(earliest);
        step.result.stopped.push_back(mover.wish.transform);
    }
}

/// What may be in a mover's way. Nothing of it changes while motions are tried.
MotionTask CollisionPipeline::Impl::taskOf(const Mover& mover) const {
    std::unordered_map<std::uint32_t, std::uint32_t> carriers;  // moved part -> the place that carries it
    handler.forPartsCarried(mover.number, [&](std::uint32_t i, std::uint32_t place) { carriers[i] = place; });
    const auto carrierOf = [&](std::uint32_t i) {
        const auto it = carriers.find(i);
        return it == carriers.end() ? Place::kNone : it->second;
    };
    std::vector<MotionTask::Obstruction> obstructions;
    for (const std::uint32_t k : pairsCarried(std::span(&mover, 1))) {
        const PairState& pair = memory.states()[k];
        const Relation relation = relationOf(pair);
        if (relation.response == InterestWords::kReport) continue;
        // Two that are carried together are as far apart as before.
        if (carrierOf(pair.a) == carrierOf(pair.b) || !obstacle(pair.a, pair.b, relation, mover.wish.transform))
            continue;
        obstructions.push_back({{pair.a, pair.b, relation.response == InterestWords::kSlide}, k});
    }
    return {handler, mover, std::move(obstructions)};
}

void CollisionPipeline::Impl::move(Step& step) {
    std::vector<MotionTask> tasks;
    tasks.reserve(step.movers.size());
    for (const Mover& mover : step.movers) {
        noteStart(mover, step);
        tasks.push_back(taskOf(mover));
    }
    MotionRuns({handler, memory, limits, *stop, *slide}, workers, step.work).run(tasks, [&](MotionTask& task) {
        settle(task, step);
    });
}

/// A motion has been tried: where it led, and what was in the way.
void CollisionPipeline::Impl::settle(const MotionTask& task, Step& step) {
    StepResult& result = step.result;
    const Mover& mover = task.mover();
    const Resolution& resolution = task.resolution();
    step.work.boxTests += task.work().boxTests;
    step.work.triangleTests += task.work().triangleTests;
    result.counters.pairsTested += task.pairsTested();
    for (const std::uint32_t k : task.changed()) memory.lookAgain(k);
    for (const std::uint32_t k : task.leftOpen())
        notLookedAt(memory.states()[k].nodeA, memory.states()[k].nodeB, NotLookedAt::Reason::kWork, step);
    if (!resolution.hits.empty()) ask(task.trial(), resolution, mover, step);
    for (const Hit& hit : resolution.hits) {
        const Obstacle& o = task.trial().obstacles()[hit.obstacle];
        const PairState& state = memory.states()[task.stateOf(o)];
        std::vector<FacePair> faces = hit.faces;
        if (faces.size() > limits.maxContacts) faces.resize(limits.maxContacts);
        stopped.add({state.nodeA, state.nodeB, o.partA, o.partB, std::move(faces), hit.faces.size(), hit.worldA,
                     hit.worldB, interestOf(relationOf(state)), std::min(hit.fraction, kBeforeTheEnd), nullptr, false,
                     hit.places});
    }
    if (resolution.undecided > 0) notLookedAt(mover.wish.transform, {}, NotLookedAt::Reason::kSteps, step);
    result.accepted.push_back(withValue(mover.wish, resolution.accepted));
    if (resolution.stopped) result.stopped.push_back(mover.wish.transform);
    handler.overlay(mover.number, localOf(resolution.accepted));
    step.moved.push_back({mover.wish, {mover.way.start, resolution.accepted}, mover.number});
}

void CollisionPipeline::Impl::ask(const MotionTrial& trial, const Resolution& resolution, const Mover& mover,
                                  Step& step) {
    for (const Hit& hit : resolution.hits) {
        const Obstacle& o = trial.obstacles()[hit.obstacle];
        const Relation relation = handler.relation(std::min(o.partA, o.partB), std::max(o.partA, o.partB));
        if (relation.response != InterestWords::kAsk) continue;
        const InterestTerms& interest = handler.interests()[relation.interests.front()];
        Question question;
        question.interest = interest.core;
        question.objectA = bodyOf(o.partA).node;
        question.objectB = bodyOf(o.partB).node;
        question.transform = mover.wish.transform;
        question.present = resolution.accepted;
        question.wanted = mover.way.end;
        const Part& a = part(o.partA);
        const Part& b = part(o.partB);
        const Contact where = !hit.places.empty()
                                  ? contactOfPlace(a, b, hit.worldA, hit.worldB, hit.faces.front(), hit.places.front())
                              : !hit.faces.empty() ? contactOfFaces(a, b, hit.worldA, hit.worldB, hit.faces.front())
                              : a.shape->hull() && b.shape->hull() ? contactOfHulls(a, b, hit.worldA, hit.worldB)
                                                                   : Contact{};
        question.point = where.point;
        question.normal = where.normal;
        questions.stopped({question.transform, question.objectA, question.objectB}, question, interest.patience,
                          limits.maxQuestions, step.result.questions);
    }
}

void CollisionPipeline::Impl::moveFreeBodies(const Aspect& committed, double seconds, Step& step) {
    std::vector<BodyVelocity>& velocities = step.result.velocities;
    velocities = FreeBodies::letGo(handler, {step.moved, step.plain}, seconds);
    if (bodies.any() && seconds > 0) {
        FreeBodies::Outcome outcome = bodies.advance(committed, handler, memory, step.startWorlds, seconds, step.work);
        for (const NotLookedAt& pair : outcome.notLookedAt) notLookedAt(pair.nodeA, pair.nodeB, pair.reason, step);
        step.result.counters.asleep = outcome.asleep;
        step.result.counters.freeBodies = bodies.count();
        step.result.counters.handedOver = outcome.handedOver;
        for (const FreeBodies::Moved& moved : outcome.moved) {
            Mover mover{.way = moved.way};
            mover.wish.transform = handler.bodies()[moved.body].transform;
            mover.number = handler.transformNumber(mover.wish.transform);
            step.result.accepted.push_back(withValue(mover.wish, moved.way.end));
            handler.overlay(mover.number, localOf(moved.way.end));
            step.moved.push_back(std::move(mover));
        }
        velocities.insert(velocities.end(), outcome.velocities.begin(), outcome.velocities.end());
        std::ranges::sort(velocities, {}, &BodyVelocity::core);
    }
    for (const ObjectId node : holdBack(velocities, committed))
        notLookedAt(node, {}, NotLookedAt::Reason::kTooFast, step);
    bodies.end(handler, velocities);
}

}  // namespace tessera

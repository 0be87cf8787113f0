#include "server/collision/pipeline/CollisionPipeline.h"

#include <algorithm>
#include <optional>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "server/collision/objects/SceneEffects.h"
#include "server/collision/pipeline/ContactList.h"
#include "server/collision/pipeline/EventBook.h"
#include "server/collision/pipeline/EventNotes.h"
#include "server/collision/pipeline/Neighbourhood.h"
#include "server/collision/pipeline/PairTasks.h"
#include "server/collision/pipeline/QuestionBook.h"
#include "server/collision/pipeline/Rollback.h"
#include "server/collision/pipeline/SelfContacts.h"
#include "server/collision/pipeline/StepLists.h"
#include "server/collision/pipeline/StoppedContacts.h"
#include "server/collision/response/Response.h"

namespace tessera {

struct CollisionPipeline::Impl {
    Impl(CollisionLimits l, Workers* w)
        : limits(l),
          workers(w),
          shapes(std::make_shared<ShapeCache>()),
          handler(shapes, {.maxInterests = l.maxInterests}),
          neighbourhood(w),
          bodies(w),
          picker(shapes) {}

    CollisionLimits limits;
    Workers* workers;
    std::shared_ptr<ShapeCache> shapes;
    ObjectHandler handler;
    Neighbourhood neighbourhood;
    PairMemory memory;
    FreeBodies bodies;
    QuestionBook questions;
    EventBook events;
    StoppedContacts stopped;
    SelfContacts selfContacts;
    ScenePicker picker;
    std::unique_ptr<Response> stop = makeStopResponse(), slide = makeSlideResponse();
    ContactList contacts;
    std::vector<Mover> admitted;                          // kept for its memory
    std::vector<std::uint32_t> incomplete;                // pairs whose touch a limit left open
    bool sceneIsNew = true;                               // since the last step
    std::optional<StepResult> still;                      // what a step says as long as nothing changes, but for lists
    double stillSeconds = 0;
    EventBook::Page eventPage;                            // of the last step
    ContactList::Page contactPage;

    StepLists lists;                                      // last: they are made of all the others

    // State of one step.
    struct Step {
        StepResult result;
        QueryWork work;
        std::vector<Mover> movers;            // that something may be in the way of, ascending by transform
        std::vector<Mover> plain;             // free bodies that are moved and that nothing is in the way of
        std::vector<Mover> moved;             // all that moved, on the ways that they went, ascending by transform
        FreeBodies::StartWorlds startWorlds;  // of the parts that they carry, but for free bodies
        std::unordered_set<std::uint32_t> metDeforming;  // pairs whose first contact the deformation has told
        std::vector<Touching> rolledBack;  // what made everybody go back; their poses are still to come
        std::vector<EventBook::Touching> touchedOnTheWay, stopped;
    };

    StepResult run(const Aspect& committed, std::span<const TentativeTransform> wanted, std::span<const Reply> replies,
                   double seconds);
    void admitWishes(const Aspect& committed, std::span<const TentativeTransform> wanted,
                     std::span<const Reply> replies, Step& step);
    void noteStart(const Mover& mover, Step& step) const;
    [[nodiscard]] std::vector<std::uint32_t> pairsCarried(std::span<const Mover> movers) const;
    [[nodiscard]] bool sameAsBefore(const Step& step) const;
    [[nodiscard]] bool obstacle(const PairState& pair, const Relation& relation, ObjectId transform) const;
    void rollBack(Step& step);
    void move(const Mover& mover, Step& step);
    void ask(const MotionTrial& trial, const Resolution& resolution, const Mover& mover, Step& step);
    void moveFreeBodies(const Aspect& committed, double seconds, Step& step);
    void lookOnTheWay(bool deforming, Step& step);
    void askAllFaces(std::uint32_t pair, QueryWork& work);
    [[nodiscard]] bool touchAtRest(Step& step);
    void giveLists(StepResult& result);
    [[nodiscard]] auto describe() { return [this](std::uint32_t k) { return restingContact(handler, memory.states()[k]); }; }
    void tellStops(Step& step);
    void tell(Step& step);
    void finish(Step& step);

    void notLookedAt(ObjectId a, ObjectId b, NotLookedAt::Reason reason, Step& step) const {
        ++step.result.counters.notLookedAt;
        if (step.result.notLookedAt.size() < limits.maxNotLookedAt) step.result.notLookedAt.push_back({a, b, reason});
    }
    [[nodiscard]] const Part& part(std::uint32_t index) const { return handler.parts()[index]; }
    [[nodiscard]] const Body& bodyOf(std::uint32_t index) const { return handler.bodies()[part(index).body]; }
    [[nodiscard]] Relation relationOf(const PairState& pair) const {
        return handler.relation(std::min(pair.a, pair.b), std::max(pair.a, pair.b));
    }
    [[nodiscard]] ObjectId interestOf(const Relation& relation) const {
        return relation.interests.empty() ? ObjectId{} : handler.interests()[relation.interests.front()].core;
    }
    template <typename Query>
    void forPairs(std::span<const std::uint32_t> pairs, QueryWork& work, const Query& query) {
        tessera::forPairs(handler, memory.states(), pairs, workers, work, query);
    }
};

StepResult CollisionPipeline::Impl::run(const Aspect& committed, std::span<const TentativeTransform> wanted,
                                        std::span<const Reply> replies, double seconds) {
    const bool asked = !wanted.empty() || !replies.empty();
    if (!asked && !sceneIsNew && still && stillSeconds == seconds) {
        StepResult same = *still;
        giveLists(same);
        return same;
    }
    lists.close();
    still.reset();
    Step step;
    step.work.limit = limits.maxTests;
    handler.dropOverlay(committed);
    admitWishes(committed, wanted, replies, step);

    const bool changed = neighbourhood.find(handler, step.movers, bodies, seconds, memory);
    step.result.counters.neighbours = memory.size();
    if (!handler.deformations().empty()) {
        // Ways are those that are wished for: how far they are free is found against the new shapes.
        lookOnTheWay(true, step);
        handler.settleDeformations();
    }
    rollBack(step);
    for (const Mover& mover : step.movers) move(mover, step);
    for (Touching& touching : step.rolledBack) {
        touching.worldA = part(touching.partA).world;
        touching.worldB = part(touching.partB).world;
        stopped.add(std::move(touching));
    }
    moveFreeBodies(committed, seconds, step);
    std::ranges::sort(step.moved, {}, [](const Mover& mover) { return mover.wish.transform; });
    lookOnTheWay(false, step);
    const bool looked = touchAtRest(step);
    tellStops(step);
    tell(step);
    for (const ObjectId transform : holdBack(step.result.accepted, committed)) {
        step.result.stopped.push_back(transform);
        notLookedAt(transform, {}, NotLookedAt::Reason::kNotFinite, step);
    }
    finish(step);
    const bool rests = !asked && !sceneIsNew && !changed && !looked && sameAsBefore(step);
    sceneIsNew = false;
    if (rests) {
        still = step.result;
        stillSeconds = seconds;
    }
    giveLists(step.result);
    return std::move(step.result);
}

void CollisionPipeline::Impl::giveLists(StepResult& result) {
    std::uint64_t none = 0;
    lists.give(contactPage, eventPage,
               {[this, none]() mutable { return contacts.list(handler, describe(), limits.maxContacts, none); },
                [this] { return events.events(limits.maxEvents); }, [this] { return events.distances(limits.maxEvents); }},
               result);
}

/// Whether another step like this one would say the same.
bool CollisionPipeline::Impl::sameAsBefore(const Step& step) const {
    const StepResult& result = step.result;
    return result.accepted.empty() && result.velocities.empty() && result.stopped.empty() && result.questions.empty() &&
           questions.empty() && incomplete.empty() && result.contactsBegun == 0 &&
           (!bodies.any() || bodies.resting()) && eventPage.eventChanges.empty() &&
           eventPage.distanceChanges.empty() && result.counters.eventsLeftOut == 0;
}

void CollisionPipeline::Impl::noteStart(const Mover& mover, Step& step) const {
    handler.forPartsCarried(mover.number, [&](std::uint32_t i, std::uint32_t) { step.startWorlds.try_emplace(i, part(i).world); });
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
bool CollisionPipeline::Impl::obstacle(const PairState& pair, const Relation& relation, ObjectId transform) const {
    switch (relation.response) {
        case Interest::kReport:
            return false;
        case Interest::kBounce:
            // What can be pushed is.
            return !bodies.isFree(part(pair.a).body) && !bodies.isFree(part(pair.b).body);
        case Interest::kAsk:
            return !questions.passes({transform, bodyOf(pair.a).node, bodyOf(pair.b).node});
        default:
            return true;
    }
}

/// All that takes part in a rollback goes back to the first time at which any of its pairs touch, everything being on
/// its way as it is wished.
void CollisionPipeline::Impl::rollBack(Step& step) {
    const auto rollsBack = [&](const Mover& mover) { return neighbourhood.traitsCarried(handler, mover.number).rollback; };
    if (std::ranges::none_of(step.movers, rollsBack)) return;
    const WayLookup lookup = [&](ObjectId transform) { return wayOf(step.movers, transform); };
    double earliest = 1;
    bool blocked = false;
    std::vector<Touching> hits;
    std::vector<RollbackPair> pairs;
    for (const std::uint32_t k : pairsCarried(step.movers)) {
        const PairState& pair = memory.states()[k];
        if (relationOf(pair).response != Interest::kRollback) continue;
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
            hits.push_back({pair.nodeA, pair.nodeB, pair.a, pair.b, {impact.faces}, 1, {}, {}, interestOf(relationOf(pair)), impact.t});
    }
    if (!blocked) return;
    for (Touching& touching : hits)
        if (touching.time == earliest) step.rolledBack.push_back(std::move(touching));
    for (Mover& mover : step.movers) {
        if (!rollsBack(mover)) continue;
        mover.way.end = mover.way.at(earliest);
        step.result.stopped.push_back(mover.wish.transform);
    }
}

void CollisionPipeline::Impl::move(const Mover& mover, Step& step) {
    StepResult& result = step.result;
    noteStart(mover, step);
    Resolution resolution;
    resolution.accepted = mover.way.end;
    std::unordered_map<std::uint32_t, std::uint32_t> carriers;  // moved part -> the place that carries it
    handler.forPartsCarried(mover.number, [&](std::uint32_t i, std::uint32_t place) { carriers[i] = place; });
    std::vector<std::uint32_t> near = pairsCarried(std::span(&mover, 1));
    std::erase_if(near, [&](std::uint32_t k) { return relationOf(memory.states()[k]).response == Interest::kReport; });
    const auto carrierOf = [&](std::uint32_t i) {
        const auto it = carriers.find(i);
        return it == carriers.end() ? Place::kNone : it->second;
    };
    std::vector<ObstaclePair> pairs;
    std::unordered_map<std::uint64_t, std::uint32_t> stateOf;
    bool slides = false;
    for (const std::uint32_t k : near) {
        const PairState& pair = memory.states()[k];
        const Relation relation = relationOf(pair);
        // Two that are carried together are as far apart as before.
        if (carrierOf(pair.a) == carrierOf(pair.b) || !obstacle(pair, relation, mover.wish.transform)) continue;
        pairs.push_back({pair.a, pair.b, relation.response == Interest::kSlide});
        slides = slides || pairs.back().slide;
        stateOf[std::uint64_t{pair.a} << 32 | pair.b] = k;
    }
    if (!pairs.empty()) {
        const auto touchingAtStart = [&](std::uint32_t a, std::uint32_t b) -> std::uint64_t {
            if (!part(a).worldBox.overlaps(part(b).worldBox)) return 0;
            const std::uint32_t k = stateOf.at(std::uint64_t{a} << 32 | b);
            const PairState& state = memory.states()[k];
            if (!state.touch.holds(part(a), part(b), true)) ++result.counters.pairsTested;
            askAllFaces(k, step.work);
            // An undecided start is taken for contact; the response will not get far with it.
            if (!state.touch.complete) notLookedAt(state.nodeA, state.nodeB, NotLookedAt::Reason::kWork, step);
            return state.touch.complete ? state.touch.faceCount : std::max<std::uint64_t>(state.touch.faceCount, 1);
        };
        const MotionTrial trial(handler, mover.wish.transform, mover.way, pairs, touchingAtStart,
                                {limits.stopTolerance, limits.maxPieces}, step.work, result.counters.pairsTested);
        resolution = (slides ? slide : stop)->resolve(trial);
        ask(trial, resolution, mover, step);
        for (Hit& hit : resolution.hits) {
            const Obstacle& o = trial.obstacles()[hit.obstacle];
            const PairState& state = memory.states()[stateOf.at(std::uint64_t{o.partA} << 32 | o.partB)];
            const std::uint64_t count = hit.faces.size();
            if (hit.faces.size() > limits.maxContacts) hit.faces.resize(limits.maxContacts);
            stopped.add({state.nodeA, state.nodeB, o.partA, o.partB, std::move(hit.faces), count, hit.worldA,
                         hit.worldB, interestOf(relationOf(state)), hit.fraction});
        }
    }
    if (resolution.undecided > 0) notLookedAt(mover.wish.transform, {}, NotLookedAt::Reason::kPieces, step);
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
        if (relation.response != Interest::kAsk) continue;
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
        const Contact where = !hit.faces.empty() ? contactOfFaces(a, b, hit.worldA, hit.worldB, hit.faces.front())
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
    for (const ObjectId node : holdBack(velocities, committed)) notLookedAt(node, {}, NotLookedAt::Reason::kTooFast, step);
    bodies.end(handler, velocities);
}

/// The first contact within the frame's motion, for interests that want to know it: of pairs that deform (before they
/// are settled, others being on the ways that they wish for), or of all others on the ways that they went.
void CollisionPipeline::Impl::lookOnTheWay(bool deforming, Step& step) {
    const std::span<const Mover> ways =
        deforming ? std::span<const Mover>(step.movers) : std::span<const Mover>(step.moved);
    if (!deforming && ways.empty()) return;
    std::vector<std::uint32_t> asked;
    if (deforming) {
        for (const Deformation& deformation : handler.deformations()) {
            const std::span<const std::uint32_t> mine = memory.pairsOf(deformation.part);
            asked.insert(asked.end(), mine.begin(), mine.end());
        }
        std::ranges::sort(asked);
        asked.erase(std::unique(asked.begin(), asked.end()), asked.end());
        memory.sort(asked, handler);
    } else {
        asked = pairsCarried(ways);
    }
    const std::span<PairState> pairs = memory.states();
    std::erase_if(asked, [&](std::uint32_t k) {
        const PairState& pair = pairs[k];
        return !relationOf(pair).dynamic || step.metDeforming.contains(k) || !part(pair.a).solid() || !part(pair.b).solid();
    });
    if (asked.empty()) return;
    const WayLookup lookup = [&](ObjectId transform) { return wayOf(ways, transform); };
    std::vector<Impact> impacts(asked.size());
    std::unordered_map<std::uint32_t, std::size_t> placeOf;
    for (std::size_t i = 0; i < asked.size(); ++i) placeOf.emplace(asked[i], i);
    forPairs(asked, step.work, [&](PairState& pair, QueryWork& work) {
        const std::size_t i = placeOf.at(static_cast<std::uint32_t>(&pair - pairs.data()));
        const double size = std::min(part(pair.a).worldBox.size().norm(), part(pair.b).worldBox.size().norm());
        impacts[i] = firstContact(handler, pair.a, pair.b, lookup, limits.stopTolerance * size, work);
    });
    step.result.counters.pairsTested += asked.size();
    for (std::size_t i = 0; i < asked.size(); ++i) {
        const PairState& pair = pairs[asked[i]];
        if (!impacts[i].complete) notLookedAt(pair.nodeA, pair.nodeB, NotLookedAt::Reason::kWork, step);
        if (!impacts[i].hit) continue;
        if (deforming) step.metDeforming.insert(asked[i]);
        PairEvent when;
        when.firstTime = impacts[i].t;
        when.point = impacts[i].point;
        when.normal = impacts[i].normal;
        appendEvents(handler, pair.a, pair.b, when, Moment::kOnTheWay, step.touchedOnTheWay);
    }
}

/// While motions are tried.
void CollisionPipeline::Impl::askAllFaces(std::uint32_t k, QueryWork& work) {
    PairState& pair = memory.states()[k];
    const bool touched = pair.touch.touching;
    askTouch(pair, part(pair.a), part(pair.b), true, limits.maxContacts, work);
    // Where a limit leaves it open the list of contacts has to know.
    if (pair.touch.touching != touched) memory.lookAgain(k);
}

/// Everything that touches in the poses that were accepted, and how far others are apart. Only pairs of which something
/// is new are looked at; says whether there were any.
bool CollisionPipeline::Impl::touchAtRest(Step& step) {
    const std::vector<std::uint32_t> moved = handler.takeMoved();
    neighbourhood.alsoMoved(moved);
    memory.moved(moved);
    std::vector<std::uint32_t> changed = moved;
    changed.insert(changed.end(), neighbourhood.changed().begin(), neighbourhood.changed().end());
    const bool lookedAtSelf = selfContacts.follow(handler, changed, limits.maxContacts, step.work);
    for (const std::uint32_t k : selfContacts.incomplete())
        notLookedAt(part(k).node, part(k).node, NotLookedAt::Reason::kWork, step);
    for (Touching& touching : selfContacts.contacts(handler)) contacts.add(std::move(touching));
    for (const std::uint32_t body : bodies.changed())
        if (body < handler.bodies().size()) memory.moved(handler.bodies()[body].parts);
    for (const std::uint32_t pair : incomplete)
        if (pair < memory.states().size() && memory.states()[pair].nodeA) memory.lookAgain(pair);
    const std::vector<std::uint32_t> stale = memory.takeStale(handler);
    const std::span<PairState> pairs = memory.states();
    std::vector<std::uint32_t> asked, measured;
    for (const std::uint32_t k : stale) {
        PairState& pair = pairs[k];
        const Part& a = part(pair.a);
        const Part& b = part(pair.b);
        const Relation relation = relationOf(pair);
        const bool wanted = relation.contacts || bodies.isFree(a.body) || bodies.isFree(b.body);
        if (wanted && a.solid() && b.solid() && a.worldBox.overlaps(b.worldBox)) {
            if (!pair.touch.holds(a, b, relation.wantsAllFaces())) asked.push_back(k);
        } else {
            pair.touch = {};
        }
        if (relation.distance && a.solid() && b.solid())
            measured.push_back(k);
        else
            pair.distance = {};
    }
    step.result.counters.pairsTested += asked.size();
    forPairs(asked, step.work, [&](PairState& pair, QueryWork& work) {
        if (work.limit == 0) {
            pair.touch = {};
            pair.touch.complete = false;
            return;
        }
        askTouch(pair, part(pair.a), part(pair.b), relationOf(pair).wantsAllFaces(), limits.maxContacts, work);
    });
    forPairs(measured, step.work, [&](PairState& pair, QueryWork& work) {
        askDistance(pair, part(pair.a), part(pair.b), relationOf(pair).threshold, work);
    });
    incomplete.clear();
    if (const auto ended = memory.takeEnded()) {
        for (const std::uint32_t k : *ended) {
            contacts.takeOut(k);
            events.takeOut(k);
        }
    } else {
        contacts.takeOutAll();
        events.takeOutAll();
    }
    for (const std::uint32_t k : stale)
        if (!pairs[k].touch.touching || !contacts.restsAs(k, pairs[k].nodeA, pairs[k].nodeB)) contacts.takeOut(k);
    for (const std::uint32_t k : stale) {
        const PairState& pair = pairs[k];
        const bool open = !pair.touch.complete || !pair.distance.complete;
        if (open) incomplete.push_back(k);
        if (!open && !pair.touch.touching && pair.distance.farther) {
            memory.tell(k, false);
            events.takeOut(k);
            continue;
        }
        const Relation relation = relationOf(pair);
        memory.tell(k, true);
        noteResting(events, handler, k, pair, relation);
        if (pair.touch.touching && relation.contacts)
            contacts.rests(k, pair.nodeA, pair.nodeB, facesTold(pair, relation), facesListed(pair, relation));
        else
            contacts.takeOut(k);
    }
    for (const std::uint32_t k : incomplete) {
        if (!pairs[k].touch.complete) notLookedAt(pairs[k].nodeA, pairs[k].nodeB, NotLookedAt::Reason::kWork, step);
    }
    return lookedAtSelf || !stale.empty();
}

void CollisionPipeline::Impl::tellStops(Step& step) {
    for (Touching& touching : stopped.settle(handler)) {
        PairEvent when;
        when.firstTime = touching.time;
        if (touching.time < 1 && !touching.faces.empty()) {
            const Contact where = contactOfFaces(part(touching.partA), part(touching.partB), touching.worldA,
                                                 touching.worldB, touching.faces.front());
            when.point = where.point;
            when.normal = where.normal;
        }
        appendEvents(handler, touching.partA, touching.partB, when, Moment::kAtEnd, step.stopped);
        contacts.add(std::move(touching));
    }
}

void CollisionPipeline::Impl::tell(Step& step) {
    for (const std::uint32_t k : incomplete) {
        const PairState& pair = memory.states()[k];
        if (!pair.distance.complete) notLookedAt(pair.nodeA, pair.nodeB, NotLookedAt::Reason::kWork, step);
    }
    std::vector<EventBook::Touching> besides = std::move(step.touchedOnTheWay);
    besides.insert(besides.end(), step.stopped.begin(), step.stopped.end());
    eventPage = events.turnPage(
        besides, [this](std::uint32_t x, std::uint32_t y) { return memory.before(x, y, handler); }, limits.maxEvents);
    step.result.counters.eventsLeftOut += eventPage.leftOut;
}

void CollisionPipeline::Impl::finish(Step& step) {
    StepResult& result = step.result;
    if (!std::ranges::is_sorted(result.accepted, {}, &TentativeTransform::transform))
        std::ranges::sort(result.accepted, {}, &TentativeTransform::transform);
    std::ranges::sort(result.stopped);
    result.stopped.erase(std::unique(result.stopped.begin(), result.stopped.end()), result.stopped.end());

    contactPage = contacts.turnPage(handler, describe(), limits.maxContacts);
    result.contactsBegun = contactPage.begun;
    result.counters.contactsLeftOut = contactPage.leftOut;

    const auto inTouch = [&](const QuestionBook::Matter& matter) {
        return std::ranges::any_of(memory.told(), [&](std::uint32_t k) {
            const PairState& pair = memory.states()[k];
            return pair.touch.touching && bodyOf(pair.a).node == matter.objectA &&
                   bodyOf(pair.b).node == matter.objectB;
        });
    };
    StepCounters& counters = result.counters;
    counters.unanswered = questions.endFrame(inTouch);
    counters.objects = handler.partCount();
    counters.skipped = handler.partsSkipped();
    counters.boxTests = step.work.boxTests;
    counters.triangleTests = step.work.triangleTests;
    counters.notLookedAt += handler.interestsLeftOut();
}

CollisionPipeline::CollisionPipeline(CollisionLimits limits, Workers* workers)
    : impl_(std::make_unique<Impl>(limits, workers)) {}
CollisionPipeline::~CollisionPipeline() = default;
CollisionPipeline::CollisionPipeline(CollisionPipeline&&) noexcept = default;
CollisionPipeline& CollisionPipeline::operator=(CollisionPipeline&&) noexcept = default;

void CollisionPipeline::sceneChanged(const Aspect& aspect, const ChangeList* list) {
    impl_->sceneIsNew = impl_->sceneIsNew || list == nullptr || !list->empty();
    // Contacts are made of where things stand, and of what is asked of them.
    if (impl_->lists.contactsHeld() && (!list || impl_->handler.wouldChange(aspect, *list))) impl_->lists.makeContacts();
    impl_->handler.update(aspect, list);
    if (list == nullptr || changesRules(*list)) impl_->bodies.rulesChanged();
}

StepResult CollisionPipeline::step(const Aspect& committed, std::span<const TentativeTransform> wanted,
                                   std::span<const Reply> replies, double seconds) {
    return impl_->run(committed, wanted, replies, seconds);
}

void CollisionPipeline::forgetLists() {
    impl_->lists.forget();
}

std::vector<std::uint64_t> CollisionPipeline::openQuestions() const {
    return impl_->questions.open();
}

std::span<const InterestTerms> CollisionPipeline::interests() const {
    return impl_->handler.interests();
}

const CollisionLimits& CollisionPipeline::limits() const {
    return impl_->limits;
}

std::optional<PickHit> CollisionPipeline::pickNode(const Aspect& aspect, const Ray& ray) {
    return impl_->picker.pick(aspect, impl_->handler, ray);
}

}  // namespace tessera

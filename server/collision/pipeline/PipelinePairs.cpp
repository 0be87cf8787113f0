/// The stages of a step that look at pairs: on the way, and where all stand at its end.
#include <algorithm>
#include <unordered_map>
#include <utility>

#include "server/collision/pipeline/PipelineState.h"
#include "server/collision/response/PairImpact.h"

namespace tessera {

/// The first contact within the frame's motion, for interests that want to know it: of pairs that deform (before they
/// are settled, others being on the ways that they wish for), or of all others on the ways that they went.
void CollisionPipeline::Impl::lookOnTheWay(bool deforming, Step& step) {
    const std::span<const Mover> ways =
        deforming ? std::span<const Mover>(step.movers) : std::span<const Mover>(step.moved);
    if (!deforming && ways.empty()) return;
    std::vector<std::uint32_t> asked;
    if (deforming) {
        for (const PartDeformation& deformation : handler.deformations()) {
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
        return !relationOf(pair).dynamic || step.metDeforming.contains(k) || !part(pair.a).solid() ||
               !part(pair.b).solid();
    });
    if (asked.empty()) return;
    const WayLookup lookup = [&](ObjectId transform) { return wayOf(ways, transform); };
    std::vector<Impact> impacts(asked.size());
    std::unordered_map<std::uint32_t, std::size_t> placeOf;
    for (std::size_t i = 0; i < asked.size(); ++i) placeOf.emplace(asked[i], i);
    forPairs(asked, step.work, [&](PairState& pair, QueryWork& work) {
        const std::size_t i = placeOf.at(static_cast<std::uint32_t>(&pair - pairs.data()));
        const double size = std::min(part(pair.a).worldBox.size().norm(), part(pair.b).worldBox.size().norm());
        impacts[i] = firstContact(handler, pair.a, pair.b, lookup,
                                  handler.toleranceOf(pair.a, pair.b, size, limits.stopTolerance), work);
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
            const Part &a = part(touching.partA), &b = part(touching.partB);
            const FacePair& faces = touching.faces.front();
            const Contact where =
                touching.places.empty()
                    ? contactOfFaces(a, b, touching.worldA, touching.worldB, faces)
                    : contactOfPlace(a, b, touching.worldA, touching.worldB, faces, touching.places.front());
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

}  // namespace tessera

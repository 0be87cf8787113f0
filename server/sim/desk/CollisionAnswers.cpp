#include "server/sim/desk/CollisionAnswers.h"

#include <algorithm>

namespace tessera {

namespace {

TouchPhase valueOf(Phase phase) {
    switch (phase) {
        case Phase::kBegan:
            return TouchPhase::kBegan;
        case Phase::kStays:
            return TouchPhase::kStays;
        case Phase::kEnded:
            break;
    }
    return TouchPhase::kEnded;
}

ContactValue valueOf(const Contact& c) {
    return {.objectA = c.objectA,
            .objectB = c.objectB,
            .faceA = c.faceA,
            .faceB = c.faceB,
            .point = c.point,
            .normal = c.normal,
            .depth = c.depth,
            .uvA = c.uvA,
            .uvB = c.uvB,
            .patchA = c.patchA,
            .patchB = c.patchB,
            .patchUvA = c.patchUvA,
            .patchUvB = c.patchUvB,
            .error = c.error,
            .interest = c.interest,
            .time = c.time};
}

PairEventValue valueOf(const PairEvent& e) {
    return {.interest = e.interest,
            .objectA = e.objectA,
            .objectB = e.objectB,
            .phase = valueOf(e.phase),
            .firstTime = e.firstTime,
            .point = e.point,
            .normal = e.normal,
            .through = e.through};
}

PairDistanceValue valueOf(const PairDistance& d) {
    return {.interest = d.interest,
            .objectA = d.objectA,
            .objectB = d.objectB,
            .phase = valueOf(d.phase),
            .distance = d.distance,
            .nodeA = d.nodeA,
            .nodeB = d.nodeB,
            .faceA = d.faceA,
            .faceB = d.faceB,
            .pointA = d.pointA,
            .pointB = d.pointB,
            .error = d.error};
}

bool isChange(const PairEvent& event) {
    return event.phase != Phase::kStays;
}

}  // namespace

answer::Contacts contactsOf(const StepResult& step, FrameNumber frame, std::uint64_t begun) {
    answer::Contacts told{.frame = frame,
                          .begun = begun,
                          .contacts = {},
                          .leftOut = step.counters.contactsLeftOut,
                          .notLookedAt = step.counters.notLookedAt};
    told.contacts.reserve(step.contacts.size());
    for (const Contact& contact : step.contacts) told.contacts.push_back(valueOf(contact));
    return told;
}

answer::PairEvents eventsOf(const StepResult& step, FrameNumber frame, bool stays, std::size_t most) {
    answer::PairEvents told{.frame = frame, .events = {}, .leftOut = step.counters.eventsLeftOut};
    const std::vector<PairEvent> changes = step.events.changes();
    std::size_t changesLeft = std::min(changes.size(), most);
    std::size_t staysLeft = stays ? std::min(step.events.size() - changes.size(), most - changesLeft) : 0;
    told.events.reserve(changesLeft + staysLeft);
    for (const PairEvent& event : stays ? step.events.all() : changes) {
        std::size_t& left = isChange(event) ? changesLeft : staysLeft;
        if (left == 0) {
            ++told.leftOut;
            continue;
        }
        --left;
        told.events.push_back(valueOf(event));
    }
    return told;
}

answer::Distances distancesOf(const StepResult& step, FrameNumber frame, std::size_t most) {
    answer::Distances told{.frame = frame, .distances = {}, .leftOut = step.counters.eventsLeftOut};
    const std::size_t listed = std::min(step.distances.size(), most);
    told.leftOut += step.distances.size() - listed;
    told.distances.reserve(listed);
    for (std::size_t i = 0; i < listed; ++i) told.distances.push_back(valueOf(step.distances[i]));
    return told;
}

QuestionValue valueOf(const Question& q) {
    return {.id = q.id,
            .interest = q.interest,
            .objectA = q.objectA,
            .objectB = q.objectB,
            .transform = q.transform,
            .present = q.present,
            .wanted = q.wanted,
            .point = q.point,
            .normal = q.normal};
}

FrameCollision numbersOf(const StepResult& step) {
    const DistanceList::Near near = step.distances.near();
    FrameCollision numbers{.contacts = step.contacts.size() + step.counters.contactsLeftOut,
                           .begun = step.contactsBegun,
                           .ended = 0,
                           .near = near.count,
                           .nearest = near.least};
    for (const PairEvent& event : step.events.changes()) numbers.ended += event.phase == Phase::kEnded;
    return numbers;
}

}  // namespace tessera

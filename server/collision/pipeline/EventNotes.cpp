#include "server/collision/pipeline/EventNotes.h"

#include <algorithm>
#include <utility>

#include "server/collision/pairwise/PairContact.h"

namespace tessera {
namespace {

ObjectId objectOf(const ObjectHandler& handler, std::uint32_t part) {
    return handler.bodies()[handler.parts()[part].body].node;
}

bool tellsEvents(const InterestTerms& interest) {
    return interest.mode == InterestWords::kPseudoDynamic || interest.mode == InterestWords::kDynamic;
}

}  // namespace

void noteResting(EventBook& book, const ObjectHandler& handler, std::uint32_t number, const PairState& pair,
                 const Relation& relation) {
    const DistanceAnswer& known = pair.distance;
    const ObjectId objectA = objectOf(handler, pair.a), objectB = objectOf(handler, pair.b);
    const auto drawnFace = [&](std::uint32_t part, std::uint32_t face, const Vec3d& towards) {
        return tessera::drawnFace({*handler.parts()[part].shape, handler.parts()[part].world}, face, towards);
    };
    std::vector<EventBook::Key> touching;
    std::vector<PairDistance> near;
    for (const std::uint32_t index : relation.interests) {
        const InterestTerms& interest = handler.interests()[index];
        if (pair.touch.touching && tellsEvents(interest)) touching.emplace_back(interest.core, objectA, objectB);
        if (interest.mode == InterestWords::kDistance && known.complete && !known.farther &&
            known.distance - known.error <= interest.threshold)
            near.push_back({interest.core, objectA, objectB, Phase::kStays, known.distance, pair.nodeA, pair.nodeB,
                            drawnFace(pair.a, known.faces.a, known.pointB - known.pointA),
                            drawnFace(pair.b, known.faces.b, known.pointA - known.pointB), known.pointA, known.pointB,
                            known.error});
    }
    book.rests(number, std::move(touching), std::move(near));
}

void appendEvents(const ObjectHandler& handler, std::uint32_t partA, std::uint32_t partB, PairEvent when, Moment moment,
                  std::vector<EventBook::Touching>& out) {
    when.objectA = objectOf(handler, partA);
    when.objectB = objectOf(handler, partB);
    for (const std::uint32_t index : handler.relation(std::min(partA, partB), std::max(partA, partB)).interests) {
        const InterestTerms& interest = handler.interests()[index];
        if (moment == Moment::kAtEnd ? !tellsEvents(interest) : interest.mode != InterestWords::kDynamic) continue;
        when.interest = interest.core;
        out.push_back({when, moment == Moment::kAtEnd});
    }
}

}  // namespace tessera

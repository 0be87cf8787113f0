#include "server/collision/pipeline/Rollback.h"

#include <algorithm>
#include <utility>

#include "server/collision/pairwise/PairTable.h"

namespace tessera {

std::vector<RollbackContact> firstRollbackContacts(const ObjectHandler& handler, std::span<const RollbackPair> pairs,
                                                   const WayLookup& wayOf, double stopTolerance, QueryWork& work) {
    struct Candidate {
        RollbackPair pair;
        Rest rest;
        RestTerms terms;
    };
    std::vector<Candidate> candidates;
    std::vector<Support> shared;  // what one of those that move rests on, seen from either side
    for (const RollbackPair& pair : pairs) {
        const Part &a = handler.parts()[pair.partA], &b = handler.parts()[pair.partB];
        const double size = std::min(a.worldBox.size().norm(), b.worldBox.size().norm());
        const WayBound boundA = boundWay(handler, pair.partA, wayOf), boundB = boundWay(handler, pair.partB, wayOf);
        Candidate of{pair,
                     {},
                     restingTerms(handler.toleranceOf(pair.partA, pair.partB, size, stopTolerance),
                                  boundA.length + boundB.length, boundA.curvature > 0, boundB.curvature > 0)};
        if (pair.touching) {
            const FacePairs faces = surfaceFacesTouching({*a.shape, a.world}, {*b.shape, b.world}, work);
            // Hulls wholly within each other, or the work was not enough.
            if (!faces.complete || faces.pairs.empty()) continue;
            addRest(of.rest, a, a.world, b, b.world, faces.pairs, of.terms);
            shareSupports(shared, of.rest.supports, false, of.terms.tolerance);
            shareSupports(shared, of.rest.supports, true, of.terms.tolerance);
        }
        candidates.push_back(std::move(of));
    }
    std::vector<RollbackContact> contacts;
    for (Candidate& of : candidates)
        contacts.push_back({of.pair, firstNewContact(handler, of.pair.partA, of.pair.partB, wayOf, of.terms.tolerance,
                                                     of.rest, shared, of.terms, work)});
    return contacts;
}

}  // namespace tessera

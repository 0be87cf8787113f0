#include "server/collision/response/RestingImpact.h"

#include <algorithm>
#include <utility>

namespace tessera {

bool addRest(Rest& rest, const Part& a, const Affine3d& worldA, const Part& b, const Affine3d& worldB,
             std::span<const FacePair> faces, const RestTerms& terms) {
    std::vector<RestingFaces> touching;
    touching.reserve(faces.size());
    for (const FacePair& f : faces) touching.push_back({f, worldFaces({*a.shape, worldA}, {*b.shape, worldB}, f)});
    return addRest(rest, std::move(touching), terms);
}

Impact firstNewContact(const ObjectHandler& handler, std::uint32_t partA, std::uint32_t partB, const WayLookup& wayOf,
                       double near, Rest& rest, std::span<const Support> shared, const RestTerms& terms,
                       QueryWork& work) {
    const Part &a = handler.parts()[partA], &b = handler.parts()[partB];
    const double together = kTogether * terms.tolerance;
    constexpr int kRounds = 16;
    for (int round = 0;; ++round) {
        std::vector<Support> supports = rest.supports;
        shareSupports(supports, shared, false, terms.tolerance);
        const Impact found = supports.empty() && rest.within.empty()
                                 ? firstRigidContact(handler, partA, partB, wayOf, near, work)
                                 : firstContactBeside(handler, partA, partB, wayOf, near, supports, rest.within, work);
        if (!found.hit || found.support >= 0 || round == kRounds) return found;
        if (found.t * terms.length > together) return found;
        const WorldFaces start = worldFaces({*a.shape, a.world}, {*b.shape, b.world}, found.faces);
        if (start.centresApart() - start.margin() > together) return found;
        if (!addRest(rest, a, a.world, b, b.world, std::span(&found.faces, 1), terms)) return found;
    }
}

void shareSupports(std::vector<Support>& supports, std::span<const Support> more, bool reversed, double tolerance) {
    for (Support support : more) {
        if (support.parting || support.turns != Support::Turns::kNo || supports.size() >= kMostSupports) continue;
        if (reversed) support.normal = -support.normal;
        support.overlap = tolerance;
        constexpr double kSame = 1 - 1e-12;
        const bool known = std::ranges::any_of(supports, [&](const Support& s) {
            return !s.parting && s.turns == Support::Turns::kNo && s.normal.dot(support.normal) > kSame;
        });
        if (!known) supports.push_back(support);
    }
}

}  // namespace tessera

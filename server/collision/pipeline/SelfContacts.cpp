#include "server/collision/pipeline/SelfContacts.h"

#include <algorithm>
#include <utility>

#include "server/collision/query/SelfCollision.h"

namespace tessera {
/// Whether a part is asked about, and anew.
void SelfContacts::note(const ObjectHandler& handler, std::uint32_t part) {
    const std::uint32_t interest = handler.selfInterestOf(part);
    if (interest == kNobody) {
        known_.erase(part);
        return;
    }
    Known& known = known_[part];
    known.interest = interest;
    const std::shared_ptr<const CollisionShape>& shape = handler.parts()[part].shape;
    if (known.shape == shape && !(shape && shape->deforms())) return;
    known.shape = shape;
    known.stale = true;
    stale_.push_back(part);
}

bool SelfContacts::follow(const ObjectHandler& handler, std::span<const std::uint32_t> changed, std::size_t most,
                          QueryWork& work) {
    stale_ = std::exchange(incomplete_, {});
    if (generation_ != handler.generation() || interests_ != handler.interestsVersion()) {
        generation_ = handler.generation();
        interests_ = handler.interestsVersion();
        anyInterest_ = std::ranges::any_of(handler.interests(),
                                           [](const InterestTerms& i) { return i.mode == InterestWords::kSelf; });
        std::map<std::uint32_t, Known> before;
        for (const std::uint32_t part : handler.partsWithSelfInterest()) {
            if (const auto old = known_.find(part); old != known_.end()) before.insert(known_.extract(old));
        }
        known_ = std::move(before);
        for (const std::uint32_t part : handler.partsWithSelfInterest()) note(handler, part);
    } else if (anyInterest_) {
        for (const std::uint32_t part : changed) note(handler, part);
    }
    bool looked = false;
    for (const std::uint32_t part : stale_) {
        const auto at = known_.find(part);
        if (at == known_.end() || !at->second.stale) continue;
        looked = true;
        Known& known = at->second;
        known.faces.clear();
        known.count = 0;
        known.stale = false;
        // A hull does not run into itself, and balls of a set are none to each other.
        const bool points = known.shape && known.shape->points() != nullptr && !known.shape->isCover();
        if (!known.shape || known.shape->hull() != nullptr || points) continue;
        FacePairs found = selfTouching(known.shape->tree(), work, {.weldEqualPositions = true});
        known.count = found.pairs.size();
        known.faces = std::move(found.pairs);
        known.faces.resize(std::min(known.faces.size(), most));
        if (found.complete) continue;
        known.stale = true;
        incomplete_.push_back(part);
    }
    return looked;
}

std::vector<Touching> SelfContacts::contacts(const ObjectHandler& handler) const {
    std::vector<Touching> out;
    for (const auto& [part, known] : known_) {
        const Part& of = handler.parts()[part];
        if (known.count == 0 || !of.solid()) continue;
        const InterestTerms& interest = handler.interests()[known.interest];
        Touching touching;
        touching.nodeA = touching.nodeB = of.node;
        touching.partA = touching.partB = part;
        touching.worldA = touching.worldB = of.world;
        touching.interest = interest.core;
        const std::size_t wanted = interest.detail == InterestWords::kAllFaces ? known.faces.size()
                                   : interest.detail == InterestWords::kYesOrNo
                                       ? 1
                                       : static_cast<std::size_t>(interest.detail);
        touching.faces.assign(known.faces.begin(),
                              known.faces.begin() + static_cast<std::ptrdiff_t>(std::min(known.faces.size(), wanted)));
        touching.faceCount = interest.detail == InterestWords::kAllFaces ? known.count : touching.faces.size();
        out.push_back(std::move(touching));
    }
    return out;
}

}  // namespace tessera

#include "server/collision/pipeline/Neighbourhood.h"

#include <algorithm>
#include <array>
#include <utility>

namespace tessera {
namespace {

/// Up to two parts of a group, of different bodies: what the parts of two groups are to each other shows in them.
using Examples = std::array<std::uint32_t, 2>;

std::vector<Examples> examplesOf(const ObjectHandler& handler) {
    std::vector<Examples> examples(handler.interactions().active.size(), Examples{kNobody, kNobody});
    for (std::uint32_t part = 0; part < handler.parts().size(); ++part) {
        Examples& known = examples[handler.interactions().groupOf[part]];
        if (known[0] == kNobody)
            known[0] = part;
        else if (known[1] == kNobody && handler.parts()[part].body != handler.parts()[known[0]].body)
            known[1] = part;
    }
    return examples;
}

void add(PartTraits& traits, const Relation& relation) {
    traits.obstructed = traits.obstructed || relation.response != Interest::kReport;
    traits.dynamic = traits.dynamic || relation.dynamic;
    traits.rollback = traits.rollback || relation.response == Interest::kRollback;
    traits.slides = traits.slides || relation.response == Interest::kSlide;
    traits.distance = traits.distance || relation.distance;
}

std::vector<PartTraits> traitsOf(const ObjectHandler& handler) {
    const std::vector<Examples> examples = examplesOf(handler);
    std::vector<PartTraits> traits(examples.size());
    for (std::size_t g = 0; g < examples.size(); ++g)
        for (std::size_t h = g; h < examples.size(); ++h) {
            if (!handler.interactions().interacts[g * examples.size() + h]) continue;
            for (const std::uint32_t a : examples[g])
                for (const std::uint32_t b : examples[h]) {
                    if (a == kNobody || b == kNobody || a == b) continue;
                    const Relation relation = handler.relation(std::min(a, b), std::max(a, b));
                    if (!relation.relevant) continue;
                    add(traits[g], relation);
                    add(traits[h], relation);
                }
        }
    return traits;
}

/// Parts of a place are a range: how many of those before each part have a trait says whether any of a range has it.
std::vector<PartTraits> carriedTraitsOf(const ObjectHandler& handler, const std::vector<PartTraits>& ofGroup) {
    std::vector<PartTraits> carried(handler.transformCount());
    for (bool PartTraits::*trait : {&PartTraits::obstructed, &PartTraits::dynamic, &PartTraits::rollback,
                                    &PartTraits::slides, &PartTraits::distance}) {
        std::vector<std::uint32_t> before(handler.parts().size() + 1, 0);
        for (std::size_t i = 0; i + 1 < before.size(); ++i)
            before[i + 1] = before[i] + (ofGroup[handler.interactions().groupOf[i]].*trait ? 1 : 0);
        for (std::uint32_t t = 0; t < carried.size(); ++t)
            carried[t].*trait = std::ranges::any_of(handler.placesOf(t), [&](std::uint32_t place) {
                const auto [first, last] = handler.partsBelow(place);
                return before[first] != before[last];
            });
    }
    return carried;
}

}  // namespace

const Way* wayOf(std::span<const Mover> movers, ObjectId transform) {
    const auto it =
        std::ranges::lower_bound(movers, transform, {}, [](const Mover& mover) { return mover.wish.transform; });
    return it != movers.end() && it->wish.transform == transform ? &it->way : nullptr;
}

void Neighbourhood::follow(const ObjectHandler& handler) {
    margin_ = 0;
    for (const InterestTerms& interest : handler.interests())
        if (interest.mode == Interest::kDistance) margin_ = std::max(margin_, 0.5 * interest.threshold);
    if (generation_ == handler.generation()) return;
    generation_ = handler.generation();
    traits_ = traitsOf(handler);
    carried_ = carriedTraitsOf(handler, traits_);
    fresh_ = true;
}

Box Neighbourhood::boxOf(const ObjectHandler& handler, std::uint32_t part, const WayLookup& wayOf, const FreeBodies& bodies,
                         double seconds, double margin, bool onTheWay) const {
    const Part& it = handler.parts()[part];
    Box box = it.worldBox;
    if (!it.solid()) return box;
    if (onTheWay) box = boxOnAllWays(handler, part, wayOf, traits(handler, part).slides);
    if (bodies.isFree(it.body)) box.extend(bodies.reach(handler, part, seconds));
    if (margin > 0 && traits(handler, part).distance) {
        box.lower -= Vec3d::Constant(margin);
        box.upper += Vec3d::Constant(margin);
    }
    return box;
}

std::span<const NeighbourPair> Neighbourhood::find(ObjectHandler& handler, std::span<const Mover> ways, const FreeBodies& bodies,
                                                   double seconds) {
    const std::span<const Part> parts = handler.parts();
    const WayLookup lookup = [&](ObjectId transform) { return wayOf(ways, transform); };
    std::vector<std::uint32_t> stale = handler.takeMoved();
    std::vector<std::uint32_t> travelling;
    for (const Mover& mover : ways)
        for (const std::uint32_t place : handler.placesOf(mover.number)) {
            const auto [first, last] = handler.partsBelow(place);
            for (std::uint32_t i = first; i < last; ++i) travelling.push_back(i);
        }
    std::ranges::sort(travelling);
    std::vector<std::uint32_t> grown = travelling;
    // As long as free bodies rest their boxes are still large enough.
    if (!bodies.resting() || fresh_) {
        stale.insert(stale.end(), free_.begin(), free_.end());
        free_.clear();
        for (const std::uint32_t body : bodies.free())
            free_.insert(free_.end(), handler.bodies()[body].parts.begin(), handler.bodies()[body].parts.end());
        stale.insert(stale.end(), free_.begin(), free_.end());
    }
    for (const Deformation& deformation : handler.deformations()) grown.push_back(deformation.part);
    std::ranges::sort(grown);
    grown.erase(std::unique(grown.begin(), grown.end()), grown.end());

    const auto target = [&](std::uint32_t part) {
        Box box = boxOf(handler, part, lookup, bodies, seconds, margin_, std::ranges::binary_search(travelling, part));
        for (const Deformation& deformation : handler.deformations()) {
            if (deformation.part != part || !parts[part].solid()) continue;
            for (const Vec3d& p : deformation.end) box.extend(parts[part].world * p);
        }
        return box;
    };
    const bool everything = margin_ != previousMargin_;
    if (fresh_) {
        boxes_.resize(parts.size());
        for (std::uint32_t i = 0; i < parts.size(); ++i) boxes_[i] = target(i);
        finder_->reset(boxes_, handler.interactions());
        fresh_ = false;
    } else {
        if (everything) {
            stale.resize(parts.size());
            for (std::uint32_t i = 0; i < parts.size(); ++i) stale[i] = i;
        } else {
            stale.insert(stale.end(), grown.begin(), grown.end());
            stale.insert(stale.end(), grown_.begin(), grown_.end());
            std::ranges::sort(stale);
            stale.erase(std::unique(stale.begin(), stale.end()), stale.end());
        }
        items_.clear();
        moved_.clear();
        for (const std::uint32_t part : stale) {
            // A sleeper's box is still large enough.
            if (bodies.isFree(parts[part].body) && bodies.asleep(parts[part].body)) continue;
            const Box box = target(part);
            if (box.lower == boxes_[part].lower && box.upper == boxes_[part].upper) continue;
            boxes_[part] = box;
            items_.push_back(part);
            moved_.push_back(box);
        }
        finder_->move(items_, moved_);
    }
    previousMargin_ = margin_;
    grown_ = std::move(grown);
    return finder_->pairs();
}

}  // namespace tessera

#include "server/collision/pipeline/Neighbourhood.h"
#include "server/collision/objects/SortOnce.h"

#include <algorithm>
#include <optional>
#include <utility>

namespace tessera {
namespace {

/// Bits of what is asked of a part.
enum : std::uint8_t { kObstructed = 1, kDynamic = 2, kRollback = 4, kSlides = 8 };

std::uint8_t bitsOf(const RelationTable::Pairing& pairing) {
    std::uint8_t bits = 0;
    if (pairing.response != InterestWords::kReport) bits |= kObstructed;
    if (pairing.dynamic) bits |= kDynamic;
    if (pairing.response == InterestWords::kRollback) bits |= kRollback;
    if (pairing.response == InterestWords::kSlide) bits |= kSlides;
    return bits;
}

void add(PartTraits& traits, const PartTraits& other) {
    traits.obstructed = traits.obstructed || other.obstructed;
    traits.dynamic = traits.dynamic || other.dynamic;
    traits.rollback = traits.rollback || other.rollback;
    traits.slides = traits.slides || other.slides;
    traits.margin = std::max(traits.margin, other.margin);
}

}  // namespace

const Way* wayOf(std::span<const Mover> movers, ObjectId transform) {
    const auto it =
        std::ranges::lower_bound(movers, transform, {}, [](const Mover& mover) { return mover.wish.transform; });
    return it != movers.end() && it->wish.transform == transform ? &it->way : nullptr;
}

/// What another group asks of one.
void Neighbourhood::ask(const RelationTable& relations, std::uint32_t group, std::uint32_t other, Row& row) const {
    const std::optional<RelationTable::Pairing> pairing = relations.pairing(group, other);
    const std::uint8_t now = pairing ? bitsOf(*pairing) : 0, before = std::exchange(row.asked[other], now);
    for (std::size_t bit = 0; bit < row.count.size(); ++bit)
        row.count[bit] += (now >> bit & 1U) - static_cast<std::uint32_t>(before >> bit & 1U);
}

const PartTraits& Neighbourhood::traitsOfGroup(const ObjectHandler& handler, std::uint32_t group) {
    const RelationTable& relations = handler.relations();
    if (traits_.size() <= group) traits_.resize(relations.groupNumbers());
    Row& row = traits_[group];
    if (row.version == relations.version()) return row.traits;
    const std::optional<std::span<const std::uint32_t>> changed = relations.changedSince(row.version);
    const bool afresh =
        !changed || changed->size() > relations.groupNumbers() || std::ranges::find(*changed, group) != changed->end();
    row.version = relations.version();
    row.asked.resize(relations.groupNumbers(), 0);
    if (afresh) {
        for (std::uint32_t other = 0; other < relations.groupNumbers(); ++other) ask(relations, group, other, row);
        // The object's side looks out for the others.
        row.margin = 0;
        for (const std::uint32_t k : relations.interestsOf(group)) {
            const InterestTerms& interest = handler.interests()[k];
            if (interest.mode == InterestWords::kDistance) row.margin = std::max(row.margin, interest.threshold);
        }
    } else {
        for (const std::uint32_t other : *changed) ask(relations, group, other, row);
    }
    row.traits = {row.count[0] > 0, row.count[1] > 0, row.count[2] > 0, row.count[3] > 0, row.margin};
    return row.traits;
}

const PartTraits& Neighbourhood::traitsCarried(const ObjectHandler& handler, std::uint32_t transform) {
    if (carried_.size() <= transform) carried_.resize(handler.transformNumbers());
    Known& known = carried_[transform];
    const ObjectId core = handler.transformAt(transform);
    if (known.version == handler.relations().version() && known.structure == handler.structure() &&
        known.transform == core)
        return known.traits;
    known = {handler.relations().version(), handler.structure(), core, {}};
    std::uint32_t last = kNobody;
    handler.forPartsCarried(transform, [&](std::uint32_t part, std::uint32_t) {
        const std::uint32_t group = handler.interactions().groupOf[part];
        if (group != last) add(known.traits, traitsOfGroup(handler, group));
        last = group;
    });
    return known.traits;
}

Box Neighbourhood::boxOf(const ObjectHandler& handler, std::uint32_t part, const WayLookup& wayOf,
                         const FreeBodies& bodies, double seconds, bool onTheWay) {
    const Part& it = handler.parts()[part];
    Box box = it.worldBox;
    if (!it.solid()) return box;
    const PartTraits& asked = traits(handler, part);
    if (onTheWay) box = boxOnAllWays(handler, part, wayOf, asked.slides);
    if (bodies.isFree(it.body)) box.extend(bodies.reach(handler, part, seconds));
    if (asked.margin > 0) {
        box.lower -= Vec3d::Constant(asked.margin);
        box.upper += Vec3d::Constant(asked.margin);
    }
    return box;
}

bool Neighbourhood::find(ObjectHandler& handler, std::span<const Mover> ways, FreeBodies& bodies, double seconds,
                         PairMemory& memory) {
    const std::span<const Part> parts = handler.parts();
    const WayLookup lookup = [&](ObjectId transform) { return wayOf(ways, transform); };
    const std::vector<std::uint32_t> moved = handler.takeMoved(), regrouped = handler.takeRegrouped(),
                                     reworded = handler.takeReworded();
    changed_ = moved;
    changed_.insert(changed_.end(), regrouped.begin(), regrouped.end());
    std::vector<std::uint32_t> stale = moved;
    stale.insert(stale.end(), later_.begin(), later_.end());
    std::erase_if(stale, [&](std::uint32_t part) { return part >= parts.size(); });
    bodies.noteMoved(stale);
    bodies.noteMoved(regrouped);
    stale.insert(stale.end(), reworded.begin(), reworded.end());
    later_.clear();
    std::vector<std::uint32_t> travelling;
    for (const Mover& mover : ways)
        handler.forPartsCarried(mover.number, [&](std::uint32_t part, std::uint32_t) { travelling.push_back(part); });
    sortOnce(travelling);
    std::vector<std::uint32_t> grown = travelling;
    const bool afresh = generation_ != handler.generation();
    // Those of sleepers are still large enough.
    for (const std::span<const std::uint32_t> some : {bodies.awake(), bodies.changed()})
        for (const std::uint32_t body : some)
            stale.insert(stale.end(), handler.bodies()[body].parts.begin(), handler.bodies()[body].parts.end());
    for (const PartDeformation& deformation : handler.deformations()) grown.push_back(deformation.part);
    sortOnce(grown);

    const auto target = [&](std::uint32_t part) {
        Box box = boxOf(handler, part, lookup, bodies, seconds, std::ranges::binary_search(travelling, part));
        if (!parts[part].solid()) return box;
        const auto deformation = std::ranges::lower_bound(handler.deformations(), part, {}, &PartDeformation::part);
        if (deformation == handler.deformations().end() || deformation->part != part) return box;
        for (const Vec3d& p : deformation->end) box.extend(parts[part].world * p);
        return box;
    };
    if (afresh) {
        generation_ = handler.generation();
        traits_.clear();
        carried_.clear();
        memory.clear();
        boxes_.assign(parts.size(), Box{});
        for (std::uint32_t i = 0; i < parts.size(); ++i)
            if (parts[i].node) boxes_[i] = target(i);
        finder_->expect(parts.size() + parts.size() / 8 + 256);
        finder_->reset(boxes_, handler.interactions());
        memory.align(finder_->pairs(), handler);
        grown_ = std::move(grown);
        return true;
    }
    if (!regrouped.empty()) {
        const std::vector<NeighbourPair> known = memory.loosen(regrouped);
        finder_->regroup(regrouped, known, handler.interactions());
        boxes_.resize(handler.interactions().groupOf.size());
        for (const std::uint32_t part : regrouped) boxes_[part] = {};
        stale.insert(stale.end(), regrouped.begin(), regrouped.end());
    }
    stale.insert(stale.end(), grown.begin(), grown.end());
    stale.insert(stale.end(), grown_.begin(), grown_.end());
    sortOnce(stale);
    items_.clear();
    moved_.clear();
    for (const std::uint32_t part : stale) {
        if (part >= parts.size() || !parts[part].node) continue;
        // A sleeper's box is still large enough.
        if (bodies.isFree(parts[part].body) && bodies.asleep(parts[part].body) && !boxes_[part].empty()) continue;
        const Box box = target(part);
        if (box.lower == boxes_[part].lower && box.upper == boxes_[part].upper) continue;
        boxes_[part] = box;
        items_.push_back(part);
        moved_.push_back(box);
    }
    finder_->move(items_, moved_);
    if (finder_->changes(begun_, ended_))
        memory.follow(begun_, ended_, handler);
    else
        memory.align(finder_->pairs(), handler);
    memory.reconsider(reworded, handler);
    memory.moved(moved);
    for (const PartDeformation& deformation : handler.deformations()) memory.moved(std::span(&deformation.part, 1));
    grown_ = std::move(grown);
    return !moved.empty() || !regrouped.empty() || !reworded.empty() || !grown_.empty();
}

}  // namespace tessera

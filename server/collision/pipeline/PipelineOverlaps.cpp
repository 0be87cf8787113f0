/// Which parts touch each other, asked between steps. The parts are put into their places without a way there.
#include <algorithm>
#include <unordered_map>
#include <utility>

#include "server/collision/pairwise/PairTable.h"
#include "server/collision/pipeline/BoxesNear.h"
#include "server/collision/pipeline/PipelineState.h"

namespace tessera {

/// Parts that some Transforms carry, ascending. `of` tells for each part the nearest place of such a Transform above
/// it. Parts with the same place are carried together.
struct CollisionPipeline::Impl::Carriers {
    struct Carrier {
        std::uint32_t place = Place::kNone;
        ObjectId transform;
    };
    std::unordered_map<std::uint32_t, Carrier> of;
    std::vector<std::uint32_t> parts;
    bool nested = false;  ///< several carry one part

    [[nodiscard]] bool together(std::uint32_t a, std::uint32_t b) const {
        const auto atA = of.find(a), atB = of.find(b);
        return atA != of.end() && atB != of.end() && atA->second.place == atB->second.place;
    }
};

CollisionPipeline::Impl::Carriers CollisionPipeline::Impl::carriersOf(std::span<const ObjectId> transforms) {
    Carriers carriers;
    for (const ObjectId transform : transforms) {
        const std::uint32_t number = handler.transformNumber(transform);
        if (number == kNobody || !neighbourhood.traitsCarried(handler, number).obstructed) continue;
        handler.forPartsCarried(number, [&](std::uint32_t i, std::uint32_t place) {
            const auto [known, fresh] = carriers.of.try_emplace(i, Carriers::Carrier{place, transform});
            if (fresh) carriers.parts.push_back(i);
            carriers.nested = carriers.nested || !fresh;
            if (handler.holds(known->second.place, place)) known->second = {place, transform};
        });
    }
    std::ranges::sort(carriers.parts);
    return carriers;
}

/// Calls visit(part, other, pair) for parts that may touch. `pair` is the number of their pair, or kNobody where there
/// is none. `others`: only these are of interest. Parts that are carried together may be left out.
template <typename Visit>
void CollisionPipeline::Impl::forNeighbours(const Carriers& carriers,
                                            std::optional<std::span<const std::uint32_t>> others, const Visit& visit) {
    // The pairs are those of the last step. They are complete as long as nothing has come, gone or moved since.
    if (!others && neighbourhood.generation() == handler.generation() && handler.nothingNew()) {
        for (const std::uint32_t i : carriers.parts)
            for (const std::uint32_t k : memory.pairsOf(i))
                visit(i, memory.states()[k].a == i ? memory.states()[k].b : memory.states()[k].a, k);
        return;
    }
    const std::span<const Part> parts = handler.parts();
    const auto companyOf = [&](std::uint32_t i) {
        const auto carrier = carriers.of.find(i);
        return carrier == carriers.of.end() ? BoxesNear::kAlone : carrier->second.place;
    };
    Box all;
    for (const std::uint32_t i : carriers.parts)
        if (parts[i].solid()) all.extend(parts[i].worldBox);
    std::vector<BoxesNear::Item> items;
    const auto add = [&](std::uint32_t i) {
        ++boxesLookedAt;
        if (parts[i].node && parts[i].worldBox.overlaps(all)) items.push_back({i, companyOf(i), parts[i].worldBox});
    };
    if (others)
        std::ranges::for_each(*others, add);
    else
        for (std::uint32_t i = 0; i < parts.size(); ++i) add(i);
    // For a few parts, comparing each with all near boxes costs less than sorting the boxes.
    constexpr std::size_t kFew = 8;
    if (carriers.parts.size() <= kFew) {
        for (const std::uint32_t i : carriers.parts)
            for (const BoxesNear::Item& other : items) {
                ++boxesLookedAt;
                if (other.item != i && other.box.overlaps(parts[i].worldBox)) visit(i, other.item, kNobody);
            }
        return;
    }
    BoxesNear near(std::move(items));
    std::vector<std::uint32_t> found;
    for (const std::uint32_t i : carriers.parts) {
        if (!parts[i].solid()) continue;
        near.find(parts[i].worldBox, companyOf(i), found);
        for (const std::uint32_t other : found)
            if (other != i) visit(i, other, kNobody);
    }
    boxesLookedAt += near.looks();
}

namespace {

using Overlapping = std::vector<std::pair<ObjectId, ObjectId>>;

Overlapping sorted(Overlapping pairs) {
    std::ranges::sort(pairs);
    pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
    return pairs;
}

}  // namespace

Overlapping CollisionPipeline::Impl::overlapsNow(std::span<const ObjectId> transforms, Deforming deforming,
                                                 std::optional<std::span<const std::uint32_t>> others) {
    const Carriers carriers = carriersOf(transforms);
    const auto deforms = [&](std::uint32_t i) {
        return deforming == Deforming::kLeftOut &&
               std::ranges::binary_search(handler.deformations(), i, {}, &PartDeformation::part);
    };
    Overlapping found;
    QueryWork work;
    work.limit = limits.maxTests;
    forNeighbours(carriers, others, [&](std::uint32_t i, std::uint32_t other, std::uint32_t k) {
        if (carriers.together(i, other) || deforms(i) || deforms(other)) return;
        if (touchesNow(i, other, carriers.of.at(i).transform, k, work))
            found.emplace_back(std::minmax(part(i).node, part(other).node));
    });
    return sorted(std::move(found));
}

bool CollisionPipeline::Impl::touchesNow(std::uint32_t i, std::uint32_t other, ObjectId transform, std::uint32_t k,
                                         QueryWork& work) const {
    if (!part(i).solid() || !part(other).solid() || !part(i).worldBox.overlaps(part(other).worldBox)) return false;
    const Relation relation = handler.relation(std::min(i, other), std::max(i, other));
    const bool isA = relation.firstIsObject == (i < other);
    const std::uint32_t a = isA ? i : other, b = isA ? other : i;
    if (!relation.relevant || !obstacle(a, b, relation, transform)) return false;
    if (k != kNobody && memory.states()[k].touch.holds(part(memory.states()[k].a), part(memory.states()[k].b), false))
        return memory.states()[k].touch.touching;
    // The pair is asked in the order of the collision step. Rounding decides about flush faces, and decides otherwise
    // in the reverse order.
    return touchOf({*part(a).shape, part(a).world}, {*part(b).shape, part(b).world}, {work}).touch != Touch::kNo;
}

std::vector<Overlapping> CollisionPipeline::Impl::overlapsAfter(const Aspect& committed,
                                                                std::span<const PosedTransforms> moves,
                                                                Against against) {
    std::vector<ObjectId> all;
    for (const PosedTransforms& move : moves)
        for (const auto& [transform, pose] : move) all.push_back(transform);
    const Carriers everybody = against == Against::kThemselves ? carriersOf(all) : Carriers();
    // Where two Transforms carry one part, putting one of them back leads the part to a place where it has never been.
    // Anything may stand there, so `nested` parts are compared with everything.
    const bool themselves = against == Against::kThemselves && !everybody.nested;
    std::vector<Overlapping> after;
    for (const PosedTransforms& move : moves) {
        std::vector<ObjectId> moved;
        for (const auto& [transform, pose] : move) {
            handler.overlay(transform, localOf(pose));
            moved.push_back(transform);
        }
        after.push_back(themselves ? overlapsNow(moved, Deforming::kAsBefore, everybody.parts)
                                   : overlapsNow(moved, Deforming::kAsBefore));
    }
    handler.dropOverlay(committed);
    return after;
}

}  // namespace tessera

/// The part of the object handler that notes what is new, for those who ask once a step.
#include <algorithm>
#include <utility>

#include "server/collision/objects/ObjectHandler.h"
#include "server/collision/objects/SortOnce.h"

namespace tessera {

void ObjectHandler::noteMoved(std::uint32_t part) {
    if (std::exchange(partTerms_[part].moved, true)) return;
    movedParts_.push_back(part);
}

void ObjectHandler::noteRegrouped(std::uint32_t part) {
    if (std::exchange(partTerms_[part].regrouped, true)) return;
    regroupedParts_.push_back(part);
}

/// Of interests that are not what they were before.
void ObjectHandler::noteReworded(std::span<const InterestTerms> before) {
    std::unordered_map<ObjectId, std::uint32_t> numbers;
    for (std::uint32_t k = 0; k < before.size(); ++k) numbers.emplace(before[k].core, k);
    std::vector<bool> reworded(interests_.size(), false);
    bool any = false, inOrder = true;
    std::uint32_t last = 0;
    for (std::uint32_t k = 0; k < interests_.size(); ++k) {
        const auto old = numbers.find(interests_[k].core);
        if (old == numbers.end()) continue;  // its groups have changed
        reworded[k] = !(before[old->second] == interests_[k]);
        any = any || reworded[k];
        inOrder = inOrder && last <= old->second;
        last = old->second;
    }
    // Another one may decide.
    if (!inOrder) reworded.assign(interests_.size(), true);
    if (!any && inOrder) return;
    for (std::uint32_t group = 0; group < relations_.interactions().active.size(); ++group) {
        ++work_.groups;
        const auto concerned = [&](std::uint32_t k) { return reworded[k]; };
        if (std::ranges::none_of(relations_.interestsOf(group), concerned)) continue;
        for (const std::uint32_t place : relations_.members(group))
            if (standings_[place].part != kNobody) noteReworded(standings_[place].part);
    }
}

std::uint32_t ObjectHandler::selfInterestOf(std::uint32_t part) const {
    if (part >= parts_.size() || !parts_[part].node) return kNobody;
    const std::uint32_t group = relations_.interactions().groupOf[part];
    if (group == kNobody) return kNobody;
    for (const std::uint32_t k : relations_.interestsOf(group))
        if (interests_[k].mode == InterestWords::kSelf) return k;
    return kNobody;
}

std::vector<std::uint32_t> ObjectHandler::partsWithSelfInterest() const {
    std::vector<std::uint32_t> out;
    if (std::ranges::none_of(interests_, [](const InterestTerms& i) { return i.mode == InterestWords::kSelf; }))
        return out;
    for (std::uint32_t part = 0; part < parts_.size(); ++part)
        if (selfInterestOf(part) != kNobody) out.push_back(part);
    return out;
}

void ObjectHandler::noteReworded(std::uint32_t part) {
    if (std::exchange(partTerms_[part].reworded, true)) return;
    rewordedParts_.push_back(part);
}

void ObjectHandler::noteDrawn(std::uint32_t place) {
    if (!drawnAsked_ || std::exchange(standings_[place].drawn, true)) return;
    drawn_.push_back(place);
}

void ObjectHandler::noteFree(std::uint32_t body) {
    if (std::exchange(bodyTerms_[body].freeChanged, true)) return;
    freeChanged_.push_back(body);
}

std::vector<std::uint32_t> ObjectHandler::takeFreeChanged() {
    for (const std::uint32_t body : freeChanged_) bodyTerms_[body].freeChanged = false;
    sortOnce(freeChanged_);
    return std::exchange(freeChanged_, {});
}

std::vector<std::uint32_t> ObjectHandler::takeMoved() {
    for (const std::uint32_t part : movedParts_) partTerms_[part].moved = false;
    std::erase_if(movedParts_, [&](std::uint32_t part) { return !parts_[part].node; });
    sortOnce(movedParts_);
    return std::exchange(movedParts_, {});
}

std::vector<std::uint32_t> ObjectHandler::takeRegrouped() {
    for (const std::uint32_t part : regroupedParts_) partTerms_[part].regrouped = false;
    sortOnce(regroupedParts_);
    return std::exchange(regroupedParts_, {});
}

std::vector<std::uint32_t> ObjectHandler::takeReworded() {
    for (const std::uint32_t part : rewordedParts_) partTerms_[part].reworded = false;
    std::erase_if(rewordedParts_, [&](std::uint32_t part) { return !parts_[part].node; });
    sortOnce(rewordedParts_);
    return std::exchange(rewordedParts_, {});
}

std::optional<std::vector<std::uint32_t>> ObjectHandler::takeDrawn() {
    drawnAsked_ = true;
    for (const std::uint32_t place : drawn_) standings_[place].drawn = false;
    if (std::exchange(drawnAll_, false)) {
        drawn_.clear();
        return std::nullopt;
    }
    return std::exchange(drawn_, {});
}

}  // namespace tessera

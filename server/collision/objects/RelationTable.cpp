#include "server/collision/objects/RelationTable.h"

#include <algorithm>
#include <limits>
#include <map>
#include <tuple>

#include "server/collision/objects/IdTable.h"
#include "server/collision/objects/Place.h"

namespace tessera {

namespace {

constexpr unsigned kObjectSide = 1, kOtherSide = 2;

/// On which sides of an interest an item is.
unsigned sidesOf(const InterestItem& item, const InterestSides& sides) {
    if (!sides.awake) return 0;
    unsigned on = 0;
    const bool below = sides.object.holds(item.place);
    if (sides.oneObject) {
        if (below) return kObjectSide;
    } else if (below && item.object && sides.object.holds(item.body) && (item.layers & sides.objectLayers) != 0) {
        on |= kObjectSide;
    }
    if (sides.against.holds(item.place) && (item.layers & sides.againstLayers) != 0) on |= kOtherSide;
    return on;
}

/// More demanding, the more faces are to be listed.
std::uint64_t demand(std::int64_t detail) {
    if (detail == Interest::kAllFaces) return std::numeric_limits<std::uint64_t>::max();
    return detail < 0 ? 0 : static_cast<std::uint64_t>(detail);
}

/// What one more interest, which is not the first to speak of a pair, asks of it besides.
void add(const InterestTerms& terms, Relation& relation) {
    if (terms.mode == Interest::kDistance) {
        relation.distance = true;
        relation.threshold = std::max(relation.threshold, terms.threshold);
        return;
    }
    relation.contacts = true;
    relation.dynamic = relation.dynamic || terms.mode == Interest::kDynamic;
    if (demand(terms.detail) > demand(relation.detail)) relation.detail = terms.detail;
}

}  // namespace

std::vector<bool> RelationTable::make(std::span<const InterestTerms> terms, std::span<const InterestSides> sides,
                                      std::span<const InterestItem> items, std::size_t maxGroups) {
    // Where the groups become too many the last interests go, and with them items that nobody else speaks of.
    taken_ = sides.size();
    for (;;) {
        const std::size_t fitting = findGroups(sides.first(taken_), items, maxGroups);
        if (fitting == taken_) break;
        taken_ = fitting;
    }
    interactions_ = {};
    std::vector<bool> takesPart(items.size(), false);
    for (std::size_t i = 0; i < items.size(); ++i) {
        if (groupOfItem_[i] == kNobody) continue;
        takesPart[i] = true;
        interactions_.groupOf.push_back(groupOfItem_[i]);
    }
    relate(sides.first(taken_), items);
    listInterests();
    refresh(terms);
    return takesPart;
}

/// Divides the items by each interest in turn. Returns how many interests fit: all, or those before the first that does
/// not.
std::size_t RelationTable::findGroups(std::span<const InterestSides> sides, std::span<const InterestItem> items,
                                      std::size_t maxGroups) {
    // Items between the same ends of sides are alike to all interests, so few need to be looked at.
    std::vector<std::uint32_t> ends;
    for (const InterestSides& s : sides)
        if (s.awake) ends.insert(ends.end(), {s.object.begin, s.object.end, s.against.begin, s.against.end});
    std::sort(ends.begin(), ends.end());
    ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
    const auto between = [&](std::uint32_t place) {
        return static_cast<std::uint32_t>(std::upper_bound(ends.begin(), ends.end(), place) - ends.begin());
    };
    using Likeness = std::tuple<std::uint32_t, std::uint32_t, std::uint32_t, std::int64_t>;
    std::map<Likeness, std::uint32_t> kinds;
    std::vector<std::uint32_t> kindOf(items.size()), example;
    Likeness last{};
    for (std::uint32_t i = 0; i < items.size(); ++i) {
        const InterestItem& item = items[i];
        const Likeness likeness{between(item.place), item.object ? between(item.body) + 1 : 0,
                                item.alone ? item.body + 1 : 0, item.layers};
        if (i > 0 && likeness == last) {
            kindOf[i] = kindOf[i - 1];
            continue;
        }
        last = likeness;
        const auto [known, isNew] = kinds.emplace(likeness, static_cast<std::uint32_t>(example.size()));
        if (isNew) example.push_back(i);
        kindOf[i] = known->second;
    }

    std::vector<bool> takesPart(example.size(), false);
    for (std::size_t c = 0; c < example.size(); ++c)
        takesPart[c] = std::any_of(sides.begin(), sides.end(), [&](const InterestSides& s) {
            return !s.ignores && sidesOf(items[example[c]], s) != 0;
        });

    std::vector<std::uint32_t> group(example.size(), kNobody);
    std::uint32_t groups = 0;
    const auto divide = [&](auto&& keyOf, std::size_t keys) {
        std::vector<std::uint32_t> number(keys, kNobody);
        std::uint32_t next = 0;
        std::vector<std::uint32_t> divided(example.size(), kNobody);
        for (std::size_t c = 0; c < example.size(); ++c) {
            if (!takesPart[c]) continue;
            std::uint32_t& at = number[keyOf(c)];
            if (at == kNobody) at = next++;
            divided[c] = at;
        }
        if (next > maxGroups) return false;
        group = std::move(divided);
        groups = next;
        return true;
    };
    std::vector<std::uint32_t> aloneNumber(example.size(), 0);
    std::map<std::uint32_t, std::uint32_t> alone;
    for (std::size_t c = 0; c < example.size(); ++c)
        if (items[example[c]].alone)
            aloneNumber[c] =
                alone.emplace(items[example[c]].body, static_cast<std::uint32_t>(alone.size()) + 1).first->second;
    if (!divide([&](std::size_t c) { return aloneNumber[c]; }, alone.size() + 1)) return 0;
    for (std::size_t k = 0; k < sides.size(); ++k)
        if (!divide([&](std::size_t c) { return 4 * group[c] + sidesOf(items[example[c]], sides[k]); },
                    std::size_t{4} * groups))
            return k;

    representative_.assign(groups, kNobody);
    manyBodies_.assign(groups, false);
    groupOfItem_.assign(items.size(), kNobody);
    for (std::uint32_t i = 0; i < items.size(); ++i) {
        const std::uint32_t g = group[kindOf[i]];
        groupOfItem_[i] = g;
        if (g == kNobody) continue;
        if (representative_[g] == kNobody) representative_[g] = i;
        if (items[i].body != items[representative_[g]].body) manyBodies_[g] = true;
    }
    return sides.size();
}

void RelationTable::relate(std::span<const InterestSides> sides, std::span<const InterestItem> items) {
    const std::size_t n = representative_.size();
    constexpr std::uint32_t kIgnored = 0xffffffffu;
    entries_.assign(n * n, 0);
    lists_.assign(1, {});
    interactions_.active.assign(n, false);

    using Extension = StrongId<struct ExtensionTag>;  // a list's number and the interest that is added to it
    BasicIdTable<Extension> extensions;
    const auto extended = [&](std::uint32_t list, std::uint32_t interest) {
        const auto next = static_cast<std::uint32_t>(lists_.size());
        const std::uint32_t known = extensions.insert(Extension((std::uint64_t{list} << 32) | (interest + 1)), next);
        if (known == next) lists_.push_back({list, interest, lists_[list].length + 1, 0, {}});
        return known;
    };
    // The pair (a, b), with a on the object's side, is seen from both of its parts; which of them has the lower number
    // is known when two parts are asked about. In a pair that could be either way round the lower one is the object.
    const auto speak = [&](std::uint32_t interest, std::uint32_t& entry, bool firstIsObject) {
        if (entry == kIgnored) return;
        std::uint32_t list = entry >> 1;
        if (list == 0 || lists_[list].interest != interest) {
            list = extended(list, interest);
            entry = (list << 1) | (entry & kFirstIsObject);
        }
        if (firstIsObject && lists_[list].length == 1) entry |= kFirstIsObject;
    };

    std::vector<std::uint32_t> objects, others;
    const auto findSides = [&](std::size_t k) {
        objects.clear();
        others.clear();
        for (std::uint32_t g = 0; g < n; ++g) {
            const unsigned on = sidesOf(items[representative_[g]], sides[k]);
            if ((on & kObjectSide) != 0) objects.push_back(g);
            if ((on & kOtherSide) != 0) others.push_back(g);
        }
    };
    for (std::size_t k = 0; k < sides.size(); ++k) {
        if (!sides[k].ignores) continue;
        findSides(k);
        for (const std::uint32_t a : objects)
            for (const std::uint32_t b : others) entries_[a * n + b] = entries_[b * n + a] = kIgnored;
    }
    for (std::uint32_t k = 0; k < sides.size(); ++k) {
        if (sides[k].ignores) continue;
        findSides(k);
        for (const std::uint32_t a : objects) {
            interactions_.active[a] = true;
            for (const std::uint32_t b : others) {
                speak(k, entries_[a * n + b], true);
                speak(k, entries_[b * n + a], false);
            }
        }
    }
    interactions_.interacts.assign(n * n, false);
    for (std::size_t e = 0; e < entries_.size(); ++e) {
        if (entries_[e] == kIgnored) entries_[e] = 0;
        // What belongs to one body never meets itself.
        const bool oneBody = e / n == e % n && !manyBodies_[e / n];
        interactions_.interacts[e] = entries_[e] != 0 && !oneBody;
    }
}

/// Writes out the lists that some pair has.
void RelationTable::listInterests() {
    std::vector<bool> used(lists_.size(), false);
    for (const std::uint32_t entry : entries_) used[entry >> 1] = true;
    listed_.clear();
    for (std::size_t i = 1; i < lists_.size(); ++i) {
        if (!used[i]) continue;
        lists_[i].first = static_cast<std::uint32_t>(listed_.size());
        listed_.resize(listed_.size() + lists_[i].length);
        std::size_t at = listed_.size();
        for (std::size_t list = i; list != 0; list = lists_[list].before) listed_[--at] = lists_[list].interest;
    }
}

void RelationTable::refresh(std::span<const InterestTerms> terms) {
    for (std::size_t i = 1; i < lists_.size(); ++i) {
        List& list = lists_[i];  // what it extends stands before it
        const InterestTerms& last = terms[list.interest];
        list.relation = lists_[list.before].relation;
        if (list.length == 1) {
            list.relation.relevant = true;
            list.relation.response = last.response;
        }
        add(last, list.relation);
    }
}

Relation RelationTable::relation(std::uint32_t a, std::uint32_t b) const {
    const std::uint32_t entry = entries_[interactions_.groupOf[a] * representative_.size() + interactions_.groupOf[b]];
    const List& list = lists_[entry >> 1];
    Relation relation = list.relation;
    relation.firstIsObject = entry == 0 || (entry & kFirstIsObject) != 0;
    relation.interests = std::span(listed_).subspan(list.first, list.length);
    return relation;
}

}  // namespace tessera

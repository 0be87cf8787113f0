#include "server/collision/objects/RelationTable.h"

#include <algorithm>
#include <limits>
#include <map>
#include <tuple>

#include "server/collision/objects/Place.h"

namespace tessera {

namespace {

bool onObjectSide(const InterestItem& item, const InterestSides& sides) {
    if (!sides.object.holds(item.place)) return false;
    return sides.oneObject || (item.object && sides.object.holds(item.body) && (item.layers & sides.objectLayers) != 0);
}

/// More demanding, the more faces are to be listed.
std::uint64_t demand(std::int64_t detail) {
    if (detail == Interest::kAllFaces) return std::numeric_limits<std::uint64_t>::max();
    return detail < 0 ? 0 : static_cast<std::uint64_t>(detail);
}

/// What one more interest asks of a pair besides.
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

/// A set that is divided again and again (partition refinement: Paige and Tarjan, SIAM J. Comput. 16, 1987). Members
/// that are left out belong to no cell.
class Partition {
public:
    explicit Partition(const std::vector<bool>& members) : cell_(members.size(), kNobody) {
        const auto size = static_cast<std::size_t>(std::count(members.begin(), members.end(), true));
        if (size == 0) return;
        sizes_.push_back(size);
        for (std::size_t i = 0; i < members.size(); ++i)
            if (members[i]) cell_[i] = 0;
    }
    [[nodiscard]] std::size_t cells() const { return sizes_.size(); }
    [[nodiscard]] std::uint32_t cellOf(std::size_t member) const { return cell_[member]; }

    /// Takes those in [begin, end) that `chosen` says apart from those that it does not, and from all outside.
    template <typename Chosen>
    void divide(std::size_t begin, std::size_t end, Chosen&& chosen) {
        counts_.assign(sizes_.size(), 0);
        chosen_.clear();
        for (std::size_t i = begin; i < end; ++i) {
            if (cell_[i] == kNobody || !chosen(i)) continue;
            chosen_.push_back(i);
            ++counts_[cell_[i]];
        }
        fresh_.assign(sizes_.size(), kNobody);
        for (const std::size_t i : chosen_) {
            const std::uint32_t cell = cell_[i];
            if (counts_[cell] == sizes_[cell] && fresh_[cell] == kNobody) continue;  // all of it: stays whole
            if (fresh_[cell] == kNobody) {
                fresh_[cell] = static_cast<std::uint32_t>(sizes_.size());
                sizes_.push_back(0);
            }
            cell_[i] = fresh_[cell];
            ++sizes_[cell_[i]];
            --sizes_[cell];
        }
    }

private:
    std::vector<std::uint32_t> cell_, counts_, fresh_;
    std::vector<std::size_t> chosen_;
    std::vector<std::size_t> sizes_;
};

}  // namespace

std::vector<bool> RelationTable::make(std::span<const InterestTerms> terms, std::span<const InterestSides> sides,
                                      std::span<const InterestItem> items, std::size_t maxGroups) {
    sides_.assign(sides.begin(), sides.end());
    // Where the groups become too many the last interests go, and with them items that nobody else speaks of.
    for (;;) {
        findOtherSides();
        const std::size_t fitting = findGroups(items, maxGroups);
        if (fitting == sides_.size()) break;
        sides_.resize(fitting);
    }
    terms_.assign(terms.begin(), terms.begin() + static_cast<std::ptrdiff_t>(sides_.size()));
    relateGroups();
    asked_.clear();
    askedNumbers_.reset(0);

    std::vector<bool> takesPart(items.size(), false);
    for (std::size_t i = 0; i < items.size(); ++i) {
        if (groupOfItem_[i] == kNobody) continue;
        takesPart[i] = true;
        interactions_.groupOf.push_back(groupOfItem_[i]);
    }
    return takesPart;
}

void RelationTable::refresh(std::span<const InterestTerms> terms) {
    terms_.assign(terms.begin(), terms.end());
    for (Asked& asked : asked_) sumUp(asked);
}

/// Most interests are against the same: everything.
void RelationTable::findOtherSides() {
    otherSides_.clear();
    otherSideOf_.assign(sides_.size(), kNobody);
    std::map<std::tuple<std::uint32_t, std::uint32_t, std::int64_t>, std::uint32_t> known;
    for (std::size_t k = 0; k < sides_.size(); ++k) {
        const InterestSides& s = sides_[k];
        if (!s.awake) continue;
        const auto next = static_cast<std::uint32_t>(otherSides_.size());
        const auto [side, isNew] = known.emplace(std::tuple(s.against.begin, s.against.end, s.againstLayers), next);
        if (isNew) otherSides_.push_back({s.against, s.againstLayers, {}});
        otherSideOf_[k] = side->second;
    }
}

/// Divides the items by each interest in turn. Returns how many interests fit: all, or those before the first that does
/// not.
std::size_t RelationTable::findGroups(std::span<const InterestItem> items, std::size_t maxGroups) {
    // Items between the same ends of sides are alike to all interests, so one of each kind is enough.
    std::vector<std::uint32_t> ends;
    for (const InterestSides& s : sides_)
        if (s.awake) ends.insert(ends.end(), {s.object.begin, s.object.end, s.against.begin, s.against.end});
    std::sort(ends.begin(), ends.end());
    ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
    const auto between = [&](std::uint32_t place) {
        return static_cast<std::uint32_t>(std::upper_bound(ends.begin(), ends.end(), place) - ends.begin());
    };
    using Likeness = std::tuple<std::uint32_t, std::uint32_t, std::uint32_t, std::int64_t>;
    std::map<Likeness, std::uint32_t> known;
    std::vector<std::uint32_t> kindOf(items.size());
    std::vector<InterestItem> kinds;  // ascending by place
    Likeness last{};
    for (std::size_t i = 0; i < items.size(); ++i) {
        const InterestItem& item = items[i];
        const Likeness likeness{between(item.place), item.object ? between(item.body) + 1 : 0,
                                item.alone ? item.body + 1 : 0, item.layers};
        if (i > 0 && likeness == last) {
            kindOf[i] = kindOf[i - 1];
            continue;
        }
        last = likeness;
        const auto [kind, isNew] = known.emplace(likeness, static_cast<std::uint32_t>(kinds.size()));
        if (isNew) kinds.push_back(item);
        kindOf[i] = kind->second;
    }
    const auto within = [&](const InterestSides::Range& range) {
        const auto at = [&](std::uint32_t place) {
            const auto it = std::lower_bound(kinds.begin(), kinds.end(), place,
                                             [](const InterestItem& item, std::uint32_t p) { return item.place < p; });
            return static_cast<std::size_t>(it - kinds.begin());
        };
        return std::pair(at(range.begin), at(range.end));
    };

    std::vector<bool> takesPart(kinds.size(), false), asked(otherSides_.size(), false);
    for (std::size_t k = 0; k < sides_.size(); ++k) {
        if (!sides_[k].awake || sides_[k].ignores) continue;
        asked[otherSideOf_[k]] = true;
        const auto [first, end] = within(sides_[k].object);
        for (std::size_t c = first; c < end; ++c) takesPart[c] = takesPart[c] || onObjectSide(kinds[c], sides_[k]);
    }
    for (std::size_t s = 0; s < otherSides_.size(); ++s)
        for (std::size_t c = 0; asked[s] && c < kinds.size(); ++c)
            takesPart[c] = takesPart[c] || otherSides_[s].holds(kinds[c]);

    Partition partition(takesPart);
    std::map<std::uint32_t, std::vector<std::size_t>> alone;
    for (std::size_t c = 0; c < kinds.size(); ++c)
        if (kinds[c].alone) alone[kinds[c].body].push_back(c);
    for (const auto& entry : alone) {
        const std::vector<std::size_t>& own = entry.second;
        partition.divide(own.front(), own.back() + 1,
                         [&](std::size_t c) { return kinds[c].alone && kinds[c].body == entry.first; });
    }
    std::vector<bool> divided(otherSides_.size(), false);
    for (std::size_t k = 0; k < sides_.size(); ++k) {
        if (partition.cells() > maxGroups) return k == 0 ? 0 : k - 1;
        if (!sides_[k].awake) continue;
        const auto [first, end] = within(sides_[k].object);
        partition.divide(first, end, [&](std::size_t c) { return onObjectSide(kinds[c], sides_[k]); });
        if (divided[otherSideOf_[k]]) continue;
        divided[otherSideOf_[k]] = true;
        const OtherSide& side = otherSides_[otherSideOf_[k]];
        const auto [from, to] = within(side.range);
        partition.divide(from, to, [&](std::size_t c) { return side.holds(kinds[c]); });
    }
    if (partition.cells() > maxGroups) return sides_.empty() ? 0 : sides_.size() - 1;

    // Numbered as they first come up.
    std::vector<std::uint32_t> number(partition.cells(), kNobody);
    groups_.clear();
    groupOfItem_.assign(items.size(), kNobody);
    for (std::size_t i = 0; i < items.size(); ++i) {
        const std::uint32_t cell = partition.cellOf(kindOf[i]);
        if (cell == kNobody) continue;
        if (number[cell] == kNobody) {
            number[cell] = static_cast<std::uint32_t>(groups_.size());
            groups_.push_back({items[i], false, {}});
        }
        Group& group = groups_[number[cell]];
        group.manyBodies = group.manyBodies || items[i].body != group.example.body;
        groupOfItem_[i] = number[cell];
    }
    return sides_.size();
}

/// Which groups interact, with the lists that relations are made of.
void RelationTable::relateGroups() {
    const auto n = static_cast<std::uint32_t>(groups_.size());
    for (OtherSide& side : otherSides_) {
        side.reaches.resize(n);
        for (std::uint32_t g = 0; g < n; ++g) side.reaches[g] = side.holds(groups_[g].example);
    }
    interactions_ = {};
    interactions_.active.assign(n, false);
    interactions_.interacts.assign(std::size_t{n} * n, false);
    // Groups are numbered in the order of their first items, so those in a range of places are nearly a range too.
    const auto forObjects = [&](std::uint32_t k, auto&& visit) {
        const auto before = [](const Group& group, std::uint32_t place) { return group.example.place < place; };
        auto group = std::lower_bound(groups_.begin(), groups_.end(), sides_[k].object.begin, before);
        for (; group != groups_.end() && group->example.place < sides_[k].object.end; ++group)
            if (onObjectSide(group->example, sides_[k])) visit(static_cast<std::uint32_t>(group - groups_.begin()));
    };
    const auto mark = [&](std::uint32_t k, bool value) {
        forObjects(k, [&](std::uint32_t a) {
            for (std::uint32_t b = 0; b < n; ++b)
                if (isAgainst(k, b))
                    interactions_.interacts[std::size_t{a} * n + b] = interactions_.interacts[std::size_t{b} * n + a] =
                        value;
        });
    };
    for (std::uint32_t k = 0; k < sides_.size(); ++k) {
        if (!sides_[k].awake || sides_[k].ignores) continue;
        forObjects(k, [&](std::uint32_t a) {
            interactions_.active[a] = true;
            groups_[a].interests.push_back(k);
        });
        mark(k, true);
    }
    for (std::uint32_t k = 0; k < sides_.size(); ++k)
        if (sides_[k].awake && sides_[k].ignores) mark(k, false);
    // What belongs to one body never meets itself.
    for (std::uint32_t g = 0; g < n; ++g)
        if (!groups_[g].manyBodies) interactions_.interacts[std::size_t{g} * n + g] = false;
}

bool RelationTable::isAgainst(std::uint32_t interest, std::uint32_t group) const {
    if (!otherSides_[otherSideOf_[interest]].reaches[group]) return false;
    return !sides_[interest].oneObject || !sides_[interest].object.holds(groups_[group].example.place);
}

Relation RelationTable::relation(std::uint32_t a, std::uint32_t b) const {
    const std::uint32_t first = interactions_.groupOf[a], second = interactions_.groupOf[b];
    if (!interactions_.interacts[std::size_t{first} * groups_.size() + second]) return {};
    const std::uint32_t low = std::min(first, second), high = std::max(first, second);
    const GroupPair pair(((std::uint64_t{low} + 1) << 32) | high);
    std::uint32_t number = askedNumbers_.find(pair);
    if (number == decltype(askedNumbers_)::kNone) {
        number = askedNumbers_.insert(pair, static_cast<std::uint32_t>(asked_.size()));
        asked_.push_back(ask(low, high));
    }
    const Asked& asked = asked_[number];
    Relation relation = asked.relation;
    relation.firstIsObject = first == low ? asked.lowIsObject : asked.highIsObject;
    relation.interests = asked.interests;
    return relation;
}

RelationTable::Asked RelationTable::ask(std::uint32_t low, std::uint32_t high) const {
    std::vector<std::uint32_t> forth, back;
    for (const std::uint32_t k : groups_[low].interests)
        if (isAgainst(k, high)) forth.push_back(k);
    for (const std::uint32_t k : groups_[high].interests)
        if (isAgainst(k, low)) back.push_back(k);
    Asked asked;
    std::set_union(forth.begin(), forth.end(), back.begin(), back.end(), std::back_inserter(asked.interests));
    const std::uint32_t decides = asked.interests.front();
    asked.lowIsObject = !forth.empty() && forth.front() == decides;
    asked.highIsObject = !back.empty() && back.front() == decides;
    sumUp(asked);
    return asked;
}

void RelationTable::sumUp(Asked& asked) const {
    asked.relation = {};
    asked.relation.relevant = true;
    asked.relation.response = terms_[asked.interests.front()].response;
    for (const std::uint32_t k : asked.interests) add(terms_[k], asked.relation);
}

}  // namespace tessera

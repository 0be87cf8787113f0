#include "server/collision/objects/RelationTable.h"

#include <algorithm>
#include <limits>
#include <map>
#include <utility>

#include "common/cores/Group.h"

namespace tessera {

namespace {

/// More demanding, the more faces are to be listed.
std::uint64_t demand(std::int64_t detail) {
    if (detail == InterestWords::kAllFaces) return std::numeric_limits<std::uint64_t>::max();
    return detail < 0 ? 0 : static_cast<std::uint64_t>(detail);
}

/// What one more interest asks of a pair besides.
void add(const InterestTerms& terms, Relation& relation) {
    if (terms.mode == InterestWords::kDistance) {
        relation.distance = true;
        relation.threshold = std::max(relation.threshold, terms.threshold);
        return;
    }
    relation.contacts = true;
    relation.dynamic = relation.dynamic || terms.mode == InterestWords::kDynamic;
    if (demand(terms.detail) > demand(relation.detail)) relation.detail = terms.detail;
}

}  // namespace

void RelationTable::clear() {
    RelationTable fresh;
    fresh.logStart_ = version() + 1;
    fresh.nextSerial_ = nextSerial_;
    *this = std::move(fresh);
}

void RelationTable::note(std::uint32_t group) {
    log_.push_back(group);
    if (log_.size() > 1024 + 2 * groups_.size()) noteAll();
}

void RelationTable::noteAll() {
    logStart_ += log_.size() + 1;
    log_.clear();
}

/// What is still the same interest with the same sides tells groups apart as it did.
RelationTable::Renumbering RelationTable::renumber(std::span<const InterestTerms> terms,
                                                   std::span<const InterestSides> sides) const {
    Renumbering now;
    now.interests.assign(terms_.size(), kNobody);
    now.reworded.assign(terms.size(), false);
    std::vector<bool> met(terms_.size(), false);
    const auto stays = [&](std::uint32_t old, std::uint32_t k) {
        met[old] = true;
        if (sides_[old] != sides[k]) return;
        now.interests[old] = k;
        now.reworded[k] = terms_[old] != terms[k];
    };
    // Few come or go at a time; whoever stands elsewhere is looked for.
    std::vector<std::uint32_t> strays;
    std::uint32_t old = 0;
    const auto is = [&](std::uint32_t at, std::uint32_t k) {
        return at < terms_.size() && terms_[at].core == terms[k].core;
    };
    for (std::uint32_t k = 0; k < terms.size(); ++k) {
        if (!is(old, k) && is(old + 1, k)) ++old;
        if (is(old, k))
            stays(old++, k);
        else
            strays.push_back(k);
    }
    if (!strays.empty()) {
        std::unordered_map<ObjectId, std::uint32_t> before;
        for (std::uint32_t i = 0; i < terms_.size(); ++i)
            if (!met[i]) before.emplace(terms_[i].core, i);
        for (const std::uint32_t k : strays)
            if (const auto known = before.find(terms[k].core); known != before.end()) stays(known->second, k);
    }
    std::uint32_t last = 0;
    for (const std::uint32_t k : now.interests) {
        if (k == kNobody) continue;
        now.inOrder = now.inOrder && last <= k;
        last = k;
    }
    return now;
}

bool RelationTable::sameRoots(const Group& group, const SideAbove& above) const {
    std::size_t i = 0;
    for (std::uint32_t root = group.likeness.side; root != kNobody; root = above(root), ++i)
        if (i == group.roots.size() || group.roots[i] != root) return false;
    return i == group.roots.size();
}

void RelationTable::setInterests(std::span<const InterestTerms> terms, std::span<const InterestSides> sides,
                                 const SideAbove& above) {
    Renumbering now = renumber(terms, sides);
    // Where interests have come or gone, or have other sides: what is below may be on others than before.
    std::vector<std::uint32_t> roots;
    const auto changes = [&](const InterestSides& side) {
        if (side.awake) roots.insert(roots.end(), {side.object, side.against});
    };
    std::vector<bool> stays(terms.size(), false);
    for (std::uint32_t k = 0; k < sides_.size(); ++k) {
        if (now.interests[k] == kNobody)
            changes(sides_[k]);
        else
            stays[now.interests[k]] = true;
    }
    for (std::uint32_t k = 0; k < sides.size(); ++k)
        if (!stays[k]) changes(sides[k]);
    std::sort(roots.begin(), roots.end());
    roots.erase(std::unique(roots.begin(), roots.end()), roots.end());

    const std::vector<OtherSide> othersBefore = std::move(otherSides_);
    terms_.assign(terms.begin(), terms.end());
    sides_.assign(sides.begin(), sides.end());
    findOtherSides();
    std::map<std::pair<std::uint32_t, std::int64_t>, std::uint32_t> others;
    for (std::uint32_t s = 0; s < otherSides_.size(); ++s)
        others.emplace(std::pair(otherSides_[s].root, otherSides_[s].layers), s);
    now.others.assign(othersBefore.size(), kNobody);
    for (std::uint32_t s = 0; s < othersBefore.size(); ++s)
        if (const auto same = others.find({othersBefore[s].root, othersBefore[s].layers}); same != others.end())
            now.others[s] = same->second;
    const auto translate = [](std::vector<std::uint32_t>& list, const std::vector<std::uint32_t>& numbers) {
        for (std::uint32_t& number : list) number = numbers[number];
        std::sort(list.begin(), list.end());
    };
    std::vector<bool> different(groups_.size(), false);
    for (std::uint32_t g = 0; g < groups_.size(); ++g) {
        Group& group = groups_[g];
        if (group.members.empty()) continue;
        translate(group.interests, now.interests);
        translate(group.others, now.others);
        const auto changed = [&](std::uint32_t root) { return std::ranges::binary_search(roots, root); };
        if (std::ranges::any_of(group.roots, changed) || !sameRoots(group, above)) {
            const std::vector<std::uint32_t> interests = group.interests, held = group.others, before = group.roots;
            sign(group, above);
            // Whoever comes to be, or ceases to be, on an other side only meets or leaves one whose own interests
            // differ.
            const bool own = interests != group.interests || before != group.roots;
            if (own) changed_.push_back(g);
            different[g] = own || held != group.others;
            setTakesPart(g);
        }
        if (std::ranges::any_of(group.interests, [&](std::uint32_t k) { return now.reworded[k]; })) note(g);
    }
    for (std::uint32_t g = 0; g < groups_.size(); ++g)
        if (different[g]) relate(g);
    if (!now.inOrder) noteAll();
    keepAsked(now, different);
}

/// What two groups are to each other, where that is what it was but for the numbers of interests.
void RelationTable::keepAsked(const Renumbering& now, const std::vector<bool>& different) {
    const auto same = [&](std::uint32_t group, std::uint64_t serial) {
        return groups_[group].serial == serial && !groups_[group].members.empty() && !different[group];
    };
    for (auto entry = asked_.begin(); entry != asked_.end();) {
        auto& [key, asked] = *entry;
        if (!now.inOrder || !same(asked.low, key >> 32) || !same(asked.high, key & 0xffffffffu)) {
            entry = asked_.erase(entry);
            continue;
        }
        bool reworded = false;
        for (std::uint32_t& k : asked.interests) {
            k = now.interests[k];
            reworded = reworded || now.reworded[k];
        }
        if (reworded) sumUp(asked);
        ++entry;
    }
}

void RelationTable::setTerms(std::span<const InterestTerms> terms) {
    std::vector<bool> reworded(terms.size(), false);
    for (std::size_t k = 0; k < terms.size(); ++k) reworded[k] = terms_[k] != terms[k];
    terms_.assign(terms.begin(), terms.end());
    for (auto& [key, asked] : asked_) sumUp(asked);
    for (std::uint32_t g = 0; g < groups_.size(); ++g)
        if (std::ranges::any_of(groups_[g].interests, [&](std::uint32_t k) { return reworded[k]; })) note(g);
}

std::vector<std::uint32_t> RelationTable::takeChanged() {
    std::sort(changed_.begin(), changed_.end());
    changed_.erase(std::unique(changed_.begin(), changed_.end()), changed_.end());
    return std::exchange(changed_, {});
}

/// Most interests are against the same: everything.
void RelationTable::findOtherSides() {
    otherSides_.clear();
    rooted_.clear();
    otherSideOf_.assign(sides_.size(), kNobody);
    std::map<std::pair<std::uint32_t, std::int64_t>, std::uint32_t> known;
    for (std::uint32_t k = 0; k < sides_.size(); ++k) {
        const InterestSides& s = sides_[k];
        if (!s.awake) continue;
        rooted_[s.object].interests.push_back(k);
        if (s.alone) continue;
        const auto next = static_cast<std::uint32_t>(otherSides_.size());
        const auto [side, isNew] = known.emplace(std::pair(s.against, s.againstLayers), next);
        if (isNew) {
            otherSides_.push_back({s.against, s.againstLayers, false});
            rooted_[s.against].others.push_back(next);
        }
        otherSides_[side->second].asked = otherSides_[side->second].asked || !s.ignores;
        otherSideOf_[k] = side->second;
    }
}

/// Which sides hold a group.
void RelationTable::sign(Group& group, const SideAbove& above) const {
    group.roots.clear();
    group.interests.clear();
    group.others.clear();
    const Likeness& like = group.likeness;
    bool bodyToo = false;  // whether the body as a whole is at or below the root
    for (std::uint32_t root = like.side; root != kNobody; root = above(root)) {
        group.roots.push_back(root);
        bodyToo = bodyToo || (like.object && root == like.bodySide);
        const auto here = rooted_.find(root);
        if (here == rooted_.end()) continue;
        for (const std::uint32_t k : here->second.interests)
            if (sides_[k].oneObject || (bodyToo && (like.layers & sides_[k].objectLayers) != 0))
                group.interests.push_back(k);
        for (const std::uint32_t s : here->second.others)
            if ((like.layers & otherSides_[s].layers) != 0) group.others.push_back(s);
    }
    std::sort(group.interests.begin(), group.interests.end());
    std::sort(group.others.begin(), group.others.end());
}

void RelationTable::setTakesPart(std::uint32_t number) {
    Group& group = groups_[number];
    const bool takes = !group.members.empty() &&
                       (std::ranges::any_of(group.interests, [&](std::uint32_t k) { return !sides_[k].ignores; }) ||
                        std::ranges::any_of(group.others, [&](std::uint32_t s) { return otherSides_[s].asked; }));
    if (takes == group.takesPart) return;
    group.takesPart = takes;
    if (takes)
        ++taking_;
    else
        --taking_;
    changed_.push_back(number);
}

std::uint32_t RelationTable::join(const Likeness& likeness, std::uint32_t place, const SideAbove& above) {
    const auto [known, isNew] = known_.emplace(likeness, 0);
    if (isNew) {
        if (free_.empty()) makeRoom();
        const std::uint32_t number = known->second = free_.back();
        free_.pop_back();
        Group& group = groups_[number];
        group = {};
        group.likeness = likeness;
        group.serial = nextSerial_++;
        group.members.push_back(place);
        sign(group, above);
        setTakesPart(number);
        relate(number);
        return number;
    }
    groups_[known->second].members.push_back(place);
    return known->second;
}

void RelationTable::leave(std::uint32_t number, std::uint32_t member) {
    Group& group = groups_[number];
    group.members[member] = group.members.back();
    group.members.pop_back();
    if (!group.members.empty()) return;
    known_.erase(group.likeness);
    setTakesPart(number);
    group.interests.clear();
    group.others.clear();
    group.roots.clear();
    relate(number);
    free_.push_back(number);
    // Nobody will ask for what it was to others again.
    if (asked_.size() > 1024 + 16 * groups_.size()) asked_.clear();
}

/// Rows for twice as many groups.
void RelationTable::makeRoom() {
    const std::size_t before = groups_.size(), now = std::max<std::size_t>(16, 2 * before);
    groups_.resize(now);
    for (std::size_t g = now; g > before; --g) free_.push_back(static_cast<std::uint32_t>(g - 1));
    std::vector<bool> interacts(now * now, false);
    for (std::size_t a = 0; a < before; ++a)
        for (std::size_t b = 0; b < before; ++b) interacts[a * now + b] = interactions_.interacts[a * before + b];
    interactions_.interacts = std::move(interacts);
    interactions_.active.resize(now, false);
}

/// Whom a group interacts with.
void RelationTable::relate(std::uint32_t number) {
    const std::size_t stride = groups_.size();
    const Group& mine = groups_[number];
    interactions_.active[number] =
        std::ranges::any_of(mine.interests, [&](std::uint32_t k) { return !sides_[k].ignores; });
    for (std::uint32_t other = 0; other < stride; ++other) {
        const bool yes = !mine.members.empty() && !groups_[other].members.empty() && interact(mine, groups_[other]);
        interactions_.interacts[number * stride + other] = interactions_.interacts[other * stride + number] = yes;
    }
    note(number);
}

bool RelationTable::interact(const Group& a, const Group& b) const {
    bool any = false;
    for (const auto& [mine, other] : {std::pair(&a, &b), std::pair(&b, &a)})
        for (const std::uint32_t k : mine->interests) {
            if (!isAgainst(k, *other)) continue;
            if (sides_[k].ignores) return false;
            any = true;
        }
    return any;
}

bool RelationTable::isAgainst(std::uint32_t interest, const Group& group) const {
    if (!std::ranges::binary_search(group.others, otherSideOf_[interest])) return false;
    return !sides_[interest].oneObject || std::ranges::find(group.roots, sides_[interest].object) == group.roots.end();
}

void RelationTable::setPart(std::uint32_t part, std::uint32_t group, std::uint32_t body) {
    if (interactions_.groupOf.size() <= part) {
        interactions_.groupOf.resize(part + 1, kNobody);
        interactions_.bodyOf.resize(part + 1, kNobody);
    }
    interactions_.groupOf[part] = group;
    interactions_.bodyOf[part] = body;
}

void RelationTable::countBody(std::uint32_t number, std::uint32_t body, bool comes) {
    Group& group = groups_[number];
    if (group.bodies <= 2) note(number);  // one of its own, or others, may be met now
    group.bodies += comes ? 1 : ~std::uint32_t{0};
    group.bodyMix ^= body;
}

Relation RelationTable::relation(std::uint32_t first, std::uint32_t second) const {
    if (!interactions_.interacts[std::size_t{first} * groups_.size() + second]) return {};
    const Group &a = groups_[first], &b = groups_[second];
    const std::uint32_t low = std::min(a.serial, b.serial), high = std::max(a.serial, b.serial);
    const std::uint64_t key = std::uint64_t{low} << 32 | high;
    auto known = asked_.find(key);
    if (known == asked_.end()) {
        known = asked_.emplace(key, a.serial == low ? ask(a, b) : ask(b, a)).first;
        known->second.low = a.serial == low ? first : second;
        known->second.high = a.serial == low ? second : first;
    }
    const Asked& asked = known->second;
    Relation relation = asked.relation;
    relation.firstIsObject = a.serial == low ? asked.lowIsObject : asked.highIsObject;
    relation.interests = asked.interests;
    return relation;
}

std::optional<RelationTable::Pairing> RelationTable::pairing(std::uint32_t group, std::uint32_t other) const {
    const Group &a = groups_[group], &b = groups_[other];
    if (!interactions_.interacts[std::size_t{group} * groups_.size() + other] || !meet(a, b, group == other))
        return std::nullopt;
    Pairing out;
    std::uint32_t decides = kNobody;
    for (const auto& [mine, theirs] : {std::pair(&a, &b), std::pair(&b, &a)})
        for (const std::uint32_t k : mine->interests) {
            if (!isAgainst(k, *theirs)) continue;
            decides = std::min(decides, k);
            out.dynamic = out.dynamic || terms_[k].mode == InterestWords::kDynamic;
        }
    out.response = terms_[decides].response;
    return out;
}

RelationTable::Asked RelationTable::ask(const Group& low, const Group& high) const {
    std::vector<std::uint32_t> forth, back;
    for (const std::uint32_t k : low.interests)
        if (isAgainst(k, high)) forth.push_back(k);
    for (const std::uint32_t k : high.interests)
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

#include "server/collision/pipeline/EventBook.h"

#include <algorithm>
#include <utility>

namespace tessera {
namespace {

using Key = EventBook::Key;

template <typename Entry>
Key keyOf(const Entry& e) {
    return {e.interest, e.objectA, e.objectB};
}

PairEvent plainEvent(const Key& key, Phase phase) {
    PairEvent event;
    std::tie(event.interest, event.objectA, event.objectB) = key;
    event.phase = phase;
    return event;
}

/// Two ascending lists as one; of two entries with one key that of `special`. `plain(entry)` makes an entry of the
/// rest.
template <typename Entry, typename Rest, typename Plain>
std::vector<Entry> merged(const Rest& rest, const std::vector<Entry>& special, std::size_t most, const Plain& plain) {
    std::vector<Entry> out;
    out.reserve(std::min(most, rest.size() + special.size()));
    auto next = special.begin();
    for (const auto& entry : rest) {
        for (; next != special.end() && keyOf(*next) < entry.first && out.size() < most; ++next) out.push_back(*next);
        if (out.size() == most) return out;
        if (next != special.end() && keyOf(*next) == entry.first)
            out.push_back(*next++);
        else
            out.push_back(plain(entry));
    }
    for (; next != special.end() && out.size() < most; ++next) out.push_back(*next);
    return out;
}

template <typename Entry>
std::vector<Entry> changesOf(const std::vector<Entry>& all) {
    std::vector<Entry> out;
    for (const Entry& entry : all)
        if (entry.phase != Phase::kStays) out.push_back(entry);
    return out;
}

}  // namespace

void EventBook::rests(std::uint32_t pair, std::vector<Key> touching, std::vector<PairDistance> near) {
    if (ofPair_.size() <= pair) ofPair_.resize(pair + 1);
    OfPair& mine = ofPair_[pair];
    if (mine.touching != touching) {
        for (const Key& key : mine.touching) {
            const auto known = resting_.find(key);
            restedBefore_.try_emplace(key, true);
            if (--known->second == 0) resting_.erase(known);
        }
        for (const Key& key : touching) {
            const auto [known, isNew] = resting_.try_emplace(key, 0);
            restedBefore_.try_emplace(key, !isNew);
            ++known->second;
        }
        mine.touching = std::move(touching);
    }
    if (mine.near.empty() && near.empty()) return;
    for (const Key& key : mine.near) {
        const auto known = nearOf_.find(key);
        std::erase_if(known->second, [&](const NearPair& entry) { return entry.pair == pair; });
        if (known->second.empty()) nearOf_.erase(known);
        nearChanged_.insert(key);
    }
    mine.near.clear();
    for (PairDistance& distance : near) {
        const Key key = keyOf(distance);
        mine.near.push_back(key);
        nearChanged_.insert(key);
        nearOf_[key].push_back({pair, std::move(distance)});
    }
}

void EventBook::takeOutAll() {
    for (const auto& [key, pairs] : resting_) restedBefore_.try_emplace(key, true);
    for (const auto& [key, pairs] : nearOf_) nearChanged_.insert(key);
    resting_.clear();
    nearOf_.clear();
    ofPair_.clear();
}

EventBook::Page EventBook::turnPage(std::span<const Touching> besides, const Before& before, std::size_t most) {
    Page page;
    turnEvents(besides, page);
    turnDistances(before, page);
    if (page.events > most) page.eventChanges = changesOf(events(most));
    if (page.distances > most) {
        const std::vector<PairDistance> listed = distances(most);
        page.distanceChanges = changesOf(listed);
        page.near = DistanceList::nearOf(listed);
    }
    for (std::size_t* count : {&page.events, &page.distances}) {
        page.leftOut += *count - std::min(*count, most);
        *count = std::min(*count, most);
    }
    return page;
}

void EventBook::turnEvents(std::span<const Touching> besides, Page& page) {
    Besides now;
    for (const Touching& entry : besides) {
        const auto [known, isNew] = now.try_emplace(keyOf(entry.event), entry);
        if (isNew) continue;
        const bool atEnd = known->second.atEnd || entry.atEnd;
        if (entry.event.firstTime < known->second.event.firstTime) known->second = entry;
        known->second.atEnd = atEnd;
    }
    std::vector<Key> keys;
    for (const auto& [key, rested] : restedBefore_) keys.push_back(key);
    for (const Besides* some : {&std::as_const(besides_), &std::as_const(now)})
        for (const auto& [key, entry] : *some) keys.push_back(key);
    std::ranges::sort(keys);
    keys.erase(std::unique(keys.begin(), keys.end()), keys.end());

    special_.clear();
    page.events = resting_.size();
    for (const Key& key : keys) {
        const bool rests = resting_.contains(key);
        const auto came = restedBefore_.find(key);
        const auto old = besides_.find(key);
        const auto entry = now.find(key);
        const bool rested = came == restedBefore_.end() ? rests : came->second;
        const bool touches = rests || (entry != now.end() && entry->second.atEnd);
        const bool touched = rested || (old != besides_.end() && old->second.atEnd);
        const auto told = [&](const auto& where, const Besides& in, Phase phase) {
            PairEvent event = where == in.end() ? plainEvent(key, phase) : where->second.event;
            event.phase = phase;
            special_.push_back(event);
        };
        page.events -= rests;
        if (touches) {
            told(entry, now, touched ? Phase::kStays : Phase::kBegan);
        } else if (touched) {
            told(old, besides_, Phase::kEnded);
        } else if (entry != now.end()) {
            told(entry, now, Phase::kEnded);
            special_.back().through = true;
        }
    }
    page.events += special_.size();
    page.eventChanges = changesOf(special_);
    restedBefore_.clear();
    besides_ = std::move(now);
}

void EventBook::turnDistances(const Before& before, Page& page) {
    specialNear_.clear();
    std::size_t ended = 0;
    for (const Key& key : nearChanged_) {
        const auto told = near_.find(key);
        const auto pairs = nearOf_.find(key);
        if (told != near_.end()) leastFirst_.erase(leastFirst_.find(told->second.distance));
        if (pairs == nearOf_.end()) {
            if (told == near_.end()) continue;
            specialNear_.push_back(told->second);
            specialNear_.back().phase = Phase::kEnded;
            near_.erase(told);
            ++ended;
            continue;
        }
        const NearPair& nearest = *std::ranges::min_element(pairs->second, [&](const NearPair& x, const NearPair& y) {
            return x.distance.distance != y.distance.distance ? x.distance.distance < y.distance.distance
                                                              : before(x.pair, y.pair);
        });
        PairDistance now = nearest.distance;
        leastFirst_.insert(now.distance);
        if (told == near_.end()) {
            now.phase = Phase::kBegan;
            specialNear_.push_back(now);
        }
        now.phase = Phase::kStays;
        near_.insert_or_assign(key, now);
    }
    nearChanged_.clear();
    page.distances = near_.size() + ended;
    page.distanceChanges = specialNear_;
    page.near = {near_.size(), leastFirst_.empty() ? 0 : *leastFirst_.begin()};
}

std::vector<PairEvent> EventBook::events(std::size_t most) const {
    return merged(resting_, special_, most, [](const auto& entry) { return plainEvent(entry.first, Phase::kStays); });
}

std::vector<PairDistance> EventBook::distances(std::size_t most) const {
    return merged(near_, specialNear_, most, [](const auto& entry) { return entry.second; });
}

}  // namespace tessera

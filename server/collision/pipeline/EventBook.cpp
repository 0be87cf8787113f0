#include "server/collision/pipeline/EventBook.h"

#include <algorithm>
#include <tuple>

namespace tessera {
namespace {

template <typename Entry>
auto keyOf(const Entry& e) {
    return std::tie(e.interest, e.objectA, e.objectB);
}

template <typename Entry>
void tell(Entry entry, Phase phase, std::vector<Entry>& out, std::size_t most, std::size_t& leftOut) {
    entry.phase = phase;
    if (out.size() < most)
        out.push_back(std::move(entry));
    else
        ++leftOut;
}

/// Walks two ascending lists of entries with unique keys: ended(old), began(new), stays(new).
template <typename Entry, typename Ended, typename Began, typename Stays>
void compare(const std::vector<Entry>& before, const std::vector<Entry>& now, Ended ended, Began began, Stays stays) {
    auto old = before.begin();
    for (const Entry& entry : now) {
        for (; old != before.end() && keyOf(*old) < keyOf(entry); ++old) ended(*old);
        if (old != before.end() && keyOf(*old) == keyOf(entry)) {
            stays(entry);
            ++old;
        } else {
            began(entry);
        }
    }
    for (; old != before.end(); ++old) ended(*old);
}

}  // namespace

std::size_t EventBook::turnPage(std::vector<Touching> touching, std::vector<Near> near, std::size_t most,
                                StepResult& result) {
    std::size_t leftOut = 0;

    // Of one pair: whether it touches at the end, and its earliest contact.
    std::ranges::stable_sort(touching, [](const Touching& x, const Touching& y) {
        return std::tuple(keyOf(x.event), x.event.firstTime) < std::tuple(keyOf(y.event), y.event.firstTime);
    });
    std::vector<PairEvent> now, throughs;
    for (std::size_t begin = 0, end = 0; begin < touching.size(); begin = end) {
        bool atEnd = false;
        for (end = begin; end < touching.size() && keyOf(touching[end].event) == keyOf(touching[begin].event); ++end)
            atEnd = atEnd || touching[end].atEnd;
        (atEnd ? now : throughs).push_back(touching[begin].event);
    }
    std::vector<PairEvent> told;
    std::size_t none = 0;
    const std::size_t all = touching.size() + touching_.size();
    compare(
        touching_, now, [&](const PairEvent& e) { tell(e, Phase::kEnded, told, all, none); },
        [&](const PairEvent& e) { tell(e, Phase::kBegan, told, all, none); },
        [&](const PairEvent& e) { tell(e, Phase::kStays, told, all, none); });
    for (PairEvent& event : throughs) {
        event.through = true;
        event.phase = Phase::kEnded;
        const auto place =
            std::ranges::lower_bound(told, keyOf(event), {}, [](const PairEvent& e) { return keyOf(e); });
        // One that touched in the last frame and parts in this one has an end already.
        if (place == told.end() || keyOf(*place) != keyOf(event)) told.insert(place, event);
    }
    leftOut += told.size() - std::min(told.size(), most);
    told.resize(std::min(told.size(), most));
    result.events = std::move(told);
    touching_ = std::move(now);

    std::ranges::stable_sort(near, [](const Near& x, const Near& y) {
        return std::tuple(keyOf(x.distance), x.distance.distance) < std::tuple(keyOf(y.distance), y.distance.distance);
    });
    std::vector<PairDistance> nearNow;
    for (Near& entry : near)
        if (nearNow.empty() || keyOf(nearNow.back()) != keyOf(entry.distance))
            nearNow.push_back(std::move(entry.distance));
    compare(
        near_, nearNow, [&](const PairDistance& d) { tell(d, Phase::kEnded, result.distances, most, leftOut); },
        [&](const PairDistance& d) { tell(d, Phase::kBegan, result.distances, most, leftOut); },
        [&](const PairDistance& d) { tell(d, Phase::kStays, result.distances, most, leftOut); });
    near_ = std::move(nearNow);
    return leftOut;
}

}  // namespace tessera

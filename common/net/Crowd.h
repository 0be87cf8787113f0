/// Those who have connected and not said yet who they are, and who of them goes so that others may come.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <optional>
#include <utility>

#include "common/base/Clock.h"
#include "common/base/SourceRows.h"

namespace tessera {

/// From the most crowded address first. Where that one has more than `kCrowd`, whoever comes from one with fewer finds
/// room at once. Else nobody goes before it has had `patience` to speak, as a peer whose machine is busy would lose its
/// place to a thousand that connect and say nothing. In a crowd, too: each that gives way lets another in, and with a
/// quarter of it ten thousand that dial again took a whole core of the frame thread (tests/drill, crowd-port). One
/// owner.
template <typename T>
class Crowd {
    struct Entry {
        TimePoint since;
        T who;
        int again = 0;  ///< how often its time has begun anew
    };

public:
    using Place = typename SourceRows<Entry>::Place;
    static constexpr std::size_t kCrowd = 8;
    static constexpr int kAgain = 3;  ///< more than a handshake has steps

    explicit Crowd(std::chrono::milliseconds patience) : patience_(patience) {}

    /// It has just come.
    Place add(SourceAddress from, T who, TimePoint now) {
        return rows_.add(from, {.since = now, .who = std::move(who)});
    }
    /// It has said who it is, or is gone.
    void remove(const Place& place) { rows_.remove(place); }
    /// It has waited for us, and its time begins anew. At most kAgain times: who sends a handshake byte by byte would
    /// hold its place as long as it likes.
    void beginAgain(const Place& place, TimePoint now) {
        if (place->again++ < kAgain) renew(place, now);
    }
    [[nodiscard]] bool empty() const { return rows_.empty(); }
    [[nodiscard]] std::size_t size() const { return rows_.size(); }

    /// Who goes so that one from there may come; none: nobody before `due`. `waitsForUs`: whether one of them has said
    /// something that we have not come to. Not when it is empty.
    template <typename F>
    [[nodiscard]] std::optional<T> givesWayTo(SourceAddress newcomer, TimePoint now, const F& waitsForUs) {
        const SourceAddress crowded = rows_.mostCrowded();
        const std::size_t count = rows_.countOf(crowded);
        if (std::optional<T> who = givesWay(now, waitsForUs)) return who;
        if (count <= kCrowd || count <= rows_.countOf(newcomer) + 1) return std::nullopt;
        return rows_.newestOf(crowded)->who;
    }
    /// Whose time is over, of the most crowded address or else of any; none: nobody before `due`. Not when it is empty.
    template <typename F>
    [[nodiscard]] std::optional<T> givesWay(TimePoint now, const F& waitsForUs) {
        for (const Place& place : {rows_.oldestOf(rows_.mostCrowded()), rows_.oldest()}) {
            if (endOf(place) > now) continue;
            if (!waitsForUs(place->who)) return place->who;
            renew(place, now);
        }
        return std::nullopt;
    }
    /// When the next one will have had its time. Not when it is empty.
    [[nodiscard]] TimePoint due() {
        return std::min(endOf(rows_.oldestOf(rows_.mostCrowded())), endOf(rows_.oldest()));
    }

private:
    void renew(const Place& place, TimePoint now) {
        place->since = now;
        rows_.moveToEnd(place);
    }
    [[nodiscard]] TimePoint endOf(const Place& place) const { return place->since + patience_; }

    std::chrono::milliseconds patience_;
    SourceRows<Entry> rows_;
};

}  // namespace tessera

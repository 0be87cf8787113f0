/// Things in the order in which they came, in a row for each address that they came from.
#pragma once

#include <cstddef>
#include <cstdint>
#include <iterator>
#include <list>
#include <map>
#include <unordered_map>
#include <utility>

#include "common/base/SourceAddress.h"

namespace tessera {

/// Each operation takes a time that grows with the logarithm of how many things there are. One owner; references stay
/// until their thing is removed.
template <typename T>
class SourceRows {
    struct Item {
        T thing;
        std::uint64_t number;  ///< in the order in which they came
    };

public:
    /// Of one thing, until it is removed.
    struct Place {
        SourceAddress from;
        typename std::list<Item>::iterator at;
        [[nodiscard]] T& operator*() const { return at->thing; }
        [[nodiscard]] T* operator->() const { return &at->thing; }
    };

    /// At the end of its row.
    Place add(SourceAddress from, T thing) {
        Row& row = rows_[from];
        if (row.things.empty()) row.turn = turns_.insert(turns_.end(), from);
        leaveOrder(row);
        row.things.push_back({std::move(thing), ++last_});
        const Place place{from, std::prev(row.things.end())};
        byAge_.emplace(last_, place);
        enterOrder(from, row);
        return place;
    }
    T remove(const Place& place) {
        const auto found = rows_.find(place.from);
        Row& row = found->second;
        T thing = std::move(*place);
        leaveOrder(row);
        byAge_.erase(place.at->number);
        row.things.erase(place.at);
        enterOrder(place.from, row);
        if (row.things.empty()) {
            turns_.erase(row.turn);
            rows_.erase(found);
        }
        return thing;
    }
    /// As if it had come now.
    void moveToEnd(const Place& place) {
        Row& row = rows_.at(place.from);
        leaveOrder(row);
        byAge_.erase(place.at->number);
        row.things.splice(row.things.end(), row.things, place.at);
        place.at->number = ++last_;
        byAge_.emplace(last_, place);
        enterOrder(place.from, row);
    }

    [[nodiscard]] std::size_t size() const { return byAge_.size(); }
    [[nodiscard]] bool empty() const { return byAge_.empty(); }
    [[nodiscard]] std::size_t countOf(SourceAddress from) const {
        const auto found = rows_.find(from);
        return found == rows_.end() ? 0 : found->second.things.size();
    }
    /// The address with the most things; of several the one whose oldest came first. Not when it is empty.
    [[nodiscard]] SourceAddress mostCrowded() const { return bySize_.begin()->second; }
    /// Of an address with things.
    [[nodiscard]] Place oldestOf(SourceAddress from) { return {from, rows_.at(from).things.begin()}; }
    [[nodiscard]] Place newestOf(SourceAddress from) { return {from, std::prev(rows_.at(from).things.end())}; }
    /// Of all. Not when it is empty.
    [[nodiscard]] Place oldest() const { return byAge_.begin()->second; }

    /// Whose turn it is: addresses take turns, whatever they bring. Not when it is empty.
    [[nodiscard]] SourceAddress turn() const { return turns_.front(); }
    /// That one's oldest; it is another one's turn then.
    T takeTurn() {
        const SourceAddress from = turn();
        turns_.splice(turns_.end(), turns_, turns_.begin());
        return remove(oldestOf(from));
    }
    /// The oldest of the most crowded address: who has come just now may have something to say.
    T takeOldestOfCrowd() { return remove(oldestOf(mostCrowded())); }

private:
    struct Row {
        std::list<Item> things;
        std::list<SourceAddress>::iterator turn;
    };
    /// The most first, and of as many the oldest.
    using Order = std::pair<std::size_t, std::uint64_t>;
    static Order orderOf(const Row& row) { return {~row.things.size(), row.things.front().number}; }
    void leaveOrder(const Row& row) {
        if (!row.things.empty()) bySize_.erase(orderOf(row));
    }
    void enterOrder(SourceAddress from, const Row& row) {
        if (!row.things.empty()) bySize_.emplace(orderOf(row), from);
    }

    std::unordered_map<SourceAddress, Row> rows_;
    std::map<Order, SourceAddress> bySize_;
    std::map<std::uint64_t, Place> byAge_;
    std::list<SourceAddress> turns_;  ///< addresses with things
    std::uint64_t last_ = 0;
};

}  // namespace tessera

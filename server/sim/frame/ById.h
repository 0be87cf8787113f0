/// Values of objects, found by id and gone through in the order of ids: what a frame says of Transforms.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "common/change/Value.h"

namespace tessera {

/// Empties it. Its room stays for as many again, unless it was far too large: one frame that moves everything holds no
/// memory for good.
template <typename T>
void clearButKeepRoom(std::vector<T>& values) {
    const bool tooLarge = values.capacity() > 1024 && values.size() < values.capacity() / 16;
    values.clear();
    if (tooLarge) values.shrink_to_fit();
}

/// A row of values and a table of their places. An id that is added or found costs a look into the table; ids that come
/// in ascending order, as those of a list mostly do, are never sorted. One thread at a time.
template <typename T>
class ById {
public:
    using Row = std::pair<ObjectId, T>;

    [[nodiscard]] bool empty() const { return rows_.empty(); }
    [[nodiscard]] std::size_t size() const { return rows_.size(); }

    struct Added {
        T& value;  ///< until the next one is added
        bool isNew;
    };
    /// The value of an id; a fresh one where there was none.
    Added add(ObjectId id) {
        if (2 * (rows_.size() + 1) > places_.size()) enterAll(std::max<std::size_t>(16, 4 * places_.size()));
        std::uint32_t& place = placeOf(id);
        const bool isNew = place == 0;
        if (isNew) {
            ascending_ = ascending_ && (rows_.empty() || rows_.back().first < id);
            rows_.emplace_back(id, T());
            place = static_cast<std::uint32_t>(rows_.size());
        }
        return {rows_[place - 1].second, isNew};
    }
    /// Null where there is none.
    [[nodiscard]] const T* find(ObjectId id) const {
        const std::uint32_t place = rows_.empty() ? 0 : placeOf(id);
        return place == 0 ? nullptr : &rows_[place - 1].second;
    }
    /// Costs a look at each of them.
    template <typename Gone>
    void eraseIf(Gone&& gone) {
        if (std::erase_if(rows_, [&](const Row& row) { return gone(row.first); }) > 0) enterAll(places_.size());
    }

    /// Nothing is left. Costs what was there, or has been shortly before.
    void clear() {
        const bool tooLarge = places_.size() > 1024 && rows_.size() < places_.size() / 64;
        clearButKeepRoom(rows_);
        if (tooLarge)
            places_ = {};
        else
            std::ranges::fill(places_, 0);
        ascending_ = true;
    }
    /// All of them by ascending id, until the next one is added.
    [[nodiscard]] const std::vector<Row>& ascending() {
        sort();
        return rows_;
    }
    /// The same, and none is left here.
    [[nodiscard]] std::vector<Row> take() {
        sort();
        places_.clear();
        return std::exchange(rows_, {});
    }

private:
    /// The place of an id, or the one where it would be noted.
    [[nodiscard]] const std::uint32_t& placeOf(ObjectId id) const {
        std::size_t i = static_cast<std::size_t>((id.value * 0x9E3779B97F4A7C15ull) >> 32) & (places_.size() - 1);
        while (places_[i] != 0 && rows_[places_[i] - 1].first != id) i = (i + 1) & (places_.size() - 1);
        return places_[i];
    }
    [[nodiscard]] std::uint32_t& placeOf(ObjectId id) {
        return const_cast<std::uint32_t&>(std::as_const(*this).placeOf(id));
    }
    void enterAll(std::size_t places) {
        places_.assign(places, 0);
        for (std::size_t i = 0; i < rows_.size(); ++i) placeOf(rows_[i].first) = static_cast<std::uint32_t>(i + 1);
    }
    void sort() {
        if (ascending_) return;
        std::ranges::sort(rows_, {}, &Row::first);
        enterAll(places_.size());
        ascending_ = true;
    }

    std::vector<Row> rows_;
    std::vector<std::uint32_t>
        places_;  ///< in `rows_`, from 1; 0: none. Open addressing, a power of two, at most half full
    bool ascending_ = true;
};

}  // namespace tessera

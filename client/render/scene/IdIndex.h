/// Object id → a number, for tables that hold something per object.
#pragma once

#include <cstdint>
#include <vector>

#include "common/change/Value.h"

namespace tessera {

/// Open addressing with linear probing. Ids that follow each other lie side by side, since ids are mostly given, and
/// asked for, in runs.
class IdIndex {
public:
    static constexpr std::uint32_t kNone = 0xffffffffu;

    [[nodiscard]] std::uint32_t find(ObjectId id) const {
        if (entries_.empty()) return kNone;
        for (std::size_t i = home(id);; i = next(i)) {
            if (entries_[i].id == id) return entries_[i].number;
            if (!entries_[i].id) return kNone;
        }
    }
    [[nodiscard]] bool contains(ObjectId id) const { return find(id) != kNone; }

    /// Replaces the number of an id that is there. The id must not be "none".
    void set(ObjectId id, std::uint32_t number) {
        if (3 * (size_ + 1) > 2 * entries_.size()) grow();
        std::size_t i = home(id);
        while (entries_[i].id && entries_[i].id != id) i = next(i);
        size_ += entries_[i].id ? 0 : 1;
        entries_[i] = {id, number};
    }

    void erase(ObjectId id) {
        if (entries_.empty()) return;
        std::size_t hole = home(id);
        while (entries_[hole].id != id) {
            if (!entries_[hole].id) return;
            hole = next(hole);
        }
        --size_;
        // What was pushed on by the one that goes moves up: no look-up may meet a gap before it.
        for (std::size_t i = next(hole); entries_[i].id; i = next(i)) {
            const std::size_t wanted = home(entries_[i].id);
            if (((i - wanted) & mask()) < ((i - hole) & mask())) continue;
            entries_[hole] = entries_[i];
            hole = i;
        }
        entries_[hole] = {};
    }

    /// Room for so many.
    void reserve(std::size_t count) {
        while (3 * (count + 1) > 2 * entries_.size()) grow();
    }
    void clear() {
        entries_.clear();
        size_ = 0;
    }
    [[nodiscard]] std::size_t size() const { return size_; }

private:
    static constexpr std::uint64_t kRun = 8;

    struct Entry {
        ObjectId id;
        std::uint32_t number = 0;
    };

    [[nodiscard]] std::size_t mask() const { return entries_.size() - 1; }
    [[nodiscard]] std::size_t next(std::size_t i) const { return (i + 1) & mask(); }
    [[nodiscard]] std::size_t home(ObjectId id) const {
        const std::uint64_t run = (id.value / kRun) * 0x9E3779B97F4A7C15ull;
        return ((run ^ run >> 32) * kRun + id.value % kRun) & mask();
    }
    void grow() {
        std::vector<Entry> before = std::move(entries_);
        entries_.assign(before.empty() ? 16 : 2 * before.size(), {});
        size_ = 0;
        for (const Entry& entry : before)
            if (entry.id) set(entry.id, entry.number);
    }

    std::vector<Entry> entries_;  ///< a power of two
    std::size_t size_ = 0;
};

}  // namespace tessera

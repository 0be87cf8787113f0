/// From ids to small numbers.
#pragma once

#include <cstdint>
#include <vector>

#include "common/change/Value.h"

namespace tessera {

/// Open addressing in one array, for tables that are asked often: an update asks for every id of its list.
template <typename Id>
class BasicIdTable {
public:
    static constexpr std::uint32_t kNone = 0xffffffffu;

    /// Forgets everything; there is room for `expected` ids without growing.
    void reset(std::size_t expected) {
        std::size_t capacity = 16;
        while (capacity < 2 * expected) capacity *= 2;
        entries_.assign(capacity, {});
        size_ = 0;
    }
    /// Keeps `value` where the id (not none) has no number yet; the number that it has now.
    std::uint32_t insert(Id id, std::uint32_t value) {
        if (2 * (size_ + 1) > entries_.size()) grow();
        Entry& entry = entries_[slotOf(id)];
        if (!entry.id) {
            entry = {id, value};
            ++size_;
        }
        return entry.value;
    }
    /// Replaces the number of a known id; false where it is not known.
    bool replace(Id id, std::uint32_t value) {
        if (entries_.empty() || !id) return false;
        Entry& entry = entries_[slotOf(id)];
        if (!entry.id) return false;
        entry.value = value;
        return true;
    }
    /// Nothing where the id is not known.
    void erase(Id id) {
        if (entries_.empty() || !id) return;
        std::size_t hole = slotOf(id);
        if (!entries_[hole].id) return;
        --size_;
        // What was pushed on by the one that goes moves up, so that no search ends before it.
        const std::size_t mask = entries_.size() - 1;
        for (std::size_t at = (hole + 1) & mask; entries_[at].id; at = (at + 1) & mask) {
            if (((at - homeOf(entries_[at].id)) & mask) < ((at - hole) & mask)) continue;
            entries_[hole] = entries_[at];
            hole = at;
        }
        entries_[hole] = {};
    }
    [[nodiscard]] std::uint32_t find(Id id) const {
        if (entries_.empty() || !id) return kNone;
        const Entry& entry = entries_[slotOf(id)];
        return entry.id ? entry.value : kNone;
    }
    [[nodiscard]] std::size_t size() const { return size_; }

private:
    struct Entry {
        Id id;
        std::uint32_t value = kNone;
    };

    /// Fibonacci hashing (Knuth, TAOCP 6.4): ids come in runs and strides, and it spreads both.
    [[nodiscard]] std::size_t homeOf(Id id) const {
        return static_cast<std::size_t>((id.value * 0x9e3779b97f4a7c15u) >> 32) & (entries_.size() - 1);
    }
    [[nodiscard]] std::size_t slotOf(Id id) const {
        const std::size_t mask = entries_.size() - 1;
        std::size_t at = homeOf(id);
        while (entries_[at].id && entries_[at].id != id) at = (at + 1) & mask;
        return at;
    }
    void grow() {
        std::vector<Entry> old = std::move(entries_);
        reset(old.empty() ? 8 : old.size());
        for (const Entry& entry : old)
            if (entry.id) insert(entry.id, entry.value);
    }

    std::vector<Entry> entries_;
    std::size_t size_ = 0;
};

using IdTable = BasicIdTable<ObjectId>;

}  // namespace tessera

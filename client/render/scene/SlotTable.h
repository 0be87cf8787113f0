/// Things in slots that stay theirs: found by object id, named by slot, listed without allocations.
#pragma once

#include <cstdint>
#include <vector>

#include "client/render/scene/IdIndex.h"
#include "common/base/PagedRow.h"

namespace tessera {

/// Values by id. A slot is its value's until that goes; then it is free for another. T is made from nothing and begins
/// with `ObjectId id` (none: the slot is free).
template <typename T>
class SlotTable {
public:
    static constexpr std::uint32_t kNone = IdIndex::kNone;

    [[nodiscard]] std::uint32_t find(ObjectId id) const { return id ? index_.find(id) : kNone; }
    [[nodiscard]] T& operator[](std::uint32_t slot) { return slots_[slot]; }
    [[nodiscard]] const T& operator[](std::uint32_t slot) const { return slots_[slot]; }
    /// The id must be new here.
    std::uint32_t add(ObjectId id) {
        std::uint32_t slot = static_cast<std::uint32_t>(slots_.size());
        if (free_.empty()) {
            slots_.growTo(slots_.size() + 1);
        } else {
            slot = free_.back();
            free_.pop_back();
        }
        slots_[slot].id = id;
        index_.set(id, slot);
        return slot;
    }
    void erase(std::uint32_t slot) {
        index_.erase(slots_[slot].id);
        slots_[slot] = T();
        free_.push_back(slot);
    }
    void reserve(std::size_t count) { index_.reserve(count); }
    void clear() {
        slots_.clear();
        free_.clear();
        index_.clear();
    }
    [[nodiscard]] std::size_t size() const { return index_.size(); }
    /// Free ones too: the id tells.
    [[nodiscard]] const PagedRow<T>& slots() const { return slots_; }

private:
    PagedRow<T> slots_;
    std::vector<std::uint32_t> free_;
    IdIndex index_;
};

/// Membership in one list of slots; the list itself is the slot of its first member.
struct SlotLink {
    std::uint32_t next = IdIndex::kNone;
    std::uint32_t previous = IdIndex::kNone;
};

template <typename Table, typename T>
void linkFirst(Table& table, std::uint32_t& first, std::uint32_t slot, SlotLink T::*link) {
    (table[slot].*link) = {.next = first, .previous = IdIndex::kNone};
    if (first != IdIndex::kNone) (table[first].*link).previous = slot;
    first = slot;
}

template <typename Table, typename T>
void unlink(Table& table, std::uint32_t& first, std::uint32_t slot, SlotLink T::*link) {
    const SlotLink was = table[slot].*link;
    if (was.previous == IdIndex::kNone)
        first = was.next;
    else
        (table[was.previous].*link).next = was.next;
    if (was.next != IdIndex::kNone) (table[was.next].*link).previous = was.previous;
    (table[slot].*link) = {};
}

}  // namespace tessera

/// Equal keys of a few words each get one number: vertices that are the same, by their numbers or by their bits.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace tessera {

/// A hash table with linear probing; a slot of four bytes for each key beside the key itself. Fewer than 2^32 - 1 keys.
class WordTable {
public:
    /// `words`: of each key.
    explicit WordTable(std::size_t words) : words_(words), slots_(1024, 0) {}

    /// The number of the key, in the order in which they first came.
    [[nodiscard]] std::uint32_t numberOf(const std::uint32_t* key) {
        if (2 * (size_ + 1) > slots_.size()) grow();
        const std::size_t mask = slots_.size() - 1;
        for (std::size_t at = hashOf(key) & mask;; at = (at + 1) & mask) {
            std::uint32_t& slot = slots_[at];
            if (slot == 0) {
                keys_.insert(keys_.end(), key, key + words_);
                slot = ++size_;
                return size_ - 1;
            }
            if (std::equal(key, key + words_, keys_.data() + words_ * (slot - 1))) return slot - 1;
        }
    }
    [[nodiscard]] std::uint32_t size() const { return size_; }
    /// In the order of their numbers.
    [[nodiscard]] std::span<const std::uint32_t> keys() const { return keys_; }
    [[nodiscard]] std::vector<std::uint32_t> takeKeys() && { return std::move(keys_); }

private:
    [[nodiscard]] std::size_t hashOf(const std::uint32_t* key) const {
        std::uint64_t hash = 0x9e3779b97f4a7c15u;
        for (std::size_t i = 0; i < words_; ++i) {
            hash = (hash ^ key[i]) * 0xd6e8feb86659fd93u;
            hash ^= hash >> 32;
        }
        return static_cast<std::size_t>(hash * 0xd6e8feb86659fd93u >> 20);
    }
    void grow() {
        std::vector<std::uint32_t>().swap(slots_);  // before the larger one is taken
        slots_.resize(std::max<std::size_t>(1024, std::bit_ceil(4 * (std::size_t{size_} + 1))), 0);
        const std::size_t mask = slots_.size() - 1;
        for (std::uint32_t number = 0; number < size_; ++number) {
            std::size_t at = hashOf(keys_.data() + words_ * number) & mask;
            while (slots_[at] != 0) at = (at + 1) & mask;
            slots_[at] = number + 1;
        }
    }

    std::size_t words_;
    std::uint32_t size_ = 0;
    std::vector<std::uint32_t> slots_;  ///< number + 1; 0: free
    std::vector<std::uint32_t> keys_;
};

}  // namespace tessera

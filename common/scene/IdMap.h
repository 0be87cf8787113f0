/// Objects that one list speaks of, by id. Internal to common/scene.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <vector>

#include "common/change/Value.h"

namespace tessera {

/// Ids mostly come in runs, so values stand in blocks of neighbouring ids, and the block that was asked for last is at
/// hand: a list that names a million objects in order costs no look-up in a hash table for most of them. References
/// hold until the map goes.
template <typename T>
class IdMap {
public:
    [[nodiscard]] bool empty() const { return size_ == 0; }
    [[nodiscard]] std::size_t size() const { return size_; }

    /// Null where there is none.
    [[nodiscard]] T* find(ObjectId id) const {
        Block* block = findBlock(id.value / kIds);
        const std::size_t place = id.value % kIds;
        return block && (block->there >> place & 1) != 0 ? &block->values[place] : nullptr;
    }
    [[nodiscard]] bool contains(ObjectId id) const { return find(id) != nullptr; }

    struct Added {
        T& value;
        bool isNew;
    };
    /// The value of an id; a fresh one where there was none.
    Added add(ObjectId id) {
        Block* block = findBlock(id.value / kIds);
        if (!block) block = addBlock(id.value / kIds);
        const std::size_t place = id.value % kIds;
        const bool isNew = (block->there >> place & 1) == 0;
        block->there = static_cast<std::uint8_t>(block->there | 1u << place);
        size_ += isNew ? 1 : 0;
        return {block->values[place], isNew};
    }

    /// All of them, in an order that depends on the order in which they were added.
    template <typename Visit>
    void forEach(Visit&& visit) const {
        for (const Block& block : blocks_)
            for (std::size_t place = 0; place < kIds; ++place)
                if ((block.there >> place & 1) != 0) visit(ObjectId(block.key * kIds + place), block.values[place]);
    }

private:
    static constexpr std::uint64_t kIds = 8;
    struct Block {
        std::uint64_t key = 0;
        std::uint8_t there = 0;  ///< a bit for each id
        std::array<T, kIds> values{};
    };

    [[nodiscard]] std::size_t home(std::uint64_t key) const {
        return static_cast<std::size_t>((key * 0x9E3779B97F4A7C15ull) >> 32) & (index_.size() - 1);
    }
    [[nodiscard]] Block* findBlock(std::uint64_t key) const {
        if (last_ && last_->key == key) return last_;
        if (index_.empty()) return nullptr;
        for (std::size_t i = home(key); index_[i]; i = (i + 1) & (index_.size() - 1))
            if (index_[i]->key == key) return last_ = index_[i];
        return nullptr;
    }
    Block* addBlock(std::uint64_t key) {
        if (2 * (blocks_.size() + 1) > index_.size()) {
            index_.assign(index_.empty() ? 16 : 4 * index_.size(), nullptr);
            for (Block& block : blocks_) enter(block);
        }
        Block& block = blocks_.emplace_back();
        block.key = key;
        enter(block);
        return last_ = &block;
    }
    void enter(Block& block) {
        std::size_t i = home(block.key);
        while (index_[i]) i = (i + 1) & (index_.size() - 1);
        index_[i] = &block;
    }

    std::deque<Block> blocks_;
    std::vector<Block*> index_;  ///< open addressing, linear probing, a power of two, at most half full
    mutable Block* last_ = nullptr;
    std::size_t size_ = 0;
};

}  // namespace tessera

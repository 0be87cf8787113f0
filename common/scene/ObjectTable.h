/// Where an aspect keeps its objects: id -> slot, with the hash tree. Internal to common/scene.
///
/// Ids are dense and grow, so slots stand in blocks of neighbouring ids and blocks in pages of Aspect::kIdsPerLeaf ids,
/// found through one small hash table of pages. A page is also the leaf of the state hash. Blocks and pages go when
/// their last object goes, and exist only where there are objects: sparse ids cost memory in proportion to the objects.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "common/scene/Aspect.h"

namespace tessera {

class ObjectTable {
public:
    struct Slot {
        std::unique_ptr<Object> object;  ///< null: nothing has this id
        std::uint64_t hash = 0;          ///< as counted into the leaf's sum; 0 until the first setHash
        std::uint32_t alternative = 0;   ///< object->index(), here so that checking a type does not fetch the object
        std::uint32_t uses = 0;          ///< refs that name this object
        /// Scratch for whoever walks over many objects and wants to see each once; see newMark. Not part of the state.
        mutable std::uint32_t mark = 0;
    };

    [[nodiscard]] const Slot* find(ObjectId id) const;
    [[nodiscard]] Slot* find(ObjectId id);
    /// There must be no object with this id. Slots stay where they are until they are erased.
    Slot& insert(ObjectId id, Object object);
    /// Takes its hash out of the tree. Unknown ids are our own bug.
    void erase(ObjectId id);
    void setHash(ObjectId id, Slot& slot, std::uint64_t hash);

    [[nodiscard]] std::size_t size() const { return size_; }
    [[nodiscard]] std::uint64_t rootHash() const;
    [[nodiscard]] std::vector<Aspect::LeafHash> leafHashes() const;
    [[nodiscard]] std::vector<Aspect::ObjectHash> objectHashes(std::uint64_t leaf) const;
    /// Ascending.
    [[nodiscard]] std::vector<ObjectId> ids() const;

    /// A value that no slot's mark has.
    [[nodiscard]] std::uint32_t newMark() const;

    /// Finds faster where ids come in runs. Valid until the next insert or erase.
    template <typename Table, typename TableSlot>
    class BasicCursor {
    public:
        explicit BasicCursor(Table& table) : table_(table) {}
        [[nodiscard]] TableSlot* find(ObjectId id) {
            const std::uint64_t key = id.value / kIdsPerBlock;
            if (key != blockKey_) {
                Block* block = table_.findBlock(key);
                slots_ = block ? block->slots.data() : nullptr;
                blockKey_ = key;
            }
            if (!slots_) return nullptr;
            TableSlot& slot = slots_[id.value % kIdsPerBlock];
            return slot.object ? &slot : nullptr;
        }

    private:
        Table& table_;
        std::uint64_t blockKey_ = ~std::uint64_t{0};
        TableSlot* slots_ = nullptr;
    };
    using Cursor = BasicCursor<ObjectTable, Slot>;
    using ConstCursor = BasicCursor<const ObjectTable, const Slot>;

private:
    static constexpr std::uint64_t kIdsPerBlock = 64;
    static constexpr std::uint64_t kBlocksPerPage = Aspect::kIdsPerLeaf / kIdsPerBlock;

    struct Block {
        std::array<Slot, kIdsPerBlock> slots;
        std::uint32_t live = 0;
    };
    struct Page {
        std::array<std::unique_ptr<Block>, kBlocksPerPage> blocks;
        std::uint64_t sum = 0;  ///< of the hashes of its objects
        std::uint32_t live = 0;
    };
    struct Entry {
        std::uint64_t leaf = 0;
        std::unique_ptr<Page> page;  ///< null: a free entry
    };

    [[nodiscard]] std::size_t home(std::uint64_t leaf) const;
    [[nodiscard]] Page* findPage(std::uint64_t leaf) const;
    Page& makePage(std::uint64_t leaf);
    void removePage(std::uint64_t leaf);
    void grow();
    [[nodiscard]] Block* findBlock(std::uint64_t blockKey) const;
    [[nodiscard]] std::vector<const Entry*> sortedEntries() const;

    std::vector<Entry> entries_ = std::vector<Entry>(16);  ///< open addressing, linear probing, a power of two
    std::size_t pages_ = 0;
    std::size_t size_ = 0;
    std::uint64_t sum_ = 0;       ///< over all pages
    Page* hashedPage_ = nullptr;  ///< of the last setHash: hashes come in runs too
    std::uint64_t hashedLeaf_ = 0;
    mutable std::uint32_t lastMark_ = 0;
};

/// Over the object's id, type, all fields, parent and children in order: the same on every host. -0 counts as 0.
/// `scratch` is reused memory.
[[nodiscard]] std::uint64_t hashObject(ObjectId id, const ObjectTable::Slot& slot, std::vector<std::byte>& scratch);

}  // namespace tessera

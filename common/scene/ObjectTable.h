/// Where an aspect keeps its objects: id -> slot -> place in the slab of its type, with the hash tree. Internal to
/// common/scene.
///
/// Ids are dense and grow, so slots stand in blocks of neighbouring ids and blocks in pages of Aspect::kIdsPerLeaf ids,
/// found through one small hash table of pages. A page is also the leaf of the state hash. Blocks and pages go when
/// their last object goes, and exist only where there are objects: sparse ids cost memory in proportion to the objects.
///
/// The objects themselves stand in slabs, one per type, each as large as its struct.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "common/scene/Aspect.h"

namespace tessera {

/// Room for the objects of one type, in chunks that grow with it. An object stays where it is until it is given back.
class Slab {
public:
    explicit Slab(const TypeInfo& type);

    /// A fresh object.
    [[nodiscard]] void* add();
    void remove(void* object);

private:
    struct Free {
        void operator()(std::byte* chunk) const { ::operator delete (chunk, std::align_val_t{64}); }
    };
    const TypeInfo* type_;
    std::size_t stride_;
    std::vector<std::unique_ptr<std::byte, Free>> chunks_;
    std::vector<void*> free_;
    std::byte* next_ = nullptr;  ///< places of the last chunk that have never been used: [next_, end_)
    std::byte* end_ = nullptr;
    std::size_t inUse_ = 0;
};

class ObjectTable {
public:
    struct Slot {
        std::uint64_t hash = 0;  ///< as counted into the leaf's sum; 0 until the first rehash
        void* data = nullptr;    ///< the object
        std::uint32_t uses = 0;  ///< refs that name this object
        /// Scratch for whoever walks over many objects and wants to see each once; see newMark. Not part of the state.
        mutable std::uint32_t mark = 0;
        std::uint16_t type =
            kNothing;  ///< index into allTypes(), here so that checking a type does not fetch the object
    };
    static constexpr std::uint16_t kNothing = 0xffff;

    ObjectTable();
    ~ObjectTable();
    ObjectTable(const ObjectTable&) = delete;
    ObjectTable& operator=(const ObjectTable&) = delete;

    [[nodiscard]] const Slot* find(ObjectId id) const;
    [[nodiscard]] Slot* find(ObjectId id);
    [[nodiscard]] Object object(const Slot& slot) const { return {types_[slot.type], slot.data}; }
    [[nodiscard]] const TypeInfo& type(const Slot& slot) const { return types_[slot.type]; }
    /// The node of a slot that holds one.
    [[nodiscard]] Node& node(const Slot& slot) const { return *static_cast<Node*>(slot.data); }

    /// A fresh object. There must be none with this id. Slots and objects stay where they are until they are erased.
    Slot& insert(ObjectId id, const TypeInfo& type);
    /// Takes its hash out of the tree. Unknown ids are our own bug.
    void erase(ObjectId id);
    /// Counts the object's hash, as it is now, into the tree.
    void rehash(ObjectId id, Slot& slot);
    /// The same for many of one type; they get this mark.
    void rehash(const TypeInfo& type, std::span<const ObjectId> ids, std::span<Slot* const> slots, std::uint32_t mark);

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
            TableSlot* slot = place(id);
            return !slot || slot->type == kNothing ? nullptr : slot;
        }
        /// Where the slot of an id is, whether there is an object or not, without looking at it. Null: none is near.
        [[nodiscard]] TableSlot* place(ObjectId id) {
            const std::uint64_t key = id.value / kIdsPerBlock;
            if (key != blockKey_) {
                Block* block = table_.findBlock(key);
                slots_ = block ? block->slots.data() : nullptr;
                blockKey_ = key;
            }
            return slots_ ? slots_ + id.value % kIdsPerBlock : nullptr;
        }

    private:
        Table& table_;
        std::uint64_t blockKey_ = ~std::uint64_t{0};
        TableSlot* slots_ = nullptr;
    };
    using Cursor = BasicCursor<ObjectTable, Slot>;
    using ConstCursor = BasicCursor<const ObjectTable, const Slot>;

private:
    static constexpr std::uint64_t kIdsPerBlock = 32;
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
    /// For those that write, whose ids come in runs; remembers the last one. Null: no such page.
    [[nodiscard]] Page* pageAtHand(std::uint64_t leaf);
    Page& makePage(std::uint64_t leaf);
    void removePage(std::uint64_t leaf);
    void grow();
    [[nodiscard]] static std::uint64_t hashOf(const TypeInfo& type, ObjectId id, const void* object) {
        return type.hash(object, id.value * 0xD6E8FEB86659FD93ull + type.type.value);
    }
    [[nodiscard]] Block* findBlock(std::uint64_t blockKey) const;
    [[nodiscard]] std::vector<const Entry*> sortedEntries() const;

    const TypeInfo* types_;
    std::vector<Slab> slabs_;                              ///< by the index of their type
    std::vector<Entry> entries_ = std::vector<Entry>(16);  ///< open addressing, linear probing, a power of two
    std::size_t pages_ = 0;
    std::size_t size_ = 0;
    std::uint64_t sum_ = 0;     ///< over all pages
    Page* lastPage_ = nullptr;  ///< see pageAtHand
    std::uint64_t lastLeaf_ = 0;
    mutable std::uint32_t lastMark_ = 0;
};

}  // namespace tessera

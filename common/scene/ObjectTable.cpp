#include "common/scene/ObjectTable.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "common/base/Hash.h"

namespace tessera {

namespace {

std::uint64_t mix(std::uint64_t value, std::uint64_t seed) {
    return hash64(std::as_bytes(std::span(&value, 1)), seed);
}

}  // namespace

// ---- Slab ----------------------------------------------------------------------------------------------------------

Slab::Slab(const TypeInfo& type)
    : type_(&type), stride_((type.size + type.alignment - 1) / type.alignment * type.alignment) {}

void* Slab::add() {
    void* object = nullptr;
    if (!free_.empty()) {
        object = free_.back();
        free_.pop_back();
    } else {
        if (next_ == end_) {
            // As many again as there are, within bounds: a few objects take little, many take few chunks.
            const std::size_t count = std::clamp<std::size_t>(inUse_, 16384 / stride_ + 1, (1 << 20) / stride_ + 1);
            chunks_.emplace_back(static_cast<std::byte*>(::operator new (count* stride_, std::align_val_t{64})));
            next_ = chunks_.back().get();
            end_ = next_ + count * stride_;
        }
        object = next_;
        next_ += stride_;
    }
    type_->construct(object);
    ++inUse_;
    return object;
}

void Slab::remove(void* object) {
    type_->destroy(object);
    free_.push_back(object);
    if (--inUse_ > 0) return;
    // Empty again: the memory goes back.
    std::vector<void*>().swap(free_);
    chunks_.clear();
    next_ = end_ = nullptr;
}

// ---- ObjectTable ---------------------------------------------------------------------------------------------------

ObjectTable::ObjectTable() : types_(allTypes().data()) {
    slabs_.reserve(allTypes().size());
    for (const TypeInfo& type : allTypes()) slabs_.emplace_back(type);
}

ObjectTable::~ObjectTable() {
    for (const Entry& entry : entries_) {
        if (!entry.page) continue;
        for (const std::unique_ptr<Block>& block : entry.page->blocks) {
            if (!block) continue;
            for (const Slot& slot : block->slots)
                if (slot.type != kNothing) types_[slot.type].destroy(slot.data);
        }
    }
}

std::size_t ObjectTable::home(std::uint64_t leaf) const {
    // Fibonacci hashing: neighbouring leaves spread well and cost one multiplication.
    return static_cast<std::size_t>((leaf * 0x9E3779B97F4A7C15ull) >> (64 - std::countr_zero(entries_.size())));
}

ObjectTable::Page* ObjectTable::findPage(std::uint64_t leaf) const {
    for (std::size_t i = home(leaf); entries_[i].page; i = (i + 1) & (entries_.size() - 1))
        if (entries_[i].leaf == leaf) return entries_[i].page.get();
    return nullptr;
}

ObjectTable::Page* ObjectTable::pageAtHand(std::uint64_t leaf) {
    if (!lastPage_ || lastLeaf_ != leaf) {
        lastPage_ = findPage(leaf);
        lastLeaf_ = leaf;
    }
    return lastPage_;
}

void ObjectTable::grow() {
    std::vector<Entry> old = std::exchange(entries_, std::vector<Entry>(entries_.size() * 2));
    for (Entry& entry : old) {
        if (!entry.page) continue;
        std::size_t i = home(entry.leaf);
        while (entries_[i].page) i = (i + 1) & (entries_.size() - 1);
        entries_[i] = std::move(entry);
    }
}

ObjectTable::Page& ObjectTable::makePage(std::uint64_t leaf) {
    if (2 * (pages_ + 1) > entries_.size()) grow();
    std::size_t i = home(leaf);
    while (entries_[i].page) i = (i + 1) & (entries_.size() - 1);
    entries_[i] = {leaf, std::make_unique<Page>()};
    ++pages_;
    return *entries_[i].page;
}

void ObjectTable::removePage(std::uint64_t leaf) {
    const std::size_t last = entries_.size() - 1;
    std::size_t hole = home(leaf);
    while (entries_[hole].leaf != leaf || !entries_[hole].page) hole = (hole + 1) & last;
    // Close the gap, so that probing needs no tombstones: whoever stands behind the hole and belongs at or before it
    // moves up.
    for (std::size_t i = (hole + 1) & last; entries_[i].page; i = (i + 1) & last) {
        const std::size_t distanceHome = (i - home(entries_[i].leaf)) & last;
        const std::size_t distanceHole = (i - hole) & last;
        if (distanceHome < distanceHole) continue;
        entries_[hole] = std::move(entries_[i]);
        hole = i;
    }
    entries_[hole] = {};
    --pages_;
    lastPage_ = nullptr;
}

ObjectTable::Block* ObjectTable::findBlock(std::uint64_t blockKey) const {
    const Page* page = findPage(blockKey / kBlocksPerPage);
    return page ? page->blocks[blockKey % kBlocksPerPage].get() : nullptr;
}

ObjectTable::Slot* ObjectTable::find(ObjectId id) {
    Block* block = findBlock(id.value / kIdsPerBlock);
    if (!block) return nullptr;
    Slot& slot = block->slots[id.value % kIdsPerBlock];
    return slot.type == kNothing ? nullptr : &slot;
}

const ObjectTable::Slot* ObjectTable::find(ObjectId id) const {
    return const_cast<ObjectTable*>(this)->find(id);
}

ObjectTable::Slot& ObjectTable::insert(ObjectId id, const TypeInfo& type) {
    const std::uint64_t leaf = id.value / Aspect::kIdsPerLeaf;
    Page* page = pageAtHand(leaf);
    if (!page) lastPage_ = page = &makePage(leaf);
    std::unique_ptr<Block>& block = page->blocks[(id.value / kIdsPerBlock) % kBlocksPerPage];
    if (!block) block = std::make_unique<Block>();
    Slot& slot = block->slots[id.value % kIdsPerBlock];
    TESSERA_CHECK(slot.type == kNothing, "an object with this id is there already");
    slot.data = slabs_[type.index].add();
    slot.type = type.index;
    ++block->live;
    ++page->live;
    ++size_;
    return slot;
}

void ObjectTable::erase(ObjectId id) {
    const std::uint64_t leaf = id.value / Aspect::kIdsPerLeaf;
    Page* page = pageAtHand(leaf);
    TESSERA_CHECK(page, "no object with this id");
    std::unique_ptr<Block>& block = page->blocks[(id.value / kIdsPerBlock) % kBlocksPerPage];
    TESSERA_CHECK(block && block->slots[id.value % kIdsPerBlock].type != kNothing, "no object with this id");
    Slot& slot = block->slots[id.value % kIdsPerBlock];
    page->sum -= slot.hash;
    sum_ -= slot.hash;
    slabs_[slot.type].remove(slot.data);
    slot = {};
    --size_;
    if (--block->live == 0) block.reset();
    if (--page->live == 0) removePage(leaf);
}

void ObjectTable::rehash(ObjectId id, Slot& slot) {
    Page* page = pageAtHand(id.value / Aspect::kIdsPerLeaf);
    TESSERA_CHECK(page, "no object with this id");
    const std::uint64_t hash = hashOf(types_[slot.type], id, slot.data);
    page->sum += hash - slot.hash;
    sum_ += hash - slot.hash;
    slot.hash = hash;
}

void ObjectTable::rehash(const TypeInfo& type, std::span<const ObjectId> ids, std::span<Slot* const> slots,
                         std::uint32_t mark) {
    Page* page = nullptr;
    std::uint64_t leaf = 0;
    for (std::size_t i = 0; i < ids.size(); ++i) {
        Slot& slot = *slots[i];
        const std::uint64_t hash = hashOf(type, ids[i], slot.data);
        if (!page || ids[i].value / Aspect::kIdsPerLeaf != leaf) {
            leaf = ids[i].value / Aspect::kIdsPerLeaf;
            page = pageAtHand(leaf);
            TESSERA_CHECK(page, "no object with this id");
        }
        const std::uint64_t more = hash - slot.hash;
        page->sum += more;
        sum_ += more;
        slot.hash = hash;
        slot.mark = mark;
    }
}

std::uint64_t ObjectTable::rootHash() const {
    return mix(sum_, 0);
}

std::vector<const ObjectTable::Entry*> ObjectTable::sortedEntries() const {
    std::vector<const Entry*> sorted;
    sorted.reserve(pages_);
    for (const Entry& entry : entries_)
        if (entry.page) sorted.push_back(&entry);
    std::sort(sorted.begin(), sorted.end(), [](const Entry* a, const Entry* b) { return a->leaf < b->leaf; });
    return sorted;
}

std::vector<Aspect::LeafHash> ObjectTable::leafHashes() const {
    std::vector<Aspect::LeafHash> hashes;
    hashes.reserve(pages_);
    for (const Entry* entry : sortedEntries()) hashes.push_back({entry->leaf, mix(entry->page->sum, entry->leaf)});
    return hashes;
}

std::vector<Aspect::ObjectHash> ObjectTable::objectHashes(std::uint64_t leaf) const {
    std::vector<Aspect::ObjectHash> hashes;
    const Page* page = findPage(leaf);
    if (!page) return hashes;
    for (std::uint64_t i = 0; i < Aspect::kIdsPerLeaf; ++i) {
        const Block* block = page->blocks[i / kIdsPerBlock].get();
        if (!block) continue;
        const Slot& slot = block->slots[i % kIdsPerBlock];
        if (slot.type != kNothing) hashes.push_back({ObjectId(leaf * Aspect::kIdsPerLeaf + i), slot.hash});
    }
    return hashes;
}

std::vector<ObjectId> ObjectTable::ids() const {
    std::vector<ObjectId> all;
    all.reserve(size_);
    for (const Entry* entry : sortedEntries())
        for (std::uint64_t i = 0; i < Aspect::kIdsPerLeaf; ++i) {
            const Block* block = entry->page->blocks[i / kIdsPerBlock].get();
            if (block && block->slots[i % kIdsPerBlock].type != kNothing)
                all.push_back(ObjectId(entry->leaf * Aspect::kIdsPerLeaf + i));
        }
    return all;
}

std::uint32_t ObjectTable::newMark() const {
    if (++lastMark_ == 0) {  // wrapped: old marks would come to life again
        for (const Entry& entry : entries_) {
            if (!entry.page) continue;
            for (const std::unique_ptr<Block>& block : entry.page->blocks)
                if (block)
                    for (const Slot& slot : block->slots) slot.mark = 0;
        }
        lastMark_ = 1;
    }
    return lastMark_;
}

}  // namespace tessera

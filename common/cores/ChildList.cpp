#include "common/cores/ChildList.h"

#include <algorithm>
#include <array>
#include <memory>
#include <unordered_map>

namespace tessera {

/// Chunks in their order, at least half full but for the last ones left; prefix counts in a Fenwick tree, which is made
/// anew when a chunk comes or goes (once in kChunk / 2 changes at most); and which chunk holds a child.
struct ChildList::Many {
    struct Chunk {
        std::uint32_t count = 0;
        std::uint32_t number = 0;  ///< its place among the chunks
        std::array<ObjectId, kChunk> ids;
    };
    struct Spot {
        Chunk* chunk;
        std::uint32_t offset;
    };

    std::vector<std::unique_ptr<Chunk>> chunks;
    std::vector<std::uint32_t> fenwick;  ///< over the counts, from 1
    std::unordered_map<ObjectId, Chunk*> where;

    void renumber(std::size_t from) {
        for (std::size_t i = from; i < chunks.size(); ++i) chunks[i]->number = static_cast<std::uint32_t>(i);
        fenwick.assign(chunks.size() + 1, 0);
        for (std::size_t i = 1; i <= chunks.size(); ++i) {
            fenwick[i] += chunks[i - 1]->count;
            if (const std::size_t above = i + (i & (~i + 1)); above < fenwick.size()) fenwick[above] += fenwick[i];
        }
    }
    void add(std::size_t number, std::uint32_t change) {
        for (std::size_t i = number + 1; i < fenwick.size(); i += i & (~i + 1)) fenwick[i] += change;
    }
    [[nodiscard]] std::size_t before(std::size_t number) const {
        std::size_t sum = 0;
        for (std::size_t i = number; i > 0; i -= i & (~i + 1)) sum += fenwick[i];
        return sum;
    }
    /// Of an index up to the size: where a child put there goes. At the seam of two chunks, the end of the first.
    [[nodiscard]] Spot spotFor(std::size_t index) const {
        std::size_t number = 0, step = 1;
        while (2 * step < fenwick.size()) step *= 2;
        for (; step > 0; step /= 2)
            if (number + step < fenwick.size() && fenwick[number + step] < index) {
                number += step;
                index -= fenwick[number];
            }
        return {chunks[number].get(), static_cast<std::uint32_t>(index)};
    }

    void split(Chunk& full) {
        auto half = std::make_unique<Chunk>();
        half->count = full.count - full.count / 2;
        full.count /= 2;
        std::copy_n(full.ids.begin() + full.count, half->count, half->ids.begin());
        for (std::uint32_t i = 0; i < half->count; ++i) where[half->ids[i]] = half.get();
        const std::size_t number = full.number + 1;
        chunks.insert(chunks.begin() + static_cast<std::ptrdiff_t>(number), std::move(half));
        renumber(number);
    }
    /// Takes the chunk behind `first` into it, where both fit well into one or one is empty.
    void mergeBehind(std::size_t first) {
        if (first + 1 >= chunks.size()) return;
        Chunk& into = *chunks[first];
        Chunk& from = *chunks[first + 1];
        if (into.count + from.count > kChunk / 2 && into.count > 0 && from.count > 0) return;
        std::copy_n(from.ids.begin(), from.count, into.ids.begin() + into.count);
        for (std::uint32_t i = 0; i < from.count; ++i) where[from.ids[i]] = &into;
        into.count += from.count;
        chunks.erase(chunks.begin() + static_cast<std::ptrdiff_t>(first) + 1);
        renumber(first);
    }
};

namespace {

/// One child behind another (none: the first). Mixed well, because sums of these are compared.
std::uint64_t linkHash(ObjectId before, ObjectId child) {
    std::uint64_t x = before.value * 0x9E3779B97F4A7C15ull + child.value;
    x ^= x >> 32;
    x *= 0xD6E8FEB86659FD93ull;
    x ^= (x >> 29) + child.value * 0xC2B2AE3D27D4EB4Full;
    x *= 0xD6E8FEB86659FD93ull;
    x ^= x >> 32;
    x *= 0x9FB21C651E98DF25ull;
    return x ^ (x >> 28);
}

}  // namespace

ObjectId ChildList::atMany(std::size_t index) const {
    const Many::Spot spot = many_->spotFor(index + 1);
    return spot.chunk->ids[spot.offset - 1];
}

std::size_t ChildList::indexOf(ObjectId child) const {
    if (isMany()) {
        const auto it = many_->where.find(child);
        TESSERA_CHECK(it != many_->where.end(), "a node is not among its parent's children");
        const Many::Chunk& chunk = *it->second;
        const auto end = chunk.ids.begin() + chunk.count;
        return many_->before(chunk.number) +
               static_cast<std::size_t>(std::find(chunk.ids.begin(), end, child) - chunk.ids.begin());
    }
    const ObjectId* end = few_ + size_;
    const ObjectId* found = std::find(const_cast<const ObjectId*>(few_), end, child);
    TESSERA_CHECK(found != end, "a node is not among its parent's children");
    return static_cast<std::size_t>(found - few_);
}

bool ChildList::contains(ObjectId child) const {
    if (isMany()) return many_->where.contains(child);
    return std::find(few_, few_ + size_, child) != few_ + size_;
}

std::size_t ChildList::memoryBytes() const {
    if (!isMany()) return capacity_ * sizeof(ObjectId);
    constexpr std::size_t kHashNode = 32;  // next, key, value, as libstdc++ keeps them, and malloc's own
    return sizeof(Many) + many_->chunks.size() * (sizeof(Many::Chunk) + sizeof(void*) + sizeof(std::uint32_t)) +
           many_->where.size() * kHashNode + many_->where.bucket_count() * sizeof(void*);
}

void ChildList::becomeMany() {
    auto many = std::make_unique<Many>();
    many->where.reserve(2 * size_);
    for (std::size_t from = 0; from < size_; from += kChunk / 2) {
        auto chunk = std::make_unique<Many::Chunk>();
        chunk->count = static_cast<std::uint32_t>(std::min<std::size_t>(kChunk / 2, size_ - from));
        std::copy_n(few_ + from, chunk->count, chunk->ids.begin());
        for (std::uint32_t i = 0; i < chunk->count; ++i) many->where.emplace(chunk->ids[i], chunk.get());
        many->chunks.push_back(std::move(chunk));
    }
    many->renumber(0);
    delete[] few_;
    many_ = many.release();
    capacity_ = kMany;
}

void ChildList::becomeFew() {
    const std::unique_ptr<Many> many(many_);
    auto* few = new ObjectId[kFew];
    ObjectId* to = few;
    for (const auto& chunk : many->chunks) to = std::copy_n(chunk->ids.begin(), chunk->count, to);
    few_ = few;
    capacity_ = kFew;
}

void ChildList::insert(std::size_t index, ObjectId child) {
    const ObjectId before = index > 0 ? (*this)[index - 1] : ObjectId();
    if (index < size_) {
        const ObjectId after = (*this)[index];
        orderHash_ += linkHash(child, after) - linkHash(before, after);
    }
    orderHash_ += linkHash(before, child);

    if (!isMany() && size_ == kFew) becomeMany();
    if (isMany()) {
        Many::Spot spot = many_->spotFor(index);
        if (spot.chunk->count == kChunk) {
            many_->split(*spot.chunk);
            spot = many_->spotFor(index);
        }
        const auto at = spot.chunk->ids.begin() + spot.offset;
        std::copy_backward(at, spot.chunk->ids.begin() + spot.chunk->count,
                           spot.chunk->ids.begin() + spot.chunk->count + 1);
        *at = child;
        ++spot.chunk->count;
        many_->add(spot.chunk->number, 1);
        many_->where.emplace(child, spot.chunk);
    } else {
        if (size_ == capacity_) {
            // One child is the most frequent family; beyond it the usual doubling.
            const std::uint32_t capacity = std::min(capacity_ == 0 ? 1 : capacity_ < 4 ? 4 : 2 * capacity_, kFew);
            auto* more = new ObjectId[capacity];
            std::copy_n(few_, size_, more);
            delete[] few_;
            few_ = more;
            capacity_ = capacity;
        }
        std::copy_backward(few_ + index, few_ + size_, few_ + size_ + 1);
        few_[index] = child;
    }
    ++size_;
}

std::size_t ChildList::erase(ObjectId child) {
    const std::size_t index = indexOf(child);
    const ObjectId before = index > 0 ? (*this)[index - 1] : ObjectId();
    orderHash_ -= linkHash(before, child);
    if (index + 1 < size_) {
        const ObjectId after = (*this)[index + 1];
        orderHash_ += linkHash(before, after) - linkHash(child, after);
    }
    --size_;
    if (!isMany()) {
        std::copy(few_ + index + 1, few_ + size_ + 1, few_ + index);
        if (size_ == 0) clear();
        return index;
    }
    Many::Chunk& chunk = *many_->where.find(child)->second;
    const auto end = chunk.ids.begin() + chunk.count;
    const auto at = std::find(chunk.ids.begin(), end, child);
    std::copy(at + 1, end, at);
    --chunk.count;
    many_->add(chunk.number, ~std::uint32_t{0});
    many_->where.erase(child);
    if (size_ <= kFew / 2) {
        becomeFew();
    } else if (chunk.count < kChunk / 8) {
        const std::size_t number = chunk.number;
        many_->mergeBehind(number);
        if (number > 0) many_->mergeBehind(number - 1);
    }
    return index;
}

void ChildList::clear() {
    if (isMany())
        delete many_;
    else
        delete[] few_;
    few_ = nullptr;
    size_ = capacity_ = 0;
    orderHash_ = 0;
}

ChildList::Iterator ChildList::begin() const {
    Iterator it;
    if (!isMany()) {
        it.at_ = few_;
        it.end_ = few_ + size_;
        return it;
    }
    it.list_ = this;
    it.chunk_ = ~std::size_t{0};
    it.nextChunk();
    return it;
}

ChildList::Iterator ChildList::from(std::size_t index) const {
    if (index == size_) return end();
    Iterator it;
    if (!isMany()) {
        it.at_ = few_ + index;
        it.end_ = few_ + size_;
        return it;
    }
    const Many::Spot spot = many_->spotFor(index + 1);
    it.list_ = this;
    it.chunk_ = spot.chunk->number;
    it.at_ = spot.chunk->ids.data() + spot.offset - 1;
    it.end_ = spot.chunk->ids.data() + spot.chunk->count;
    return it;
}

ChildList::Iterator ChildList::end() const {
    Iterator it;
    if (!isMany()) it.at_ = few_ + size_;
    return it;
}

void ChildList::Iterator::nextChunk() {
    do {
        if (++chunk_ == list_->many_->chunks.size()) {
            at_ = end_ = nullptr;
            return;
        }
        const Many::Chunk& chunk = *list_->many_->chunks[chunk_];
        at_ = chunk.ids.data();
        end_ = at_ + chunk.count;
    } while (at_ == end_);
}

bool operator==(const ChildList& list, const std::vector<ObjectId>& ids) {
    return list.size() == ids.size() && std::equal(list.begin(), list.end(), ids.begin());
}

}  // namespace tessera

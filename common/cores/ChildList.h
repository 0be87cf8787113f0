/// The children of a node, in their order.
#pragma once

#include <cstdint>
#include <iterator>
#include <vector>

#include "common/base/Error.h"
#include "common/change/Value.h"

namespace tessera {

/// A sequence of distinct ids. Few stand in one array; many in chunks with an index beside them, so that inserting,
/// erasing and finding a child by id or by index cost O(log n) however many there are (and the moving of one chunk of
/// kChunk ids).
///
/// `orderHash` depends on the ids and their order alone and is kept up to date at a constant cost: it is a sum over
/// neighbours, each child hashed with the one before it.
class ChildList {
public:
    ChildList() = default;
    ~ChildList() { clear(); }
    ChildList(ChildList&& other) noexcept { swap(other); }
    ChildList& operator=(ChildList&& other) noexcept {
        swap(other);
        return *this;
    }

    [[nodiscard]] std::size_t size() const { return size_; }
    [[nodiscard]] bool empty() const { return size_ == 0; }
    [[nodiscard]] ObjectId operator[](std::size_t index) const { return isMany() ? atMany(index) : few_[index]; }
    [[nodiscard]] ObjectId front() const { return (*this)[0]; }
    [[nodiscard]] ObjectId back() const { return (*this)[size_ - 1]; }
    /// The child must be there.
    [[nodiscard]] std::size_t indexOf(ObjectId child) const;
    /// Children at most kFew are looked through; else found through the index.
    [[nodiscard]] bool contains(ObjectId child) const;
    [[nodiscard]] std::uint64_t orderHash() const { return orderHash_; }
    /// What it takes besides itself.
    [[nodiscard]] std::size_t memoryBytes() const;

    /// The child must not be there yet; index at most size().
    void insert(std::size_t index, ObjectId child);
    void push_back(ObjectId child) { insert(size_, child); }
    /// Returns the index where it stood.
    std::size_t erase(ObjectId child);
    void clear();

    class Iterator {
    public:
        using iterator_category = std::forward_iterator_tag;
        using value_type = ObjectId;
        using difference_type = std::ptrdiff_t;
        using pointer = const ObjectId*;
        using reference = const ObjectId&;

        Iterator() = default;
        const ObjectId& operator*() const { return *at_; }
        const ObjectId* operator->() const { return at_; }
        Iterator& operator++() {
            if (++at_ == end_ && list_) nextChunk();
            return *this;
        }
        Iterator operator++(int) {
            Iterator before = *this;
            ++*this;
            return before;
        }
        bool operator==(const Iterator& other) const { return at_ == other.at_; }

    private:
        friend class ChildList;
        void nextChunk();

        const ObjectId* at_ = nullptr;
        const ObjectId* end_ = nullptr;
        const ChildList* list_ = nullptr;  ///< of many: where the next chunk is found
        std::size_t chunk_ = 0;
    };
    [[nodiscard]] Iterator begin() const;
    /// From this child on; index at most size().
    [[nodiscard]] Iterator from(std::size_t index) const;
    [[nodiscard]] Iterator end() const;

    friend bool operator==(const ChildList& list, const std::vector<ObjectId>& ids);

    static constexpr std::uint32_t kFew = 128;
    static constexpr std::uint32_t kChunk = 256;

private:
    struct Many;
    static constexpr std::uint32_t kMany = 0xffffffffu;

    [[nodiscard]] bool isMany() const { return capacity_ == kMany; }
    [[nodiscard]] ObjectId atMany(std::size_t index) const;
    void becomeMany();
    void becomeFew();
    void swap(ChildList& other) noexcept {
        std::swap(few_, other.few_);
        std::swap(size_, other.size_);
        std::swap(capacity_, other.capacity_);
        std::swap(orderHash_, other.orderHash_);
    }

    union {
        ObjectId* few_ = nullptr;
        Many* many_;
    };
    std::uint32_t size_ = 0;
    std::uint32_t capacity_ = 0;  ///< kMany: many_ is it
    std::uint64_t orderHash_ = 0;
};

}  // namespace tessera

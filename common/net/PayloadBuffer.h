/// Memory for one message that arrives bit by bit.
#pragma once

#include <sys/mman.h>

#include <cstdlib>
#include <cstring>
#include <memory>
#include <new>
#include <utility>

#include "common/base/ByteSlice.h"
#include "common/base/SparePages.h"

namespace tessera {

/// Grows without clearing what it takes: pages that no byte has reached cost nothing but addresses. A large one has
/// pages of its own, which are moved instead of copied as it grows, and go with it: in the heap, whatever small thing
/// was made in between would keep them for good.
class PayloadBuffer {
public:
    static constexpr std::size_t kOwnPages = std::size_t{256} << 10;

    PayloadBuffer() = default;
    PayloadBuffer(PayloadBuffer&& other) noexcept
        : bytes_(std::exchange(other.bytes_, nullptr)), capacity_(std::exchange(other.capacity_, 0)) {}
    PayloadBuffer& operator=(PayloadBuffer&& other) noexcept {
        std::swap(bytes_, other.bytes_);
        std::swap(capacity_, other.capacity_);
        return *this;
    }
    ~PayloadBuffer() { free(bytes_, capacity_); }

    /// Room for so many bytes in all; what is there stays.
    void reserve(std::size_t capacity) {
        if (capacity <= capacity_) return;
        if (capacity < kOwnPages)
            growInHeap(capacity);
        else
            growInPages((capacity + kOwnPages - 1) / kOwnPages * kOwnPages);
    }
    [[nodiscard]] std::size_t capacity() const { return capacity_; }
    [[nodiscard]] std::byte* data() { return bytes_; }
    /// The first `size` bytes, in this very memory. The buffer is empty afterwards.
    [[nodiscard]] ByteSlice take(std::size_t size) {
        const std::size_t capacity = std::exchange(capacity_, 0);
        std::shared_ptr<std::byte> owner(std::exchange(bytes_, nullptr),
                                         [capacity](std::byte* bytes) { free(bytes, capacity); });
        const ByteSpan bytes(owner.get(), size);
        return {std::move(owner), bytes};
    }

private:
    void growInHeap(std::size_t capacity) {
        void* const grown = std::realloc(bytes_, capacity);
        if (grown == nullptr) throw std::bad_alloc();
        bytes_ = static_cast<std::byte*>(grown);
        capacity_ = capacity;
    }
    void growInPages(std::size_t capacity) {
        if (capacity_ >= kOwnPages) {
            void* const grown = ::mremap(bytes_, capacity_, capacity, MREMAP_MAYMOVE);
            if (grown == MAP_FAILED) throw std::bad_alloc();
            bytes_ = static_cast<std::byte*>(grown);
            capacity_ = capacity;
            return;
        }
        SparePages::Pages pages = SparePages::ofThisProcess().take(capacity);
        if (!pages.bytes) {
            void* const fresh = ::mmap(nullptr, capacity, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
            if (fresh == MAP_FAILED) throw std::bad_alloc();
            pages = {static_cast<std::byte*>(fresh), capacity};
        }
        if (bytes_ != nullptr) std::memcpy(pages.bytes, bytes_, capacity_);
        std::free(bytes_);
        bytes_ = pages.bytes;
        capacity_ = pages.capacity;
    }
    static void free(std::byte* bytes, std::size_t capacity) {
        if (capacity >= kOwnPages)
            SparePages::ofThisProcess().give({bytes, capacity});
        else
            std::free(bytes);
    }

    std::byte* bytes_ = nullptr;
    std::size_t capacity_ = 0;
};

}  // namespace tessera

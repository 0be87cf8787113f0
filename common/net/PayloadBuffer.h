/// Memory for one message that arrives bit by bit.
#pragma once

#include <algorithm>
#include <cstdlib>
#include <memory>
#include <new>
#include <span>

#include "common/base/ByteSlice.h"

namespace tessera {

/// Grows without clearing what it takes: pages that no byte has reached cost nothing but addresses. The C library moves
/// the pages of a large one instead of copying them, where it can.
class PayloadBuffer {
public:
    /// Room for so many bytes in all; what is there stays.
    void reserve(std::size_t capacity) {
        if (capacity <= capacity_) return;
        void* const grown = std::realloc(bytes_.get(), capacity);
        if (grown == nullptr) throw std::bad_alloc();
        (void)bytes_.release();
        bytes_.reset(static_cast<std::byte*>(grown));
        capacity_ = capacity;
    }
    [[nodiscard]] std::size_t capacity() const { return capacity_; }
    [[nodiscard]] std::byte* data() { return bytes_.get(); }
    /// The first `size` bytes, in this very memory. The buffer is empty afterwards.
    [[nodiscard]] ByteSlice take(std::size_t size) {
        capacity_ = 0;
        std::shared_ptr<std::byte> owner(bytes_.release(), Free());
        const ByteSpan bytes(owner.get(), size);
        return {std::move(owner), bytes};
    }

private:
    struct Free {
        void operator()(std::byte* bytes) const { std::free(bytes); }
    };
    std::unique_ptr<std::byte, Free> bytes_;
    std::size_t capacity_ = 0;
};

}  // namespace tessera

/// Which parts of a long array are taken. Pure bookkeeping.
#pragma once

#include <cstdint>
#include <map>
#include <optional>

namespace tessera {

/// Ranges of a growing array of elements, first fit, neighbours joined when released.
class RangeAllocator {
public:
    /// Start of `count` free elements, taken from now on; nothing where no gap is long enough.
    [[nodiscard]] std::optional<std::uint64_t> allocate(std::uint64_t count);
    void release(std::uint64_t start, std::uint64_t count);
    /// Adds free elements at the end.
    void grow(std::uint64_t capacity);

    [[nodiscard]] std::uint64_t capacity() const { return capacity_; }
    [[nodiscard]] std::uint64_t used() const { return used_; }

private:
    std::map<std::uint64_t, std::uint64_t> free_;  ///< start -> count, never touching each other
    std::uint64_t capacity_ = 0;
    std::uint64_t used_ = 0;
};

}  // namespace tessera

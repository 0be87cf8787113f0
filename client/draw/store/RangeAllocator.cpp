#include "client/draw/store/RangeAllocator.h"

#include <iterator>

#include "common/base/Error.h"

namespace tessera {

std::optional<std::uint64_t> RangeAllocator::allocate(std::uint64_t count) {
    if (count == 0) return 0;
    for (auto gap = free_.begin(); gap != free_.end(); ++gap) {
        if (gap->second < count) continue;
        const std::uint64_t start = gap->first;
        const std::uint64_t rest = gap->second - count;
        free_.erase(gap);
        if (rest > 0) free_.emplace(start + count, rest);
        used_ += count;
        return start;
    }
    return std::nullopt;
}

void RangeAllocator::release(std::uint64_t start, std::uint64_t count) {
    if (count == 0) return;
    TESSERA_CHECK(start + count <= capacity_ && count <= used_, "a released range was taken");
    used_ -= count;
    auto next = free_.lower_bound(start);
    TESSERA_CHECK(next == free_.end() || start + count <= next->first, "a range is released once");
    if (next != free_.end() && start + count == next->first) {
        count += next->second;
        next = free_.erase(next);
    }
    if (next != free_.begin()) {
        const auto before = std::prev(next);
        TESSERA_CHECK(before->first + before->second <= start, "a range is released once");
        if (before->first + before->second == start) {
            before->second += count;
            return;
        }
    }
    free_.emplace(start, count);
}

void RangeAllocator::grow(std::uint64_t capacity) {
    if (capacity <= capacity_) return;
    const std::uint64_t start = capacity_;
    capacity_ = capacity;
    used_ += capacity - start;  // as if taken, so that it joins a gap at the end
    release(start, capacity - start);
}

}  // namespace tessera

/// Mapped memory that is used again.
#pragma once

#include <sys/mman.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <mutex>
#include <utility>

namespace tessera {

/// Pages that messages have given back, for the next ones: of a message in each frame the fault of each page costs more
/// than all else that its reader does with it. At most 16 MiB of a process. Any thread.
class SparePages {
public:
    struct Pages {
        std::byte* bytes = nullptr;
        std::size_t capacity = 0;
    };
    static SparePages& ofThisProcess() {
        static SparePages spare;
        return spare;
    }
    /// The smallest that are enough; null: there are none.
    [[nodiscard]] Pages take(std::size_t capacity) {
        const std::lock_guard lock(mutex_);
        Pages* best = nullptr;
        for (Pages& one : spare_)
            if (one.capacity >= capacity && (!best || one.capacity < best->capacity)) best = &one;
        return best ? std::exchange(*best, {}) : Pages();
    }
    /// What is too much goes back to the system: the smallest.
    void give(Pages pages) {
        if (pages.capacity <= kLargest) {
            const std::lock_guard lock(mutex_);
            std::swap(*std::ranges::min_element(spare_, {}, &Pages::capacity), pages);
        }
        if (pages.bytes) ::munmap(pages.bytes, pages.capacity);
    }

private:
    static constexpr std::size_t kLargest = std::size_t{4} << 20;
    std::mutex mutex_;
    std::array<Pages, 4> spare_{};
};

}  // namespace tessera

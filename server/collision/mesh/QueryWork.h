/// What every query counts, and what the simple ones answer.
#pragma once

#include <compare>
#include <cstdint>
#include <vector>

namespace tessera {

/// Work done so far and allowed at most; hand the same one to many queries to bound them together.
struct QueryWork {
    std::uint64_t boxTests = 0;
    std::uint64_t triangleTests = 0;
    std::uint64_t limit = ~std::uint64_t{0};  ///< of both together
    [[nodiscard]] bool exhausted() const { return boxTests + triangleTests >= limit; }
};

/// kUnknown: the work was exhausted before anything was found. Whoever must be safe takes it for a yes.
enum class Touch : std::uint8_t { kNo, kYes, kUnknown };

struct FacePair {
    std::uint32_t a = 0;
    std::uint32_t b = 0;
    auto operator<=>(const FacePair&) const = default;
};

struct FacePairs {
    std::vector<FacePair> pairs;  ///< ascending
    bool complete = true;         ///< false: the work was exhausted, there may be more
};

}  // namespace tessera

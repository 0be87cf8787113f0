/// What a series of numbers was like, in memory of a fixed size.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace tessera {

/// Half, all but a hundredth, and the worst of any count of numbers: of times in ms, say. A histogram whose buckets are
/// as wide as a sixty-fourth of the power of two that they lie above (log-linear, as in HdrHistogram by G. Tene).
///
/// Exact for the smallest and the largest number; what lies between is told within 0.8 %, from a nanosecond to twelve
/// days where numbers are milliseconds. What is smaller, negative or NaN counts as 0. 26 KB, whatever comes. A plain
/// value.
class Series {
public:
    Series();
    void add(double value);
    [[nodiscard]] std::uint64_t count() const { return count_; }
    /// The smallest value that at least `share` of all values do not exceed; 0 for none.
    [[nodiscard]] double quantile(double share) const;
    /// What it holds, in bytes.
    [[nodiscard]] std::size_t memory() const { return sizeof(*this) + buckets_.capacity() * sizeof(buckets_.front()); }

private:
    static constexpr int kLowest = -20, kHighest = 30;  ///< powers of two
    static constexpr std::size_t kParts = 64;           ///< of each
    std::vector<std::uint64_t> buckets_;                ///< the first one's numbers are 0
    std::uint64_t count_ = 0;
    double smallest_ = 0, largest_ = 0;
};

}  // namespace tessera

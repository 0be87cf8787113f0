#include "server/sim/report/Series.h"

#include <algorithm>
#include <cmath>

namespace tessera {

Series::Series() : buckets_(1 + kParts * static_cast<std::size_t>(kHighest - kLowest)) {}

void Series::add(double value) {
    const bool counts = value >= std::ldexp(1.0, kLowest);
    if (!counts) value = 0;
    smallest_ = count_ == 0 ? value : std::min(smallest_, value);
    largest_ = std::max(largest_, value);
    ++count_;
    if (!counts) {
        ++buckets_.front();
        return;
    }
    int exponent = 0;
    const double fraction = std::frexp(std::min(value, std::ldexp(1.0, kHighest)), &exponent);  // [0.5, 1)
    const auto octave = static_cast<std::size_t>(exponent - 1 - kLowest);
    const auto part = static_cast<std::size_t>((2 * fraction - 1) * kParts);
    ++buckets_[std::min(buckets_.size() - 1, 1 + octave * kParts + part)];
}

double Series::quantile(double share) const {
    if (count_ == 0) return 0;
    const auto rank = std::clamp<std::uint64_t>(
        static_cast<std::uint64_t>(std::ceil(share * static_cast<double>(count_))), 1, count_);
    if (rank == count_) return largest_;
    std::uint64_t sum = 0;
    std::size_t bucket = 0;
    for (; bucket < buckets_.size(); ++bucket)
        if (sum += buckets_[bucket]; sum >= rank) break;
    if (bucket == 0) return smallest_;
    const std::size_t at = bucket - 1;
    const double middle = 1 + (static_cast<double>(at % kParts) + 0.5) / kParts;
    return std::clamp(std::ldexp(middle, kLowest + static_cast<int>(at / kParts)), smallest_, largest_);
}

}  // namespace tessera

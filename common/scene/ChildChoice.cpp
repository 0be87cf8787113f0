#include "common/scene/ChildChoice.h"

#include <fmt/format.h>

#include <bit>
#include <cmath>

#include "common/cores/DistanceLOD.h"
#include "common/cores/Switch.h"

namespace tessera {

std::optional<std::vector<std::size_t>> seenChildren(const Object& core, std::size_t count) {
    const Switch* choice = core.as<Switch>();
    const bool levels = core.is<DistanceLOD>();
    if (!levels && (!choice || choice->choice == Switch::kAll)) return std::nullopt;
    std::vector<std::size_t> seen;
    if (levels || choice->choice >= 0) {
        const std::size_t index = levels ? 0 : static_cast<std::size_t>(choice->choice);
        if (index < count) seen.push_back(index);
    } else if (choice->choice == Switch::kMask) {
        for (std::uint64_t left = static_cast<std::uint64_t>(choice->mask); left != 0; left &= left - 1)
            if (const auto index = static_cast<std::size_t>(std::countr_zero(left)); index < count)
                seen.push_back(index);
    }
    return seen;
}

Expected<void> checkRanges(const DistanceLOD& lod) {
    const std::span<const double> ranges = lod.ranges.as<double>();
    if (lod.ranges.sizeBytes() % sizeof(double) != 0)
        return fail(ErrorCode::kBadInput,
                    fmt::format("{} bytes of ranges are not a whole number of doubles", lod.ranges.sizeBytes()));
    if (ranges.size() >= DistanceLOD::kMostLevels)
        return fail(ErrorCode::kLimit,
                    fmt::format("{} ranges: there may be {} at most", ranges.size(), DistanceLOD::kMostLevels - 1));
    const bool size = lod.measure == DistanceLOD::kSize;
    for (std::size_t i = 0; i < ranges.size(); ++i) {
        if (!std::isfinite(ranges[i]) || ranges[i] < 0)
            return fail(ErrorCode::kBadInput,
                        fmt::format("range {} is {}: it has to be a finite number from 0", i, ranges[i]));
        if (i == 0 || (size ? ranges[i] < ranges[i - 1] : ranges[i] > ranges[i - 1])) continue;
        return fail(
            ErrorCode::kBadInput,
            fmt::format("range {} is {} after {}: each {} than the one before (set ranges and measure together)", i,
                        ranges[i], ranges[i - 1],
                        size ? "size in pixels has to be less" : "distance has to be greater"));
    }
    return {};
}

}  // namespace tessera

#include "common/scene/ChildChoice.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>

namespace tessera {

std::optional<std::size_t> soleChild(const Object& core) {
    if (core.is<DistanceLOD>()) return 0;
    const Switch* choice = core.as<Switch>();
    if (!choice || choice->choice == Switch::kAll) return std::nullopt;
    return choice->choice < 0 ? std::numeric_limits<std::size_t>::max() : static_cast<std::size_t>(choice->choice);
}

Expected<void> checkRanges(const DistanceLOD& lod) {
    const std::span<const double> ranges = lod.ranges.as<double>();
    if (lod.ranges.sizeBytes() % sizeof(double) != 0)
        return fail(ErrorCode::kBadInput, fmt::format("{} bytes of ranges are not a whole number of doubles", lod.ranges.sizeBytes()));
    if (ranges.size() >= DistanceLOD::kMostLevels)
        return fail(ErrorCode::kLimit, fmt::format("{} ranges: there may be {} at most", ranges.size(), DistanceLOD::kMostLevels - 1));
    const bool size = lod.measure == DistanceLOD::kSize;
    for (std::size_t i = 0; i < ranges.size(); ++i) {
        if (!std::isfinite(ranges[i]) || ranges[i] < 0)
            return fail(ErrorCode::kBadInput, fmt::format("range {} is {}: it has to be a finite number from 0", i, ranges[i]));
        if (i == 0 || (size ? ranges[i] < ranges[i - 1] : ranges[i] > ranges[i - 1])) continue;
        return fail(ErrorCode::kBadInput, fmt::format("range {} is {} after {}: each {} than the one before (set ranges and measure together)", i, ranges[i],
                                                      ranges[i - 1], size ? "size in pixels has to be less" : "distance has to be greater"));
    }
    return {};
}

}  // namespace tessera

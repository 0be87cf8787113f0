/// Where in a volume there is nothing to be seen: cubes of its cells, the least and the greatest value in each. No GL.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/cores/ShippedTypes.h"

namespace tessera {

class VolumeBricks {
public:
    /// Cells along each side of a brick: with the voxels at all its corners it shares a layer of them with its
    /// neighbours.
    static constexpr std::int64_t kSide = 8;

    VolumeBricks() = default;
    /// Of a volume whose fields have been checked, its voxels here.
    explicit VolumeBricks(const Volume& volume);
    /// Layers [first, end) of its voxels have become others.
    void update(const Volume& volume, std::int64_t first, std::int64_t end);

    [[nodiscard]] const std::array<std::int64_t, 3>& counts() const { return counts_; }
    /// By brick, x first, then y, then z: 0 where the transfer function makes anything in it visible; else how many
    /// steps away the nearest such brick is at least, sideways and across corners alike, 255 at most: all that are
    /// nearer are empty. Whatever float arithmetic makes of a value within a brick, what is taken from the transfer
    /// function is of opacity 0. Costs a look at each brick and stop.
    [[nodiscard]] std::vector<std::uint8_t> emptySteps(const Volume& volume) const;
    /// The greatest values, in field values.
    [[nodiscard]] const std::vector<float>& greatest() const { return most_; }
    [[nodiscard]] const std::vector<float>& least() const { return least_; }

private:
    std::array<std::int64_t, 3> counts_{};
    std::vector<float> least_, most_;
};

}  // namespace tessera

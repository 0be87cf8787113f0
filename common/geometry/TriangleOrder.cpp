#include "common/geometry/TriangleOrder.h"

#include <algorithm>
#include <array>
#include <bit>
#include <numeric>

#include "common/geometry/Mesh.h"

namespace tessera {
namespace {

/// Two zeros after each of 21 bits.
std::uint64_t spread(std::uint64_t x) {
    x = (x | x << 32) & 0x1f00000000ffffull;
    x = (x | x << 16) & 0x1f0000ff0000ffull;
    x = (x | x << 8) & 0x100f00f00f00f00full;
    x = (x | x << 4) & 0x10c30c30c30c30c3ull;
    return (x | x << 2) & 0x1249249249249249ull;
}

/// Sorted by all bits above the lowest `ignored`; those that are equal there stay as they stand. Digit by digit, from
/// the lowest; digits that all have in common are passed over.
void sortByHighBits(std::vector<std::uint64_t>& all, unsigned ignored) {
    constexpr unsigned kDigit = 11, kBits = 64;
    constexpr std::size_t kValues = std::size_t{1} << kDigit;
    const unsigned digits = (kBits - ignored + kDigit - 1) / kDigit;
    const auto digitOf = [&](std::uint64_t key, unsigned digit) {
        return static_cast<std::size_t>(key >> (ignored + digit * kDigit) & (kValues - 1));
    };
    std::vector<std::array<std::uint32_t, kValues>> ends(digits);
    for (const std::uint64_t key : all)
        for (unsigned digit = 0; digit < digits; ++digit) ++ends[digit][digitOf(key, digit)];
    std::vector<std::uint64_t> sorted(all.size());
    for (unsigned digit = 0; digit < digits; ++digit) {
        if (std::ranges::find(ends[digit], all.size()) != ends[digit].end()) continue;
        std::exclusive_scan(ends[digit].begin(), ends[digit].end(), ends[digit].begin(), std::uint32_t{0});
        for (const std::uint64_t key : all) sorted[ends[digit][digitOf(key, digit)]++] = key;
        all.swap(sorted);
    }
}

}  // namespace

std::vector<std::uint32_t> inSpatialOrder(std::span<const float> positions, std::span<const std::uint32_t> indices) {
    const Box bounds = boundsOf(positions);
    constexpr double kCells = (1 << 21) - 1;
    const double size = bounds.empty() ? 0 : bounds.size().maxCoeff();
    const double cells = size > 0 ? kCells / size : 0;
    // Above a triangle's number are as many bits of its code as are left: of three million 14 for each axis.
    std::vector<std::uint64_t> order(indices.size() / 3);
    const auto numberBits = static_cast<unsigned>(std::bit_width(order.size()));
    const std::uint64_t numbers = (std::uint64_t{1} << numberBits) - 1;
    for (std::uint32_t triangle = 0; triangle < order.size(); ++triangle) {
        std::uint64_t code = 0;
        for (unsigned axis = 0; axis < 3; ++axis) {
            double sum = 0;
            for (unsigned corner = 0; corner < 3; ++corner)
                sum += static_cast<double>(positions[3 * std::size_t{indices[3 * triangle + corner]} + axis]);
            const double cell = (sum / 3 - bounds.lower[axis]) * cells;
            code |= spread(static_cast<std::uint64_t>(std::clamp(cell, 0.0, kCells))) << axis;
        }
        order[triangle] = (code << 1 & ~numbers) | triangle;
    }
    sortByHighBits(order, numberBits);
    std::vector<std::uint32_t> out(indices.size());
    auto to = out.begin();
    for (const std::uint64_t key : order)
        to = std::copy_n(indices.begin() + static_cast<std::ptrdiff_t>(3 * (key & numbers)), 3, to);
    return out;
}

}  // namespace tessera

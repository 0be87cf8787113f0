#include "common/geometry/TriangleOrder.h"

#include <algorithm>
#include <array>
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

struct CodedTriangle {
    std::uint64_t code;
    std::uint32_t triangle;
};

/// By their codes; equal ones stay as they stand. Digit by digit, from the lowest.
void sortByCode(std::vector<CodedTriangle>& all) {
    constexpr unsigned kDigit = 11, kCode = 63;
    std::vector<CodedTriangle> sorted(all.size());
    for (unsigned shift = 0; shift < kCode; shift += kDigit) {
        std::array<std::size_t, std::size_t{1} << kDigit> ends{};
        const auto digitOf = [&](const CodedTriangle& place) { return place.code >> shift & (ends.size() - 1); };
        for (const CodedTriangle& place : all) ++ends[digitOf(place)];
        std::exclusive_scan(ends.begin(), ends.end(), ends.begin(), std::size_t{0});
        for (const CodedTriangle& place : all) sorted[ends[digitOf(place)]++] = place;
        all.swap(sorted);
    }
}

}  // namespace

std::vector<std::uint32_t> inSpatialOrder(std::span<const float> positions, std::span<const std::uint32_t> indices) {
    const Box bounds = boundsOf(positions);
    constexpr double kCells = (1 << 21) - 1;
    const double size = bounds.empty() ? 0 : bounds.size().maxCoeff();
    const double cells = size > 0 ? kCells / size : 0;
    std::vector<CodedTriangle> order(indices.size() / 3);
    for (std::uint32_t triangle = 0; triangle < order.size(); ++triangle) {
        std::uint64_t code = 0;
        for (unsigned axis = 0; axis < 3; ++axis) {
            double sum = 0;
            for (unsigned corner = 0; corner < 3; ++corner)
                sum += static_cast<double>(positions[3 * std::size_t{indices[3 * triangle + corner]} + axis]);
            const double cell = (sum / 3 - bounds.lower[axis]) * cells;
            code |= spread(static_cast<std::uint64_t>(std::clamp(cell, 0.0, kCells))) << axis;
        }
        order[triangle] = {code, triangle};
    }
    sortByCode(order);
    std::vector<std::uint32_t> out;
    out.reserve(indices.size());
    for (const CodedTriangle& place : order)
        for (unsigned corner = 0; corner < 3; ++corner) out.push_back(indices[3 * place.triangle + corner]);
    return out;
}

}  // namespace tessera

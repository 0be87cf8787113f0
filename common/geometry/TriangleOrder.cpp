#include "common/geometry/TriangleOrder.h"

#include <algorithm>

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

}  // namespace

std::vector<std::uint32_t> inSpatialOrder(std::span<const float> positions, std::span<const std::uint32_t> indices) {
    const Box bounds = boundsOf(positions);
    constexpr double kCells = (1 << 21) - 1;
    const double size = bounds.empty() ? 0 : bounds.size().maxCoeff();
    const double cells = size > 0 ? kCells / size : 0;
    struct Place {
        std::uint64_t code;
        std::uint32_t triangle;
        bool operator<(const Place& other) const {
            return code != other.code ? code < other.code : triangle < other.triangle;
        }
    };
    std::vector<Place> order(indices.size() / 3);
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
    std::sort(order.begin(), order.end());
    std::vector<std::uint32_t> out;
    out.reserve(indices.size());
    for (const Place& place : order)
        for (unsigned corner = 0; corner < 3; ++corner) out.push_back(indices[3 * place.triangle + corner]);
    return out;
}

}  // namespace tessera

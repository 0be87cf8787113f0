#include "server/collision/query/RealignedPlanes.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

namespace tessera {
namespace {

/// Where the plane of a direction begins in a node, by the direction's signs: 13 + x + 3 y + 9 z. That of the opposite
/// direction is at 26 minus that.
struct Rows {
    std::array<std::uint16_t, 27> at{};
    std::array<std::array<double, 3>, kMaxDirections> direction{};
};

constexpr std::uint64_t kStep[] = {1, 3, 9};
constexpr std::uint64_t kZero = 13;

Rows rowsOf(DirectionSet set) {
    Rows rows;
    const std::span<const Vec3d> all = directions(set);
    for (std::size_t i = 0; i < all.size(); ++i) {
        int code = 0;
        for (int axis = 0; axis < 3; ++axis) {
            code += static_cast<int>(kStep[axis]) * static_cast<int>(all[i][axis]);
            rows.direction[i][static_cast<std::size_t>(axis)] = all[i][axis];
        }
        rows.at[static_cast<std::size_t>(13 + code)] = static_cast<std::uint16_t>(i * kernel::kWidth);
        rows.at[static_cast<std::size_t>(13 - code)] = static_cast<std::uint16_t>((i + all.size()) * kernel::kWidth);
    }
    return rows;
}

const Rows& rowsBySigns(DirectionSet set) {
    static const std::array<Rows, 4> rows = {rowsOf(DirectionSet::k6), rowsOf(DirectionSet::k14),
                                             rowsOf(DirectionSet::k18), rowsOf(DirectionSet::k26)};
    return rows[static_cast<std::size_t>(set)];
}

/// The size of a coordinate with its axis and sign in the lowest bits (as step + kZero, 4 to 22): order by size is
/// order of these numbers, without branches, which nobody could predict.
constexpr std::uint64_t kCode = 31;
std::uint64_t sized(double x, int axis) {
    const std::uint64_t bits = std::bit_cast<std::uint64_t>(x), negative = bits >> 63;
    const std::uint64_t code = kZero + kStep[axis] - 2 * kStep[axis] * negative;
    return (bits & ~(kCode | std::uint64_t{1} << 63)) | code;
}
void order(std::uint64_t& a, std::uint64_t& b) {
    const std::uint64_t low = std::min(a, b);
    a = std::max(a, b);
    b = low;
}

struct Sum {
    std::uint64_t code[3];
    double weight[3];
};

/// The formulas of volume/Realignment.h for sizes a ≥ b ≥ c of the axes x, y, z; codes less kZero add up as directions.
template <DirectionSet Set>
Sum weigh(std::uint64_t x, std::uint64_t y, std::uint64_t z, double a, double b, double c) {
    if constexpr (Set == DirectionSet::k14)
        return {{x, x + y + z - 2 * kZero, x + y - z}, {a - b, 0.5 * (b + c), 0.5 * (b - c)}};
    if constexpr (Set == DirectionSet::k18) {
        // Both cases at once: (a + b - c) / 2 is b + rest / 2.
        const double rest = a - b - c, inner = 0.5 * std::min(rest, 0.0);
        const std::uint64_t isInner = std::uint64_t{0} - (std::bit_cast<std::uint64_t>(inner) >> 63);
        return {{x ^ ((x ^ (y + z - kZero)) & isInner), x + y - kZero, x + z - kZero},
                {std::max(rest, -inner), b + inner, c + inner}};
    }
    if constexpr (Set == DirectionSet::k26) return {{x, x + y - kZero, x + y + z - 2 * kZero}, {a - b, b - c, c}};
    return {{x, y, z}, {a, b, c}};
}

template <DirectionSet Set>
void weighAll(kernel::Realigned& out, const Rows& rows, std::size_t n, const Mat3d& m, const Vec3d& t, double slack) {
    for (std::size_t i = 0; i < n; ++i) {
        const std::array<double, 3>& d = rows.direction[i];
        const auto along = [&](int column) { return d[0] * m(0, column) + d[1] * m(1, column) + d[2] * m(2, column); };
        std::uint64_t x = sized(along(0), 0), y = sized(along(1), 1), z = sized(along(2), 2);
        order(x, y);
        order(y, z);
        order(x, y);
        // The codes that stay in the sizes change them by 2^-47, less than a float can tell.
        const Sum sum = weigh<Set>(x & kCode, y & kCode, z & kCode, std::bit_cast<double>(x), std::bit_cast<double>(y),
                                   std::bit_cast<double>(z));
        for (std::size_t j = 0; j < 3; ++j) {
            out.row[i][j] = rows.at[sum.code[j]];
            out.row[i + n][j] = rows.at[2 * kZero - sum.code[j]];
            out.weight[i][j] = out.weight[i + n][j] = static_cast<float>(sum.weight[j]);
        }
        const double offset = d[0] * t[0] + d[1] * t[1] + d[2] * t[2];
        out.offset[i] = static_cast<float>(slack + offset);
        out.offset[i + n] = static_cast<float>(slack - offset);
    }
}

}  // namespace

void realignPlanes(kernel::Realigned& out, DirectionSet set, const Affine3d& to_T_from, double radius, double stretch,
                   PlaneChoice choice) {
    // A bound is three products and the offset: 6 · 2^-24 of the sum of their sizes (forKernels of
    // volume/Realignment.h). That sum is at most 3 stretch · radius for the products, whatever the formula, and √3 |T|.
    const Mat3d m = to_T_from.linear();
    const Vec3d t = to_T_from.translation();
    const double slack = 0x1p-21 * (5 * stretch * radius + 2 * t.norm()) + 0x1p-120;
    const Rows& rows = rowsBySigns(set);
    const std::size_t n = directionCount(set);
    if (choice == PlaneChoice::kBoxEnclosure) return weighAll<DirectionSet::k6>(out, rows, n, m, t, slack);
    switch (set) {
        case DirectionSet::k6:
            return weighAll<DirectionSet::k6>(out, rows, n, m, t, slack);
        case DirectionSet::k14:
            return weighAll<DirectionSet::k14>(out, rows, n, m, t, slack);
        case DirectionSet::k18:
            return weighAll<DirectionSet::k18>(out, rows, n, m, t, slack);
        case DirectionSet::k26:
            return weighAll<DirectionSet::k26>(out, rows, n, m, t, slack);
    }
}

}  // namespace tessera

// The farthest vertex along a direction.
#include <algorithm>
#include <cmath>

#include "server/collision/convex/ConvexHull.h"
#include "server/collision/mesh/Expansion.h"
#include "server/collision/mesh/Predicates.h"

namespace tessera {

namespace {

using Lanes = double __attribute__((vector_size(16)));
using Masks = long long __attribute__((vector_size(16)));

template <typename Vector>
Vector chosen(Masks mask, Vector yes, Vector no) {
    return (Vector)((mask & (Masks)yes) | (~mask & (Masks)no));
}

/// The sign of d · (to - from) without rounding error.
int exactSignAlong(const Vec3d& d, const Vec3d& from, const Vec3d& to) {
    const exact::Expansion<4> x = exact::scaled(exact::difference(to.x(), from.x()), d.x());
    const exact::Expansion<4> y = exact::scaled(exact::difference(to.y(), from.y()), d.y());
    const exact::Expansion<4> z = exact::scaled(exact::difference(to.z(), from.z()), d.z());
    return exact::sum(exact::sum(x, y), z).sign();
}

struct Rise {
    double height;
    double doubt;  ///< the height is right to within this
};

Rise riseAlong(const Vec3d& d, const Vec3d& from, const Vec3d& to) {
    const double x = d.x() * (to.x() - from.x()), y = d.y() * (to.y() - from.y()), z = d.z() * (to.z() - from.z());
    // A difference, a product and two sums round; 5 instead of 4 pays for the rounding of the bound itself.
    return {x + y + z, 5 * exact::kRounding * (std::abs(x) + std::abs(y) + std::abs(z))};
}

}  // namespace

std::uint32_t ConvexHull::support(const Vec3d& wanted, std::uint32_t start, std::uint64_t& looks) const {
    const double largest = wanted.cwiseAbs().maxCoeff();
    if (!(largest > 0)) return start < vertices_.size() ? start : 0;
    const bool extreme = largest < 1e-100 || largest > 1e100;
    const Vec3d direction = extreme ? Vec3d(wanted / largest) : wanted;
    if (cells_ == 0) {
        looks += vertices_.size();
        return scan(direction);
    }
    const std::uint32_t kept = starts_[cellOf(direction)];
    ++looks;
    if (start >= vertices_.size() || riseAlong(direction, vertices_[start], vertices_[kept]).height > 0) start = kept;
    return climb(direction, start, looks);
}

std::uint32_t ConvexHull::scan(const Vec3d& d) const {
    const std::size_t rows = columns_.size() / 3;
    const double *x = columns_.data(), *y = x + rows, *z = y + rows;
    const auto heights = [&](std::size_t i) {
        const Lanes px{x[i], x[i + 1]}, py{y[i], y[i + 1]}, pz{z[i], z[i + 1]};
        return px * d.x() + py * d.y() + pz * d.z();
    };
    // Two pairs at a time: the comparisons of one do not wait for the other's.
    Lanes bestA = heights(0), bestB = heights(2);
    Masks whereA{0, 1}, whereB{2, 3}, atA = whereA, atB = whereB;
    for (std::size_t i = 4; i < rows; i += 4) {
        const Lanes a = heights(i), b = heights(i + 2);
        atA += 4;
        atB += 4;
        const Masks moreA = a > bestA, moreB = b > bestB;
        bestA = chosen(moreA, a, bestA);
        bestB = chosen(moreB, b, bestB);
        whereA = chosen(moreA, atA, whereA);
        whereB = chosen(moreB, atB, whereB);
    }
    const double best[4] = {bestA[0], bestA[1], bestB[0], bestB[1]};
    const long long where[4] = {whereA[0], whereA[1], whereB[0], whereB[1]};
    std::size_t k = 0;
    for (std::size_t i = 1; i < 4; ++i)
        if (best[i] > best[k] || (best[i] == best[k] && where[i] < where[k])) k = i;
    // The rows that fill up repeat vertex 0.
    return where[k] < static_cast<long long>(vertices_.size()) ? static_cast<std::uint32_t>(where[k]) : 0;
}

std::uint32_t ConvexHull::climb(const Vec3d& d, std::uint32_t at, std::uint64_t& looks) const {
    // On a convex surface a vertex above all its neighbours is above all others, if "above" is exact.
    while (true) {
        std::uint32_t up = at;
        double highest = 0;
        bool doubtful = false;
        for (const std::uint32_t n : neighbours(at)) {
            ++looks;
            const Rise rise = riseAlong(d, vertices_[at], vertices_[n]);
            if (rise.height > std::max(highest, rise.doubt)) {
                highest = rise.height;
                up = n;
            } else if (rise.doubt > 0 && std::abs(rise.height) <= rise.doubt) {
                doubtful = true;
            }
        }
        if (up == at && doubtful)
            for (const std::uint32_t n : neighbours(at))
                if (exactSignAlong(d, vertices_[at], vertices_[n]) > 0) {
                    up = n;
                    break;
                }
        if (up == at) return at;
        at = up;
    }
}

/// Cells of the six sides of a cube around the origin.
std::size_t ConvexHull::cellOf(const Vec3d& direction) const {
    int axis = 0;
    const double size = direction.cwiseAbs().maxCoeff(&axis);
    const auto cell = [&](double coordinate) {
        const double place = 0.5 * (coordinate / size + 1) * cells_;
        return std::min(cells_ - 1, static_cast<std::uint32_t>(std::max(0.0, place)));
    };
    const std::size_t side = 2 * static_cast<std::size_t>(axis) + (direction[axis] < 0 ? 1 : 0);
    return (side * cells_ + cell(direction[(axis + 1) % 3])) * cells_ + cell(direction[(axis + 2) % 3]);
}

void ConvexHull::keepStarts() {
    const double wanted = std::sqrt(static_cast<double>(vertices_.size()) / 24);
    cells_ = static_cast<std::uint32_t>(std::clamp(wanted, 1.0, 64.0));
    starts_.reserve(6 * std::size_t{cells_} * cells_);
    std::uint64_t looks = 0;
    std::uint32_t at = 0;
    for (int side = 0; side < 6; ++side)
        for (std::uint32_t i = 0; i < cells_; ++i)
            for (std::uint32_t j = 0; j < cells_; ++j) {
                Vec3d middle;
                middle[side / 2] = side % 2 == 0 ? 1 : -1;
                middle[(side / 2 + 1) % 3] = (2.0 * i + 1) / cells_ - 1;
                middle[(side / 2 + 2) % 3] = (2.0 * j + 1) / cells_ - 1;
                at = climb(middle, at, looks);
                starts_.push_back(at);
            }
}

}  // namespace tessera

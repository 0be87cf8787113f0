#include "server/collision/volume/KDop.h"

#include <algorithm>
#include <numbers>

namespace tessera {

namespace {

struct Table {
    std::array<Vec3d, kMaxDirections> all;
    std::array<Vec3d, 7> axesAndCorners;
};

const Table& table() {
    static const Table made = [] {
        Table t;
        t.all = {Vec3d(1, 0, 0),  Vec3d(0, 1, 0),  Vec3d(0, 0, 1),  Vec3d(1, 1, 0),  Vec3d(1, -1, 0),
                 Vec3d(1, 0, 1),  Vec3d(1, 0, -1), Vec3d(0, 1, 1),  Vec3d(0, 1, -1), Vec3d(1, 1, 1),
                 Vec3d(1, 1, -1), Vec3d(1, -1, 1), Vec3d(1, -1, -1)};
        std::copy_n(t.all.begin(), 3, t.axesAndCorners.begin());
        std::copy_n(t.all.begin() + 9, 4, t.axesAndCorners.begin() + 3);
        return t;
    }();
    return made;
}

}  // namespace

std::span<const Vec3d> directions(DirectionSet set) {
    if (set == DirectionSet::k14) return table().axesAndCorners;
    return std::span<const Vec3d>(table().all).first(directionCount(set));
}

double coveringAngle(DirectionSet set) {
    // From a vertex of the DOP around the unit sphere to the points where its planes touch: 1 / (its distance).
    switch (set) {
        case DirectionSet::k6:  // vertex (1, 1, 1)
            return std::acos(1 / std::numbers::sqrt3);
        case DirectionSet::k14: {  // x = 1, x + y ± z = √3: (1, √3 - 1, 0)
            const double y = std::numbers::sqrt3 - 1;
            return std::acos(1 / std::sqrt(1 + y * y));
        }
        case DirectionSet::k18:  // the three edges around a corner: (1, 1, 1) / √2
            return std::acos(std::numbers::sqrt2 / std::numbers::sqrt3);
        case DirectionSet::k26:
            break;
    }
    // x = 1, x + y = √2, x + y + z = √3.
    const double y = std::numbers::sqrt2 - 1, z = std::numbers::sqrt3 - std::numbers::sqrt2;
    return std::acos(1 / std::sqrt(1 + y * y + z * z));
}

Projections project(DirectionSet set, const Vec3d& v) {
    const double x = v.x(), y = v.y(), z = v.z();
    switch (set) {
        case DirectionSet::k6:
            return {x, y, z};
        case DirectionSet::k14:
            return {x, y, z, x + y + z, x + y - z, x - y + z, x - y - z};
        case DirectionSet::k18:
            return {x, y, z, x + y, x - y, x + z, x - z, y + z, y - z};
        case DirectionSet::k26:
            break;
    }
    const double plus = x + y, minus = x - y;
    return {x, y, z, plus, minus, x + z, x - z, y + z, y - z, plus + z, plus - z, minus + z, minus - z};
}

KDop::KDop(DirectionSet s) : set(s) {
    lower.fill(0);
    upper.fill(0);
    std::fill_n(lower.begin(), count(), std::numeric_limits<double>::infinity());
    std::fill_n(upper.begin(), count(), -std::numeric_limits<double>::infinity());
}

KDop KDop::around(DirectionSet set, std::span<const Vec3d> points) {
    KDop dop(set);
    for (const Vec3d& p : points) dop.extend(p);
    return dop;
}

void KDop::extend(const Vec3d& point) {
    const Projections at = project(set, point);
    for (std::size_t i = 0; i < count(); ++i) {
        lower[i] = std::min(lower[i], at[i]);
        upper[i] = std::max(upper[i], at[i]);
    }
}

void KDop::extend(const KDop& other) {
    for (std::size_t i = 0; i < count(); ++i) {
        lower[i] = std::min(lower[i], other.lower[i]);
        upper[i] = std::max(upper[i], other.upper[i]);
    }
}

bool KDop::overlaps(const KDop& other) const {
    for (std::size_t i = 0; i < count(); ++i)
        if (!(lower[i] <= other.upper[i] && other.lower[i] <= upper[i])) return false;
    return true;
}

}  // namespace tessera

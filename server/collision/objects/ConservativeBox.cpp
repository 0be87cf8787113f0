#include "server/collision/objects/ConservativeBox.h"

namespace tessera {

Box boxAround(const Affine3d& to_T_from, const Box& box) {
    if (box.empty()) return {};
    // A mapped vertex is off by a few units in the last place of the sums that made it.
    constexpr double kSlack = 4e-15;
    const Vec3d center = 0.5 * (box.lower + box.upper);
    const Vec3d half = 0.5 * (box.upper - box.lower);
    const Mat3d magnitude = to_T_from.linear().cwiseAbs();
    const Vec3d shift = to_T_from.translation().cwiseAbs();
    const Vec3d reach = magnitude * half + kSlack * (magnitude * (center.cwiseAbs() + half) + shift);
    const Vec3d c = to_T_from * center;
    Box out;
    out.lower = c - reach;
    out.upper = c + reach;
    return out;
}

}  // namespace tessera

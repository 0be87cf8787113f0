#include "common/math/Box.h"

namespace tessera {

Box Box::transformed(const Affine3d& m) const {
    if (empty()) return {};
    const Vec3d c = m * center();
    const Vec3d h = m.linear().cwiseAbs() * (0.5 * size());
    Box out;
    out.lower = c - h;
    out.upper = c + h;
    return out;
}

}  // namespace tessera

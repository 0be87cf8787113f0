#include "server/collision/mesh/Predicates.h"

#include "server/collision/mesh/Expansion.h"

namespace tessera::exact {

namespace {

/// a*d - b*c of two-term entries.
Expansion<16> minor2(const Expansion<2>& a, const Expansion<2>& b, const Expansion<2>& c, const Expansion<2>& d) {
    return sum(product(a, d), negated(product(b, c)));
}

}  // namespace

int orient2dExact(const Vec2d& a, const Vec2d& b, const Vec2d& c) {
    const Expansion<2> acx = difference(a.x(), c.x()), acy = difference(a.y(), c.y());
    const Expansion<2> bcx = difference(b.x(), c.x()), bcy = difference(b.y(), c.y());
    return minor2(acx, acy, bcx, bcy).sign();
}

int orient3dExact(const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& d) {
    const Expansion<2> adx = difference(a.x(), d.x()), ady = difference(a.y(), d.y()), adz = difference(a.z(), d.z());
    const Expansion<2> bdx = difference(b.x(), d.x()), bdy = difference(b.y(), d.y()), bdz = difference(b.z(), d.z());
    const Expansion<2> cdx = difference(c.x(), d.x()), cdy = difference(c.y(), d.y()), cdz = difference(c.z(), d.z());
    const Expansion<64> first = product(minor2(bdx, bdy, cdx, cdy), adz);
    const Expansion<64> second = product(minor2(cdx, cdy, adx, ady), bdz);
    const Expansion<64> third = product(minor2(adx, ady, bdx, bdy), cdz);
    return -sum(sum(first, second), third).sign();
}

}  // namespace tessera::exact

#include "server/collision/volume/PolytopeVolume.h"

#include <vector>

namespace tessera {
namespace {

struct HalfSpace {
    Vec3d normal;  ///< of unit length
    double offset;
};

/// What of a convex polygon is within a half-space (Sutherland and Hodgman).
void clip(std::vector<Vec3d>& polygon, const HalfSpace& side, std::vector<Vec3d>& scratch) {
    scratch.clear();
    for (std::size_t i = 0; i < polygon.size(); ++i) {
        const Vec3d &from = polygon[i], &to = polygon[(i + 1) % polygon.size()];
        const double a = side.normal.dot(from) - side.offset, b = side.normal.dot(to) - side.offset;
        if (a <= 0) scratch.push_back(from);
        if ((a < 0 && b > 0) || (a > 0 && b < 0)) scratch.push_back(from + a / (a - b) * (to - from));
    }
    polygon.swap(scratch);
}

}  // namespace

double polytopeVolume(const KDop& dop) {
    if (dop.empty()) return 0;
    const std::size_t n = dop.count();
    // About its middle, so that what is far from the origin loses no digits.
    Vec3d centre;
    for (int axis = 0; axis < 3; ++axis)
        centre[axis] = 0.5 * (dop.lower[static_cast<std::size_t>(axis)] + dop.upper[static_cast<std::size_t>(axis)]);
    std::vector<HalfSpace> sides(2 * n);
    double reach = 0;
    for (std::size_t i = 0; i < 2 * n; ++i) {
        const Vec3d d = i < n ? directions(dop.set)[i] : Vec3d(-directions(dop.set)[i - n]);
        sides[i] = {d.normalized(), (dop.halfPlane(i) - d.dot(centre)) / d.norm()};
        if (i < 3) reach += dop.upper[i] - dop.lower[i];
    }
    double six = 0;
    std::vector<Vec3d> polygon, scratch;
    for (std::size_t i = 0; i < sides.size(); ++i) {
        // A square on this plane that is larger than the axis box, cut by all other planes.
        const Vec3d middle = sides[i].offset * sides[i].normal, u = sides[i].normal.unitOrthogonal(),
                    v = sides[i].normal.cross(u);
        polygon = {middle - reach * (u + v), middle + reach * (u - v), middle + reach * (u + v),
                   middle - reach * (u - v)};
        for (std::size_t j = 0; j < sides.size() && !polygon.empty(); ++j)
            if (j != i) clip(polygon, sides[j], scratch);
        for (std::size_t k = 2; k < polygon.size(); ++k) six += polygon[0].dot(polygon[k - 1].cross(polygon[k]));
    }
    return std::max(0.0, six / 6);
}

}  // namespace tessera

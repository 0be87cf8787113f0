#include "server/collision/spherical_bezier/StarShape.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

namespace tessera {
namespace {

struct Plane {
    Vec3d normal;  ///< of unit length
    double offset;
};

/// How far a place is behind the plane that it is least behind, and that plane.
struct Least {
    double depth = std::numeric_limits<double>::infinity();
    const Plane* plane = nullptr;
};

Least leastBehind(const std::vector<Plane>& planes, const Vec3d& at) {
    Least least;
    for (const Plane& p : planes)
        if (const double depth = p.offset - p.normal.dot(at); depth < least.depth) least = {depth, &p};
    return least;
}

/// Van Oosterom and Strackee 1983, with the sign of the determinant.
double solidAngle(const Vec3d& a, const Vec3d& b, const Vec3d& c) {
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    return 2 * std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
}

}  // namespace

std::optional<Vec3d> starCentreOf(const TriangleMesh& mesh) {
    if (mesh.faceCount() == 0) return std::nullopt;
    const Vec3d middle = mesh.bounds().center();
    const double size = mesh.bounds().size().norm();
    if (!(size > 0)) return std::nullopt;
    // About the middle and of size 1, so that one margin fits all.
    std::vector<Plane> planes;
    planes.reserve(mesh.faceCount());
    double volume = 0;
    const auto cornerOf = [&](std::uint32_t face, unsigned i) { return Vec3d((mesh.corner(face, i) - middle) / size); };
    for (std::uint32_t face = 0; face < mesh.faceCount(); ++face) {
        const Vec3d a = cornerOf(face, 0), b = cornerOf(face, 1), c = cornerOf(face, 2);
        const Vec3d normal = (b - a).cross(c - a);
        const double length = normal.norm();
        volume += a.dot(normal);
        // What is narrower than rounding may look anywhere: the poles of a ball, say.
        if (length > 1e-12) planes.push_back({normal / length, normal.dot(a) / length});
    }
    // Faces may all look inwards.
    if (volume < 0)
        for (Plane& p : planes) p = {-p.normal, -p.offset};
    // Towards the side of the plane that is missed by most, again and again (Motzkin and Schoenberg 1954): it comes to
    // a place that is `wanted` behind all planes wherever there is one; thin bodies may have less.
    constexpr double kEnough = 1e-6;
    constexpr int kSteps = 100;
    Vec3d best = Vec3d::Zero();
    double depth = leastBehind(planes, best).depth;
    for (const double wanted : {0.05, 0.005, 1e-4}) {
        Vec3d at = best;
        for (int step = 0; step < kSteps && depth < wanted; ++step) {
            const Least least = leastBehind(planes, at);
            if (least.depth > depth) {
                depth = least.depth;
                best = at;
            }
            at -= (wanted - least.depth) * least.plane->normal;
        }
        if (depth >= wanted) break;
    }
    if (!(depth > kEnough)) return std::nullopt;
    // Each direction once.
    double angle = 0;
    for (std::uint32_t face = 0; face < mesh.faceCount(); ++face)
        angle += std::abs(solidAngle(cornerOf(face, 0) - best, cornerOf(face, 1) - best, cornerOf(face, 2) - best));
    constexpr double kSphere = 4 * std::numbers::pi;
    if (angle > kSphere * (1 + 1e-6)) return std::nullopt;
    return Vec3d(middle + size * best);
}

}  // namespace tessera

#include "server/collision/rigid_bodies/ContactPoint.h"

#include <algorithm>
#include <array>

namespace tessera::rigid {

namespace {

constexpr double kSameDirection = 0.97;

struct Cluster {
    Vec3d normal;
    std::size_t count = 0;
    std::array<ContactPoint, kMostPoints> kept;
};

/// The deepest is in already. Then the farthest from it, the farthest from the line of both, the farthest from all on
/// the other side: as large a quadrangle as there is, whatever the number of points.
void choose(Cluster& cluster, const std::vector<ContactPoint>& points, std::size_t first, double near) {
    const auto best = [&](const auto& value) {
        const ContactPoint* found = nullptr;
        double most = near;
        for (std::size_t i = first; i < points.size(); ++i) {
            if (points[i].normal.dot(cluster.normal) < kSameDirection) continue;
            const double v = value(points[i].position);
            // A hair's breadth decides nothing: among equals the earlier stays, frame after frame.
            if (v > most * (1 + 1e-6)) {
                most = v;
                found = &points[i];
            }
        }
        if (found != nullptr) cluster.kept[cluster.count++] = *found;
        return found != nullptr;
    };
    const Vec3d a = cluster.kept[0].position;
    if (!best([&](const Vec3d& p) { return (p - a).norm(); })) return;
    const Vec3d along = (cluster.kept[1].position - a).normalized(), aside = cluster.normal.cross(along);
    if (!best([&](const Vec3d& p) { return std::abs((p - a).dot(aside)); })) return;
    const double side = (cluster.kept[2].position - a).dot(aside);
    // Farthest outside the triangle: beyond any of its three edges.
    const Vec3d c = cluster.kept[2].position;
    const Vec3d b = cluster.kept[1].position;
    best([&](const Vec3d& p) {
        const auto beyond = [&](const Vec3d& from, const Vec3d& to, const Vec3d& inner) {
            Vec3d out = cluster.normal.cross(to - from);
            const double length = out.norm();
            if (!(length > 0)) return 0.0;
            out /= length;
            if (out.dot(inner - from) > 0) out = -out;
            return out.dot(p - from);
        };
        return std::max({side > 0 || side < 0 ? beyond(a, b, c) : 0.0, beyond(b, c, a), beyond(c, a, b)});
    });
}

}  // namespace

void reduceContacts(std::vector<ContactPoint>& points, std::size_t first, double near) {
    if (points.size() - first <= 1) return;
    std::array<Cluster, kMostClusters> clusters;
    std::size_t count = 0;
    while (count < kMostClusters) {
        // The deepest in a direction that no cluster has yet.
        const ContactPoint* deepest = nullptr;
        for (std::size_t i = first; i < points.size(); ++i) {
            const ContactPoint& p = points[i];
            if (deepest != nullptr && !(p.gap < deepest->gap - 1e-6 * near)) continue;
            const bool taken = std::any_of(clusters.begin(), clusters.begin() + static_cast<std::ptrdiff_t>(count),
                                           [&](const Cluster& c) { return c.normal.dot(p.normal) >= kSameDirection; });
            if (!taken) deepest = &p;
        }
        if (deepest == nullptr) break;
        Cluster& cluster = clusters[count++];
        cluster.normal = deepest->normal;
        cluster.kept[0] = *deepest;
        cluster.count = 1;
        choose(cluster, points, first, near);
    }
    points.resize(first);
    for (std::size_t c = 0; c < count; ++c)
        points.insert(points.end(), clusters[c].kept.begin(),
                      clusters[c].kept.begin() + static_cast<std::ptrdiff_t>(clusters[c].count));
}

}  // namespace tessera::rigid

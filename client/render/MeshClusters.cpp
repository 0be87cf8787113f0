#include "client/render/MeshClusters.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace tessera {

namespace {

constexpr float kFloatHuge = std::numeric_limits<float>::infinity();

/// Its triangles' normals and their least height. Nothing where one has no area: rounding may give it any direction.
void findCone(std::span<const float> positions, std::span<const std::uint32_t> indices, MeshCluster& cluster) {
    std::array<Vec3d, MeshCluster::kTriangles> normals;
    Vec3d sum = Vec3d::Zero();
    double lowest = HUGE_VAL;
    for (std::size_t t = 0; 3 * t < indices.size(); ++t) {
        std::array<Vec3d, 3> p;
        for (std::size_t i = 0; i < 3; ++i) {
            const float* from = positions.data() + 3 * std::size_t{indices[3 * t + i]};
            p[i] = Vec3d(from[0], from[1], from[2]);
        }
        const Vec3d area = (p[1] - p[0]).cross(p[2] - p[0]);
        const double longest = std::max({(p[1] - p[0]).norm(), (p[2] - p[1]).norm(), (p[0] - p[2]).norm()});
        lowest = std::min(lowest, area.norm() / longest);
        // Sixteen digits leave nothing of a direction below this; NaN, too, ends here.
        if (!(area.norm() > 1e-10 * longest * longest)) return;
        normals[t] = area.normalized();
        sum += normals[t];
    }
    const Vec3f axis = sum.normalized().cast<float>();
    double cosine = 1;
    for (std::size_t t = 0; 3 * t < indices.size(); ++t)
        cosine = std::min(cosine, normals[t].dot(axis.cast<double>().normalized()));
    if (!(cosine > 0.01)) return;
    cluster.axis = axis;
    // Rounded so that the cone holds all the same.
    cluster.cosine = static_cast<float>(cosine) - 1e-6f;
    cluster.sine = static_cast<float>(std::sqrt(std::max(0.0, 1 - cosine * cosine))) + 1e-6f;
    cluster.altitude = std::nextafter(static_cast<float>(0.999999 * lowest), 0.0f);
}

}  // namespace

std::vector<MeshCluster> clustersOf(std::span<const float> positions, std::span<const std::uint32_t> indices) {
    constexpr std::size_t kFewest = 4;
    const std::size_t perCluster = 3 * MeshCluster::kTriangles;
    if (indices.size() < kFewest * perCluster) return {};
    std::vector<MeshCluster> clusters;
    clusters.reserve((indices.size() + perCluster - 1) / perCluster);
    Box all;
    double sizes = 0;
    for (std::size_t first = 0; first < indices.size(); first += perCluster) {
        const std::span<const std::uint32_t> corners =
            indices.subspan(first, std::min(perCluster, indices.size() - first));
        Box box;
        for (const std::uint32_t corner : corners) {
            const float* p = positions.data() + 3 * std::size_t{corner};
            box.extend(Vec3d(p[0], p[1], p[2]));
        }
        all.extend(box);
        sizes += box.size().norm();
        MeshCluster cluster{box.center().cast<float>(), {}};
        // So that rounding leaves nothing outside.
        const Vec3d centre = cluster.centre.cast<double>();
        for (int axis = 0; axis < 3; ++axis) {
            const double reach = std::max(box.upper[axis] - centre[axis], centre[axis] - box.lower[axis]);
            cluster.half[axis] = std::nextafter(static_cast<float>(reach), kFloatHuge);
        }
        findCone(positions, corners, cluster);
        clusters.push_back(cluster);
    }
    // Where each reaches through half of the mesh little would ever be left away.
    constexpr double kCompact = 0.5;
    if (sizes > kCompact * all.size().norm() * static_cast<double>(clusters.size())) return {};
    return clusters;
}

ClusterSight::ClusterSight(const ScreenCamera& screen, const PixelRect& shown, const PixelRect& uncut)
    : shown_(tileFrustum(screen, shown)),
      // A pixel less on each side: corners are displaced by far less.
      uncut_(tileFrustum(screen, uncut, -1)),
      projection_(screen, uncut),
      eye_T_world_(screen.eye_T_world) {}

ClusterSight::Sides ClusterSight::sidesOf(const Frustum& frustum, const Affine3d& world_T_mesh) {
    Sides sides;
    for (std::size_t i = 0; i < sides.size(); ++i) {
        const Plane& plane = frustum.planes()[i];
        const Vec3d normal = world_T_mesh.linear().transpose() * plane.normal;
        sides[i] = {normal, normal.cwiseAbs(), plane.normal.dot(world_T_mesh.translation()) + plane.offset};
    }
    return sides;
}

std::optional<ClusterSight::Facing> ClusterSight::facing(const Mesh& mesh, const Affine3d& world_T_mesh) const {
    if (mesh.backFacesShown || !projection_.usable()) return std::nullopt;
    const Affine3d eye_T_mesh = eye_T_world_ * world_T_mesh;
    const Mat3d m = eye_T_mesh.linear();
    const double volume = std::abs(m.determinant());
    // At least how much longer any length becomes, squared.
    const double stretch = (m.transpose() * m).cwiseAbs().rowwise().sum().maxCoeff();
    if (!(volume > 1e-9 * stretch * std::sqrt(stretch))) return std::nullopt;
    Facing facing;
    facing.eye = -(m.inverse() * eye_T_mesh.translation());
    const Vec3d forward = -m.row(2).transpose();
    facing.depth = {forward, forward.cwiseAbs(), -eye_T_mesh.translation().z()};
    facing.scale = projection_.leastPixelsPerMetre() * volume / stretch;
    facing.noise = projection_.noise(mesh.reach, world_T_mesh.translation());
    return facing;
}

// Twice a triangle's area on the screen, in pixels, is kx · ky · |det M| · 2 A · n·(p - e) / (z0 z1 z2), M being the
// linear part of eye_T_mesh, A its area and n·(p - e) the eye's distance from its plane in the mesh; the way on the
// screen between two points whose greater distance from the eye is d is at most k · |p - q| · d / z². Their quotient is
// its least height.
bool ClusterSight::turnedAway(const MeshCluster& cluster, const Vec3d& centre, const Vec3d& half,
                              const Facing& facing) const {
    if (!(cluster.altitude > 0)) return false;
    const Vec3d away = centre - facing.eye;
    const double distance = away.norm(), radius = half.norm();
    const double along = cluster.axis.cast<double>().dot(away);
    // The eye's least distance from any of its planes.
    const double behind =
        along * static_cast<double>(cluster.cosine) -
        std::sqrt(std::max(0.0, distance * distance - along * along)) * static_cast<double>(cluster.sine) -
        1.00001 * radius - 1e-5 * distance;
    if (!(behind > 0)) return false;
    const double nearest = facing.depth.least(centre, half), farthest = facing.depth.most(centre, half);
    if (!(nearest > projection_.nearMetres())) return false;
    const double height = facing.scale * static_cast<double>(cluster.altitude) * behind * nearest * nearest /
                          (farthest * farthest * farthest * (distance + radius));
    return height > projection_.flattestPx(facing.noise, 1 / nearest);
}

void ClusterSight::appendRuns(const Mesh& mesh, const Affine3d& world_T_mesh, std::vector<TriangleRun>& runs) const {
    const Sides shown = sidesOf(shown_, world_T_mesh), uncut = sidesOf(uncut_, world_T_mesh);
    const std::optional<Facing> facing = this->facing(mesh, world_T_mesh);
    const std::size_t before = runs.size();
    for (std::size_t k = 0; k < mesh.clusters.size(); ++k) {
        if (hasBit(mesh.hidden, k)) continue;
        const MeshCluster& cluster = mesh.clusters[k];
        const Vec3d centre = cluster.centre.cast<double>(), half = cluster.half.cast<double>();
        // NaN is not outside.
        const auto outside = [&](const Side& side) { return side.most(centre, half) < 0; };
        if (std::any_of(shown.begin(), shown.end(), outside)) continue;
        const auto inside = [&](const Side& side) { return side.least(centre, half) > 0; };
        if (facing && turnedAway(cluster, centre, half, *facing) && std::all_of(uncut.begin(), uncut.end(), inside))
            continue;
        const auto first = static_cast<std::uint32_t>(k * MeshCluster::kTriangles);
        const std::uint32_t count =
            std::min(static_cast<std::uint32_t>(MeshCluster::kTriangles), mesh.triangles - first);
        if (runs.size() > before && runs.back().first + runs.back().count == first)
            runs.back().count += count;
        else
            runs.push_back({first, count});
    }
}

}  // namespace tessera

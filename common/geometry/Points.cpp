#include "common/geometry/Points.h"

#include <algorithm>
#include <limits>

namespace tessera {

namespace {

constexpr double kUnknownRadius = 1.0 / 2000;

constexpr std::array<std::array<int, 3>, kVerticesPerPoint> kCorners = {
    {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}};

/// The face of an octant: its corners on X, Y and Z, turned around where the octant is a mirrored one.
constexpr std::array<std::uint32_t, 3> faceOf(std::uint32_t octant) {
    const std::uint32_t x = octant & 1, y = 2 + (octant >> 1 & 1), z = 4 + (octant >> 2 & 1);
    const bool mirrored = ((octant ^ octant >> 1 ^ octant >> 2) & 1) != 0;
    return mirrored ? std::array{x, z, y} : std::array{x, y, z};
}

/// `perPoint` values of each point, for each of its corners.
template <typename T>
std::vector<T> repeated(std::span<const T> values, std::size_t perPoint, const ByteRange& which) {
    std::vector<T> out;
    if (values.empty()) return out;
    out.reserve((which.end - which.begin) * perPoint * kVerticesPerPoint);
    for (std::size_t point = which.begin; point < which.end; ++point)
        for (std::size_t corner = 0; corner < kVerticesPerPoint; ++corner)
            for (std::size_t i = 0; i < perPoint; ++i) out.push_back(values[point * perPoint + i]);
    return out;
}

/// A coordinate at the end of what a float holds stays there.
float toFloat(double x) {
    constexpr double kMost = std::numeric_limits<float>::max();
    return static_cast<float>(std::clamp(x, -kMost, kMost));
}

}  // namespace

double shownRadius(double pointRadius, const Box& places) {
    if (pointRadius > 0) return pointRadius;
    const double diagonal = places.empty() ? 0.0 : places.size().norm();
    return kUnknownRadius * (diagonal > 0 ? diagonal : 1.0);
}

double shownRadius(const MeshArrays& points) {
    return points.pointRadius > 0 ? points.pointRadius : shownRadius(0, boundsOf(points.positions.as<float>()));
}

Box boundsOfPoints(const Box& places, double pointRadius) {
    if (places.empty()) return places;
    const Vec3d radius = Vec3d::Constant(shownRadius(pointRadius, places));
    // The balls, and their octahedra, whose corners are rounded to floats.
    Box bounds;
    for (const Vec3d& end : {Vec3d(places.lower - radius), Vec3d(places.upper + radius)}) {
        bounds.extend(end);
        bounds.extend(Vec3d(toFloat(end.x()), toFloat(end.y()), toFloat(end.z())));
    }
    return bounds;
}

MeshData trianglesOfPoints(const MeshArrays& points, double radius, const ByteRange& which) {
    const std::span<const float> centres = points.positions.as<float>();
    const std::size_t count = which.end - which.begin;
    MeshData mesh;
    mesh.normals = repeated(points.normals.as<float>(), 3, which);
    mesh.texcoords = repeated(points.texcoords.as<float>(), 2, which);
    mesh.texcoords1 = repeated(points.texcoords1.as<float>(), 2, which);
    mesh.colors = repeated(points.colors.as<std::uint8_t>(), 4, which);
    const bool asBalls = mesh.normals.empty();
    mesh.positions.reserve(3 * kVerticesPerPoint * count);
    mesh.indices = indicesOfPoints({0, count});
    if (asBalls) mesh.normals.reserve(3 * kVerticesPerPoint * count);
    for (std::size_t point = which.begin; point < which.end; ++point)
        for (const std::array<int, 3>& corner : kCorners)
            for (std::size_t axis = 0; axis < 3; ++axis) {
                mesh.positions.push_back(toFloat(double{centres[3 * point + axis]} + radius * corner[axis]));
                if (asBalls) mesh.normals.push_back(static_cast<float>(corner[axis]));
            }
    return mesh;
}

std::vector<std::uint32_t> indicesOfPoints(const ByteRange& which) {
    std::vector<std::uint32_t> indices;
    indices.reserve((which.end - which.begin) * kFacesPerPoint * 3);
    for (std::uint64_t point = which.begin; point < which.end; ++point)
        for (std::uint32_t octant = 0; octant < kFacesPerPoint; ++octant)
            for (const std::uint32_t corner : faceOf(octant))
                indices.push_back(static_cast<std::uint32_t>(point * kVerticesPerPoint) + corner);
    return indices;
}

MeshData trianglesOfPoints(const MeshArrays& points) {
    return trianglesOfPoints(points, shownRadius(points), {0, points.positions.as<float>().size() / 3});
}

}  // namespace tessera

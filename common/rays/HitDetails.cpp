#include "common/rays/HitDetails.h"

#include <array>
#include <cstring>

#include "common/geometry/Points.h"

namespace tessera {

namespace {

/// An element of an array of floats or indices; nothing where it has none.
template <typename Value, std::size_t count>
std::optional<std::array<Value, count>> elementOf(const Blob& blob, std::size_t index) {
    std::array<Value, count> out;
    if (!blob.resident() || blob.sizeBytes() / sizeof(out) <= index) return std::nullopt;
    std::memcpy(out.data(), blob.bytes().data() + index * sizeof(out), sizeof(out));
    return out;
}

std::optional<Vec2d> texcoordOf(const MeshArrays& arrays, std::uint32_t face, const Vec3d& weights) {
    if (arrays.kind != MeshKind::kTriangles) return std::nullopt;
    const auto corners = elementOf<std::uint32_t, 3>(arrays.indices, face);
    if (!corners) return std::nullopt;
    Vec2d sum = Vec2d::Zero();
    for (std::size_t i = 0; i < 3; ++i) {
        const auto uv = elementOf<float, 2>(arrays.texcoords, (*corners)[i]);
        if (!uv) return std::nullopt;
        sum += weights[static_cast<Eigen::Index>(i)] * Vec2d((*uv)[0], (*uv)[1]);
    }
    return sum;
}

}  // namespace

std::optional<HitDetails> detailsOf(const MeshArrays& arrays, const Affine3d& world_T_mesh, std::uint32_t face,
                                    const Vec3d& point) {
    const double radius = arrays.kind == MeshKind::kPoints ? shownRadius(arrays) : 0;
    const std::optional<std::array<Vec3f, 3>> corners = cornersOf(arrays, face, radius);
    if (!corners) return std::nullopt;
    std::array<Vec3d, 3> at;
    for (std::size_t i = 0; i < 3; ++i) at[i] = world_T_mesh * Vec3d((*corners)[i].cast<double>());
    HitDetails out;
    const Vec3d cross = (at[1] - at[0]).cross(at[2] - at[0]);
    const double area = cross.norm();
    out.weights = {1, 0, 0};
    if (area > 0) {
        out.normal = cross / area;
        // Areas of the parts across from each corner (C. Ericson, "Real-Time Collision Detection", 2005, 3.4), in the
        // face's plane.
        const double second = out.normal.dot((at[0] - point).cross(at[2] - at[0])) / -area;
        const double third = out.normal.dot((at[1] - at[0]).cross(point - at[0])) / area;
        out.weights = {1 - second - third, second, third};
    }
    out.texcoord = texcoordOf(arrays, face, out.weights);
    return out;
}

}  // namespace tessera

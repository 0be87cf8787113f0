#include "server/import/DeformedCores.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "common/drawable/DeformationArrays.h"
#include "common/drawable/Drawable.h"
#include "common/geometry/Mesh.h"
#include "server/import/MessageArrays.h"

namespace tessera {
namespace {

/// Strips, quads and polygons as the triangles that they are; `refusal`: of points and lines.
Expected<MeshArrays> trianglesOf(LoadedFile& file, const std::string& mesh, const char* refusal) {
    const Expected<Geometry> geometry = file.mesh(mesh);
    if (!geometry) return tl::unexpected(geometry.error());
    std::optional<MeshArrays> arrays = drawableOf(Object::of(*geometry)).arrays();
    if (arrays->kind != MeshKind::kTriangles) return fail(ErrorCode::kBadInput, refusal);
    return std::move(*arrays);
}

template <typename Core>
void takeArrays(Core& core, MeshArrays&& arrays) {
    core.positions = std::move(arrays.positions);
    core.normals = std::move(arrays.normals);
    core.colors = std::move(arrays.colors);
    core.texcoords = std::move(arrays.texcoords);
    core.texcoords1 = std::move(arrays.texcoords1);
    core.indices = std::move(arrays.indices);
    core.tangents = std::move(arrays.tangents);
}

Vec3d vectorOf(const proto::scene::Vector& v) {
    return {v.x(), v.y(), v.z()};
}

/// Around the mesh; a flat one lies in the middle of its volume.
Box boxAround(const MeshArrays& arrays) {
    Box box = boundsOf(arrays.positions.as<float>());
    if (box.empty()) box = {Vec3d::Zero(), Vec3d::Zero()};
    const double thinnest = std::max(0.05 * box.size().maxCoeff(), 1e-6);
    for (Eigen::Index i = 0; i < 3; ++i) {
        if (box.upper[i] - box.lower[i] >= thinnest) continue;
        box.lower[i] -= thinnest;
        box.upper[i] += thinnest;
    }
    return box;
}

void setAxis(std::uint32_t points, std::uint32_t degree, std::int64_t& pointsOut, std::int64_t& degreeOut) {
    pointsOut = points > 0 ? points : 4;
    degreeOut = degree > 0 ? degree : std::clamp<std::int64_t>(pointsOut - 1, 1, 3);
}

Expected<void> checkJoints(const Skin& skin, std::size_t joints) {
    if (!skin.jointIndices.empty() && joints == 0)
        return fail(ErrorCode::kBadInput, "its vertices follow joints, and it names none");
    if (!skin.jointIndices.empty() && skin.jointWeights.empty())
        return fail(ErrorCode::kBadInput, "its vertices follow joints without weights");
    if (skin.jointIndices.empty() && !skin.jointWeights.empty())
        return fail(ErrorCode::kBadInput, "it has weights of joints, and its vertices follow none");
    const std::size_t bytes = joints * 12 * sizeof(float);
    if (joints > 0 && !skin.inverseBinds.empty() && skin.inverseBinds.sizeBytes() != bytes)
        return fail(ErrorCode::kBadInput, fmt::format("inverse_bind has {} bytes; {} joints have {}",
                                                      skin.inverseBinds.sizeBytes(), joints, bytes));
    return {};
}

/// Until the server has looked where the joints are, in the first frame.
Blob poseAtRest(std::size_t joints) {
    std::vector<float> rest;
    for (std::size_t i = 0; i < joints; ++i)
        for (const float number : {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}) rest.push_back(number);
    return blobOfNumbers(rest);
}

}  // namespace

Expected<Deformation> readDeformation(LoadedFile& file, const proto::scene::Node& node) {
    const proto::scene::Lattice& lattice = node.lattice();
    Expected<MeshArrays> arrays =
        trianglesOf(file, node.geometry().mesh(), "a lattice bends triangles, no points or lines");
    if (!arrays) return tl::unexpected(arrays.error());
    Deformation value;
    setAxis(lattice.points_x(), lattice.degree_x(), value.pointsX, value.degreeX);
    setAxis(lattice.points_y(), lattice.degree_y(), value.pointsY, value.degreeY);
    setAxis(lattice.points_z(), lattice.degree_z(), value.pointsZ, value.degreeZ);
    const Box box = boxAround(*arrays);
    value.lower = lattice.has_lower() ? vectorOf(lattice.lower()) : box.lower;
    value.upper = lattice.has_upper() ? vectorOf(lattice.upper()) : box.upper;
    std::vector<float> points;
    for (const proto::scene::Vector& point : lattice.point())
        for (const double coordinate : vectorOf(point)) points.push_back(static_cast<float>(coordinate));
    value.controlPoints = blobOfNumbers(points);
    takeArrays(value, std::move(*arrays));
    // At rest, but there: who bends it edits ranges of them. What makes no lattice is refused as a whole.
    if (value.controlPoints.empty())
        if (const Expected<Blob> rest = controlPointsAtRest(value)) value.controlPoints = *rest;
    return value;
}

Expected<Skin> readSkin(LoadedFile& file, const proto::scene::Skin& message) {
    Expected<MeshArrays> arrays = trianglesOf(file, message.mesh(), "a skin deforms triangles, no points or lines");
    if (!arrays) return tl::unexpected(arrays.error());
    Skin value;
    takeArrays(value, std::move(*arrays));
    std::vector<std::uint16_t> joints;
    for (const std::uint32_t joint : message.joint_index()) {
        if (joint > 0xffff)
            return fail(ErrorCode::kBadInput, fmt::format("joint {} is more than a skin can have", joint));
        joints.push_back(static_cast<std::uint16_t>(joint));
    }
    value.jointIndices = blobOfNumbers(joints);
    value.jointWeights = blobOfNumbers(message.joint_weight());
    value.inverseBinds = blobOfNumbers(message.inverse_bind());
    value.morphPositions = blobOfNumbers(message.morph_position());
    value.morphNormals = blobOfNumbers(message.morph_normal());
    value.morphTangents = blobOfNumbers(message.morph_tangent());
    value.weights = blobOfNumbers(message.weight());
    for (const auto& [target, number] : {std::pair(&value.jointIndices, message.joint_indices_blob()),
                                         std::pair(&value.jointWeights, message.joint_weights_blob()),
                                         std::pair(&value.inverseBinds, message.inverse_binds_blob()),
                                         std::pair(&value.morphPositions, message.morph_positions_blob()),
                                         std::pair(&value.morphNormals, message.morph_normals_blob()),
                                         std::pair(&value.morphTangents, message.morph_tangents_blob()),
                                         std::pair(&value.pose, message.pose_blob())}) {
        if (number == 0) continue;
        Expected<Blob> blob = file.blob(number);
        if (!blob) return tl::unexpected(blob.error());
        *target = std::move(*blob);
    }
    const auto jointCount = static_cast<std::size_t>(message.joint_size() + message.joint_key_size());
    if (Expected<void> sound = checkJoints(value, jointCount); !sound) return tl::unexpected(sound.error());
    if (jointCount > 0 && value.pose.empty()) value.pose = poseAtRest(jointCount);
    if (value.pose.sizeBytes() != jointCount * 12 * sizeof(float))
        return fail(ErrorCode::kBadInput, "its pose is of another number of joints");
    return value;
}

}  // namespace tessera

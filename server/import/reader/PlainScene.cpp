#include "server/import/reader/PlainScene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "common/base/Utf8.h"
#include "common/geometry/Points.h"
#include "common/geometry/TriangleOrder.h"
#include "common/math/Decompositions.h"
#include "server/import/reader/ReadProgress.h"

namespace tessera {
namespace {

/// The numbers are gone then: a large mesh is not there twice.
template <typename T>
Bytes bytesOf(std::vector<T>& values) {
    Bytes bytes(values.size() * sizeof(T));
    if (!bytes.empty()) std::memcpy(bytes.data(), values.data(), bytes.size());
    std::vector<T>().swap(values);
    return bytes;
}

}  // namespace

std::string ReadLimits::tooManyNodes(std::uint64_t bytes) const {
    const std::size_t most = nodesOf(bytes);
    if (most == maxNodes) return fmt::format("the scene has more than {} nodes", most);
    return fmt::format(
        "what it places so often becomes more than {} nodes, the most that are read of {} bytes: fewer places, or "
        "parts joined into one mesh, or more by --import-memory",
        most, bytes);
}

proto::scene::Node* PlainScene::addBeside() {
    return file.by_tessera() && file.node_size() == 1 ? file.mutable_node(0)->add_node() : file.add_node();
}

void PlainScene::note(std::string text) {
    if (std::find(notes.begin(), notes.end(), text) == notes.end()) notes.push_back(std::move(text));
}

void PlainScene::noteMissing(const std::string& text) {
    note(text);
    missing.push_back(text);
}

const std::string& PlainScene::plainMaterial() {
    if (plain.empty()) {
        plain = "plain";
        proto::scene::Material& message = *file.add_material();
        message.set_name(plain);
        message.set_double_sided(true);
    }
    return plain;
}

std::uint32_t PlainScene::addBlob(Bytes bytes) {
    if (bytes.empty()) return 0;
    blobs.push_back(std::move(bytes));
    return static_cast<std::uint32_t>(blobs.size());
}

proto::scene::Mesh& PlainScene::addMesh(const std::string& name, MeshData mesh) {
    sayConverting();
    proto::scene::Mesh* message = file.add_mesh();
    message->set_name(name);
    if (mesh.primitive == Primitive::kPoints) {
        message->set_primitive(proto::scene::Mesh::POINTS);
        constexpr double kLargest = 1e12;  // that a Geometry may have
        message->set_point_radius(mesh.pointRadius > 0 ? mesh.pointRadius
                                                       : std::min(0.5 * spacingOf(mesh.positions), kLargest));
    } else if (mesh.primitive == Primitive::kLines) {
        message->set_primitive(proto::scene::Mesh::LINES);
        message->set_line_width(mesh.lineWidth);
    } else if (mesh.normals.empty()) {
        computeNormals(mesh);
        mesh.tangents.clear();  // of other normals
    }
    message->set_positions_blob(addBlob(bytesOf(mesh.positions)));
    message->set_normals_blob(addBlob(bytesOf(mesh.normals)));
    message->set_texcoords_blob(addBlob(bytesOf(mesh.texcoords)));
    message->set_texcoords1_blob(addBlob(bytesOf(mesh.texcoords1)));
    message->set_colors_blob(addBlob(bytesOf(mesh.colors)));
    message->set_tangents_blob(addBlob(bytesOf(mesh.tangents)));
    message->set_indices_blob(addBlob(bytesOf(mesh.primitive == Primitive::kLines ? mesh.lines : mesh.indices)));
    return *message;
}

void PlainScene::addModelMesh(const std::string& name, MeshData mesh, const ReadLimits& limits) {
    // Three steps: what the reader made of it, its order, the rest.
    const std::uint64_t corners = mesh.indices.size();
    const auto say = [&](std::uint64_t steps) { sayConverting(3 * cornersDone + steps * corners, 3 * cornersToCome); };
    say(1);
    // Smaller ones are not drawn in parts.
    constexpr std::size_t kLarge = 1024;
    const std::size_t vertices = mesh.positions.size() / 3;
    const bool sound =
        mesh.indices.size() % 3 == 0 &&
        std::all_of(mesh.indices.begin(), mesh.indices.end(), [&](std::uint32_t i) { return i < vertices; }) &&
        std::all_of(mesh.positions.begin(), mesh.positions.end(), [](float x) { return std::isfinite(x); });
    if (!limits.verbatim && sound && mesh.indices.size() >= 3 * kLarge)
        mesh.indices = inSpatialOrder(mesh.positions, mesh.indices);
    say(2);
    addMesh(name, std::move(mesh));
    cornersDone += corners;
}

std::string foreignName(std::string_view name, const char* otherwise) {
    std::string text(name.substr(0, name.find('\0')));
    const bool isOurs = isUtf8(text);
    for (char& c : text)
        if (!isOurs && static_cast<unsigned char>(c) >= 0x80) c = '_';
    return text.empty() ? otherwise : text;
}

void setTransform(proto::scene::Transform& message, const Vec3d& translation, const Quatd& rotation,
                  const Vec3d& scale) {
    message.mutable_translation()->set_x(translation.x());
    message.mutable_translation()->set_y(translation.y());
    message.mutable_translation()->set_z(translation.z());
    if (!rotation.isApprox(Quatd::Identity(), 0.0)) {
        proto::scene::Quaternion* q = message.mutable_rotation()->mutable_quaternion();
        q->set_w(rotation.w());
        q->set_x(rotation.x());
        q->set_y(rotation.y());
        q->set_z(rotation.z());
    }
    if (scale != Vec3d::Ones()) {
        message.mutable_scale()->set_x(scale.x());
        message.mutable_scale()->set_y(scale.y());
        message.mutable_scale()->set_z(scale.z());
    }
}

namespace {

/// Of orthogonal columns, some of them 0, the axes: those of such columns stand across the others.
Mat3d axesOf(const Mat3d& linear, const Vec3d& lengths) {
    Mat3d axes = Mat3d::Identity();
    const auto flat = (lengths.array() == 0).count();
    if (flat == 3) return axes;
    for (Eigen::Index i = 0; i < 3; ++i)
        if (lengths[i] > 0) axes.col(i) = linear.col(i) / lengths[i];
    Eigen::Index first = 0;
    while (lengths[first] == 0) ++first;
    if (flat == 2) axes.col((first + 1) % 3) = Vec3d(axes.col(first)).unitOrthogonal();
    for (Eigen::Index i = 0; i < 3; ++i)
        if (lengths[i] == 0 && (flat == 1 || i == (first + 2) % 3))
            axes.col(i) = axes.col((i + 1) % 3).cross(axes.col((i + 2) % 3));
    return axes;
}

}  // namespace

proto::scene::Node* addPlacedNode(const std::function<proto::scene::Node*()>& make, const std::string& name,
                                  const Affine3d& map) {
    proto::scene::Node* node = make();
    node->set_name(name);
    const Mat3d linear = map.linear();
    // Orthogonal columns: rotation · scale says it all; a reflection goes into the first factor.
    Vec3d lengths = linear.colwise().norm();
    const Mat3d gram = linear.transpose() * linear;
    const double offDiagonal = std::max({std::abs(gram(0, 1)), std::abs(gram(0, 2)), std::abs(gram(1, 2))});
    if (offDiagonal <= 1e-6 * lengths.maxCoeff() * lengths.maxCoeff()) {
        if (linear.determinant() < 0.0) lengths.x() = -lengths.x();
        const Mat3d rotation = lengths.cwiseAbs().minCoeff() > 0 ? Mat3d(linear * lengths.cwiseInverse().asDiagonal())
                                                                 : axesOf(linear, lengths);
        // Matrices in files are floats: what is a rounding error away from no scale is no scale.
        for (double& length : lengths)
            if (std::abs(std::abs(length) - 1.0) < 1e-6) length = length < 0.0 ? -1.0 : 1.0;
        setTransform(*node->mutable_transform(), map.translation(), Quatd(rotation).normalized(), lengths);
        return node;
    }
    const SingularValues svd = singularValuesOf(linear);
    Mat3d outer = svd.u;
    Mat3d inner = svd.v;
    Vec3d factors = svd.values;
    // Both must be rotations: a reflection moves into the scale between them.
    if (outer.determinant() < 0.0) {
        outer.col(2) = -outer.col(2);
        factors.z() = -factors.z();
    }
    if (inner.determinant() < 0.0) {
        inner.col(2) = -inner.col(2);
        factors.z() = -factors.z();
    }
    setTransform(*node->mutable_transform(), map.translation(), Quatd(outer).normalized(), factors);
    proto::scene::Node* sheared = node->add_node();
    sheared->set_name("shear");
    const Mat3d innerTransposed = inner.transpose();
    setTransform(*sheared->mutable_transform(), Vec3d::Zero(), Quatd(innerTransposed).normalized(), Vec3d::Ones());
    return sheared;
}

}  // namespace tessera

#include "server/import/reader/GlyphPlaces.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

namespace tessera {
namespace {

// common/drawable/GlyphArrays.h and MeshLimits say what a core of them may have.
constexpr std::size_t kMostGlyphsOfACore = 1'000'000, kMostGlyphVertices = 1024, kMostGlyphTriangles = 2048,
                      kMostTrianglesOfACore = 64'000'000;

/// Glyphs have one scale along Y and one across it: along which axis of the thing this place's own one is, where
/// there is one. Nothing: all three differ, or one mirrors.
std::optional<std::size_t> glyphAxis(const Vec3d& scale) {
    if (!(scale.minCoeff() > 0)) return std::nullopt;
    if (scale.x() == scale.z()) return 1;
    if (scale.x() == scale.y()) return 2;
    if (scale.y() == scale.z()) return 0;
    return std::nullopt;
}

/// What makes that axis Y.
Quatd toY(std::size_t axis) {
    const double half = std::sqrt(0.5);
    if (axis == 0) return {half, 0, 0, half};
    if (axis == 2) return {half, -half, 0, 0};
    return Quatd::Identity();
}

void turnShape(const Quatd& turn, google::protobuf::RepeatedField<float>& vectors) {
    for (int v = 0; v + 2 < vectors.size(); v += 3) {
        const Vec3d turned = turn * Vec3d(vectors[v], vectors[v + 1], vectors[v + 2]);
        for (int axis = 0; axis < 3; ++axis) vectors[v + axis] = static_cast<float>(turned[axis]);
    }
}

/// One part of the thing at all of `which`, in as many nodes as it takes.
void addPart(std::span<const std::size_t> which, const std::function<CopyPlace(std::size_t)>& placeOf, std::size_t axis,
             proto::scene::Glyphs shape, std::size_t part, const GlyphNodes& make) {
    const std::size_t triangles = std::max<std::size_t>(static_cast<std::size_t>(shape.shape_indices_size()) / 3, 1);
    const std::size_t most = std::min(kMostGlyphsOfACore, kMostTrianglesOfACore / triangles);
    const Quatd turned = toY(axis);
    turnShape(turned, *shape.mutable_shape_positions());
    turnShape(turned, *shape.mutable_shape_normals());
    const auto across = [&](std::size_t i) { return placeOf(i).scale[(axis + 1) % 3]; };
    const auto along = [&](std::size_t i) { return placeOf(i).scale[static_cast<Eigen::Index>(axis)]; };
    const bool isEven = std::ranges::all_of(which, [&](std::size_t i) { return along(i) == across(i); });
    const bool isTurned = axis != 1 || !std::ranges::all_of(which, [&](std::size_t i) {
                              return placeOf(i).turn.coeffs() == Quatd::Identity().coeffs();
                          });
    if (isEven) shape.set_length_by(proto::scene::Glyphs::SCALAR);
    for (; !which.empty(); which = which.subspan(std::min(most, which.size()))) {
        proto::scene::Glyphs& glyphs = *make(which.front(), part)->mutable_glyphs();
        glyphs = shape;
        for (const std::size_t i : which.first(std::min(most, which.size()))) {
            const CopyPlace place = placeOf(i);
            for (const double number : place.position) glyphs.add_positions(static_cast<float>(number));
            glyphs.add_scalars(static_cast<float>(across(i)));
            if (!isEven)
                for (const double number : {0.0, along(i), 0.0}) glyphs.add_vectors(static_cast<float>(number));
            if (!isTurned) continue;
            const Quatd turn = place.turn * turned.conjugate();
            for (const double number : {turn.x(), turn.y(), turn.z(), turn.w()})
                glyphs.add_turns(static_cast<float>(number));
        }
    }
}

template <typename Number>
std::vector<Number> numbersIn(const PlainScene& scene, std::uint32_t blob) {
    if (blob == 0 || blob > scene.blobs.size()) return {};
    const Bytes& bytes = scene.blobs[blob - 1];
    std::vector<Number> numbers(bytes.size() / sizeof(Number));
    std::memcpy(numbers.data(), bytes.data(), numbers.size() * sizeof(Number));
    return numbers;
}

bool hasPictures(const proto::scene::Material& material) {
    return !(material.base_color_image() + material.normal_image() + material.metallic_roughness_image() +
             material.occlusion_image() + material.emissive_image())
                .empty();
}

}  // namespace

std::optional<proto::scene::Glyphs> glyphOf(const PlainScene& scene, const std::string& meshName,
                                            const std::string& materialName, const Affine3d& place) {
    const auto mesh = std::ranges::find(scene.file.mesh(), meshName, &proto::scene::Mesh::name);
    if (mesh == scene.file.mesh().end() || mesh->primitive() != proto::scene::Mesh::TRIANGLES ||
        mesh->colors_blob() != 0)
        return std::nullopt;
    const auto material = std::ranges::find(scene.file.material(), materialName, &proto::scene::Material::name);
    if (material != scene.file.material().end() && hasPictures(*material)) return std::nullopt;
    const auto positions = numbersIn<float>(scene, mesh->positions_blob()),
               normals = numbersIn<float>(scene, mesh->normals_blob());
    const auto indices = numbersIn<std::uint32_t>(scene, mesh->indices_blob());
    if (positions.size() / 3 > kMostGlyphVertices || indices.size() / 3 > kMostGlyphTriangles || indices.empty())
        return std::nullopt;
    if (!(place.linear().determinant() > 1e-12)) return std::nullopt;  // a mirror would turn its faces
    const Mat3d turned = place.linear().inverse().transpose();
    proto::scene::Glyphs glyphs;
    glyphs.set_shape(proto::scene::Glyphs::MESH);
    glyphs.set_size(1);
    glyphs.set_length_by(proto::scene::Glyphs::VECTOR);
    glyphs.set_width_by(proto::scene::Glyphs::SCALAR);
    glyphs.set_color_by(proto::scene::Glyphs::NOTHING);
    glyphs.set_material(materialName);
    for (std::size_t v = 0; v + 2 < positions.size(); v += 3)
        for (const double part : place* Vec3d(positions[v], positions[v + 1], positions[v + 2]))
            glyphs.add_shape_positions(static_cast<float>(part));
    for (std::size_t v = 0; v + 2 < normals.size(); v += 3) {
        const Vec3d normal = (turned * Vec3d(normals[v], normals[v + 1], normals[v + 2])).normalized();
        for (int axis = 0; axis < 3; ++axis) glyphs.add_shape_normals(static_cast<float>(normal[axis]));
    }
    for (const std::uint32_t index : indices) glyphs.add_shape_indices(index);
    return glyphs;
}

std::string instancesName(std::size_t first, std::size_t part) {
    return part == 0 ? fmt::format("instances {}", first) : fmt::format("instances {} part {}", first, part);
}

std::vector<std::size_t> addGlyphs(std::span<const std::size_t> which,
                                   const std::function<CopyPlace(std::size_t)>& placeOf,
                                   const std::vector<proto::scene::Glyphs>& parts, const GlyphNodes& make) {
    std::array<std::vector<std::size_t>, 3> byAxis;
    std::vector<std::size_t> left;
    for (const std::size_t i : which) {
        const std::optional<std::size_t> axis = glyphAxis(placeOf(i).scale);
        (axis ? byAxis[*axis] : left).push_back(i);
    }
    for (std::size_t axis = 0; axis < byAxis.size(); ++axis)
        for (std::size_t part = 0; part < parts.size(); ++part)
            addPart(byAxis[axis], placeOf, axis, parts[part], part, make);
    return left;
}

}  // namespace tessera

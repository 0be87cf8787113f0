#include "server/import/reader/GlyphShape.h"

#include <algorithm>
#include <cstring>
#include <vector>

namespace tessera {
namespace {

// common/drawable/GlyphArrays.h and MeshLimits say what a core of them may have.
constexpr std::size_t kMostGlyphsOfACore = 1'000'000, kMostGlyphVertices = 1024, kMostGlyphTriangles = 2048,
                      kMostTrianglesOfACore = 64'000'000;

template <typename Number>
std::vector<Number> numbersIn(const PlainScene& scene, std::uint32_t blob) {
    if (blob == 0 || blob > scene.blobs.size()) return {};
    const Bytes& bytes = scene.blobs[blob - 1];
    std::vector<Number> numbers(bytes.size() / sizeof(Number));
    std::memcpy(numbers.data(), bytes.data(), numbers.size() * sizeof(Number));
    return numbers;
}

}  // namespace

bool isGlyphPlace(const GlyphPlace& place) {
    if (place.scale.x() != place.scale.z() || !(place.scale.minCoeff() > 0)) return false;
    const Quatd shortest = Quatd::FromTwoVectors(Vec3d::UnitY(), place.orientation * Vec3d::UnitY());
    return std::abs(place.orientation.dot(shortest)) > 1 - 1e-6;
}

std::optional<proto::scene::Glyphs> glyphsOf(const PlainScene& scene, const std::string& meshName,
                                             const std::string& materialName, const Affine3d& place) {
    const auto mesh = std::ranges::find(scene.file.mesh(), meshName, &proto::scene::Mesh::name);
    if (mesh == scene.file.mesh().end() || mesh->primitive() != proto::scene::Mesh::TRIANGLES) return std::nullopt;
    const auto material = std::ranges::find(scene.file.material(), materialName, &proto::scene::Material::name);
    if (mesh->colors_blob() != 0 ||
        (material != scene.file.material().end() &&
         !(material->base_color_image() + material->normal_image() + material->metallic_roughness_image() +
           material->occlusion_image() + material->emissive_image())
              .empty()))
        return std::nullopt;
    const auto positions = numbersIn<float>(scene, mesh->positions_blob());
    const auto normals = numbersIn<float>(scene, mesh->normals_blob());
    const auto indices = numbersIn<std::uint32_t>(scene, mesh->indices_blob());
    if (positions.size() / 3 > kMostGlyphVertices || indices.size() / 3 > kMostGlyphTriangles || indices.empty())
        return std::nullopt;
    if (!(place.linear().determinant() > 1e-12)) return std::nullopt;
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

std::size_t mostPlacesOf(const proto::scene::Glyphs& glyphs) {
    const std::size_t triangles = std::max<std::size_t>(static_cast<std::size_t>(glyphs.shape_indices_size()) / 3, 1);
    return std::min(kMostGlyphsOfACore, kMostTrianglesOfACore / triangles);
}

void addPlace(proto::scene::Glyphs& glyphs, const GlyphPlace& place) {
    const Vec3d along = place.scale.y() * (place.orientation * Vec3d::UnitY());
    for (int axis = 0; axis < 3; ++axis) glyphs.add_positions(static_cast<float>(place.position[axis]));
    for (int axis = 0; axis < 3; ++axis) glyphs.add_vectors(static_cast<float>(along[axis]));
    glyphs.add_scalars(static_cast<float>(place.scale.x()));
}

}  // namespace tessera

#include "server/import/reader/GlyphPlaces.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <optional>
#include <utility>

#include "common/math/Srgb.h"

namespace tessera {
namespace {

// common/drawable/GlyphArrays.h and MeshLimits say what a core of them may have.
constexpr std::size_t kMostGlyphsOfACore = 1'000'000, kMostGlyphVertices = 1024, kMostGlyphTriangles = 2048,
                      kMostTrianglesOfACore = 64'000'000;

/// Glyphs have one scale along Y and one across it: along which axis of the thing this place's own one is, where
/// there is one. Nothing: all three differ, or one is none.
std::optional<std::size_t> glyphAxis(const Vec3d& signedScale) {
    const Vec3d scale = signedScale.cwiseAbs();
    if (!(scale.minCoeff() > 0)) return std::nullopt;
    // Scales out of matrices in single precision are one scale within some of its bits.
    const double equal = 1e-6 * scale.maxCoeff();
    for (const double most : {0.0, equal}) {
        if (std::abs(scale.x() - scale.z()) <= most) return 1;
        if (std::abs(scale.x() - scale.y()) <= most) return 2;
        if (std::abs(scale.y() - scale.z()) <= most) return 0;
    }
    return std::nullopt;
}

/// What makes that axis Y.
Quatd toY(std::size_t axis) {
    const double half = std::sqrt(0.5);
    if (axis == 0) return {half, 0, 0, half};
    if (axis == 2) return {half, -half, 0, 0};
    return Quatd::Identity();
}

bool mirrors(const Vec3d& scale) {
    return scale.prod() < 0;
}

/// A scale of any signs is one of none after half a turn, of the thing where an even number of them are below 0, else
/// of its mirror image along X.
CopyPlace withoutSigns(CopyPlace place) {
    Vec3d signs = place.scale.cwiseSign();
    if (mirrors(place.scale)) signs.x() = -signs.x();
    place.scale = place.scale.cwiseAbs();
    for (int axis = 0; axis < 3; ++axis)
        if (signs[axis] > 0 && signs[(axis + 1) % 3] < 0 && signs[(axis + 2) % 3] < 0) {
            Quatd half(0, 0, 0, 0);
            half.vec()[axis] = 1;
            place.turn = place.turn * half;
        }
    return place;
}

void mirrorShape(proto::scene::Glyphs& shape) {
    for (auto* const vectors : {shape.mutable_shape_positions(), shape.mutable_shape_normals()})
        for (int v = 0; v < vectors->size(); v += 3) vectors->Set(v, -vectors->Get(v));
    for (int corner = 0; corner + 2 < shape.shape_indices_size(); corner += 3)
        shape.mutable_shape_indices()->SwapElements(corner + 1, corner + 2);
}

/// As light, which is what colours multiply; the last byte is opacity.
std::uint32_t multiplied(std::uint32_t a, std::uint32_t b) {
    if (a == 0xffffffff) return b;
    if (b == 0xffffffff) return a;
    std::uint32_t product = 0;
    for (const unsigned shift : {24u, 16u, 8u, 0u}) {
        const double x = (a >> shift & 255u) / 255.0, y = (b >> shift & 255u) / 255.0;
        const double both = shift == 0 ? x * y : srgbOfLinear(linearOfSrgb(x) * linearOfSrgb(y));
        product |= static_cast<std::uint32_t>(std::lround(255 * both)) << shift;
    }
    return product;
}

void turnShape(const Quatd& turn, google::protobuf::RepeatedField<float>& vectors) {
    for (int v = 0; v + 2 < vectors.size(); v += 3) {
        const Vec3d turned = turn * Vec3d(vectors[v], vectors[v + 1], vectors[v + 2]);
        for (int axis = 0; axis < 3; ++axis) vectors[v + axis] = static_cast<float>(turned[axis]);
    }
}

/// One part of the thing at all of `which`, whose scales have no signs, in as many nodes as it takes.
void addPart(std::span<const std::size_t> which, const std::function<CopyPlace(std::size_t)>& placeOf, std::size_t axis,
             GlyphPart part, std::size_t number, const GlyphNodes& make) {
    proto::scene::Glyphs& shape = part.shape;
    const std::size_t triangles = std::max<std::size_t>(static_cast<std::size_t>(shape.shape_indices_size()) / 3, 1);
    const std::size_t most = std::min(kMostGlyphsOfACore, kMostTrianglesOfACore / triangles);
    const Quatd turned = toY(axis);
    turnShape(turned, *shape.mutable_shape_positions());
    turnShape(turned, *shape.mutable_shape_normals());
    const auto along = static_cast<Eigen::Index>(axis), across = (along + 1) % 3;
    bool isEven = true, isTurned = axis != 1, isColored = part.color != 0xffffffff;
    for (const std::size_t i : which) {
        const CopyPlace place = placeOf(i);
        isEven = isEven && place.scale[along] == place.scale[across];
        isTurned = isTurned || place.turn.coeffs() != Quatd::Identity().coeffs();
        isColored = isColored || place.color != 0xffffffff;
    }
    if (isEven) shape.set_length_by(proto::scene::Glyphs::SCALAR);
    for (; !which.empty(); which = which.subspan(std::min(most, which.size()))) {
        proto::scene::Glyphs& glyphs = *make(which.front(), number)->mutable_glyphs();
        glyphs = shape;
        for (const std::size_t i : which.first(std::min(most, which.size()))) {
            const CopyPlace place = placeOf(i);
            for (const double coordinate : place.position) glyphs.add_positions(static_cast<float>(coordinate));
            glyphs.add_scalars(static_cast<float>(place.scale[across]));
            if (!isEven)
                for (const double length : {0.0, place.scale[along], 0.0})
                    glyphs.add_vectors(static_cast<float>(length));
            if (isColored) glyphs.add_colors(multiplied(part.color, place.color));
            if (!isTurned) continue;
            const Quatd turn = place.turn * turned.conjugate();
            for (const double component : {turn.x(), turn.y(), turn.z(), turn.w()})
                glyphs.add_turns(static_cast<float>(component));
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

bool hasImages(const proto::scene::Material& material) {
    return !(material.base_color_image() + material.normal_image() + material.metallic_roughness_image() +
             material.occlusion_image() + material.emissive_image())
                .empty() ||
           material.layer_size() > 0;
}

/// The one colour of all vertices. Nothing: there are several.
std::optional<std::uint32_t> onlyColor(const std::vector<std::uint8_t>& colors) {
    for (std::size_t i = 4; i < colors.size(); ++i)
        if (colors[i] != colors[i - 4]) return std::nullopt;
    std::uint32_t color = 0xffffffff;
    for (std::size_t i = 0; i < 4 && colors.size() >= 4; ++i) color = color << 8 | colors[i];
    return color;
}

}  // namespace

Expected<GlyphPart> glyphOf(const PlainScene& scene, const std::string& meshName, const std::string& materialName,
                            const Affine3d& place) {
    const auto refused = [](std::string why) { return fail(ErrorCode::kUnsupported, std::move(why)); };
    const auto mesh = std::ranges::find(scene.file.mesh(), meshName, &proto::scene::Mesh::name);
    if (mesh == scene.file.mesh().end() || mesh->primitive() != proto::scene::Mesh::TRIANGLES)
        return refused("has lines or points");
    const std::optional<std::uint32_t> color = onlyColor(numbersIn<std::uint8_t>(scene, mesh->colors_blob()));
    if (!color) return refused("has a colour at each vertex");
    const auto material = std::ranges::find(scene.file.material(), materialName, &proto::scene::Material::name);
    const bool hasImages = material != scene.file.material().end() && tessera::hasImages(*material);
    if (hasImages && mesh->texcoords1_blob() != 0) return refused("has two sets of texture coordinates");
    const auto positions = numbersIn<float>(scene, mesh->positions_blob()),
               normals = numbersIn<float>(scene, mesh->normals_blob()),
               texcoords = numbersIn<float>(scene, mesh->texcoords_blob());
    auto indices = numbersIn<std::uint32_t>(scene, mesh->indices_blob());
    if (positions.size() / 3 > kMostGlyphVertices || indices.size() / 3 > kMostGlyphTriangles || indices.empty())
        return refused(fmt::format("has {} vertices and {} triangles, more than {} or {}", positions.size() / 3,
                                   indices.size() / 3, kMostGlyphVertices, kMostGlyphTriangles));
    const double volume = place.linear().determinant();
    const double longest = place.linear().colwise().norm().maxCoeff();
    if (!(std::abs(volume) > 1e-9 * longest * longest * longest)) return refused("is flat");
    if (volume < 0)  // a mirror turns its faces
        for (std::size_t corner = 0; corner + 2 < indices.size(); corner += 3)
            std::swap(indices[corner + 1], indices[corner + 2]);
    const Mat3d turned = place.linear().inverse().transpose();
    GlyphPart part{.shape = {}, .color = *color};
    proto::scene::Glyphs& glyphs = part.shape;
    glyphs.set_shape(proto::scene::Glyphs::MESH);
    glyphs.set_size(1);
    glyphs.set_length_by(proto::scene::Glyphs::VECTOR);
    glyphs.set_width_by(proto::scene::Glyphs::SCALAR);
    glyphs.set_color_by(proto::scene::Glyphs::NOTHING);
    glyphs.set_material(materialName);
    for (std::size_t v = 0; v + 2 < positions.size(); v += 3)
        for (const double coordinate : place* Vec3d(positions[v], positions[v + 1], positions[v + 2]))
            glyphs.add_shape_positions(static_cast<float>(coordinate));
    for (std::size_t v = 0; v + 2 < normals.size(); v += 3) {
        const Vec3d normal = (turned * Vec3d(normals[v], normals[v + 1], normals[v + 2])).normalized();
        for (int axis = 0; axis < 3; ++axis) glyphs.add_shape_normals(static_cast<float>(normal[axis]));
    }
    if (hasImages)
        for (const float coordinate : texcoords) glyphs.add_shape_texcoords(coordinate);
    for (const std::uint32_t index : indices) glyphs.add_shape_indices(index);
    return part;
}

std::string instancesName(std::size_t first, std::size_t part) {
    return part == 0 ? fmt::format("instances {}", first) : fmt::format("instances {} part {}", first, part);
}

std::vector<std::size_t> addGlyphs(std::span<const std::size_t> which,
                                   const std::function<CopyPlace(std::size_t)>& placeOf,
                                   const std::vector<GlyphPart>& parts, const GlyphNodes& make) {
    std::array<std::vector<std::size_t>, 6> groups;  // by axis, and mirrored ones after these
    std::vector<std::size_t> left;
    for (const std::size_t i : which) {
        const Vec3d scale = placeOf(i).scale;
        const std::optional<std::size_t> axis = glyphAxis(scale);
        (axis ? groups[*axis + (mirrors(scale) ? 3 : 0)] : left).push_back(i);
    }
    const auto signless = [&](std::size_t i) { return withoutSigns(placeOf(i)); };
    for (std::size_t group = 0; group < groups.size(); ++group)
        for (std::size_t part = 0; part < parts.size() && !groups[group].empty(); ++part) {
            GlyphPart shown = parts[part];
            if (group >= 3) mirrorShape(shown.shape);
            addPart(groups[group], signless, group % 3, std::move(shown), part, make);
        }
    return left;
}

void noteUnsorted(PlainScene& scene, std::string_view where, const std::vector<GlyphPart>& parts) {
    const auto isTransparent = [&](const GlyphPart& part) {
        const auto material =
            std::ranges::find(scene.file.material(), part.shape.material(), &proto::scene::Material::name);
        return material != scene.file.material().end() && material->alpha_mode() == proto::scene::Material::BLEND;
    };
    if (std::ranges::any_of(parts, isTransparent))
        scene.note(fmt::format("{}: transparent instances are glyphs, and not sorted among each other", where));
}

std::string noteOfPlacedNodes(std::string_view where, std::size_t count, std::string_view why) {
    return fmt::format("{}: {} instances are nodes, a kilobyte or more each, and no glyphs: {}", where, count, why);
}

}  // namespace tessera

// PointInstancer: prototypes at many places.
//
// A place is a node with the prototype's Definition below: prototypes may be whole trees, with materials and textures,
// and anybody may move, pick and hit one. That is about a kilobyte each. Of very many places those of a small mesh
// without textures are Glyphs, 28 bytes each, as far as glyphs can be turned and scaled so.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <set>

#include "common/math/Compose.h"
#include "server/import/reader/UsdReader.h"

namespace tessera {
namespace {

/// Where the instances are; all arrays as long as `prototypes`.
struct InstancePlaces {
    std::vector<std::int32_t> prototypes;
    std::vector<double> positions, orientations, scales;  ///< the last two may be empty
    std::vector<bool> shown;

    [[nodiscard]] std::size_t count() const { return prototypes.size(); }
    /// Nothing: it stands nowhere.
    [[nodiscard]] bool stands(std::size_t i) const {
        return std::isfinite(positions[3 * i]) && std::isfinite(positions[3 * i + 1]) &&
               std::isfinite(positions[3 * i + 2]) &&
               std::max({std::abs(positions[3 * i]), std::abs(positions[3 * i + 1]), std::abs(positions[3 * i + 2])}) <
                   1e15;
    }
    [[nodiscard]] Vec3d position(std::size_t i) const {
        return {positions[3 * i], positions[3 * i + 1], positions[3 * i + 2]};
    }
    [[nodiscard]] Quatd orientation(std::size_t i) const {
        if (orientations.empty()) return Quatd::Identity();
        const Quatd q(orientations[4 * i + 3], orientations[4 * i], orientations[4 * i + 1], orientations[4 * i + 2]);
        return q.coeffs().allFinite() && q.norm() > 1e-6 ? q.normalized() : Quatd::Identity();
    }
    [[nodiscard]] Vec3d scale(std::size_t i) const {
        if (scales.empty()) return Vec3d::Ones();
        const Vec3d s(scales[3 * i], scales[3 * i + 1], scales[3 * i + 2]);
        return s.allFinite() && s.cwiseAbs().maxCoeff() < 1e12 ? s : Vec3d(Vec3d::Ones());
    }
};

/// As many are worth a node each.
constexpr std::size_t kMostNodes = 10'000;
// common/drawable/GlyphArrays.h and MeshLimits say what a core of them may have.
constexpr std::size_t kMostGlyphsOfACore = 1'000'000, kMostGlyphVertices = 1024, kMostGlyphTriangles = 2048,
                      kMostTrianglesOfACore = 64'000'000;

/// Whether a glyph, whose Y axis is turned the shortest way to its vector, stands as this place does.
bool isGlyphPlace(const InstancePlaces& places, std::size_t i) {
    const Vec3d scale = places.scale(i);
    if (scale.x() != scale.z() || !(scale.minCoeff() > 0)) return false;
    const Quatd turn = places.orientation(i);
    const Quatd shortest = Quatd::FromTwoVectors(Vec3d::UnitY(), turn * Vec3d::UnitY());
    return std::abs(turn.dot(shortest)) > 1 - 1e-6;
}

/// Without those that are glyphs now: what is left to be nodes is `shown`.
void addGlyphs(InstancePlaces& places, std::size_t prototype, const proto::scene::Glyphs& shape,
               const std::function<proto::scene::Node*()>& make) {
    const std::size_t triangles = std::max<std::size_t>(static_cast<std::size_t>(shape.shape_indices_size()) / 3, 1);
    const std::size_t most = std::min(kMostGlyphsOfACore, kMostTrianglesOfACore / triangles);
    proto::scene::Glyphs* glyphs = nullptr;
    for (std::size_t i = 0; i < places.count(); ++i) {
        if (!places.shown[i] || static_cast<std::size_t>(places.prototypes[i]) != prototype || !places.stands(i) ||
            !isGlyphPlace(places, i))
            continue;
        if (glyphs == nullptr || static_cast<std::size_t>(glyphs->scalars_size()) >= most) {
            proto::scene::Node& node = *make();
            node.set_name(fmt::format("instances {}", i));
            glyphs = node.mutable_glyphs();
            *glyphs = shape;
        }
        places.shown[i] = false;
        const Vec3d at = places.position(i), scale = places.scale(i);
        const Vec3d along = scale.y() * (places.orientation(i) * Vec3d::UnitY());
        for (int axis = 0; axis < 3; ++axis) glyphs->add_positions(static_cast<float>(at[axis]));
        for (int axis = 0; axis < 3; ++axis) glyphs->add_vectors(static_cast<float>(along[axis]));
        glyphs->add_scalars(static_cast<float>(scale.x()));
    }
}

std::vector<double> instanceNumbers(const UsdComposedPrim& prim, std::string_view name, UsdRemarks& remarks) {
    const std::optional<UsdAttribute> attribute = prim.attribute(name);
    if (!attribute || !attribute->value) return {};
    if (attribute->samples.size() > 1) remarks.add("instances that move stand where they are first", prim.path());
    return attribute->value->numbers<double>();
}

InstancePlaces instancePlacesOf(const UsdComposedPrim& prim, UsdRemarks& remarks) {
    InstancePlaces places;
    for (const double index : instanceNumbers(prim, "protoIndices", remarks))
        places.prototypes.push_back(index >= 0 && index < 1e9 ? static_cast<std::int32_t>(index) : -1);
    places.positions = instanceNumbers(prim, "positions", remarks);
    for (const char* name : {"orientationsf", "orientations"})
        if (places.orientations.empty()) places.orientations = instanceNumbers(prim, name, remarks);
    places.scales = instanceNumbers(prim, "scales", remarks);
    const std::size_t count = std::min(places.prototypes.size(), places.positions.size() / 3);
    if (places.prototypes.size() != count || places.positions.size() != 3 * count)
        remarks.add("instancers whose arrays are of different lengths show as many as all have", prim.path());
    places.prototypes.resize(count);
    if (places.orientations.size() < 4 * count) places.orientations.clear();
    if (places.scales.size() < 3 * count) places.scales.clear();
    // Instances that are not to be seen are named by their ids, which are their numbers where there are none.
    std::set<double> hidden;
    for (const double id : instanceNumbers(prim, "invisibleIds", remarks)) hidden.insert(id);
    if (const UsdValue* inactive = prim.metadata("inactiveIds"))
        for (const double id : inactive->numbers<double>()) hidden.insert(id);
    const std::vector<double> ids = hidden.empty() ? std::vector<double>() : instanceNumbers(prim, "ids", remarks);
    places.shown.assign(count, true);
    for (std::size_t i = 0; i < count && !hidden.empty(); ++i)
        places.shown[i] = !hidden.contains(ids.size() == count ? ids[i] : static_cast<double>(i));
    return places;
}

}  // namespace

Expected<UsdReader::Prototype> UsdReader::prototype(const std::string& path, const Above& inside) {
    const std::string key =
        fmt::format("{}\n{} {}{}", path, inside.material, inside.materialHolds, usdPrintOf(inside.primvars.get()));
    if (const auto known = prototypes_.find(key); known != prototypes_.end()) return known->second;
    Prototype made;
    const Expected<UsdStage::Prim> prim = stage_.at(path);
    if (!prim) return tl::unexpected(prim.error());
    if (!*prim || !openPrototypes_.insert(path).second) {
        remarks_.add(*prim ? "prototypes that hold themselves are left out" : "prototypes that are not there", path);
        return made;
    }
    proto::scene::Definition definition;
    definition.set_name(fmt::format("prototype {}", prototypes_.size()));
    Above above = inside;
    above.make = [&] { return definition.add_node(); };
    above.world_T_parent = above.parent_T_above = Affine3d::Identity();
    const Box bounds = std::exchange(bounds_, Box());
    const bool within = std::exchange(inPrototype_, true);
    const std::size_t before = nodes_;
    const Expected<void> walked = walk(**prim, above);
    made.nodes = nodes_ - before;
    inPrototype_ = within;
    made.bounds = std::exchange(bounds_, bounds);
    openPrototypes_.erase(path);
    if (!walked) return tl::unexpected(walked.error());
    if (definition.node_size() > 0) {
        made.definition = definition.name();
        made.number = scene_.file.definition_size();
        *scene_.file.add_definition() = std::move(definition);
    }
    prototypes_.emplace(key, made);
    return made;
}

std::optional<proto::scene::Glyphs> UsdReader::glyphOf(const proto::scene::Definition& definition) const {
    if (definition.node_size() != 1) return std::nullopt;
    const Node& node = definition.node(0);
    if (!node.has_geometry() || node.node_size() > 0 || node.key() != 0) return std::nullopt;
    const auto mesh = std::ranges::find(scene_.file.mesh(), node.geometry().mesh(), &proto::scene::Mesh::name);
    if (mesh == scene_.file.mesh().end() || mesh->primitive() != proto::scene::Mesh::TRIANGLES) return std::nullopt;
    const auto material =
        std::ranges::find(scene_.file.material(), node.geometry().material(), &proto::scene::Material::name);
    if (mesh->colors_blob() != 0 ||
        (material != scene_.file.material().end() && material->ByteSizeLong() > 0 &&
         !(material->base_color_image() + material->normal_image() + material->metallic_roughness_image() +
           material->occlusion_image() + material->emissive_image())
              .empty()))
        return std::nullopt;
    const auto numbersIn = [&]<typename Number>(std::uint32_t blob, std::vector<Number> numbers) {
        if (blob == 0 || blob > scene_.blobs.size()) return numbers;
        const Bytes& bytes = scene_.blobs[blob - 1];
        numbers.resize(bytes.size() / sizeof(Number));
        std::memcpy(numbers.data(), bytes.data(), numbers.size() * sizeof(Number));
        return numbers;
    };
    const std::vector<float> positions = numbersIn(mesh->positions_blob(), std::vector<float>()),
                             normals = numbersIn(mesh->normals_blob(), std::vector<float>());
    const std::vector<std::uint32_t> indices = numbersIn(mesh->indices_blob(), std::vector<std::uint32_t>());
    if (positions.size() / 3 > kMostGlyphVertices || indices.size() / 3 > kMostGlyphTriangles || indices.empty())
        return std::nullopt;
    const proto::scene::Transform& t = node.transform();
    const proto::scene::Quaternion& q = t.rotation().quaternion();
    const Affine3d place =
        composeTransform(Vec3d(t.translation().x(), t.translation().y(), t.translation().z()),
                         t.has_rotation() ? Quatd(q.w(), q.x(), q.y(), q.z()) : Quatd::Identity(),
                         t.has_scale() ? Vec3d(t.scale().x(), t.scale().y(), t.scale().z()) : Vec3d(Vec3d::Ones()));
    if (!(place.linear().determinant() > 1e-12)) return std::nullopt;  // a mirror would turn its faces
    const Mat3d turned = place.linear().inverse().transpose();
    proto::scene::Glyphs glyphs;
    glyphs.set_shape(proto::scene::Glyphs::MESH);
    glyphs.set_size(1);
    glyphs.set_length_by(proto::scene::Glyphs::VECTOR);
    glyphs.set_width_by(proto::scene::Glyphs::SCALAR);
    glyphs.set_color_by(proto::scene::Glyphs::NOTHING);
    glyphs.set_material(node.geometry().material());
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

Expected<void> UsdReader::addInstances(const UsdComposedPrim& prim, const Above& inside) {
    const std::vector<std::string> targets = prim.targets("prototypes");
    InstancePlaces places = instancePlacesOf(prim, remarks_);
    std::vector<Prototype> prototypes;
    for (const std::string& target : targets) {
        Expected<Prototype> made = prototype(target, inside);
        if (!made) return tl::unexpected(made.error());
        prototypes.push_back(std::move(*made));
    }
    std::size_t lost = 0;
    for (std::size_t i = 0; i < places.count(); ++i)
        if (const auto which = static_cast<std::size_t>(places.prototypes[i]);
            places.shown[i] && places.prototypes[i] >= 0 && which < prototypes.size() && places.stands(i))
            bounds_.extend(prototypes[which].bounds.transformed(
                inside.world_T_parent * composeTransform(places.position(i), places.orientation(i), places.scale(i))));
    for (std::size_t which = 0; which < prototypes.size() && places.count() > kMostNodes; ++which)
        if (!prototypes[which].definition.empty())
            if (const auto glyph = glyphOf(scene_.file.definition(prototypes[which].number)))
                addGlyphs(places, which, *glyph, inside.make);
    for (std::size_t i = 0; i < places.count(); ++i) {
        if (!places.shown[i]) continue;
        const auto which = static_cast<std::size_t>(places.prototypes[i]);
        if (places.prototypes[i] < 0 || which >= prototypes.size() || !places.stands(i)) {
            ++lost;
            continue;
        }
        const Prototype& prototype = prototypes[which];
        if (prototype.definition.empty()) continue;
        if (Expected<void> counted = countNodes(1 + prototype.nodes); !counted) return counted;
        Node& node = *inside.make();
        node.set_name(fmt::format("instance {}", i));
        setTransform(*node.mutable_transform(), places.position(i), places.orientation(i), places.scale(i));
        node.set_instance(prototype.definition);
    }
    if (lost > 0)
        scene_.noteMissing(fmt::format("{}: {} of {} instances are left out, as they have no prototype or no place",
                                       prim.path(), lost, places.count()));
    return {};
}

}  // namespace tessera

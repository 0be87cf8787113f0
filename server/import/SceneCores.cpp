// Cores of an import: content to plain structs, each shared one created once.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "common/drawable/DeformationArrays.h"
#include "common/drawable/Drawable.h"
#include "common/drawable/ImageLayout.h"
#include "common/geometry/Mesh.h"
#include "common/scene/ChildChoice.h"
#include "common/scene/Cores.h"
#include "common/scene/MaterialParts.h"
#include "common/scene/Text.h"
#include "server/import/CollisionCores.h"
#include "server/import/NurbsCores.h"
#include "server/import/SceneAssembly.h"
#include "server/import/TableCores.h"

namespace tessera {
namespace {

constexpr std::uint32_t kMaxImageSide = 16384;
constexpr std::uint64_t kMostDerivedTriangles = 10'000'000;  // of all surfaces of an import

using Content = proto::scene::Node::ContentCase;

// One number in code, on the wire and in files.
using MeshMessage = proto::scene::Mesh;
using ImageMessage = proto::scene::Image;
using MaterialMessage = proto::scene::Material;
static_assert(MaterialMessage::AUTO_ALPHA == Material::kAutoAlpha && MaterialMessage::OPAQUE == Material::kOpaque &&
              MaterialMessage::MASK == Material::kMask && MaterialMessage::BLEND == Material::kBlend);
static_assert(MaterialMessage::FILLED == Material::kFilled && MaterialMessage::EDGES == Material::kEdges && MaterialMessage::CORNERS == Material::kCorners);
static_assert(MaterialMessage::METAL_ROUGHNESS == Material::kMetalRoughness && MaterialMessage::PHONG == Material::kPhong);
using LayerMessage = proto::scene::TextureLayer;
static_assert(LayerMessage::MODULATE == TextureLayer::kModulate && LayerMessage::ADD == TextureLayer::kAdd && LayerMessage::DECAL == TextureLayer::kDecal &&
              LayerMessage::REPLACE == TextureLayer::kReplace);
static_assert(LayerMessage::TEXCOORDS == TextureLayer::kTexcoords && LayerMessage::SPHERE == TextureLayer::kSphere &&
              LayerMessage::REFLECTION == TextureLayer::kReflection && LayerMessage::POSITION == TextureLayer::kPosition);
static_assert(MeshMessage::TRIANGLES == Geometry::kTriangles && MeshMessage::POINTS == Geometry::kPoints && MeshMessage::LINES == Geometry::kLines &&
              MeshMessage::LINE_STRIPS == Geometry::kLineStrip && MeshMessage::LINE_LOOPS == Geometry::kLineLoop &&
              MeshMessage::TRIANGLE_STRIPS == Geometry::kTriangleStrip && MeshMessage::TRIANGLE_FANS == Geometry::kTriangleFan &&
              MeshMessage::QUADS == Geometry::kQuads && MeshMessage::QUAD_STRIPS == Geometry::kQuadStrip && MeshMessage::POLYGONS == Geometry::kPolygons);
static_assert(ImageMessage::REPEAT == Image::kRepeat && ImageMessage::CLAMP == Image::kClamp &&
              ImageMessage::MIRROR == Image::kMirror);
static_assert(ImageMessage::LINEAR == Image::kLinear && ImageMessage::NEAREST == Image::kNearest);
static_assert(ImageMessage::TRILINEAR == Image::kTrilinear && ImageMessage::NEAREST_ALONE == Image::kNearestAlone &&
              ImageMessage::LINEAR_ALONE == Image::kLinearAlone &&
              ImageMessage::NEAREST_MIPMAP_NEAREST == Image::kNearestOfNearest &&
              ImageMessage::LINEAR_MIPMAP_NEAREST == Image::kLinearOfNearest &&
              ImageMessage::NEAREST_MIPMAP_LINEAR == Image::kNearestOfTwo);
static_assert(ImageMessage::RGBE == Image::kRgbe && ImageMessage::BC1 == Image::kBc1 && ImageMessage::BC2 == Image::kBc2 && ImageMessage::BC3 == Image::kBc3 &&
              ImageMessage::BC4 == Image::kBc4 && ImageMessage::BC5 == Image::kBc5 && ImageMessage::BC6H == Image::kBc6h && ImageMessage::BC7 == Image::kBc7);
static_assert(ImageMessage::FLAT == Image::kFlat && ImageMessage::LINE == Image::kLine && ImageMessage::SOLID == Image::kSolid && ImageMessage::CUBE == Image::kCube);

template <typename Numbers>
Blob blobOfNumbers(const Numbers& numbers) {
    using Number = std::remove_cvref_t<decltype(*numbers.data())>;
    return numbers.empty() ? Blob() : Blob::of(std::span<const Number>(numbers.data(), static_cast<std::size_t>(numbers.size())));
}

/// 0xRRGGBBAA each.
template <typename Colors>
Blob blobOfColors(const Colors& colors) {
    std::vector<std::uint8_t> bytes;
    for (const std::uint32_t color : colors)
        for (int shift = 24; shift >= 0; shift -= 8) bytes.push_back(static_cast<std::uint8_t>(color >> shift));
    return bytes.empty() ? Blob() : Blob::of(std::span<const std::uint8_t>(bytes));
}

}  // namespace

Expected<ObjectId> SceneAssembly::contentCore(LoadedFile& file, const proto::scene::Node& node, const Spot& spot) {
    switch (node.content_case()) {
        case Content::CONTENT_NOT_SET:
        case Content::kImport:
        case Content::kInstance:
            return ObjectId{};
        case Content::kGeometry: {
            if (node.has_lattice()) return deformationCore(file, node, spot);
            const Expected<LoadedFile::GeometryCore> core = geometryCore(file, node.geometry(), spot);
            if (!core) return tl::unexpected(core.error());
            result_.triangles += core->triangles;
            ++drawn_;
            return core->id;
        }
        case Content::kSubdivisionSurface:
        case Content::kNurbsSurface: {
            const Expected<LoadedFile::GeometryCore> core =
                node.has_nurbs_surface() ? nurbsCore(file, node.nurbs_surface(), spot) : surfaceCore(file, node.subdivision_surface(), spot);
            if (!core) return tl::unexpected(core.error());
            if (core->triangles == 0) note(fmt::format("{}: nothing of the surface '{}' has an area that can be shown", file.label, readName(node.name(), "")));
            result_.triangles += core->triangles;
            ++drawn_;
            return core->id;
        }
        case Content::kText: {
            const Expected<LoadedFile::GeometryCore> core = textCore(file, node.text(), spot);
            if (!core) return tl::unexpected(core.error());
            result_.triangles += core->triangles;
            ++drawn_;
            return core->id;
        }
        case Content::kParticles:
        case Content::kVolume: {
            const Expected<LoadedFile::GeometryCore> core = node.has_volume() ? volumeCore(file, node.volume(), spot) : particlesCore(file, node.particles(), spot);
            if (!core) return tl::unexpected(core.error());
            result_.triangles += core->triangles;
            ++drawn_;
            return core->id;
        }
        case Content::kCamera: {
            Camera camera;
            if (node.camera().has_world_units_per_metre())
                camera.worldUnitsPerMetre = node.camera().world_units_per_metre();
            if (!(camera.worldUnitsPerMetre > 1e-9 && camera.worldUnitsPerMetre < 1e12))
                return fail(ErrorCode::kBadInput, "a camera's world_units_per_metre must be above zero");
            camera.enabled = enablesCamera(file, spot, !node.camera().disabled());
            if (camera.enabled) result_.hasCamera = true;
            return create(camera);
        }
        case Content::kSwitch: {
            Switch choice;
            if (node.switch_().has_choice()) choice.choice = node.switch_().choice();
            if (choice.choice < Switch::kNone)
                return fail(ErrorCode::kBadInput,
                            "a switch's choice is a child's number from 0, -1 (all) or -2 (none); `shown` names several");
            if (node.switch_().shown_size() > 0 && node.switch_().has_choice())
                return fail(ErrorCode::kBadInput, "a switch has a choice, or says which are shown");
            for (const std::uint32_t child : node.switch_().shown()) {
                if (child > 62) return fail(ErrorCode::kBadInput, fmt::format("a switch shows child {}: several can be chosen among the first 63", child));
                choice.choice = Switch::kMask;
                choice.mask |= std::int64_t{1} << child;
            }
            return create(choice);
        }
        case Content::kMaterialGroup: {
            Expected<MaterialGroup> group = readTableObject<MaterialGroup>(node.material_group());
            if (!group) return tl::unexpected(group.error());
            if (!node.material_group().material().empty()) {
                const Expected<ObjectId> material = materialCore(file, node.material_group().material());
                if (!material) return material;
                group->material = *material;
            }
            return create(*group);
        }
        case Content::kDistanceLod: {
            const auto& message = node.distance_lod();
            Expected<DistanceLOD> lod = readTableObject<DistanceLOD>(message);
            if (!lod) return tl::unexpected(lod.error());
            lod->ranges = Blob::of(std::span<const double>(message.range().data(), static_cast<std::size_t>(message.range_size())));
            if (const Expected<void> sound = checkRanges(*lod); !sound) return tl::unexpected(sound.error());
            if (node.node_size() == 0)
                note(fmt::format("{}: a distance_lod without levels: nothing below it is shown until nodes hang there", file.label));
            else if (node.node_size() <= message.range_size())
                note(fmt::format("{}: a distance_lod with {} ranges and {} below it: beyond the ranges that count the last of these is shown", file.label,
                                 message.range_size(), node.node_size()));
            return create(*lod);
        }
        case Content::kBillboard: {
            if (node.billboard().point() && node.billboard().has_axis()) return fail(ErrorCode::kBadInput, "a billboard has an axis or a point, not both");
            Expected<Billboard> billboard = readTableObject<Billboard>(node.billboard());
            if (!billboard) return tl::unexpected(billboard.error());
            if (node.billboard().point()) billboard->axis = Vec3d::Zero();
            return create(*billboard);
        }
        case Content::kMotion: {
            const Expected<Blob> keys = readKeys(node.motion());
            if (!keys) return tl::unexpected(keys.error());
            Motion motion;
            motion.keys = *keys;
            motion.mode = node.motion().mode();
            if (!proto::scene::Motion::Mode_IsValid(node.motion().mode()))
                return fail(ErrorCode::kBadInput, fmt::format("a motion's mode is {}, which is none of its words", motion.mode));
            motion.playing = !node.motion().paused();
            return create(motion);
        }
        case Content::kAnimation: {
            Expected<Animation> animation = readTableObject<Animation>(node.animation());
            if (!animation) return tl::unexpected(animation.error());
            if (node.animation().has_mode() && !proto::scene::Animation::Mode_IsValid(node.animation().mode()))
                return fail(ErrorCode::kBadInput, "an animation's mode is none of its words");
            if (node.animation().channel().empty()) return fail(ErrorCode::kBadInput, "an animation has no channels");
            animation->playing = !node.animation().paused();
            return create(*animation);
        }
        case Content::kSkin:
            return skinCore(file, node.skin(), spot);
        case Content::kInline:
        case Content::kProxyGroup:
            return inlineCore(file, node);
        case Content::kApplicationData: {
            Expected<ApplicationData> data = readTableObject<ApplicationData>(node.application_data());
            if (!data) return tl::unexpected(data.error());
            if (data->key.empty()) return fail(ErrorCode::kBadInput, "application_data without a key, which says what it is");
            const std::string& bytes = node.application_data().data();
            data->data = Blob::of(std::span<const char>(bytes.data(), bytes.size()));
            return create(*data);
        }
        case Content::kMovie:
            return movieCore(file, node.movie());
        case Content::kEnvironment: {
            Expected<Environment> environment = readEnvironment(node.environment());
            if (!environment) return tl::unexpected(environment.error());
            if (!node.environment().image().empty()) {
                const Expected<ObjectId> image = imageCore(file, node.environment().image());
                if (!image) return image;
                const proto::scene::Image& said = *file.images.at(node.environment().image());
                if (said.shape() == ImageMessage::LINE || said.shape() == ImageMessage::SOLID)
                    return fail(ErrorCode::kBadInput, fmt::format("the surroundings' image '{}' is neither flat nor a cube", node.environment().image()));
                if (said.shape() == ImageMessage::FLAT && std::abs(static_cast<double>(said.width_px()) - 2.0 * said.height_px()) > said.height_px() / 8.0)
                    return fail(ErrorCode::kBadInput, fmt::format("the surroundings' image '{}' of {} × {} pixels is not about twice "
                                                                  "as wide as high",
                                                                  node.environment().image(), said.width_px(), said.height_px()));
                environment->image = *image;
            }
            return create(*environment);
        }
        case Content::kInterest: {
            const Expected<Interest> interest = readInterest(node.interest());
            if (!interest) return tl::unexpected(interest.error());
            return create(*interest);
        }
        case Content::kCollisionObject: {
            const Expected<CollisionObject> object = readCollisionObject(node.collision_object());
            if (!object) return tl::unexpected(object.error());
            return create(*object);
        }
        case Content::kCore:
            return writtenCore(file, node, spot);
        default:
            if (const TypeInfo* type = tableTypeOf(node)) {
                const Expected<TableFields> fields = readTableFields(contentOf(node), *type);
                if (!fields) return tl::unexpected(fields.error());
                const ObjectId id = createObject(type->freshObject());
                for (const auto& [field, value] : *fields) builder_.set(id, type->type, field, value);
                return id;
            }
            return fail(ErrorCode::kBadInput, "it is not in plain form (shapes are made into meshes by the reader)");
    }
}

Expected<LoadedFile::GeometryCore> SceneAssembly::geometryCore(LoadedFile& file, const proto::scene::Geometry& geometry,
                                                               const Spot& spot) {
    const std::string& name = geometry.material().empty() ? spot.material : geometry.material();
    LoadedFile::GeometryCore& core =
        file.geometryCores[{geometry.mesh(), spot.paint ? std::string() : name, spot.paint}];
    if (core.id) return core;
    Expected<Geometry> mesh = file.mesh(geometry.mesh());
    if (!mesh) return tl::unexpected(mesh.error());
    Geometry value = std::move(*mesh);
    core.triangles = drawableOf(Object::of(value)).triangleCount();
    value.material = spot.paint;
    if (!spot.paint && !name.empty()) {
        const Expected<ObjectId> material = materialCore(file, name);
        if (!material) return tl::unexpected(material.error());
        value.material = *material;
    }
    core.id = create(value);
    ++result_.geometries;
    result_.trianglesStored += core.triangles;
    return core;
}

Expected<ObjectId> SceneAssembly::deformationCore(LoadedFile& file, const proto::scene::Node& node, const Spot& spot) {
    const proto::scene::Geometry& geometry = node.geometry();
    const proto::scene::Lattice& lattice = node.lattice();
    const Expected<Geometry> mesh = file.mesh(geometry.mesh());
    if (!mesh) return tl::unexpected(mesh.error());
    std::optional<MeshArrays> arrays = drawableOf(Object::of(*mesh)).arrays();  // strips, quads, polygons as the triangles that they are
    if (arrays->primitive != Primitive::kTriangles) return fail(ErrorCode::kBadInput, "a lattice bends triangles, no points or lines");
    Deformation value;
    const auto axis = [](std::uint32_t points, std::uint32_t degree, std::int64_t& pointsOut, std::int64_t& degreeOut) {
        pointsOut = points > 0 ? points : 4;
        degreeOut = degree > 0 ? degree : std::clamp<std::int64_t>(pointsOut - 1, 1, 3);
    };
    axis(lattice.points_x(), lattice.degree_x(), value.pointsX, value.degreeX);
    axis(lattice.points_y(), lattice.degree_y(), value.pointsY, value.degreeY);
    axis(lattice.points_z(), lattice.degree_z(), value.pointsZ, value.degreeZ);
    const auto vector = [](const proto::scene::Vector& v) { return Vec3d(v.x(), v.y(), v.z()); };
    Box box = boundsOf(arrays->positions.as<float>());
    if (box.empty()) box = {Vec3d::Zero(), Vec3d::Zero()};
    // A flat mesh lies in the middle of its volume.
    const double thinnest = std::max(0.05 * box.size().maxCoeff(), 1e-6);
    for (Eigen::Index i = 0; i < 3; ++i) {
        if (box.upper[i] - box.lower[i] >= thinnest) continue;
        box.lower[i] -= thinnest;
        box.upper[i] += thinnest;
    }
    value.lower = lattice.has_lower() ? vector(lattice.lower()) : box.lower;
    value.upper = lattice.has_upper() ? vector(lattice.upper()) : box.upper;
    std::vector<float> points;
    for (const proto::scene::Vector& point : lattice.point())
        for (const double coordinate : {point.x(), point.y(), point.z()}) points.push_back(static_cast<float>(coordinate));
    if (!points.empty()) value.controlPoints = Blob::of(std::span<const float>(points));
    value.positions = std::move(arrays->positions);
    value.normals = std::move(arrays->normals);
    value.colors = std::move(arrays->colors);
    value.texcoords = std::move(arrays->texcoords);
    value.texcoords1 = std::move(arrays->texcoords1);
    value.indices = std::move(arrays->indices);
    // At rest, but there: who bends it edits ranges of them. What makes no lattice is refused below.
    if (value.controlPoints.empty())
        if (const Expected<Blob> rest = controlPointsAtRest(value)) value.controlPoints = *rest;
    LoadedFile::GeometryCore core;
    const auto made = derivedCore(file, core, std::move(value), geometry.material().empty() ? spot.material : geometry.material(), spot);
    if (!made) return tl::unexpected(made.error());
    ++drawn_;
    result_.triangles += core.triangles;
    return core.id;
}

Expected<ObjectId> SceneAssembly::skinCore(LoadedFile& file, const proto::scene::Skin& skin, const Spot& spot) {
    const Expected<Geometry> mesh = file.mesh(skin.mesh());
    if (!mesh) return tl::unexpected(mesh.error());
    std::optional<MeshArrays> arrays = drawableOf(Object::of(*mesh)).arrays();  // strips, quads, polygons as the triangles that they are
    if (arrays->primitive != Primitive::kTriangles) return fail(ErrorCode::kBadInput, "a skin deforms triangles, no points or lines");
    Skin value;
    value.positions = std::move(arrays->positions);
    value.normals = std::move(arrays->normals);
    value.colors = std::move(arrays->colors);
    value.texcoords = std::move(arrays->texcoords);
    value.texcoords1 = std::move(arrays->texcoords1);
    value.indices = std::move(arrays->indices);
    const auto written = [](const auto& numbers) {
        return numbers.empty() ? Blob() : Blob::of(std::span<const float>(numbers.data(), static_cast<std::size_t>(numbers.size())));
    };
    std::vector<std::uint16_t> joints;
    for (const std::uint32_t joint : skin.joint_index()) {
        if (joint > 0xffff) return fail(ErrorCode::kBadInput, fmt::format("joint {} is more than a skin can have", joint));
        joints.push_back(static_cast<std::uint16_t>(joint));
    }
    if (!joints.empty()) value.jointIndices = Blob::of(std::span<const std::uint16_t>(joints));
    value.jointWeights = written(skin.joint_weight());
    value.inverseBinds = written(skin.inverse_bind());
    value.morphPositions = written(skin.morph_position());
    value.morphNormals = written(skin.morph_normal());
    value.weights = written(skin.weight());
    for (const auto& [target, number] : {std::pair(&value.jointIndices, skin.joint_indices_blob()), std::pair(&value.jointWeights, skin.joint_weights_blob()),
                                         std::pair(&value.inverseBinds, skin.inverse_binds_blob()), std::pair(&value.morphPositions, skin.morph_positions_blob()),
                                         std::pair(&value.morphNormals, skin.morph_normals_blob()), std::pair(&value.pose, skin.pose_blob())}) {
        if (number == 0) continue;
        Expected<Blob> blob = file.blob(number);
        if (!blob) return tl::unexpected(blob.error());
        *target = std::move(*blob);
    }
    const auto jointCount = static_cast<std::size_t>(skin.joint_size() + skin.joint_key_size());
    if (!value.jointIndices.empty() && jointCount == 0) return fail(ErrorCode::kBadInput, "its vertices follow joints, and it names none");
    if (!value.jointIndices.empty() && value.jointWeights.empty()) return fail(ErrorCode::kBadInput, "its vertices follow joints without weights");
    if (value.jointIndices.empty() && !value.jointWeights.empty()) return fail(ErrorCode::kBadInput, "it has weights of joints, and its vertices follow none");
    if (jointCount > 0 && !value.inverseBinds.empty() && value.inverseBinds.sizeBytes() != jointCount * 12 * sizeof(float))
        return fail(ErrorCode::kBadInput, fmt::format("inverse_bind has {} bytes; {} joints have {}", value.inverseBinds.sizeBytes(), jointCount, jointCount * 12 * sizeof(float)));
    // At rest until the server has looked where the joints are, in the first frame.
    if (jointCount > 0 && value.pose.empty()) {
        std::vector<float> rest;
        for (std::size_t i = 0; i < jointCount; ++i)
            for (const float number : {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}) rest.push_back(number);
        value.pose = Blob::of(std::span<const float>(rest));
    }
    if (value.pose.sizeBytes() != jointCount * 12 * sizeof(float)) return fail(ErrorCode::kBadInput, "its pose is of another number of joints");
    LoadedFile::GeometryCore core;
    const auto made = derivedCore(file, core, std::move(value), skin.material().empty() ? spot.material : skin.material(), spot);
    if (!made) return tl::unexpected(made.error());
    ++drawn_;
    result_.triangles += core.triangles;
    return core.id;
}

Expected<LoadedFile::GeometryCore> SceneAssembly::surfaceCore(LoadedFile& file, const proto::scene::SubdivisionSurface& message,
                                                              const Spot& spot) {
    const std::string& name = message.material().empty() ? spot.material : message.material();
    // Equal surfaces are one core, as equal shapes are.
    LoadedFile::GeometryCore& core = file.surfaceCores[{hash128(asBytes(message.SerializeAsString())), spot.paint ? std::string() : name, spot.paint}];
    if (core.id) return core;
    Expected<SubdivisionSurface> surface = readTableObject<SubdivisionSurface>(message);
    if (!surface) return tl::unexpected(surface.error());
    const auto numbers = [](const auto& values) {
        using Number = std::remove_cvref_t<decltype(*values.data())>;
        return values.empty() ? Blob() : Blob::of(std::span<const Number>(values.data(), static_cast<std::size_t>(values.size())));
    };
    surface->points = numbers(message.points());
    surface->faceVertices = numbers(message.face_vertices());
    surface->faceSizes = numbers(message.face_sizes());
    if (message.face_sizes().empty()) {
        const std::uint32_t each = surface->scheme == SubdivisionSurface::kLoop ? 3 : 4;
        const std::vector<std::uint32_t> sizes(static_cast<std::size_t>(message.face_vertices_size()) / each, each);
        if (!sizes.empty()) surface->faceSizes = Blob::of(std::span<const std::uint32_t>(sizes));
    }
    surface->creases = numbers(message.creases());
    surface->creaseSharpness = numbers(message.crease_sharpness());
    surface->corners = numbers(message.corners());
    surface->cornerSharpness = numbers(message.corner_sharpness());
    surface->holes = numbers(message.holes());
    return derivedCore(file, core, std::move(*surface), name, spot);
}

Expected<LoadedFile::GeometryCore> SceneAssembly::nurbsCore(LoadedFile& file, const proto::scene::NurbsSurface& message, const Spot& spot) {
    const std::string& name = message.material().empty() ? spot.material : message.material();
    LoadedFile::GeometryCore& core = file.surfaceCores[{hash128(asBytes(message.SerializeAsString())), spot.paint ? std::string() : name, spot.paint}];
    if (core.id) return core;
    Expected<NurbsSurfaceCore> surface = readNurbsSurface(message);
    if (!surface) return tl::unexpected(surface.error());
    return derivedCore(file, core, std::move(*surface), name, spot);
}

Expected<LoadedFile::GeometryCore> SceneAssembly::textCore(LoadedFile& file, const proto::scene::Text& message, const Spot& spot) {
    const std::string& name = message.material().empty() ? spot.material : message.material();
    LoadedFile::GeometryCore& core = file.surfaceCores[{hash128(asBytes(message.SerializeAsString())), spot.paint ? std::string() : name, spot.paint}];
    if (core.id) return core;
    Expected<Text> text = readTableObject<Text>(message);
    if (!text) return tl::unexpected(text.error());
    std::vector<std::string> notes;
    const Expected<TextOutlines> set = typesetter_.set(*text, notes);
    for (const std::string& said : notes) note(fmt::format("{}: {}", file.label, said));
    // A machine without fonts may still hand the scene on.
    if (!set && set.error().code == ErrorCode::kUnsupported) note(fmt::format("{}: {}", file.label, set.error().message));
    else if (!set) return tl::unexpected(set.error());
    else text->outlines = set->toBlob();
    return derivedCore(file, core, std::move(*text), name, spot);
}

Expected<LoadedFile::GeometryCore> SceneAssembly::particlesCore(LoadedFile& file, const proto::scene::Particles& message, const Spot& spot) {
    const std::string& name = message.material().empty() ? spot.material : message.material();
    LoadedFile::GeometryCore& core = file.surfaceCores[{hash128(asBytes(message.SerializeAsString())), spot.paint ? std::string() : name, spot.paint}];
    if (core.id) return core;
    if (!proto::scene::Particles::Mode_IsValid(message.mode())) return fail(ErrorCode::kBadInput, "the particles' mode is none of its words");
    Expected<Particles> particles = readTableObject<Particles>(message);
    if (!particles) return tl::unexpected(particles.error());
    particles->positions = blobOfNumbers(message.positions());
    particles->tails = blobOfNumbers(message.tails());
    particles->colors = blobOfColors(message.colors());
    particles->sizes = blobOfNumbers(message.sizes());
    particles->ages = blobOfNumbers(message.ages());
    particles->turns = blobOfNumbers(message.turns());
    particles->ageColors = blobOfColors(message.age_colors());
    particles->ageSizes = blobOfNumbers(message.age_sizes());
    return derivedCore(file, core, std::move(*particles), name, spot);
}

Expected<LoadedFile::GeometryCore> SceneAssembly::volumeCore(LoadedFile& file, const proto::scene::Volume& message, const Spot& spot) {
    const std::string& name = message.material().empty() ? spot.material : message.material();
    LoadedFile::GeometryCore& core = file.surfaceCores[{hash128(asBytes(message.SerializeAsString())), spot.paint ? std::string() : name, spot.paint}];
    if (core.id) return core;
    if (!proto::scene::Volume::Mode_IsValid(message.mode()) || !proto::scene::Volume::Format_IsValid(message.format()))
        return fail(ErrorCode::kBadInput, "the volume's mode or format is none of its words");
    Expected<Volume> volume = readTableObject<Volume>(message);
    if (!volume) return tl::unexpected(volume.error());
    if (message.voxels_blob() != 0) {
        Expected<Blob> voxels = file.blob(message.voxels_blob());
        if (!voxels) return tl::unexpected(voxels.error());
        volume->voxels = std::move(*voxels);
    } else {
        volume->voxels = blobOfNumbers(message.voxels());
        volume->format = Volume::kFloat;
    }
    volume->transfer = blobOfColors(message.transfer());
    volume->slices = blobOfNumbers(message.slices());
    volume->clipPlanes = blobOfNumbers(message.clip_planes());
    return derivedCore(file, core, std::move(*volume), name, spot);
}

template <typename Surface>
Expected<LoadedFile::GeometryCore> SceneAssembly::derivedCore(LoadedFile& file, LoadedFile::GeometryCore& core, Surface surface, const std::string& name, const Spot& spot) {
    surface.material = spot.paint;
    if (!spot.paint && !name.empty()) {
        const Expected<ObjectId> material = materialCore(file, name);
        if (!material) return tl::unexpected(material.error());
        surface.material = *material;
    }
    const Drawable drawable = drawableOf(Object::of(surface));
    if (Expected<void> sound = drawable.check(); !sound) return tl::unexpected(sound.error());
    core.triangles = drawable.triangleCount();
    // Each surface is bounded; a file of thousands of them is too.
    derivedTriangles_ += core.triangles;
    if (derivedTriangles_ > kMostDerivedTriangles)
        return fail(ErrorCode::kLimit, fmt::format("the scene's surfaces by control points have more than {} triangles: a lower level or a larger tolerance has fewer", kMostDerivedTriangles));
    core.id = create(surface);
    ++result_.geometries;
    result_.trianglesStored += core.triangles;
    return core;
}

Expected<ObjectId> SceneAssembly::materialCore(LoadedFile& file, const std::string& name) {
    if (const auto known = file.materialCores.find(name); known != file.materialCores.end()) return known->second;
    const auto found = file.materials.find(name);
    if (found == file.materials.end())
        return fail(ErrorCode::kBadInput, fmt::format("there is no material '{}'", readName(name, "")));
    std::vector<Mended> mended;
    Expected<Material> material = readTableObject<Material>(*found->second, &mended);
    if (!material) return failWith(fmt::format("material '{}'", readName(name, "")), material.error());
    for (const Mended& number : mended) noteMended(file, fmt::format("{}material '{}': {}", placeIn(*found->second, number.field), readName(name, ""), number.what));
    const google::protobuf::Message& message = *found->second;
    for (const FieldEntry& field : findType(Material::kType)->fields) {
        if (field.kind != FieldKind::kRef || field.refType != Image::kType) continue;
        const auto* said = message.GetDescriptor()->FindFieldByName(snakeCase(field.name));
        if (!field.name.ends_with("Image") || !said) continue;
        const std::string image = message.GetReflection()->GetString(message, said);
        if (image.empty()) continue;
        const Expected<ObjectId> core = imageCore(file, image);
        if (!core) return core;
        field.store(&*material, *core);
    }
    for (const proto::scene::TextureLayer& layer : found->second->layer()) {
        Expected<TextureLayer> made = readTableObject<TextureLayer>(layer);
        if (!made) return failWith(fmt::format("material '{}', layer {}", readName(name, ""), material->layers.size()), made.error());
        if (!layer.image().empty()) {
            const Expected<ObjectId> image = imageCore(file, layer.image());
            if (!image) return image;
            made->image = *image;
        }
        material->layers.push_back(create(*made));
    }
    if (const Expected<void> sound = checkLayers(*material); !sound) return failWith(fmt::format("material '{}'", readName(name, "")), sound.error());
    // Known from here on: materials may name one another in circles.
    const ObjectId id = file.materialCores[name] = create(*material);
    if (Expected<void> named = materialParts(file, *found->second, id); !named) return failWith(fmt::format("material '{}'", readName(name, "")), named.error());
    return id;
}

Expected<void> SceneAssembly::materialParts(LoadedFile& file, const proto::scene::Material& message, ObjectId id) {
    const auto set = [&](FieldId field, const FieldValue& value) { builder_.set(id, typeOf<Material>(), field, value); };
    if (static_cast<std::size_t>(message.pass_size()) > Material::kMostPasses)
        return fail(ErrorCode::kLimit, fmt::format("{} passes, and {} may be", message.pass_size(), Material::kMostPasses));
    if (static_cast<std::size_t>(message.uniform_size()) > Material::kMostUniforms)
        return fail(ErrorCode::kLimit, fmt::format("{} uniforms, and {} may be", message.uniform_size(), Material::kMostUniforms));
    if (message.has_program()) {
        const Expected<SurfaceProgram> program = readTableObject<SurfaceProgram>(message.program());
        if (!program) return tl::unexpected(program.error());
        set(fieldId<&Material::program>, toValue(create(*program)));
    }
    RefList uniforms;
    for (const proto::scene::Uniform& said : message.uniform()) {
        Uniform uniform{.name = said.name(), .value = Vec4f::Zero(), .image = {}};
        if (said.value_size() > 4) return fail(ErrorCode::kBadInput, fmt::format("the uniform '{}' has more than four numbers", readName(said.name(), "")));
        for (int i = 0; i < said.value_size(); ++i) {
            if (!std::isfinite(said.value(i))) return fail(ErrorCode::kBadInput, fmt::format("the uniform '{}' is not a number", readName(said.name(), "")));
            uniform.value[i] = said.value(i);
        }
        if (!said.image().empty()) {
            const Expected<ObjectId> image = imageCore(file, said.image());
            if (!image) return tl::unexpected(image.error());
            uniform.image = *image;
        }
        uniforms.push_back(create(uniform));
    }
    if (!uniforms.empty()) set(fieldId<&Material::uniforms>, uniforms);
    if (message.pass().empty() && message.coarser().empty()) return {};
    constexpr int kDeepest = 64;
    if (materialDepth_ == kDeepest) return fail(ErrorCode::kLimit, fmt::format("materials name one another {} times in a row", kDeepest));
    ++materialDepth_;
    RefList passes;
    Expected<void> done;
    for (const std::string& name : message.pass()) {
        const Expected<ObjectId> pass = done ? materialCore(file, name) : Expected<ObjectId>(ObjectId());
        if (!pass) done = tl::unexpected(pass.error());
        if (pass) passes.push_back(*pass);
    }
    if (done && !message.coarser().empty()) {
        const Expected<ObjectId> coarser = materialCore(file, message.coarser());
        if (!coarser) done = tl::unexpected(coarser.error());
        if (coarser) set(fieldId<&Material::coarser>, toValue(*coarser));
    }
    --materialDepth_;
    if (done && !passes.empty()) set(fieldId<&Material::passes>, passes);
    return done;
}

Expected<ObjectId> SceneAssembly::imageCore(LoadedFile& file, const std::string& name) {
    if (const auto known = file.imageCores.find(name); known != file.imageCores.end()) return known->second;
    const auto found = file.images.find(name);
    if (found == file.images.end())
        return fail(ErrorCode::kBadInput, fmt::format("there is no image '{}'", readName(name, "")));
    const proto::scene::Image& message = *found->second;
    const Expected<Blob> pixels = file.blob(message.pixels_blob());
    if (!pixels) return failWith(fmt::format("image '{}'", readName(name, "")), pixels.error());
    Expected<Image> image = readTableObject<Image>(message);
    if (!image) return failWith(fmt::format("image '{}'", readName(name, "")), image.error());
    image->pixels = *pixels;
    if (pixels->empty() && message.width_px() == 0 && message.height_px() == 0 && isFilm(file, name)) {
        // Black, until the film is there.
        static constexpr std::array<std::uint8_t, 4> kBlack = {0, 0, 0, 255};
        image->pixels = Blob::of(std::span<const std::uint8_t>(kBlack));
        image->widthPx = image->heightPx = 1;
        return file.imageCores[name] = create(*image);
    }
    if (message.width_px() == 0 || message.height_px() == 0 || message.width_px() > kMaxImageSide || message.height_px() > kMaxImageSide || pixels->sizeBytes() == 0)
        return fail(ErrorCode::kBadInput, fmt::format("image '{}': {} bytes are not {} × {} pixels", readName(name, ""),
                                                      pixels->sizeBytes(), message.width_px(), message.height_px()));
    if (const Expected<void> sound = checkImage(*image); !sound) return failWith(fmt::format("image '{}'", readName(name, "")), sound.error());
    return file.imageCores[name] = create(*image);
}

}  // namespace tessera

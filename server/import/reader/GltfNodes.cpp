#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "common/base/WrittenByTessera.h"
#include "common/math/Compose.h"
#include "server/import/reader/GltfReader.h"

namespace tessera {
namespace {

float coneDegrees(double radians) {
    return static_cast<float>(std::clamp(radians * 180.0 / std::numbers::pi, 0.0, 90.0));
}

/// Extensions that a file may insist on and still be shown well enough.
constexpr std::array<std::string_view, 16> kUnderstood = {"KHR_lights_punctual",
                                                          "KHR_draco_mesh_compression",
                                                          "EXT_meshopt_compression",
                                                          "KHR_meshopt_compression",
                                                          "EXT_texture_webp",
                                                          "KHR_mesh_quantization",
                                                          "EXT_mesh_gpu_instancing",
                                                          "KHR_texture_transform",
                                                          "MSFT_texture_dds",
                                                          "KHR_materials_unlit",
                                                          "KHR_materials_emissive_strength",
                                                          "KHR_materials_clearcoat",
                                                          "KHR_materials_transmission",
                                                          "KHR_materials_specular",
                                                          "KHR_materials_ior",
                                                          "KHR_materials_pbrSpecularGlossiness"};
/// Of these a file may insist on any: without it a surface looks otherwise, but is there.
constexpr std::string_view kMaterialExtensions = "KHR_materials_";
constexpr std::array<std::string_view, 1> kPictureExtensions = {"KHR_texture_basisu"};

bool isUnderstood(std::string_view extension) {
    return std::find(kUnderstood.begin(), kUnderstood.end(), extension) != kUnderstood.end();
}

template <int N>
Eigen::Matrix<double, N, 1> vectorFrom(const std::vector<double>& values,
                                       const Eigen::Matrix<double, N, 1>& otherwise) {
    if (values.size() != N) return otherwise;
    return Eigen::Map<const Eigen::Matrix<double, N, 1>>(values.data());
}

/// What tinygltf passes over as if it were not there, as it is of another JSON type than glTF's; nothing: there is no
/// such.
std::string oddTypeOfLight(const tinygltf::Model& model, int index) {
    const auto extension = model.extensions.find("KHR_lights_punctual");
    if (extension == model.extensions.end() || !extension->second.Has("lights") ||
        !extension->second.Get("lights").IsArray())
        return {};
    const tinygltf::Value& light = extension->second.Get("lights").Get(index);
    const auto oddNumber = [](const tinygltf::Value& of, const char* name) {
        return of.Has(name) && !of.Get(name).IsNumber();
    };
    for (const char* name : {"intensity", "range"})
        if (oddNumber(light, name)) return fmt::format("{} is no number", name);
    if (light.Has("color")) {
        const tinygltf::Value& color = light.Get("color");
        bool good = color.IsArray() && color.ArrayLen() == 3;
        for (std::size_t i = 0; good && i < 3; ++i) good = color.Get(static_cast<int>(i)).IsNumber();
        if (!good) return "colour is not three numbers";
    }
    if (!light.Has("spot")) return {};
    for (const char* name : {"innerConeAngle", "outerConeAngle"})
        if (oddNumber(light.Get("spot"), name)) return fmt::format("spot's {} is no number", name);
    return {};
}

}  // namespace

Affine3d localTransform(const tinygltf::Node& node) {
    if (node.matrix.size() == 16) {
        Affine3d map = Affine3d::Identity();
        map.matrix().topRows<3>() = Eigen::Map<const Mat4d>(node.matrix.data()).topRows<3>();
        return map;
    }
    const Vec4d q = vectorFrom<4>(node.rotation, Vec4d(0, 0, 0, 1));
    Quatd rotation(q[3], q[0], q[1], q[2]);
    if (!(rotation.norm() > 1e-12)) rotation = Quatd::Identity();
    return composeTransform(vectorFrom<3>(node.translation, Vec3d::Zero()), rotation,
                            vectorFrom<3>(node.scale, Vec3d::Ones()));
}

std::string GltfReader::nodeName(int index) const {
    const tinygltf::Node& node = model_.nodes[static_cast<std::size_t>(index)];
    if (!node.name.empty()) return node.name;
    if (node.mesh >= 0 && static_cast<std::size_t>(node.mesh) < model_.meshes.size() &&
        !model_.meshes[static_cast<std::size_t>(node.mesh)].name.empty())
        return model_.meshes[static_cast<std::size_t>(node.mesh)].name;
    return fmt::format("node {}", index);
}

/// First pass: checks the tree, collects world transforms and bounds.
Expected<void> GltfReader::walk(int index, const Affine3d& world_T_parent, std::size_t depth) {
    if (index < 0 || static_cast<std::size_t>(index) >= model_.nodes.size())
        return fail(ErrorCode::kBadInput, fmt::format("node {} does not exist", index));
    if (depth > limits_.maxDepth)
        return fail(ErrorCode::kLimit, fmt::format("nodes are nested deeper than {} levels", limits_.maxDepth));
    const tinygltf::Node& node = model_.nodes[static_cast<std::size_t>(index)];
    const Affine3d world_T_node = world_T_parent * localTransform(node);
    if (!world_T_node.matrix().allFinite())
        return fail(ErrorCode::kBadInput, fmt::format("node {} has a transform that is not finite", index));
    if (!world_.emplace(index, world_T_node).second)
        return fail(ErrorCode::kBadInput, fmt::format("node {} has two parents, or is its own ancestor", index));
    for (const auto& [name, value] : node.extensions) noteExtension(name);
    if (node.mesh >= 0) countLeftOut(node.mesh);
    if (deforms(node)) {
        if (Expected<void> done = extendByDeforming(index, world_T_node); !done) return done;
    } else if (node.mesh >= 0) {
        const Expected<std::vector<Part>> parts = meshParts(node);
        if (!parts) return tl::unexpected(parts.error());
        const Expected<std::vector<Instance>> places = instances(node);
        if (!places) return tl::unexpected(places.error());
        if (Expected<void> room = hasRoomForNodes(places->size() * parts->size() / ReadLimits::kGlyphsPerNode); !room)
            return room;
        for (const Part& part : *parts) {
            if (places->empty()) bounds_.extend(part.bounds.transformed(world_T_node));
            for (const Instance& place : *places)
                bounds_.extend(part.bounds.transformed(world_T_node * place.matrix()));
        }
    }
    for (const int child : node.children)
        if (Expected<void> done = walk(child, world_T_node, depth + 1); !done) return done;
    return {};
}

/// Second pass: builds nodes.
Expected<void> GltfReader::addNode(int index, const std::function<proto::scene::Node*()>& make) {
    const tinygltf::Node& node = model_.nodes[static_cast<std::size_t>(index)];
    proto::scene::Node* placed = nullptr;
    if (animated_.count(index) > 0) {
        // Its parts as they are: what is animated of them replaces one, and leaves the others.
        placed = make();
        placed->set_name(nodeName(index));
        const Vec4d q = vectorFrom<4>(node.rotation, Vec4d(0, 0, 0, 1));
        const Quatd rotation(q[3], q[0], q[1], q[2]);
        setTransform(*placed->mutable_transform(), vectorFrom<3>(node.translation, Vec3d::Zero()),
                     rotation.norm() > 1e-12 ? rotation.normalized() : Quatd::Identity(),
                     vectorFrom<3>(node.scale, Vec3d::Ones()));
    } else {
        placed = addPlacedNode(make, nodeName(index), localTransform(node));
    }
    placed->set_key(keyOf(index));
    if (deforms(node)) {
        if (Expected<void> done = addDeforming(index, *placed); !done) return done;
    } else if (node.mesh >= 0) {
        if (Expected<void> done = addMesh(node, *placed); !done) return done;
    }
    if (node.camera >= 0) addCamera(node.camera, world_.at(index), *placed);
    if (const auto light = node.extensions.find("KHR_lights_punctual");
        light != node.extensions.end() && light->second.Has("light")) {
        const tinygltf::Value& number = light->second.Get("light");
        if (number.IsNumber() && number.GetNumberAsDouble() == number.GetNumberAsInt())
            addLight(number.GetNumberAsInt(), world_.at(index), *placed);
        else
            scene_.note(fmt::format("the light of {} is left out: its number is no whole number", nodeName(index)));
    }
    for (const int child : node.children)
        if (Expected<void> done = addNode(child, [placed] { return placed->add_node(); }); !done) return done;
    return {};
}

void GltfReader::addCamera(int index, const Affine3d& world_T_node, proto::scene::Node& node) {
    const auto leaveOut = [&] { scene_.note(fmt::format("camera {} is left out: it can show nothing", index)); };
    if (static_cast<std::size_t>(index) >= model_.cameras.size()) return leaveOut();
    const tinygltf::Camera& camera = model_.cameras[static_cast<std::size_t>(index)];
    ModelCamera said;
    said.name = camera.name.empty() ? fmt::format("camera {}", index) : camera.name;
    if (camera.type == "perspective")
        said.fieldOfView = camera.perspective.yfov;
    else
        said.height = 2.0 * std::abs(camera.orthographic.ymag);
    if (!addModelCamera(said, world_T_node, bounds_, scene_, node)) leaveOut();
}

void GltfReader::addLight(int index, const Affine3d& world_T_node, proto::scene::Node& node) {
    if (index < 0 || static_cast<std::size_t>(index) >= model_.lights.size())
        return scene_.note(fmt::format("light {} does not exist", index));
    const tinygltf::Light& light = model_.lights[static_cast<std::size_t>(index)];
    const bool known = light.type == "directional" || light.type == "spot" || light.type == "point";
    if (!known)
        return scene_.note(fmt::format("light {} is left out: it is of the unknown type '{}'", index, light.type));
    if (const std::string odd = oddTypeOfLight(model_, index); !odd.empty())
        return scene_.note(fmt::format("light {} is left out: its {}", index, odd));
    const auto sound = [](double value) { return value >= 0 && value <= kUtmostLight; };
    if (!sound(light.intensity) || !sound(light.range))
        return scene_.note(fmt::format("light {} is left out: its intensity or its range is no number from 0 to {}",
                                       index, kUtmostLight));
    if (!light.color.empty() &&
        (light.color.size() != 3 || !std::all_of(light.color.begin(), light.color.end(), sound)))
        return scene_.note(
            fmt::format("light {} is left out: its colour is not three numbers from 0 to {}", index, kUtmostLight));
    const double strongest = light.color.empty() ? 1 : *std::ranges::max_element(light.color);
    light_.add(light.intensity * strongest, light.type == "directional" ? kNoFalloff : kInverseSquare,
               world_T_node.translation(), bounds_);
    const auto angle = [](double radians) { return radians >= 0 && radians <= 0.5 * std::numbers::pi + 1e-6; };
    if (light.type == "spot" && !(angle(light.spot.innerConeAngle) && angle(light.spot.outerConeAngle)))
        scene_.note(fmt::format("light {} has a cone beyond 0 to 90 degrees: the nearest is taken", index));
    if (light.type == "spot" && !(light.spot.innerConeAngle < light.spot.outerConeAngle))
        scene_.note(fmt::format("light {} has an inner cone that is not within its outer one: it has an edge", index));
    proto::scene::Node* child = node.add_node();
    child->set_name(light.name.empty() ? fmt::format("light {}", index) : light.name);
    proto::scene::Color* color = nullptr;
    if (light.type == "directional") {
        color = child->mutable_directional_light()->mutable_color();
        child->mutable_directional_light()->set_intensity(static_cast<float>(light.intensity));
    } else if (light.type == "spot") {
        proto::scene::SpotLight& spot = *child->mutable_spot_light();
        color = spot.mutable_color();
        spot.set_intensity(static_cast<float>(light.intensity));
        spot.set_range(static_cast<float>(light.range));
        spot.set_inner_angle_deg(coneDegrees(light.spot.innerConeAngle));
        spot.set_outer_angle_deg(coneDegrees(light.spot.outerConeAngle));
    } else {
        color = child->mutable_point_light()->mutable_color();
        child->mutable_point_light()->set_intensity(static_cast<float>(light.intensity));
        child->mutable_point_light()->set_range(static_cast<float>(light.range));
    }
    const bool hasColor = !light.color.empty();
    color->set_r(hasColor ? static_cast<float>(light.color[0]) : 1.0f);
    color->set_g(hasColor ? static_cast<float>(light.color[1]) : 1.0f);
    color->set_b(hasColor ? static_cast<float>(light.color[2]) : 1.0f);
}

Expected<void> checkRequired(const tinygltf::Model& model) {
    for (const std::string& extension : model.extensionsRequired)
        if (!isUnderstood(extension) && !extension.starts_with(kMaterialExtensions) &&
            std::find(kPictureExtensions.begin(), kPictureExtensions.end(), extension) == kPictureExtensions.end())
            return fail(ErrorCode::kUnsupported,
                        fmt::format("it cannot be shown without the glTF extension {}", extension));
    return {};
}

void GltfReader::noteExtension(const std::string& name) {
    if (!isUnderstood(name)) scene_.note(fmt::format("the glTF extension {} is left out", name));
}

Expected<PlainScene> GltfReader::read() {
    scene_.file.set_up_axis(2);  // Y, as glTF 2.0 says (proto/scene.proto)
    scene_.file.set_by_tessera(isWrittenByTessera(model_.asset.generator));
    for (const std::string& extension : model_.extensionsUsed) noteExtension(extension);
    if (model_.scenes.size() > 1) scene_.note("of several scenes, the file's own choice is shown");
    // The scene the file names, else its first, else every node that nobody holds.
    std::vector<int> roots;
    if (model_.scenes.empty()) {
        std::set<int> held;
        for (const tinygltf::Node& node : model_.nodes) held.insert(node.children.begin(), node.children.end());
        for (int i = 0; i < static_cast<int>(model_.nodes.size()); ++i)
            if (held.count(i) == 0) roots.push_back(i);
    } else {
        const std::size_t chosen = model_.defaultScene < 0 ? 0 : static_cast<std::size_t>(model_.defaultScene);
        if (chosen >= model_.scenes.size())
            return fail(ErrorCode::kBadInput, fmt::format("scene {} does not exist", chosen));
        roots = model_.scenes[chosen].nodes;
    }
    for (const tinygltf::Mesh& mesh : model_.meshes)
        for (const tinygltf::Primitive& part : mesh.primitives) {
            const auto positions = part.attributes.find("POSITION");
            const int accessor =
                part.indices >= 0 || positions == part.attributes.end() ? part.indices : positions->second;
            scene_.cornersToCome += std::min<std::size_t>(accessors_.count(accessor), 1'000'000'000);
        }
    for (const int root : roots)
        if (Expected<void> done = walk(root, Affine3d::Identity(), 1); !done) return tl::unexpected(done.error());
    findAnimated();

    const auto addRoot = [this] { return scene_.file.add_node(); };
    for (const int root : roots)
        if (Expected<void> done = addNode(root, addRoot); !done) return tl::unexpected(done.error());
    if (Expected<void> done = addAnimations(); !done) return tl::unexpected(done.error());
    light_.addExposure(scene_);
    noteLeftOut();
    pictures_.finish();
    return std::move(scene_);
}

}  // namespace tessera

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "common/geometry/TangentSpace.h"
#include "server/import/reader/GltfReader.h"

namespace tessera {
namespace {

int attributeOf(const tinygltf::Primitive& primitive, const std::string& name) {
    const auto found = primitive.attributes.find(name);
    return found == primitive.attributes.end() ? -1 : found->second;
}

}  // namespace

/// A host would make a skin's tangents anew wherever its joints are. Which vertices have got copies behind them all.
std::vector<std::uint32_t> GltfReader::addTangents(const tinygltf::Primitive& primitive, MeshData& data) const {
    if (!data.tangents.empty() || data.normals.empty() || primitive.material < 0 ||
        static_cast<std::size_t>(primitive.material) >= model_.materials.size())
        return {};
    const tinygltf::NormalTextureInfo& map =
        model_.materials[static_cast<std::size_t>(primitive.material)].normalTexture;
    // Where the picture is placed by itself, hosts know how.
    if (map.index < 0 || map.texCoord > 1 || map.extensions.contains("KHR_texture_transform")) return {};
    const std::vector<float>& texcoords = map.texCoord == 1 ? data.texcoords1 : data.texcoords;
    if (texcoords.empty()) return {};
    VertexTangents made = mikkVertexTangents({data.positions, data.normals, texcoords, data.indices});
    data.tangents = std::move(made.tangents);
    data.indices = std::move(made.indices);
    const auto copy = [&](auto& values, std::size_t each) {
        if (values.empty()) return;
        for (const std::uint32_t vertex : made.copied)
            for (std::size_t k = 0; k < each; ++k) values.push_back(values[each * vertex + k]);
    };
    copy(data.positions, 3);
    copy(data.normals, 3);
    copy(data.texcoords, 2);
    copy(data.texcoords1, 2);
    copy(data.colors, 4);
    return std::move(made.copied);
}

/// Of a vertex the four strongest of all its joints, which a file may say in several sets.
Expected<void> GltfReader::readInfluences(const tinygltf::Primitive& primitive, std::size_t vertices,
                                          std::span<const std::uint32_t> copied, std::size_t joints,
                                          SkinInfluences& influences) {
    std::vector<std::vector<std::uint32_t>> jointSets;
    std::vector<std::vector<float>> weightSets;
    for (int set = 0; attributeOf(primitive, fmt::format("JOINTS_{}", set)) >= 0 && set < 8; ++set) {
        Expected<std::vector<std::uint32_t>> joint =
            accessors_.integers(attributeOf(primitive, fmt::format("JOINTS_{}", set)), 4);
        if (!joint) return tl::unexpected(joint.error());
        Expected<std::vector<float>> weight =
            accessors_.floats(attributeOf(primitive, fmt::format("WEIGHTS_{}", set)), 4);
        if (!weight) return tl::unexpected(weight.error());
        if (joint->size() != vertices * 4 || weight->size() != vertices * 4)
            return fail(ErrorCode::kBadInput, "JOINTS_0, WEIGHTS_0 and POSITION have different numbers of vertices");
        jointSets.push_back(std::move(*joint));
        weightSets.push_back(std::move(*weight));
    }
    std::vector<Influence> all;
    for (std::size_t i = 0; i < vertices + copied.size(); ++i) {
        const std::size_t v = i < vertices ? i : copied[i - vertices];
        all.clear();
        for (std::size_t set = 0; set < jointSets.size(); ++set)
            for (std::size_t k = 4 * v; k < 4 * v + 4; ++k) {
                const float weight = weightSets[set][k];
                if (weight > 0 && std::isfinite(weight) && jointSets[set][k] >= joints)
                    return fail(ErrorCode::kBadInput, "a vertex names a joint that does not exist");
                all.push_back({weight, jointSets[set][k]});
            }
        influences.addVertex(all, 0);
    }
    if (influences.hadNone()) scene_.note("vertices that follow no joint follow the skin's first one");
    return {};
}

/// Deltas of all targets, one after the other; a target without the attribute moves nothing.
Expected<std::vector<float>> GltfReader::readTargets(const tinygltf::Primitive& primitive, const char* name,
                                                     std::size_t vertices, std::span<const std::uint32_t> copied) {
    std::vector<float> all;
    const bool any = std::any_of(primitive.targets.begin(), primitive.targets.end(),
                                 [&](const auto& target) { return target.count(name) > 0; });
    if (!any) return all;
    if (primitive.targets.size() * (vertices + copied.size()) > kMaxMorphVertices)
        return fail(ErrorCode::kLimit, "a mesh has more than a hundred million vertices in morph targets");
    for (const auto& target : primitive.targets) {
        const auto found = target.find(name);
        if (found == target.end()) {
            all.resize(all.size() + (vertices + copied.size()) * 3, 0.0f);
            continue;
        }
        const Expected<std::vector<float>> delta = accessors_.floats(found->second, 3);
        if (!delta) return delta;
        if (delta->size() != vertices * 3)
            return fail(ErrorCode::kBadInput, "a morph target has another number of vertices");
        if (!holdsSkinNumbers(*delta))
            return fail(ErrorCode::kBadInput, "a morph target holds a number that is not finite or beyond 1e15");
        all.insert(all.end(), delta->begin(), delta->end());
        for (const std::uint32_t vertex : copied)
            all.insert(all.end(), delta->data() + std::size_t{3} * vertex, delta->data() + std::size_t{3} * vertex + 3);
    }
    return all;
}

Expected<void> GltfReader::setMorphs(const tinygltf::Node& node, const tinygltf::Mesh& mesh,
                                     const tinygltf::Primitive& primitive, std::size_t vertices,
                                     std::span<const std::uint32_t> copied, proto::scene::Skin& skin) {
    if (primitive.targets.empty()) return {};
    for (const auto& target : primitive.targets)
        for (const auto& [name, accessor] : target)
            if (name != "POSITION" && name != "NORMAL" && name != "TANGENT" && !name.starts_with('_'))
                scene_.note(fmt::format("{} of morph targets are left out", name));
    Expected<std::vector<float>> positions = readTargets(primitive, "POSITION", vertices, copied);
    if (!positions) return tl::unexpected(positions.error());
    if (positions->empty())
        positions->resize(primitive.targets.size() * (vertices + copied.size()) * 3);  // targets of normals alone
    Expected<std::vector<float>> normals = readTargets(primitive, "NORMAL", vertices, copied);
    if (!normals) return tl::unexpected(normals.error());
    skin.set_morph_positions_blob(scene_.addBlob(bytesOfNumbers(*positions)));
    if (attributeOf(primitive, "NORMAL") >= 0) skin.set_morph_normals_blob(scene_.addBlob(bytesOfNumbers(*normals)));
    if (attributeOf(primitive, "NORMAL") >= 0 && attributeOf(primitive, "TANGENT") >= 0) {
        const Expected<std::vector<float>> tangents = readTargets(primitive, "TANGENT", vertices, copied);
        if (!tangents) return tl::unexpected(tangents.error());
        skin.set_morph_tangents_blob(scene_.addBlob(bytesOfNumbers(*tangents)));
    }
    const std::vector<double>& weights = node.weights.empty() ? mesh.weights : node.weights;
    for (std::size_t t = 0; t < primitive.targets.size(); ++t) {
        const double weight = t < weights.size() ? weights[t] : 0.0;
        if (!(std::abs(weight) <= 1e15))
            scene_.note("weights of morph targets that are no numbers within 1e15 count as zero");
        skin.add_weight(std::abs(weight) <= 1e15 ? static_cast<float>(weight) : 0.0f);
    }
    return {};
}

Expected<void> GltfReader::setJoints(int nodeIndex, const tinygltf::Primitive& primitive, std::size_t vertices,
                                     std::span<const std::uint32_t> copied, proto::scene::Skin& message) {
    const tinygltf::Skin& skin =
        model_.skins[static_cast<std::size_t>(model_.nodes[static_cast<std::size_t>(nodeIndex)].skin)];
    if (skin.joints.empty() || skin.joints.size() > 0xffff)
        return fail(ErrorCode::kBadInput, fmt::format("a skin has {} joints", skin.joints.size()));
    std::vector<float> binds;
    if (skin.inverseBindMatrices >= 0) {
        Expected<std::vector<float>> read = accessors_.floats(skin.inverseBindMatrices, 16);
        if (!read) return tl::unexpected(read.error());
        if (read->size() < skin.joints.size() * 16 || !holdsSkinNumbers(*read))
            return fail(
                ErrorCode::kBadInput,
                "a skin's inverse bind matrices are too few, or hold numbers that are not finite or beyond 1e15");
        binds = std::move(*read);
    }
    const Affine3d bearer_T_world = world_.at(nodeIndex).inverse(Eigen::Affine);
    std::vector<float> pose, rows;
    std::set<int> seen;
    for (std::size_t j = 0; j < skin.joints.size(); ++j) {
        const auto joint = world_.find(skin.joints[j]);
        if (joint == world_.end())
            return fail(ErrorCode::kBadInput, fmt::format("joint {} of a skin is no node of the scene", j));
        if (!seen.insert(skin.joints[j]).second)
            return fail(ErrorCode::kBadInput, fmt::format("a skin names its joint {} twice", j));
        Affine3d bind = Affine3d::Identity();
        if (!binds.empty())
            bind.matrix().topRows<3>() = Eigen::Map<const Mat4f>(binds.data() + j * 16).cast<double>().topRows<3>();
        appendMatrixRows(rows, bind);
        appendMatrixRows(pose, Affine3d(bearer_T_world * joint->second * bind));
        message.add_joint_key(keyOf(skin.joints[j]));
    }
    if (!holdsSkinNumbers(pose)) {
        // A bearer that is scaled to nothing: at rest until it is not.
        pose.clear();
        for (std::size_t j = 0; j < skin.joints.size(); ++j) appendMatrixRows(pose, Affine3d::Identity());
    }
    message.set_inverse_binds_blob(scene_.addBlob(bytesOfNumbers(rows)));
    message.set_pose_blob(scene_.addBlob(bytesOfNumbers(pose)));
    SkinInfluences influences(scene_);
    if (Expected<void> read = readInfluences(primitive, vertices, copied, skin.joints.size(), influences); !read)
        return read;
    influences.write(message);
    return {};
}

bool GltfReader::deforms(const tinygltf::Node& node) const {
    if (node.mesh < 0 || static_cast<std::size_t>(node.mesh) >= model_.meshes.size()) return false;
    if (node.skin >= 0) return true;
    const auto& primitives = model_.meshes[static_cast<std::size_t>(node.mesh)].primitives;
    return std::any_of(primitives.begin(), primitives.end(),
                       [](const tinygltf::Primitive& primitive) { return !primitive.targets.empty(); });
}

/// The parts of a node's mesh that joints or morph targets deform. What can't be is drawn as it is at rest.
Expected<void> GltfReader::addDeforming(int index, proto::scene::Node& placed) {
    const tinygltf::Node& node = model_.nodes[static_cast<std::size_t>(index)];
    if (node.skin >= 0 && static_cast<std::size_t>(node.skin) >= model_.skins.size())
        return fail(ErrorCode::kBadInput, fmt::format("node {} names a skin or mesh that does not exist", index));
    const tinygltf::Mesh& mesh = model_.meshes[static_cast<std::size_t>(node.mesh)];
    for (std::size_t i = 0; i < mesh.primitives.size(); ++i) {
        const tinygltf::Primitive& source = mesh.primitives[i];
        if (isLeftOut(source)) continue;
        const auto here = [&](const Error& error) {
            return failWith(fmt::format("mesh {}, primitive {}", node.mesh, i), error);
        };
        const bool triangles = isSurface(source);
        const bool skinned = node.skin >= 0 && triangles && attributeOf(source, "JOINTS_0") >= 0 &&
                             attributeOf(source, "WEIGHTS_0") >= 0;
        const bool morphed = triangles && !source.targets.empty();
        if (node.skin >= 0 && !skinned)
            scene_.note(triangles ? "parts of meshes that have a skin, but no joints, stay at rest"
                                  : "points and lines that have a skin stay at rest");
        if (!triangles && !source.targets.empty()) scene_.note("morph targets of points and lines are shown at rest");
        Expected<MeshData> data = primitive(node, mesh, source, skinned || morphed);
        if (!data) return here(data.error());
        if (data->empty()) continue;
        Expected<std::string> material = materialName(source);
        if (!material) return tl::unexpected(material.error());
        const std::size_t vertices = data->positions.size() / 3;
        const std::vector<std::uint32_t> copied = skinned ? addTangents(source, *data) : std::vector<std::uint32_t>();
        const std::string name = fmt::format("skin {}.{}", index, i);
        proto::scene::Node* child = placed.add_node();
        child->set_name(fmt::format("part {}", i));
        if (skinned || morphed) {
            proto::scene::Skin& skin = *child->mutable_skin();
            skin.set_mesh(name);
            skin.set_material(std::move(*material));
            if (skinned)
                if (Expected<void> done = setJoints(index, source, vertices, copied, skin); !done)
                    return here(done.error());
            if (morphed) {
                if (Expected<void> done = setMorphs(node, mesh, source, vertices, copied, skin); !done)
                    return here(done.error());
                child->set_key(static_cast<std::uint32_t>(model_.nodes.size()) + ++partKeys_);
                Morphed& known = morphed_[index];
                if (known.targets == 0) known.targets = source.targets.size();
                if (known.targets == source.targets.size())
                    known.keys.push_back(child->key());
                else
                    scene_.note(
                        "a mesh's parts have different numbers of morph targets: those of the first are animated");
            }
        } else {
            child->mutable_geometry()->set_mesh(name);
            child->mutable_geometry()->set_material(std::move(*material));
        }
        scene_.addMesh(name, std::move(*data));
    }
    return {};
}

/// Where a deforming mesh is in the pose that the file stands in, roughly: for cameras.
Expected<void> GltfReader::extendByDeforming(int index, const Affine3d& world_T_node) {
    const tinygltf::Node& node = model_.nodes[static_cast<std::size_t>(index)];
    for (const tinygltf::Primitive& source : model_.meshes[static_cast<std::size_t>(node.mesh)].primitives) {
        if (isLeftOut(source)) continue;
        const Expected<std::vector<float>> positions = accessors_.floats(attributeOf(source, "POSITION"), 3);
        if (!positions) return tl::unexpected(positions.error());
        const Box box = boundsOf(*positions);
        if (!box.empty()) bounds_.extend(box.transformed(world_T_node));
    }
    return {};
}

}  // namespace tessera

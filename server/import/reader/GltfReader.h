/// glTF model → plain scene, in parts: meshes, materials, nodes.
#pragma once

#include <tiny_gltf.h>

#include <map>
#include <set>
#include <string>
#include <vector>

#include "common/math/Box.h"
#include "server/import/reader/FolderFiles.h"
#include "server/import/reader/GltfAccessors.h"
#include "server/import/reader/PlainScene.h"

namespace tessera {

class GltfReader {
public:
    GltfReader(const tinygltf::Model& model, const FolderFiles& files, const ReadLimits& limits)
        : model_(model), files_(files), limits_(limits), accessors_(model) {}

    [[nodiscard]] Expected<PlainScene> read();

private:
    /// A primitive that became a mesh.
    struct Part {
        std::string mesh;
        std::string material;
        Box bounds;
    };

    // GltfNodes.cpp
    Expected<void> walk(int index, const Affine3d& world_T_parent, std::size_t depth);
    Expected<void> addNode(int index, const std::function<proto::scene::Node*()>& make);
    void addCamera(int camera, const Affine3d& world_T_node, proto::scene::Node& node);
    void addLight(int light, proto::scene::Node& node);
    [[nodiscard]] std::string nodeName(int index) const;

    // GltfMeshes.cpp
    /// Of the node's mesh.
    Expected<std::vector<Part>> meshParts(const tinygltf::Node& node);
    Expected<MeshData> primitive(const tinygltf::Node& node, const tinygltf::Mesh& mesh,
                                 const tinygltf::Primitive& primitive);
    /// The indices of a primitive, or one for each of its vertices.
    Expected<std::vector<std::uint32_t>> vertexOrder(const tinygltf::Primitive& primitive, std::size_t vertices);
    /// With a note.
    bool isLeftOut(const tinygltf::Primitive& primitive);
    Expected<std::vector<std::uint32_t>> triangles(const tinygltf::Primitive& primitive, std::size_t vertices);
    /// The skin's pose in the file as a mesh in world coordinates (glTF 2.0, "Skins": the node's own transform does
    /// not count).
    Expected<std::vector<Part>> skinnedParts(int node);

    // GltfMaterials.cpp
    Expected<std::string> materialName(int material);
    /// The name of the image of a texture, or empty with a note where it can't be had.
    std::string imageName(int texture);
    /// Mean of a texture's green and blue channels: roughness and metal where there is no texture for them.
    Vec2d meanRoughnessAndMetal(int texture);

    // GltfAnimations.cpp
    Expected<void> readAnimation();

    const tinygltf::Model& model_;
    const FolderFiles& files_;
    const ReadLimits& limits_;
    GltfAccessors accessors_;
    PlainScene scene_;

    std::map<std::pair<int, double>, std::vector<Part>> parts_;  ///< by mesh, and the radius that its node says
    std::set<int> materials_;
    std::map<int, std::string> images_;            ///< by image; empty: unusable
    std::map<int, Affine3d> world_;                ///< world_T_node of the nodes in the scene
    std::map<int, proto::scene::Motion> motions_;  ///< by node
    Box bounds_;
};

/// parent_T_node of a glTF node.
[[nodiscard]] Affine3d localTransform(const tinygltf::Node& node);

}  // namespace tessera

/// glTF model → plain scene, in parts: meshes, materials, nodes.
#pragma once

#include <tiny_gltf.h>

#include <map>
#include <set>
#include <span>
#include <string>
#include <tuple>
#include <vector>

#include "common/math/Box.h"
#include "server/import/reader/BoundedNumbers.h"
#include "server/import/reader/FolderFiles.h"
#include "server/import/reader/GltfAccessors.h"
#include "server/import/reader/ModelView.h"
#include "server/import/reader/MovingParts.h"
#include "server/import/reader/Pictures.h"
#include "server/import/reader/PlainScene.h"

namespace tessera {

/// A number in an object of an extension, or of an array in it.
[[nodiscard]] double gltfNumber(const tinygltf::Value& object, const char* key, double otherwise);
[[nodiscard]] double gltfElement(const tinygltf::Value& object, const char* key, int index, double otherwise);

/// Whether it is triangles, in whatever form.
[[nodiscard]] bool isSurface(const tinygltf::Primitive& primitive);

/// How a material takes a texture; no texture: -1.
struct GltfTextureUse {
    static constexpr const char* kTextureTransform = "KHR_texture_transform";
    int texture = -1;
    int texcoordSet = 0;
    const tinygltf::Value* transform = nullptr;

    /// What a material says; `Info`: one of tinygltf's three.
    template <typename Info>
    GltfTextureUse(const Info& info) : texture(info.index), texcoordSet(info.texCoord) {
        const auto found = info.extensions.find(kTextureTransform);
        if (found != info.extensions.end()) transform = &found->second;
    }
    /// What an extension says.
    explicit GltfTextureUse(const tinygltf::Value& info);
};

class GltfReader {
public:
    GltfReader(const tinygltf::Model& model, const FolderFiles& files, const ReadLimits& limits)
        : model_(model),
          files_(files),
          limits_(limits),
          accessors_(model),
          pictures_(scene_, limits),
          animations_(scene_) {}

    [[nodiscard]] Expected<PlainScene> read();

private:
    /// A primitive that became a mesh.
    struct Part {
        std::string mesh;
        std::string material;
        Box bounds;
    };

    /// A place of a mesh, in its node's coordinates.
    struct Instance {
        Vec3d translation = Vec3d::Zero();
        Quatd rotation = Quatd::Identity();  ///< as the file says it
        Vec3d scale = Vec3d::Ones();
        std::uint32_t color = 0xffffffff;  ///< 0xRRGGBBAA, sRGB
        [[nodiscard]] Affine3d matrix() const;
    };

    // GltfInstances.cpp
    /// Empty: the node has none, and its mesh is at the node itself.
    Expected<std::vector<Instance>> instances(const tinygltf::Node& node);
    static void addParts(const std::vector<Part>& parts, proto::scene::Node& node);
    /// Glyphs for as many places as can be some, where there are very many or of many colours; the others.
    [[nodiscard]] std::vector<std::size_t> withoutGlyphs(const std::string& name, const std::vector<Part>& parts,
                                                         const std::vector<Instance>& places,
                                                         proto::scene::Node& placed);
    /// The node's mesh, at each of its places.
    Expected<void> addMesh(const tinygltf::Node& node, proto::scene::Node& placed);
    /// Refused where instances would be more than the file's bytes bear.
    [[nodiscard]] Expected<void> hasRoomForNodes(std::size_t more) const;

    // GltfNodes.cpp
    Expected<void> walk(int index, const Affine3d& world_T_parent, std::size_t depth);
    Expected<void> addNode(int index, const std::function<proto::scene::Node*()>& make);
    void addCamera(int camera, const Affine3d& world_T_node, proto::scene::Node& node);
    void addLight(int light, const Affine3d& world_T_node, proto::scene::Node& node);
    [[nodiscard]] std::string nodeName(int index) const;
    /// Of what is not shown here.
    void noteExtension(const std::string& name);

    // GltfMeshes.cpp
    /// Of the node's mesh.
    Expected<std::vector<Part>> meshParts(const tinygltf::Node& node);
    /// `atRest`: without its morph targets, whatever their weights.
    Expected<MeshData> primitive(const tinygltf::Node& node, const tinygltf::Mesh& mesh,
                                 const tinygltf::Primitive& primitive, bool atRest);
    /// The indices of a primitive, or one for each of its vertices.
    Expected<std::vector<std::uint32_t>> vertexOrder(const tinygltf::Primitive& primitive, std::size_t vertices);
    /// Lines, and what has no positions.
    [[nodiscard]] bool isLeftOut(const tinygltf::Primitive& primitive) const;
    /// Of a mesh that a node places.
    void countLeftOut(int mesh);
    void noteLeftOut();
    void noteAttributes(const tinygltf::Primitive& primitive);
    Expected<std::vector<std::uint32_t>> triangles(const tinygltf::Primitive& primitive, std::size_t vertices);

    // GltfSkins.cpp
    /// Joints or morph targets deform its mesh.
    [[nodiscard]] bool deforms(const tinygltf::Node& node) const;
    Expected<void> addDeforming(int index, proto::scene::Node& placed);
    Expected<void> extendByDeforming(int index, const Affine3d& world_T_node);
    // `copied`: of vertices behind those of the file, which they are copies of.
    [[nodiscard]] std::vector<std::uint32_t> addTangents(const tinygltf::Primitive& primitive, MeshData& data) const;
    Expected<void> setJoints(int nodeIndex, const tinygltf::Primitive& primitive, std::size_t vertices,
                             std::span<const std::uint32_t> copied, proto::scene::Skin& message);
    Expected<void> setMorphs(const tinygltf::Node& node, const tinygltf::Mesh& mesh,
                             const tinygltf::Primitive& primitive, std::size_t vertices,
                             std::span<const std::uint32_t> copied, proto::scene::Skin& skin);
    Expected<void> readInfluences(const tinygltf::Primitive& primitive, std::size_t vertices,
                                  std::span<const std::uint32_t> copied, std::size_t joints,
                                  SkinInfluences& influences);
    Expected<std::vector<float>> readTargets(const tinygltf::Primitive& primitive, const char* name,
                                             std::size_t vertices, std::span<const std::uint32_t> copied);

    // GltfMaterials.cpp
    Expected<std::string> materialName(const tinygltf::Primitive& primitive);
    /// glTF 2.0, 3.9.7: what names none is of a white, rough metal. Of points and lines, which are not lit as metal:
    /// empty.
    std::string defaultMaterialName(const tinygltf::Primitive& primitive);
    void setMetalRoughness(const tinygltf::PbrMetallicRoughness& pbr, const BoundedNumbers& numbers,
                           proto::scene::Material& message);
    void setSpecularGlossiness(const tinygltf::Value& old, const BoundedNumbers& numbers,
                               proto::scene::Material& message);
    void setCoatAndTransmission(const tinygltf::Material& material, const BoundedNumbers& numbers,
                                proto::scene::Material& message);
    void setSpecular(const tinygltf::Material& material, const BoundedNumbers& numbers,
                     proto::scene::Material& message);

    // GltfTextures.cpp
    /// The name of the image of a texture, or empty with a note where it can't be had.
    std::string imageName(const GltfTextureUse& use);

    // GltfAnimations.cpp
    /// What channels and joints name: of a node; parts of meshes have others.
    [[nodiscard]] static std::uint32_t keyOf(int node);
    /// The nodes whose transforms are animated: they keep their three parts.
    void findAnimated();
    /// Each of the file's animations as a node at its top.
    Expected<void> addAnimations();
    Expected<void> addAnimation(const tinygltf::Animation& source, std::size_t number);
    struct Sampled {
        std::uint32_t times = 0, values = 0;  ///< blobs
        proto::scene::Channel::Interpolation interpolation = proto::scene::Channel::LINEAR;
    };
    /// False, and counted: its keys, which so many channels play, would be more than the file's bytes bear.
    [[nodiscard]] bool hasRoomForKeys(const tinygltf::Animation& animation, int number, std::size_t channels);
    Expected<Sampled> sampler(const tinygltf::Animation& animation, int number, const std::string& path,
                              std::size_t components);

    const tinygltf::Model& model_;
    const FolderFiles& files_;
    const ReadLimits& limits_;
    GltfAccessors accessors_;
    PlainScene scene_;
    Pictures pictures_;

    /// A mesh, and what a node says of it: the radius of points, weights of morph targets.
    using MeshUse = std::tuple<int, double, std::vector<double>>;
    std::map<MeshUse, std::vector<Part>> parts_;
    std::set<int> materials_;
    /// By image, and what the Image message says besides; empty: unusable.
    std::map<std::pair<int, std::string>, std::string> images_;
    std::map<int, Affine3d> world_;  ///< world_T_node of the nodes in the scene
    std::set<int> animated_;
    struct Morphed {
        std::vector<std::uint32_t> keys;  ///< of the parts
        std::size_t targets = 0;
    };
    std::map<int, Morphed> morphed_;  ///< by node
    std::uint32_t partKeys_ = 0;
    std::map<int, std::uint32_t> keyTimes_;  ///< blobs, by accessor
    std::map<std::pair<int, std::string>, std::uint32_t> keyValues_;
    std::uint64_t keys_ = 0, channelsBeyond_ = 0;
    AnimationNodes animations_;
    ModelLight light_;
    Box bounds_;
    std::size_t placedNodes_ = 0;       ///< of instances
    std::size_t withoutPositions_ = 0;  ///< as placed; left out
};

/// Refuses a model that insists on what is not shown here.
[[nodiscard]] Expected<void> checkRequired(const tinygltf::Model& model);

/// parent_T_node of a glTF node.
[[nodiscard]] Affine3d localTransform(const tinygltf::Node& node);

}  // namespace tessera

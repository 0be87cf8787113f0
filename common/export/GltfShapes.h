/// Meshes, skins and instances as glTF 2.0 has them.
#pragma once

#include <map>
#include <optional>
#include <span>

#include "common/cores/Skin.h"
#include "common/export/GltfLooks.h"
#include "common/export/LeavingMeshes.h"
#include "common/export/Selection.h"

namespace tessera {

class GltfShapes {
public:
    GltfShapes(GltfParts& parts, GltfLooks& looks, LeavingMeshes& meshes, ExportNotes& notes)
        : parts_(parts), looks_(looks), meshes_(meshes), notes_(notes) {}

    /// The mesh of which these are the primitives, the same for nodes that share their cores and materials. Nothing:
    /// there is nothing to be seen. `skinned`: Skins are written at rest, with their joints and morph targets; else as
    /// they stand. `times`: at how many places a node draws it.
    [[nodiscard]] Expected<std::optional<int>> mesh(std::span<const SelectedNode* const> primitives, bool skinned,
                                                    std::size_t times = 1);
    /// EXT_mesh_gpu_instancing of a node with Glyphs, and how many there are; 0: none is shown.
    struct Instances {
        std::string json;
        std::size_t count = 0;
    };
    [[nodiscard]] Expected<Instances> instances(const SelectedNode& node);
    /// The inverse bind matrices of a Skin.
    [[nodiscard]] int inverseBinds(const Skin& skin);

    /// As often as nodes and glyphs place them.
    [[nodiscard]] std::size_t triangles() const { return triangles_; }

private:
    struct Primitive {
        std::string json;  ///< empty: nothing to be seen
        std::size_t triangles = 0;
    };
    [[nodiscard]] Expected<Primitive> primitive(const SelectedNode& node, bool skinned);
    [[nodiscard]] Primitive describe(const MeshArrays& arrays, const SelectedNode& node, ObjectId material,
                                     const Skin* skin);
    void addInfluences(const Skin& skin, JsonObject& attributes);
    [[nodiscard]] std::string morphTargets(const Skin& skin, std::size_t vertices);
    [[nodiscard]] int unitVectors(const Blob& blob, std::size_t each);
    [[nodiscard]] int colors(const Blob& blob);

    GltfParts& parts_;
    GltfLooks& looks_;
    LeavingMeshes& meshes_;
    ExportNotes& notes_;
    using Worn = std::tuple<ObjectId, ObjectId, bool>;  ///< core, material, skinned
    std::map<Worn, Primitive> primitives_;
    std::map<std::vector<Worn>, std::optional<int>> known_;
    std::map<std::pair<BlobId, std::size_t>, int> vectors_;
    std::map<BlobId, int> colors_;
    std::map<std::pair<BlobId, std::size_t>, int> binds_;  ///< and of how many joints
    std::size_t triangles_ = 0;
};

}  // namespace tessera

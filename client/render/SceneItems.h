/// What RenderScene keeps: the inside of this folder, not for others.
#pragma once

#include <utility>
#include <vector>

#include "client/render/BoxTree.h"
#include "client/render/MeshCache.h"
#include "client/render/RenderAction.h"

namespace tessera {

/// A Geometry at its place.
struct SceneItem {
    ObjectId node, geometry, material;
    const RenderMesh* mesh = nullptr;
    std::uint32_t place = 0;  ///< index into `places`
    bool mirrored = false;
    bool transparent = false;
    bool occludes = false;  ///< opaque in every pixel it covers
    double reach = 0;       ///< at least the distance of any vertex from the mesh's own origin, in world units
};

/// A visible node, in document order, so that a subtree is a contiguous range.
struct ScenePlace {
    static constexpr std::uint32_t kNone = 0xffffffffu;

    ObjectId node;
    ObjectId transform;  ///< the Transform that is the node's core, or none
    std::uint32_t parent = kNone;
    std::uint32_t end = 0;       ///< behind the last place of the subtree
    std::uint32_t item = kNone;  ///< the item here
    Affine3d world_T_node = Affine3d::Identity();
};

struct SceneLight {
    std::uint32_t place = 0;
    ObjectId core;
};

struct RenderScene::Impl {
    std::vector<ScenePlace> places;
    std::vector<SceneItem> items;
    std::vector<Box> boxes;  ///< of the items, world
    BoxTree tree;
    std::vector<SceneLight> lightPlaces;
    bool anyLight = false;  ///< hidden ones counted
    std::vector<LightItem> lights;
    ObjectId environmentCore;
    Environment environment;
    double maxReach = 0;         ///< over all items since the last rebuild
    std::uint64_t rebuilds = 0;  ///< an item's index means the same item as long as this stays

    MeshCache meshes;
    /// (Transform core, place), sorted: who moves when a core changes.
    std::vector<std::pair<ObjectId, std::uint32_t>> transformUsers;

    void rebuild(const Aspect& aspect);
    void moveTransforms(const Aspect& aspect, std::vector<std::uint32_t> places);
    void refreshLights(const Aspect& aspect);
    void refreshMaterials(const Aspect& aspect);

private:
    void collect(const Aspect& aspect);
    void setWorld(const Aspect& aspect, ScenePlace& place);
    void setItem(SceneItem& item, Box& box);
    void setMaterial(const Aspect& aspect, SceneItem& item);
};

/// The light of a scene that brings none: three directional lights that are fixed in the world.
[[nodiscard]] std::vector<LightItem> defaultLights();

}  // namespace tessera

/// Meshes of USD: faces of many corners, with values per face, vertex or corner, and parts of other materials.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/math/Box.h"
#include "server/import/reader/PlainScene.h"
#include "server/import/reader/UsdMaterials.h"
#include "server/import/reader/UsdPrimvars.h"

namespace tessera {

/// A mesh, or a smooth surface, with its material.
struct UsdPart {
    std::string mesh;  ///< name of a mesh of the scene; empty: `surface`
    std::string material;
    std::shared_ptr<const proto::scene::SubdivisionSurface> surface;
    Box bounds;
};

/// Makes each once: prims that share their values, as references do, share the mesh.
class UsdMeshes {
public:
    UsdMeshes(UsdStage& stage, PlainScene& scene, const ReadLimits& limits, UsdMaterials& materials,
              UsdRemarks& remarks)
        : stage_(stage), scene_(scene), limits_(limits), materials_(materials), remarks_(remarks) {}

    /// Of a Mesh, Points, BasisCurves, or one of the shapes (Cube, Sphere, …); none, with a remark, of others.
    /// `material`: the path of what is bound, or empty.
    Expected<std::vector<UsdPart>> parts(const UsdComposedPrim& prim, const std::string& material);

private:
    struct Faces;
    Expected<std::vector<UsdPart>> ofMesh(const UsdComposedPrim& prim, const std::string& material);
    Expected<Faces> facesOf(const UsdComposedPrim& prim);
    /// By material, those of subsets first; which faces have it.
    Expected<std::vector<std::pair<std::string, std::vector<std::uint32_t>>>> groupsOf(const UsdComposedPrim& prim,
                                                                                       const std::string& material,
                                                                                       const Faces& faces);
    std::optional<UsdPrimvar> normalsOf(const UsdComposedPrim& prim, const Faces& faces);
    MeshData meshOf(const UsdComposedPrim& prim, const Faces& faces, const std::vector<std::uint32_t>& which,
                    const UsdLook& look, const std::optional<UsdPrimvar>& normals);
    /// Null: it is better shown as polygons.
    std::shared_ptr<const proto::scene::SubdivisionSurface> surfaceOf(const UsdComposedPrim& prim, const Faces& faces,
                                                                      const UsdLook& look, std::size_t groups);
    Expected<std::vector<UsdPart>> ofPoints(const UsdComposedPrim& prim, const std::string& material);
    Expected<std::vector<UsdPart>> ofCurves(const UsdComposedPrim& prim, const std::string& material);
    std::vector<UsdPart> ofShape(const UsdComposedPrim& prim, const std::string& material);
    /// Of vertices alone, as points and curves have them.
    void setColors(const UsdComposedPrim& prim, const UsdLook& look, const UsdElements& elements, MeshData& data);
    UsdLook lookOf(const UsdComposedPrim& prim, const std::string& material, bool surface);
    std::vector<UsdPart> added(const UsdComposedPrim& prim, MeshData data, const UsdLook& look);

    UsdStage& stage_;
    PlainScene& scene_;
    const ReadLimits& limits_;
    UsdMaterials& materials_;
    UsdRemarks& remarks_;
    std::map<std::string, std::vector<UsdPart>> known_;  ///< by what they are made of
};

/// A Cube, Sphere, Cylinder, Cone, Capsule or Plane as triangles; empty: it is none of these, or has no size.
[[nodiscard]] MeshData usdShape(const UsdComposedPrim& prim);

}  // namespace tessera

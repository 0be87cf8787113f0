/// Meshes of USD: faces of many corners, with values per face, vertex or corner, and parts of other materials.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/base/Hash.h"
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

/// What a prim has of those above.
struct UsdWorn {
    std::string material;  ///< a path; empty: none
    bool holds = false;    ///< whatever the prim's own parts say
    const UsdInherited* primvars = nullptr;
};

/// Makes each once: prims of equal values share the mesh, whether one refers to the other or says the same again.
class UsdMeshes {
public:
    UsdMeshes(UsdStage& stage, PlainScene& scene, const ReadLimits& limits, UsdMaterials& materials,
              UsdRemarks& remarks)
        : stage_(stage), scene_(scene), limits_(limits), materials_(materials), remarks_(remarks) {}

    /// Of a Mesh, Points, BasisCurves, or one of the shapes (Cube, Sphere, …); none, with a remark, of others.
    Expected<std::vector<UsdPart>> parts(const UsdComposedPrim& prim, const UsdWorn& worn);

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
    /// From 1, the same of equal values.
    std::size_t numberOf(const UsdValuePtr& value);
    std::vector<UsdPart> added(const UsdComposedPrim& prim, MeshData data, const UsdLook& look);

    UsdStage& stage_;
    PlainScene& scene_;
    const ReadLimits& limits_;
    UsdMaterials& materials_;
    UsdRemarks& remarks_;
    UsdWorn worn_;                                       ///< by the prim that is looked at
    std::map<std::string, std::vector<UsdPart>> known_;  ///< by what they are made of
    std::map<UsdValuePtr, std::size_t> numbers_;
    std::map<Hash128, std::vector<UsdValuePtr>> values_;  ///< the first of each
};

/// Lines along cubic curves of `points`, or along straight ones; UsdCurves.cpp.
struct UsdCurves {
    MeshData lines;
    /// Of each vertex: four points that it is mixed of, the shares of these, its curve, and the two values that it is
    /// between, of those that vary along curves.
    struct Vertex {
        std::array<std::uint32_t, 4> points{};
        std::array<float, 4> shares{};
        std::uint32_t curve = 0;
        std::array<std::uint32_t, 2> values{};
        float share = 0;  ///< of the second
    };
    std::vector<Vertex> vertices;
    std::size_t curves = 0, varying = 0;  ///< how many there are, and how many values vary along all of them
    bool cut = false;                     ///< some curves have points that are not there
};
[[nodiscard]] UsdCurves usdCurvesOf(const UsdComposedPrim& prim);

/// A Cube, Sphere, Cylinder, Cone, Capsule or Plane as triangles; empty: it is none of these, or has no size, which a
/// remark says.
[[nodiscard]] MeshData usdShape(const UsdComposedPrim& prim, UsdRemarks& remarks);

}  // namespace tessera

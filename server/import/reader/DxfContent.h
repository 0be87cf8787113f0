/// What a drawing or a block of it holds: meshes and letters by layer and colour, and blocks that are placed in it.
#pragma once

#include <map>
#include <span>
#include <string>
#include <vector>

#include "common/geometry/Mesh.h"
#include "server/import/reader/DxfCurves.h"
#include "server/import/reader/DxfDocument.h"
#include "server/import/reader/DxfText.h"

namespace tessera {

/// Of one layer and one colour. Meshes are about `origin`, as maps lie so far from theirs that floats are too coarse.
class DxfBucket {
public:
    /// A strip of lines; or, with a thickness, the wall over it.
    void addPath(std::span<const Vec3d> path, bool closed, const Vec3d& thickness);
    void addPoint(const Vec3d& point);
    /// Three or four corners.
    void addFace(std::span<const Vec3d> corners);
    void addTriangles(std::span<const Vec3d> corners, std::span<const std::uint32_t> triangles);
    void addLetters(DxfLetters letters);

    Vec3d origin = Vec3d::Zero();
    std::vector<MeshData> lines;  ///< several, as one may hold so many only
    MeshData faces, points;
    std::vector<DxfLetters> letters;
    Box bounds;

private:
    std::uint32_t addVertex(MeshData& mesh, const Vec3d& at);
    MeshData& roomForLines();
    bool placed_ = false;
};

/// A block as it looks where an insert gives it a layer and a colour.
struct DxfGuise {
    std::string definition;      ///< of the plain scene; empty: nothing, or a mesh alone
    std::string mesh, material;  ///< of one that is a mesh alone
    std::size_t nodes = 0;       ///< of each that is placed
    std::size_t letters = 0;     ///< the same
    Box bounds;
    bool byLayer = false, byColor = false;  ///< whether it looks otherwise with another layer or colour
};

struct DxfPlaced {
    std::string name;
    const DxfGuise* guise;
    Affine3d place;
};

struct DxfLayerContent {
    const DxfLayer* layer = nullptr;
    std::map<DxfColor, DxfBucket> buckets;
    std::vector<DxfPlaced> placed;
};

struct DxfContent {
    std::map<std::string, DxfLayerContent> layers;  ///< by key
    std::size_t placedNodes = 0;
    std::size_t letters = 0;  ///< those of placed blocks, too

    [[nodiscard]] DxfLayerContent& of(const DxfLayer& layer);
    [[nodiscard]] Box bounds() const;
};

}  // namespace tessera

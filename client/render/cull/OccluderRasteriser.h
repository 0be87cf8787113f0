/// Finds the pixels that a mesh surely covers, and how deep behind it everything is hidden.
///
/// A rasteriser with four samples per pixel, vertices snapped to a grid and transformed in single precision shows
/// things through slits that an exact picture at pixel centres does not have. So this one never asks what a sample
/// hits. It uses that a surface without an edge in a place covers that place as a whole:
///
/// - Front-facing triangles joined along edges form *patches*. Left out (so that their neighbours end there) are back
/// faces,
///   triangles so flat on the screen that rounding may turn them over, and what reaches out of the depth range.
/// - A patch marks each pixel whose square, grown by a margin, a triangle of it meets, with the least inverse depth
/// that a
///   triangle has there. Then every edge where the patch ends unmarks each pixel whose square, grown by a greater
///   margin, it meets.
/// - What remains marked is covered whole: no border of the patch passes near, and the projection covers one point
/// near. Its
///   degree is then the same positive number all over the square, for the displaced triangles as well, as long as
///   nothing is displaced by more than the margins; so each sample lies in at least one front-facing triangle.
///
/// A mesh with holes, cracks or T-junctions thus hides less, never too much. Patches do not disturb one another: a
/// detail inside a housing does not cut it open. Where only runs of a mesh's triangles are taken, its patches end where
/// they do: the same holds for the part as for a mesh of its own.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "client/render/TileProjection.h"
#include "client/render/cull/OcclusionBuffer.h"
#include "client/render/cull/PatchMarks.h"
#include "client/render/scene/OccluderMesh.h"

namespace tessera {

/// Keeps only scratch memory from call to call.
class OccluderRasteriser {
public:
    struct Placed {
        Mat4d clip_T_mesh;
        bool mirrored = false;  ///< front faces are clockwise
        double noise = 0;       ///< metres, see TileProjection
    };
    struct Work {
        std::uint64_t triangles = 0;  ///< rasterised
        std::uint64_t pixels = 0;     ///< of the blocks that patches touched
    };
    /// Adds to the buffer what the mesh hides, or these runs of its triangles alone: ascending, and none meets another.
    Work add(const OccluderMesh& mesh, const Placed& placed, const TileProjection& tile, OcclusionBuffer& buffer);
    Work add(const OccluderMesh& mesh, std::span<const OccluderMesh::Run> runs, const Placed& placed,
             const TileProjection& tile, OcclusionBuffer& buffer);

private:
    enum class Fate : std::uint8_t { kUsable, kTooNear, kUnusable };
    enum class Side : std::uint8_t { kOut, kFront, kFrontClipped };
    /// At most four corners: a triangle clipped by one plane.
    struct Polygon {
        ScreenPoint corners[4];
        /// Of the edge from corner i to i + 1: the triangle's edge, or -1 where the near plane cut.
        int edges[4] = {0, 1, 2, -1};
        int size = 0;
    };
    struct Patch {
        std::uint32_t first = 0, count = 0;  ///< of `ordered_`
        float lowerX, lowerY, upperX, upperY, nearest;
    };

    template <typename F>
    void forEachTriangle(F&& f) const;
    void project(const OccluderMesh& mesh, const Placed& placed, const TileProjection& tile);
    void projectPoint(const OccluderMesh::Point& point, std::size_t index, const Mat4d& m, const TileProjection& tile);
    void findSides(const OccluderMesh& mesh, const Placed& placed);
    void findPatches(const OccluderMesh& mesh);
    void addPatch(const OccluderMesh& mesh, const Patch& patch, OcclusionBuffer& buffer, Work& work);
    [[nodiscard]] Polygon polygonOf(const OccluderMesh& mesh, std::uint32_t triangle) const;
    [[nodiscard]] ScreenPoint clipEdge(const OccluderMesh::Point& from, const OccluderMesh::Point& to) const;
    [[nodiscard]] bool facesFront(const Polygon& polygon, bool mirrored) const;
    [[nodiscard]] std::uint32_t rootOf(std::uint32_t triangle);

    const TileProjection* tile_ = nullptr;
    Mat4d clip_T_mesh_;
    double nearest_ = 0;  ///< what is nearer is clipped away, metres
    double farthest_ = 0;
    double noise_ = 0;
    double flattest_ = 0;                      ///< triangles lower than this are left out, pixels
    double nearestVertex_ = 0;                 ///< as inverse depth
    std::span<const OccluderMesh::Run> runs_;  ///< while `add` runs
    // Of points and triangles that are in no run nothing is known but that their side is kOut.
    std::vector<ScreenPoint> points_;
    std::vector<Fate> fates_;
    std::vector<std::uint32_t> projectedFor_;  ///< by point: the call that last did, where not all are
    std::uint32_t call_ = 0;
    std::vector<Side> sides_;
    std::vector<std::uint32_t> parents_;
    std::vector<std::uint32_t> patchOf_;
    std::vector<Patch> patches_;
    std::vector<std::uint32_t> ordered_;
    PatchMarks marks_;
};

}  // namespace tessera

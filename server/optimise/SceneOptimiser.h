/// A scene with less to carry: the same to look at and to collide with, within what is said here.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "common/scene/Aspect.h"

namespace tessera {

struct OptimiseOptions {
    /// Images, materials, meshes and surfaces that are equal field by field become one object. Changes nothing that is
    /// seen.
    bool share = true;
    /// Triangles of one material that nothing moves, names or chooses become one mesh, under the nearest node that
    /// stays. Their positions are rounded to floats in that node's coordinates: off by at most 2^-24 of the largest
    /// coordinate there. Names of nodes that go are gone. It saves calls and nodes; walls and floors, which hide much,
    /// stay by themselves. README.md says what that brings.
    bool merge = false;
    /// Of what is not merged, chains of transforms that nothing moves become one each.
    bool flatten = true;
    /// Vertices and triangles of meshes in an order that draws faster (MeshOrder.h): the same triangles. Of triangles
    /// of one mesh that lie upon each other another one may be seen.
    bool order = true;
    /// Meshes of 2,000 triangles or more get coarser ones, shown where they are off by less than half a pixel, about,
    /// on the screen that sees most of them (DistanceLOD by size). Collisions and picks look at the finest.
    bool levels = false;
    /// Paths of nodes that stay what and where they are, with all that is below them.
    std::vector<std::string> keep;
    std::size_t mostMergedTriangles = 65'536;  ///< of one merged mesh; 3 at least
};

struct OptimiseCounts {
    std::size_t nodesBefore = 0, nodesAfter = 0, objectsBefore = 0,
                objectsAfter = 0;            ///< objects: nodes, cores, materials, images
    std::size_t shared = 0;                  ///< objects that were equal to another one, and are gone
    std::size_t merged = 0, mergedInto = 0;  ///< places of meshes, and meshes made of them
    std::size_t flattened = 0;               ///< places whose chain of transforms is one now
    std::size_t ordered = 0;                 ///< meshes
    std::uint64_t verticesJoined = 0;
    std::size_t levelled = 0, levels = 0;  ///< meshes that have coarser ones, and how many all of those are
};

/// What stays for sure: everything that an object of the scene names by a reference (motions, animations, interests,
/// joints, beacons …), cores that are no groups, transforms or triangles, what has one of these below it, children of
/// switches and of levels of detail, what collides divided or in another shape than its triangles, and materials whose
/// look depends on their node (programs, layers by position, coarser materials). kNotFound: a path of `keep` names
/// nothing.
[[nodiscard]] Expected<OptimiseCounts> optimiseScene(Aspect& scene, const OptimiseOptions& options);

}  // namespace tessera

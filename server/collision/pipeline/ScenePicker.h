/// What does a ray hit first? What is drawn near a place, and what of it is the nearest?
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "common/math/Ray.h"
#include "common/rays/HitDetails.h"
#include "common/rays/PickTree.h"
#include "common/scene/Aspect.h"
#include "server/collision/mesh/QueryWork.h"
#include "server/collision/mesh/TriangleTriangle.h"
#include "server/collision/objects/ObjectHandler.h"

namespace tessera {

class WorldTransforms;

struct NearestSurface {
    ObjectId node;                ///< the node that bears the geometry
    std::uint32_t face = 0;       ///< as of PickHit
    Vec3d point = Vec3d::Zero();  ///< world
    double distance = 0;          ///< world units
    double error = 0;  ///< the truth is within it; 0: exact to rounding. Points are balls, and looked at as octahedra
    HitDetails details = {};
};

struct PickHit {
    ObjectId node;                ///< the node that bears the geometry
    std::uint32_t face = 0;       ///< triangle index in the geometry; of points, 8 for each (common/geometry/Points.h)
    Vec3d point = Vec3d::Zero();  ///< world
    double t = 0;                 ///< in lengths of the ray's direction
    HitDetails details = {};      ///< normal, barycentric weights, texture coordinate
};

/// What somebody who may wait lets a question take at once.
struct PickPatience {
    /// Of a geometry whose tree is not there: with more faces it is put down here, and the search ends without an
    /// answer. The nearest comes first: what it hides is not wanted.
    std::size_t maxMadeFaces = 2048;
    std::optional<UnmadeShape> unmade = {};
    QueryWork work = {};  ///< where it is exhausted, nothing is found
};

/// What was put down, with its tree; null where nothing comes of it. On any thread.
[[nodiscard]] inline std::shared_ptr<const CollisionShape> makeShape(const UnmadeShape& unmade) {
    return ShapeCache::make(unmade);
}

/// Looks at every visible geometry, from either side, but for what is below a CollisionObject of layers 0 that stands
/// at the very node it names. Follows what the handler has seen: a pick costs O(log n) for each geometry that has come,
/// gone or moved since the last one, or that what lay over the scene had carried elsewhere then, and for each that the
/// ray comes near; their trees are built then. Not thread-safe.
class ScenePicker {
public:
    explicit ScenePicker(std::shared_ptr<ShapeCache> shapes) : shapes_(std::move(shapes)) {}

    /// In the scene as the handler has seen it last, without what is laid over it. Of equal distances the first node in
    /// document order. Geometry that is absent or malformed is not hit.
    [[nodiscard]] std::optional<PickHit> pick(const Aspect& aspect, ObjectHandler& handler, const Ray& ray,
                                              PickPatience* patience = nullptr);

    /// Appends the triangles of all that a pick looks at, in world coordinates: all that meet `box`, and some more of those
    /// whose own boxes overlap it; what is flattened too. Lines have none. False: the work was exhausted, and nothing is
    /// appended. A box counts as a box test, of the scene's tree and of the trees of geometries alike.
    /// Nor where a tree is to be made first; of `patience` nothing else counts.
    [[nodiscard]] bool facesIn(const Aspect& aspect, ObjectHandler& handler, const Box& box, QueryWork& work,
                               std::vector<Triangle>& faces, PickPatience* patience = nullptr);

    /// What is nearest to a place of all that a pick looks at below a node, that node included; of what is flattened,
    /// too. In the scene as pick takes it. Of equal distances the first node in document order, there the lowest face.
    /// Nothing where nothing is seen below it; nothing, too, where the work was exhausted. What is farther away than
    /// kMostCoordinate does not count.
    [[nodiscard]] std::optional<NearestSurface> nearest(const Aspect& aspect, ObjectHandler& handler,
                                                        const Vec3d& place, ObjectId below, QueryWork& work,
                                                        PickPatience* patience = nullptr);
    static constexpr double kMostCoordinate = 1e50;

private:
    /// What is to be made elsewhere is put down.
    [[nodiscard]] bool isUnmade(const MeshArrays& arrays, PickPatience* patience) const;
    /// Null where nothing is to be found of these, or not yet.
    [[nodiscard]] std::shared_ptr<const CollisionShape> shapeOf(const MeshArrays& arrays, PickPatience* patience);
    void follow(const Aspect& aspect, ObjectHandler& handler);
    [[nodiscard]] Box boxOf(const Aspect& aspect, const Place& place, WorldTransforms& worlds);

    std::shared_ptr<ShapeCache> shapes_;
    PickTree tree_;                        // by place
    /// Of large geometry, the last ones that were asked about: they took long to make, and the cache may let go of them.
    std::array<std::shared_ptr<const CollisionShape>, 2> recent_;
    std::uint64_t changes_ = 0;  // of these
    std::vector<std::uint32_t> laidOver_;  // places in it that stood elsewhere in the handler than in the scene
};

}  // namespace tessera

/// What does a ray hit first? What is drawn near a place, and what of it is the nearest?
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "common/math/Ray.h"
#include "common/rays/PickTree.h"
#include "common/scene/Aspect.h"
#include "server/collision/mesh/TriangleTriangle.h"
#include "server/collision/objects/ObjectHandler.h"
#include "server/collision/pipeline/AsideQuery.h"
#include "server/collision/pipeline/KeptShapes.h"
#include "server/collision/pipeline/SceneHits.h"

namespace tessera {

class WorldTransforms;

/// Looks at every visible geometry, from either side, but for what is below a CollisionObject of layers 0 that stands
/// at the very node it names. Follows what the handler has seen: a pick costs O(log n) for each geometry that has come,
/// gone or moved since the last one, or that what lay over the scene had carried elsewhere then, and for each that the
/// ray comes near; their trees are built then, as far as PickPatience allows it. Not thread-safe.
class ScenePicker {
public:
    explicit ScenePicker(std::shared_ptr<ShapeCache> shapes) : shapes_(std::move(shapes)), kept_(shapes_) {}

    /// In the scene as the handler has seen it last, without what is laid over it. Of equal distances the first node in
    /// document order. Geometry that is absent or malformed is not hit.
    [[nodiscard]] std::optional<PickHit> pick(const Aspect& aspect, ObjectHandler& handler, const Ray& ray,
                                              PickPatience* patience = nullptr);

    /// Appends the triangles of all that a pick looks at, in world coordinates: all that meet `box`, and some more of
    /// those whose own boxes overlap it; what is flattened too. Lines have none. False: the work was exhausted, and
    /// nothing is appended. A box counts as a box test, of the scene's tree and of the trees of geometries alike. Nor
    /// where a tree is to be made first; of `patience` nothing else counts.
    [[nodiscard]] bool facesIn(const Aspect& aspect, ObjectHandler& handler, const Box& box, QueryWork& work,
                               std::vector<Triangle>& faces, PickPatience* patience = nullptr);

    /// What is nearest to a place of all that a pick looks at below a node, that node included; of what is flattened,
    /// too. In the scene as pick takes it. Of equal distances the first node in document order, there the lowest face.
    /// Nothing where nothing is seen below it; nothing, too, where the work was exhausted. What is farther away than
    /// kMostCoordinate does not count.
    [[nodiscard]] std::optional<NearestSurface> nearest(const Aspect& aspect, ObjectHandler& handler,
                                                        const Vec3d& place, ObjectId below,
                                                        PickPatience* patience = nullptr);
    static constexpr double kMostCoordinate = 1e50;

    /// The same questions, to be answered elsewhere. Nothing: more stands there than AsideQuery::kMostThings, or a look
    /// at that takes too long.
    [[nodiscard]] std::optional<AsidePick> pickAside(const Aspect& aspect, ObjectHandler& handler, const Ray& ray);
    [[nodiscard]] std::optional<AsideNearest> nearestAside(const Aspect& aspect, ObjectHandler& handler,
                                                           const Vec3d& place, ObjectId below);
    /// What an answer has needed is there for the next question (KeptShapes).
    void put(std::vector<MadeShape> made);
    /// What went for that.
    [[nodiscard]] std::vector<std::shared_ptr<const CollisionShape>> takeReleased() { return kept_.takeReleased(); }

private:
    [[nodiscard]] AsideQuery::Thing thingAt(const ObjectHandler& handler, std::uint32_t number,
                                            const MeshArrays& arrays, const Affine3d& world);
    /// What is to be made elsewhere is put down.
    [[nodiscard]] bool isUnmade(const MeshArrays& arrays, PickPatience* patience) const;
    /// Null where nothing is to be found of these, or not yet.
    [[nodiscard]] std::shared_ptr<const CollisionShape> shapeOf(const MeshArrays& arrays, PickPatience* patience);
    void follow(const Aspect& aspect, ObjectHandler& handler);
    /// visit(number, arrays, world_T_mesh, mesh_T_world) for what may be hit before `limit`, until over().
    template <typename Over, typename Visit>
    void along(const Aspect& aspect, ObjectHandler& handler, const Ray& ray, const double& limit, QueryWork& work,
               const Over& over, const Visit& visit) const;
    [[nodiscard]] Box boxOf(const Aspect& aspect, const Place& place, WorldTransforms& worlds);

    std::shared_ptr<ShapeCache> shapes_;
    PickTree tree_;  // by place
    KeptShapes kept_;
    std::vector<std::uint32_t> laidOver_;  // places in it that stood elsewhere in the handler than in the scene
};

}  // namespace tessera

/// The collision pipeline: what the frame loop asks before it commits a motion.
///
/// Object handler (who takes part, where) → neighbour finding (whose boxes meet) → responses (how far may motions go,
/// where do free bodies go) → pairwise (whose triangles meet, how far apart) → events. Values in, values out: the
/// pipeline changes no scene.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "common/math/Box.h"
#include "common/math/Ray.h"
#include "common/scene/Aspect.h"
#include "server/collision/mesh/QueryWork.h"
#include "server/collision/mesh/TriangleTriangle.h"
#include "server/collision/pipeline/StepResult.h"

namespace tessera {

class Workers;
struct InterestTerms;
struct NearestSurface;
struct PickHit;
struct PickPatience;
struct MadeShape;
class AsideNearest;
class AsidePick;
class CollisionShape;

/// One thread owns it (the sim thread). Deterministic: the same scene history, wishes (in any order within a step) and
/// replies give the same results and counters, for any number of workers.
class CollisionPipeline {
public:
    /// `workers` may be null; else it must outlive the pipeline.
    explicit CollisionPipeline(CollisionLimits limits = {}, Workers* workers = nullptr);
    ~CollisionPipeline();
    CollisionPipeline(CollisionPipeline&&) noexcept;
    CollisionPipeline& operator=(CollisionPipeline&&) noexcept;

    /// Call after each list applied to the aspect, with that list; with null after a load or anything else that cannot
    /// be said by one list. Before the first step: once with null (or the list that made the scene).
    void sceneChanged(const Aspect& aspect, const ChangeList* list);

    /// Looks at `committed` (the scene that sceneChanged has seen) with the wishes laid over it, and lets free bodies
    /// move on for `seconds`; 0: time stands, and they with it.
    [[nodiscard]] StepResult step(const Aspect& committed, std::span<const TentativeTransform> wanted,
                                  std::span<const Reply> replies = {}, double seconds = kSecondsPerFrame);

    /// Of what the scene deforms in this frame, before the step: the shape as it was before, or nothing at all.
    enum class Deforming : std::uint8_t { kAsBefore, kLeftOut };
    /// Which parts touch that motions of these Transforms would keep apart: each carried part against all that is not
    /// carried with it, in the scene that sceneChanged has seen. Pairs of the nodes that bear them, the lower id first,
    /// ascending. What the work was not enough for counts as touching. After a step, until something changes, it costs
    /// a look at the neighbours; else one at the box of each part.
    [[nodiscard]] std::vector<std::pair<ObjectId, ObjectId>> overlaps(const Aspect& committed,
                                                                      std::span<const ObjectId> transforms,
                                                                      Deforming deforming = Deforming::kAsBefore);
    /// Transforms and the local values that they would have.
    using PosedTransforms = std::vector<std::pair<ObjectId, Pose>>;
    /// The same if these had been put there one after the other: for each, what touches once it and those before it are
    /// there. Against everything, at the cost of a look at the box of each part for each; or, where no two carry the
    /// same part, among the parts alone that any of them carry.
    enum class Against : std::uint8_t { kEverything, kThemselves };
    [[nodiscard]] std::vector<std::vector<std::pair<ObjectId, ObjectId>>> overlapsAfter(
        const Aspect& committed, std::span<const PosedTransforms> moves, Against against);

    /// Boxes that these two have looked at so far.
    [[nodiscard]] std::uint64_t boxesLookedAt() const;

    /// Nobody asks about the last step any more: of its lists those that nobody has asked for are not made; whoever
    /// still holds them has empty ones. Else they are made when the next step begins for whoever holds them.
    void forgetLists();

    /// Questions that wait for a reply, ascending by id.
    [[nodiscard]] std::vector<std::uint64_t> openQuestions() const;
    /// The enabled interests, in document order; valid until the scene changes.
    [[nodiscard]] std::span<const InterestTerms> interests() const;
    [[nodiscard]] const CollisionLimits& limits() const;
    /// The one visible node that has this core; none: none has it, or several have.
    [[nodiscard]] ObjectId bearerOf(ObjectId core) const;

    /// The nearest visible triangle along a ray in world coordinates.
    [[nodiscard]] std::optional<PickHit> pickNode(const Aspect& aspect, const Ray& ray,
                                                  PickPatience* patience = nullptr);
    /// These questions to be answered elsewhere, and what answers have made (ScenePicker).
    [[nodiscard]] std::optional<AsidePick> pickAside(const Aspect& aspect, const Ray& ray);
    [[nodiscard]] std::optional<AsideNearest> nearestAside(const Aspect& aspect, const Vec3d& place, ObjectId below);
    void putShapes(std::vector<MadeShape> made);
    [[nodiscard]] std::vector<std::shared_ptr<const CollisionShape>> takeReleased();
    /// The visible triangles near a place (ScenePicker::facesIn).
    [[nodiscard]] bool facesIn(const Aspect& aspect, const Box& box, QueryWork& work, std::vector<Triangle>& faces,
                               PickPatience* patience = nullptr);
    /// The visible surface nearest to a place, at or below a node (ScenePicker::nearest).
    [[nodiscard]] std::optional<NearestSurface> nearestSurface(const Aspect& aspect, const Vec3d& place, ObjectId below,
                                                               PickPatience* patience = nullptr);

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace tessera

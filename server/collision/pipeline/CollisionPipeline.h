/// The collision pipeline: what the frame loop asks before it commits a motion.
///
/// Object handler (who takes part, where) → neighbour finding (whose boxes meet) → pairwise (whose triangles meet) →
/// response (how far may it go). Values in, values out: the pipeline changes no scene.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "common/math/Ray.h"
#include "common/scene/Aspect.h"
#include "server/collision/pipeline/ScenePicker.h"
#include "server/collision/pipeline/StepResult.h"

namespace tessera {

/// One thread owns it (the sim thread). Deterministic: the same scene history and wishes, in any order within a step,
/// give the same results and counters.
class CollisionPipeline {
public:
    explicit CollisionPipeline(CollisionLimits limits = {});
    ~CollisionPipeline();
    CollisionPipeline(CollisionPipeline&&) noexcept;
    CollisionPipeline& operator=(CollisionPipeline&&) noexcept;

    /// Call after each list applied to the aspect, with that list; with null after a load or anything else that cannot
    /// be said by one list. Before the first step: once with null (or the list that made the scene).
    void sceneChanged(const Aspect& aspect, const ChangeList* list);

    /// Looks at `committed` (the scene that sceneChanged has seen) with the wishes laid over it.
    [[nodiscard]] StepResult step(const Aspect& committed, std::span<const TentativeTransform> wanted);

    /// The nearest visible triangle along a ray in world coordinates.
    [[nodiscard]] std::optional<PickHit> pickNode(const Aspect& aspect, const Ray& ray);

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace tessera

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

namespace tessera {

/// The values that somebody wants a Transform core to have, before anything is committed.
struct TentativeTransform {
    ObjectId transform;  ///< a Transform core
    Vec3d translation = Vec3d::Zero();
    Quatd rotation = Quatd::Identity();  ///< normalised on use
    Vec3d scale = Vec3d::Ones();
    int source = 0;  ///< whose wish it is; handed through. Of several wishes for one transform the lowest source counts
};

/// Two triangles of two geometry-bearing nodes that meet.
struct Contact {
    ObjectId objectA, objectB;  ///< the nodes that bear the geometry; A is part of an interest's object
    std::uint32_t faceA = 0, faceB = 0;
    Vec3d point = Vec3d::Zero();   ///< world
    Vec3d normal = Vec3d::Zero();  ///< world, unit length, from A to B
};

struct CollisionLimits {
    std::size_t maxContacts = 1000;       ///< listed in a step; more are counted
    std::size_t maxInterests = 4096;      ///< enabled at a time; the first ones in document order count
    std::uint64_t maxTests = 30'000'000;  ///< box and triangle tests in a step
    /// How near to an obstacle a motion is stopped, in sizes (box diagonals) of the moving geometry.
    double stopTolerance = 1e-4;
    /// A rotating motion is cut into pieces whose arcs leave their chords by at most this many sizes...
    double arcTolerance = 1e-3;
    /// ...and into at most so many pieces; so are motions that begin in contact.
    int maxPieces = 64;
};

struct StepCounters {
    std::size_t objects = 0;        ///< geometry-bearing nodes that take part in an interest
    std::size_t skipped = 0;        ///< of those: absent, malformed or flattened by a zero scale; they meet nothing
    std::size_t neighbours = 0;     ///< pairs whose boxes (swept over the motion) meet
    std::uint64_t pairsTested = 0;  ///< queries of the pairwise stage
    std::uint64_t boxTests = 0;
    std::uint64_t triangleTests = 0;
    std::uint64_t notLookedAt = 0;  ///< pairs and motions left undecided because a limit was reached: taken as blocked
    std::uint64_t contactsLeftOut = 0;  ///< found, but beyond maxContacts
};

struct StepResult {
    /// Ascending by transform, one for each wish that names a Transform: the values to commit, as wanted or as far as
    /// the way is free. Committing a value equal to the present one is harmless.
    std::vector<TentativeTransform> accepted;
    /// Transforms that did not get (all the way) where they were wanted, ascending. Wishes that cannot be granted at
    /// all (not finite, a zero or sign-changing scale, no such Transform) are here too.
    std::vector<ObjectId> stopped;
    /// What touches now, and what stopped a motion at its first touch. Ascending by (objectA, objectB, faceA, faceB).
    std::vector<Contact> contacts;
    /// Pairs of objects that touch now and did not in the last step.
    std::uint64_t contactsBegun = 0;
    StepCounters counters;
};

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

/// What the collision pipeline takes and gives in a frame. Plain values.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "common/change/Value.h"
#include "common/math/Pose.h"
#include "common/math/Types.h"
#include "server/collision/pipeline/LazyList.h"

namespace tessera {

/// The values that somebody wants a Transform core to have, before anything is committed.
struct TentativeTransform {
    ObjectId transform;  ///< a Transform core
    Vec3d translation = Vec3d::Zero();
    Quatd rotation = Quatd::Identity();  ///< normalised on use
    Vec3d scale = Vec3d::Ones();
    int source = 0;  ///< whose wish it is; handed through. Of several wishes for one transform the lowest source counts
};

/// An application's answer to a Question: what becomes of the motion that it was asked about.
struct Reply {
    enum class Decision : std::uint8_t {
        kStop,  ///< it stays stopped; the same motion is not asked about again while the two objects stay in touch
        kPass,  ///< it goes where it wanted to be; the pair is no obstacle until it is apart again
        kMove,  ///< it goes to `pose` instead; the pair is no obstacle until it is apart again
    };
    std::uint64_t question = 0;
    Decision decision = Decision::kStop;
    Pose pose;  ///< local value of the question's transform
};

/// A pair of faces of two geometry-bearing nodes that meet.
struct Contact {
    static constexpr std::uint32_t kNoFace = 0xffffffffu;  ///< of a hull: no triangle of the file
    static constexpr double kNoDepth = -1;

    ObjectId objectA, objectB;           ///< the nodes that bear the geometry; A is part of an interest's object
    std::uint32_t faceA = 0, faceB = 0;  ///< as they are drawn: of points those of their octahedra, 8 · point + octant
    Vec3d point = Vec3d::Zero();         ///< world
    Vec3d normal = Vec3d::Zero();        ///< world, unit length, from A to B
    /// How deep the two are in each other along the normal, world units: of the region that the contact bounds, where
    /// both are closed and all their contacts are known, or of two hulls. Else kNoDepth.
    double depth = kNoDepth;
    /// Where on the faces: corner 0 + u · (corner 1 - corner 0) + v · (corner 2 - corner 0).
    Vec2d uvA = Vec2d::Zero(), uvB = Vec2d::Zero();
    /// Of what is looked at as the smooth surface that it is: the surface's own face (a ptex face, a NURBS by its
    /// number) and the parameters there. kNoFace: it is looked at as something else, or runs into itself.
    std::uint32_t patchA = kNoFace, patchB = kNoFace;
    Vec2d patchUvA = Vec2d::Zero(), patchUvB = Vec2d::Zero();
    double error = 0;   ///< the point may be off by so much, world units; 0: it is exact to rounding
    ObjectId interest;  ///< the one that decides about the pair
    double time = 1;    ///< when in the frame's motion: 1 at its end; less for what stopped a motion on its way,
                        ///< in later frames too, as long as both stay
};

enum class Phase : std::uint8_t { kBegan, kStays, kEnded };

/// Two objects of an interest touch, or have just ceased to. For modes kPseudoDynamic and kDynamic; of a static
/// interest only the contacts are told. `objectA`, `objectB`: their topmost nodes.
struct PairEvent {
    ObjectId interest, objectA, objectB;
    Phase phase = Phase::kBegan;
    /// kDynamic: when they first touched in this frame's motion, 0 to 1; 1 too where they do so at the end only.
    double firstTime = 1;
    Vec3d point = Vec3d::Zero(), normal = Vec3d::Zero();  ///< kDynamic, of a contact that began: where; world, A to B
    bool through = false;  ///< kDynamic: touched on the way and are apart at its end (phase kEnded in the same frame)
};

/// How far two objects of a kDistance interest are apart. Listed while they are nearer than its threshold, and once
/// more (phase kEnded, numbers of the last time) when they are not.
struct PairDistance {
    ObjectId interest, objectA, objectB;
    Phase phase = Phase::kBegan;
    double distance = 0;    ///< 0: they touch
    ObjectId nodeA, nodeB;  ///< geometry-bearing nodes of the nearest faces
    std::uint32_t faceA = 0, faceB = 0;
    Vec3d pointA = Vec3d::Zero(), pointB = Vec3d::Zero();  ///< world
    /// Of distance fields: the truth is within this of `distance`, world units; then no faces are named (kNoFace), and
    /// what may be within the threshold is listed. 0: exact to rounding.
    double error = 0;
};

/// A motion has been stopped by a kAsk interest: what shall become of it? It stands until a Reply comes or the
/// interest's patience is over.
struct Question {
    std::uint64_t id = 0;  ///< grows; never given twice by one pipeline
    ObjectId interest, objectA, objectB;
    ObjectId transform;                                   ///< that wanted to move
    Pose present, wanted;                                 ///< its local values: where it stopped, where it wanted to be
    Vec3d point = Vec3d::Zero(), normal = Vec3d::Zero();  ///< world, from A to B
};

/// New velocities of a free body, for its CollisionObject.
struct BodyVelocity {
    ObjectId core;
    Vec3d velocity = Vec3d::Zero(), spin = Vec3d::Zero();
};

/// What a limit kept from being looked at: taken as blocked, and named here. Or held back: a free body that would have
/// become faster than CollisionObject::kFastest goes at that speed, one that would have left what numbers tell stays.
struct NotLookedAt {
    enum class Reason : std::uint8_t { kWork, kSteps, kNotFinite, kTooFast };
    ObjectId nodeA, nodeB;  ///< geometry-bearing nodes; B none: a whole motion of A; of kTooFast A is a body's node, of
                            ///< kNotFinite it may be a Transform that stayed where it was
    Reason reason = Reason::kWork;
};

/// A geometry that is taken for something else than its object asks for (CollisionObject::shape, level).
struct StandIn {
    ObjectId node;
    std::string_view asked;  ///< a word of CollisionObject::shape, or the level that it cannot have: "level 5"
    std::string_view taken;  ///< a word of CollisionObject::shape
};

struct CollisionLimits {
    std::size_t maxContacts = 1000;       ///< listed in a step; more are counted
    std::size_t maxEvents = 100'000;      ///< events and distances listed in a step, each; more are counted
    std::size_t maxInterests = 4096;      ///< enabled at a time; the first ones in document order count
    std::size_t maxNotLookedAt = 100;     ///< listed; more are counted
    std::size_t maxQuestions = 256;       ///< open at a time; further motions are stopped without one
    std::uint64_t maxTests = 30'000'000;  ///< box and triangle tests in a step
    /// How near to an obstacle a motion is stopped, in sizes (box diagonals) of the moving geometry.
    double stopTolerance = 1e-4;
};

struct StepCounters {
    std::size_t objects = 0;        ///< geometry-bearing nodes that take part in an interest
    std::size_t skipped = 0;        ///< of those: absent, malformed or flattened by a zero scale; they meet nothing
    std::size_t freeBodies = 0;     ///< bodies that gravity and impulses move
    std::size_t asleep = 0;         ///< of those: at rest
    std::size_t handedOver = 0;     ///< bodies, free or not, that the rigid-body stage looked at
    std::size_t neighbours = 0;     ///< pairs whose boxes (swept over the motion) meet
    std::uint64_t pairsTested = 0;  ///< queries of the pairwise stage
    std::uint64_t boxTests = 0;
    std::uint64_t triangleTests = 0;
    std::uint64_t notLookedAt = 0;      ///< pairs and motions left undecided because a limit was reached
    std::uint64_t contactsLeftOut = 0;  ///< found, but beyond maxContacts
    std::uint64_t eventsLeftOut = 0;
    std::uint64_t unanswered = 0;  ///< questions whose patience ended in this step
    std::uint64_t standIns = 0;    ///< geometries that are taken for something else than is asked for
};

/// What began, stays and ended. What began or ended is known without the others.
template <typename Entry>
class PhaseList : public LazyList<Entry> {
public:
    using LazyList<Entry>::LazyList;
    PhaseList() = default;
    PhaseList(std::shared_ptr<typename LazyList<Entry>::LateItems> late, std::vector<Entry> changes)
        : LazyList<Entry>(std::move(late)), changes_(std::move(changes)) {}

    /// In the order of the list.
    [[nodiscard]] std::vector<Entry> changes() const {
        if (changes_) return *changes_;
        std::vector<Entry> out;
        for (const Entry& entry : this->all())
            if (entry.phase != Phase::kStays) out.push_back(entry);
        return out;
    }

private:
    std::optional<std::vector<Entry>> changes_;  // none: they are looked for
};

/// How many are near, and the least of their distances, are known without the list.
class DistanceList : public PhaseList<PairDistance> {
public:
    struct Near {
        std::size_t count = 0;  ///< listed, but for those that ended
        double least = 0;       ///< of them
    };

    using PhaseList<PairDistance>::PhaseList;
    DistanceList() = default;
    DistanceList(std::shared_ptr<LateItems> late, std::vector<PairDistance> changes, const Near& near)
        : PhaseList<PairDistance>(std::move(late), std::move(changes)), near_(near) {}

    [[nodiscard]] Near near() const { return near_ ? *near_ : nearOf(all()); }
    [[nodiscard]] static Near nearOf(const std::vector<PairDistance>& list) {
        Near out;
        for (const PairDistance& pair : list) {
            if (pair.phase == Phase::kEnded) continue;
            if (out.count++ == 0 || pair.distance < out.least) out.least = pair.distance;
        }
        return out;
    }

private:
    std::optional<Near> near_;
};

/// The lists of contacts, events and distances are made when first asked for: until the next step begins, or the scene
/// is told of, by the pipeline itself for those that somebody holds; CollisionPipeline::forgetLists lets go of them.
struct StepResult {
    /// Ascending by transform, one for each wish that names a Transform, and one for each free body that moved: the
    /// values to commit. Committing a value equal to the present one is harmless.
    std::vector<TentativeTransform> accepted;
    /// Ascending by core: free bodies whose velocities are no longer what their core says.
    std::vector<BodyVelocity> velocities;
    /// Transforms that did not get (all the way) where they were wanted, ascending. Wishes that cannot be granted at
    /// all (not finite, a zero or sign-changing scale, no such Transform) are here too.
    std::vector<ObjectId> stopped;
    /// What touches now, and what stopped a motion at its first touch. Ascending by (objectA, objectB, faceA, faceB);
    /// of points by these.
    LazyList<Contact> contacts;
    PhaseList<PairEvent> events;      ///< ascending by (interest, objectA, objectB)
    DistanceList distances;           ///< ascending by (interest, objectA, objectB)
    std::vector<Question> questions;  ///< asked in this step
    /// Pairs of objects that touch now and did not in the last step, by any interest.
    std::uint64_t contactsBegun = 0;
    std::vector<NotLookedAt> notLookedAt;
    std::vector<StandIn> standIns;  ///< of the scene as it is now, at most CollisionLimits::maxNotLookedAt
    StepCounters counters;
};

}  // namespace tessera

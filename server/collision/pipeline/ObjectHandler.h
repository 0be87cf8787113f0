/// The object handler: who takes part in collision detection, of interest to whom, and where it is now.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <unordered_map>
#include <vector>

#include "common/scene/Aspect.h"
#include "server/collision/mesh/AabbTree.h"
#include "server/collision/neighbours/NeighbourFinder.h"
#include "server/collision/pipeline/ShapeCache.h"

namespace tessera {

/// A geometry-bearing node that takes part in an interest.
struct Part {
    ObjectId node;
    std::uint32_t place = 0;                ///< index into ObjectHandler::places()
    std::shared_ptr<const AabbTree> shape;  ///< null: nothing to collide with (absent or malformed)
    Affine3d world = Affine3d::Identity();  ///< world_T_part
    Box worldBox;                           ///< empty where the part meets nothing
    std::uint64_t poseVersion = 0;          ///< never the same for two poses of one part

    /// Has triangles, and a pose that does not flatten them.
    [[nodiscard]] bool solid() const { return !worldBox.empty(); }
};

/// A visible node, in document order (depth first, children in order).
struct Place {
    static constexpr std::uint32_t kNone = 0xffffffffu;

    std::uint32_t parent = kNone;
    std::uint32_t end = 0;  ///< one past the last place below
    ObjectId transform;     ///< the Transform core; none: the parent's frame
    Affine3d local = Affine3d::Identity();
    Affine3d world = Affine3d::Identity();
};

/// What one pair of parts is to each other.
struct Relation {
    bool relevant = false;
    bool stop = false;          ///< some interest wants motions stopped
    bool firstIsObject = true;  ///< the lower-numbered part is the interest's object (side A); else the other is
};

/// Follows an aspect; lays tentative transforms over it. Hidden nodes are not there. Not thread-safe.
///
/// A change of structure (nodes, switches, interests, arrays) makes the tables anew, at a cost proportional to the
/// visible nodes (trees come from the cache); a moved Transform costs what is below it; other changes cost nothing.
class ObjectHandler {
public:
    ObjectHandler(std::shared_ptr<ShapeCache> shapes, std::size_t maxInterests)
        : shapes_(std::move(shapes)), maxInterests_(maxInterests) {}

    /// See CollisionPipeline::sceneChanged.
    void update(const Aspect& aspect, const ChangeList* list);
    /// Grows with each time that the tables were made anew: part numbers of an earlier generation mean nothing.
    [[nodiscard]] std::uint64_t generation() const { return generation_; }

    [[nodiscard]] std::span<const Place> places() const { return places_; }
    [[nodiscard]] std::span<const Part> parts() const { return parts_; }
    /// Parts at or below a place: [first, second).
    [[nodiscard]] std::pair<std::uint32_t, std::uint32_t> partsBelow(std::uint32_t place) const;
    /// The visible places of a Transform core, ascending.
    [[nodiscard]] std::span<const std::uint32_t> placesOf(ObjectId transform) const;
    [[nodiscard]] const InteractionTable& interactions() const { return interactions_; }
    [[nodiscard]] Relation relation(std::uint32_t a, std::uint32_t b) const;
    /// Enabled interests beyond the limit: not looked at.
    [[nodiscard]] std::size_t interestsLeftOut() const { return interestsLeftOut_; }
    [[nodiscard]] std::size_t partsSkipped() const;

    /// Gives a Transform another local value until `dropOverlay`.
    void overlay(ObjectId transform, const Affine3d& local);
    void dropOverlay(const Aspect& aspect);
    /// Parts whose world pose has changed since the last call, ascending.
    [[nodiscard]] std::vector<std::uint32_t> takeMoved();

private:
    struct InterestTerms {
        std::uint32_t objectBegin, objectEnd;    // places
        std::uint32_t againstBegin, againstEnd;  // places; those of the object excepted
        bool stop;
    };

    void rebuild(const Aspect& aspect);
    void flatten(const Aspect& aspect);
    void chooseParts(const Aspect& aspect);
    void relate();
    void place(std::uint32_t index);
    void setLocal(ObjectId transform, const Affine3d& local);
    void reload(const Aspect& aspect, ObjectId transform);

    std::shared_ptr<ShapeCache> shapes_;
    std::size_t maxInterests_;
    std::vector<Place> places_;
    std::vector<ObjectId> nodes_;  // per place
    std::vector<std::uint32_t> partOfPlace_;
    std::vector<Part> parts_;
    std::vector<InterestTerms> interests_;
    std::unordered_map<ObjectId, std::vector<std::uint32_t>> placesOfTransform_;
    InteractionTable interactions_;
    std::vector<Relation> relations_;  // groups × groups; firstIsObject seen from the first group
    std::vector<ObjectId> overlaid_;
    std::vector<std::uint32_t> moved_;
    std::uint64_t generation_ = 0;
    std::uint64_t nextVersion_ = 1;
    std::size_t interestsLeftOut_ = 0;
};

/// Whether queries can work with this map: finite, and far enough from flat that it has an inverse.
[[nodiscard]] bool invertible(const Affine3d& m);

}  // namespace tessera

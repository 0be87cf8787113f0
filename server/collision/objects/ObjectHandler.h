/// The object handler: who takes part in collision detection, of interest to whom, and where it is now.
///
/// Follows an aspect through its change lists and keeps what collision needs as data beside the nodes: bodies (what
/// takes part as one), their parts (nodes that bear geometry), world poses, shapes, and what each pair is to each
/// other.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "common/scene/Aspect.h"
#include "server/collision/neighbours/NeighbourFinder.h"
#include "server/collision/objects/Body.h"
#include "server/collision/objects/BodyRules.h"
#include "server/collision/objects/DeformingShapes.h"
#include "server/collision/objects/IdTable.h"
#include "server/collision/objects/Part.h"
#include "server/collision/objects/Place.h"
#include "server/collision/objects/Relation.h"
#include "server/collision/objects/RelationTable.h"
#include "server/collision/objects/ShapeCache.h"
#include "server/collision/objects/VisibleTree.h"

namespace tessera {

struct HandlerLimits {
    std::size_t maxInterests = 4096;  ///< enabled at a time; the first ones in document order count
    /// Of parts that the same interests speak of in the same way. Interests that would make more do not count, nor do
    /// those after them.
    std::size_t maxGroups = 4096;
};

/// Follows an aspect; lays tentative transforms over it. Hidden nodes are not there. Not thread-safe.
///
/// What only moves, deforms or concerns nobody costs as much as it changes. Who takes part, with whom, and the tree
/// itself are found anew, at a cost proportional to the visible nodes, where a list changes them.
class ObjectHandler {
public:
    explicit ObjectHandler(std::shared_ptr<ShapeCache> shapes, HandlerLimits limits = {})
        : shapes_(std::move(shapes)), limits_(limits) {}

    /// After each list applied to the aspect, with that list; null: anything may have changed.
    void update(const Aspect& aspect, const ChangeList* list);
    /// Grows with each time that the tables were made anew: numbers of parts, bodies and places of an earlier
    /// generation mean nothing; node ids and pose versions still do.
    [[nodiscard]] std::uint64_t generation() const { return generation_; }

    [[nodiscard]] std::span<const Place> places() const { return tree_.places; }
    [[nodiscard]] std::span<const Part> parts() const { return parts_; }    ///< in document order
    [[nodiscard]] std::span<const Body> bodies() const { return bodies_; }  ///< by their first part
    [[nodiscard]] std::span<const InterestTerms> interests() const { return interests_; }
    /// The part that a node is, or kNobody.
    [[nodiscard]] std::uint32_t partOf(ObjectId node) const { return partOfNode_.find(node); }
    /// Parts at or below a place: [first, second).
    [[nodiscard]] std::pair<std::uint32_t, std::uint32_t> partsBelow(std::uint32_t place) const {
        return {firstPart_[place], firstPart_[tree_.places[place].end]};
    }
    /// The visible places of a Transform core, ascending.
    [[nodiscard]] std::span<const std::uint32_t> placesOf(ObjectId transform) const;
    /// The free body that a Transform core carries, or kNobody.
    [[nodiscard]] std::uint32_t freeBodyOf(ObjectId transform) const;
    /// Transforms by number, for those who ask much about one: 0 to transformCount() in this generation; kNobody where no
    /// visible place has it. The number `guess` is tried first: wishes come in the order of the scene.
    [[nodiscard]] std::uint32_t transformNumber(ObjectId transform, std::uint32_t guess = 0) const;
    [[nodiscard]] std::size_t transformCount() const { return tree_.transforms.size(); }
    [[nodiscard]] std::span<const std::uint32_t> placesOf(std::uint32_t number) const { return tree_.placesOf(number); }
    [[nodiscard]] std::uint32_t freeBodyOf(std::uint32_t number) const { return carriers_[number].freeBody; }
    [[nodiscard]] bool carriesParts(std::uint32_t number) const { return carriers_[number].parts; }
    [[nodiscard]] std::span<const std::uint32_t> freeBodies() const { return freeBodies_; }  ///< ascending
    /// Another one after each change of who is free, and of a free body's pose, shape or terms.
    [[nodiscard]] std::uint64_t freeBodiesVersion() const { return freeBodiesVersion_; }
    [[nodiscard]] const InteractionTable& interactions() const { return relations_.interactions(); }
    /// Parts of one body are nothing to each other. The list of interests lives until the tables are made anew. Two
    /// groups of parts are asked about for the first time by one thread at a time, and then by any number of threads.
    [[nodiscard]] Relation relation(std::uint32_t a, std::uint32_t b) const;
    /// Enabled interests beyond the limits: not looked at.
    [[nodiscard]] std::size_t interestsLeftOut() const { return interestsLeftOut_; }
    [[nodiscard]] std::size_t partsSkipped() const { return skipped_; }
    /// Of the first Environment in document order.
    [[nodiscard]] const Vec3d& gravity() const { return gravity_; }

    /// Gives a Transform another local value until `dropOverlay` or the next `update`. Where the scene has that very
    /// value by then, nothing has moved.
    void overlay(ObjectId transform, const Affine3d& local);
    void overlay(std::uint32_t number, const Affine3d& local);
    void dropOverlay(const Aspect& aspect);
    /// Parts whose world pose or shape has changed since the last call, ascending; all of them where the tables were
    /// made anew.
    [[nodiscard]] std::vector<std::uint32_t> takeMoved();

    /// What the scene has deformed since the last settling; the shapes are still as before. Ascending by part.
    [[nodiscard]] std::span<const Deformation> deformations() const { return deformations_; }
    void settleDeformations();

private:
    /// What shape a body's geometries have.
    enum class BodyShape : std::uint8_t { kTriangles, kHull, kDeforming };
    struct BodyTerms {
        BodyShape shape = BodyShape::kTriangles;
        double mass = 0;                    ///< of a body that is free unless what is above it speaks against it
        std::uint32_t transform = kNobody;  ///< the Transform's number, where it is the body's alone
    };
    struct Carrier {
        std::uint32_t freeBody = kNobody;
        bool parts = false;  // at or below one of its places
        bool overlaid = false;
        bool touched = false;
    };
    /// Beside indices into interests_, what a visible Interest core can be.
    static constexpr std::uint32_t kDisabled = 0xfffffffeu, kLeftOut = 0xfffffffdu;

    [[nodiscard]] bool changesTables(const ChangeList& list) const;
    void rebuild(const Aspect& aspect, bool jump);
    [[nodiscard]] std::vector<InterestSides> chooseInterests(const Aspect& aspect);
    void chooseParts(const Aspect& aspect, const BodyRules& rules, std::span<const InterestSides> sides);
    void makeBody(const Aspect& aspect, const BodyRules& rules, std::uint32_t place);
    void shapeParts(const Aspect& aspect, bool jump);
    [[nodiscard]] std::shared_ptr<const CollisionShape> shapeOf(const Aspect& aspect, std::uint32_t part, bool jump);
    void listDeformations();

    void applyColumn(const Aspect& aspect, const FieldColumn& column);
    void copyTerms(const CollisionObject& core, std::uint32_t body);
    void touch(ObjectId transform);
    void reloadTouched(const Aspect& aspect);
    void moveTouched();
    void movePlacesBelow(std::uint32_t index);
    void movePart(std::uint32_t part);
    void reshapePart(std::uint32_t part);
    void findFreeBodies();

    std::shared_ptr<ShapeCache> shapes_;
    HandlerLimits limits_;
    std::uint64_t generation_ = 0;
    std::uint64_t nextVersion_ = 1;

    VisibleTree tree_;
    std::vector<std::uint32_t> firstPart_;  // per place and one more: the number of parts before it
    std::vector<bool> aboveCandidate_;      // per place: its pose decides whether some body is free
    std::vector<Carrier> carriers_;         // per Transform of the tree
    std::vector<std::uint32_t> touched_;    // Transforms, by number
    std::vector<std::uint32_t> overlaid_;
    std::vector<std::uint32_t> movedPlaces_;

    std::vector<Part> parts_;
    IdTable partOfNode_;
    std::vector<ObjectId> geometryOfPart_;
    IdTable geometries_;  // those of parts: a number for partsOfGeometry_
    std::vector<std::vector<std::uint32_t>> partsOfGeometry_;
    std::vector<bool> moved_;  // per part
    std::vector<std::uint32_t> movedParts_;
    std::size_t skipped_ = 0;  // parts that are not solid

    std::vector<Body> bodies_;
    std::vector<BodyTerms> bodyTerms_;
    std::vector<std::uint32_t> candidates_;  // bodies that may be free, ascending by place
    bool freedomChanged_ = false;
    std::vector<std::uint32_t> freeBodies_;  // ascending
    std::uint64_t freeBodiesVersion_ = 0;
    IdTable objectNumbers_;  // visible CollisionObject cores
    std::vector<std::vector<std::uint32_t>> bodiesOfObject_;

    std::vector<InterestTerms> interests_;
    IdTable interestNumbers_;  // visible Interest cores: index, kDisabled or kLeftOut
    std::size_t interestsLeftOut_ = 0;
    RelationTable relations_;
    bool termsChanged_ = false;

    DeformingShapes deforming_;
    std::vector<std::uint32_t> deformingParts_;
    std::vector<Deformation> deformations_;
    bool deformed_ = false;
    Vec3d gravity_ = Vec3d::Zero();
};

/// Whether queries can work with this map: finite, and far enough from flat that it has an inverse.
[[nodiscard]] bool invertible(const Affine3d& m);

}  // namespace tessera

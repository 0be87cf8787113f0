/// The object handler: who takes part in collision detection, of interest to whom, and where it is now.
///
/// Follows an aspect through its change lists and keeps what collision needs as data beside the nodes: bodies (what takes
/// part as one), their parts (nodes that bear geometry), world poses, shapes, and what each pair is to each other.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <unordered_map>
#include <vector>

#include "common/scene/Aspect.h"
#include "server/collision/neighbours/NeighbourFinder.h"
#include "server/collision/objects/ShapeCache.h"

namespace tessera {

inline constexpr std::uint32_t kNobody = 0xffffffffu;

/// A geometry-bearing node that takes part in an interest.
struct Part {
    ObjectId node;
    std::uint32_t place = 0;                      ///< index into ObjectHandler::places()
    std::uint32_t body = 0;                       ///< index into ObjectHandler::bodies()
    std::shared_ptr<const CollisionShape> shape;  ///< null: nothing to collide with (absent or malformed)
    Affine3d world = Affine3d::Identity();        ///< world_T_part
    Box worldBox;                                 ///< empty where the part meets nothing
    /// Never the same for two poses or shapes of one part; survives tables made anew where pose and shape stay.
    std::uint64_t poseVersion = 0;

    /// Has triangles, and a pose that does not flatten them.
    [[nodiscard]] bool solid() const { return !worldBox.empty(); }
};

/// What takes part as one: a CollisionObject (or one item of a divided one), an interest's object, or one geometry.
struct Body {
    ObjectId node;                ///< its topmost node
    ObjectId core;                ///< its CollisionObject; none: what an interest or a geometry makes one
    std::uint32_t place = 0;
    std::int64_t kind = CollisionObject::kRigid;
    std::int64_t layers = 1;
    double mass = 0;              ///< above 0: a free body (all conditions of CollisionObject::mass hold)
    double restitution = 0.2;
    double friction = 0.5;
    Vec3d velocity = Vec3d::Zero(), spin = Vec3d::Zero();
    /// Of a free body: the Transform core that carries it. What is above it is rigid but for one uniform scale.
    ObjectId transform;
    std::vector<std::uint32_t> parts;  ///< ascending

    [[nodiscard]] bool free() const { return mass > 0; }
};

/// A visible node, in document order (depth first, children in order).
struct Place {
    static constexpr std::uint32_t kNone = kNobody;

    std::uint32_t parent = kNone;
    std::uint32_t end = 0;  ///< one past the last place below
    ObjectId transform;     ///< the Transform core; none: the parent's frame
    Affine3d local = Affine3d::Identity();
    Affine3d world = Affine3d::Identity();
};

/// An enabled interest as its core says it, in document order. One whose object is gone or hidden has no pairs.
struct InterestTerms {
    ObjectId core;
    std::int64_t response = Interest::kStop;
    std::int64_t mode = Interest::kPseudoDynamic;
    std::int64_t detail = Interest::kAllFaces;
    double threshold = 0;
    std::int64_t show = 0;
    std::int64_t patience = 0;
};

/// What one pair of parts is to each other. Nothing where an ignoring interest speaks of the pair.
struct Relation {
    bool relevant = false;
    bool firstIsObject = true;      ///< the lower-numbered part is on the deciding interest's object side: side A
    std::int64_t response = Interest::kReport;   ///< of the deciding interest: the first in document order
    /// What all its interests ask of it together.
    bool contacts = false, dynamic = false, distance = false;
    std::int64_t detail = Interest::kYesOrNo;    ///< the most demanding
    double threshold = 0;                        ///< the largest
    std::span<const std::uint32_t> interests;    ///< indices into ObjectHandler::interests(), ascending; the first decides
};

/// The vertices of a deforming part are about to be elsewhere.
struct Deformation {
    std::uint32_t part = 0;
    std::vector<Vec3d> end;  ///< one per vertex of the shape's mesh, in the part's frame
};

struct HandlerLimits {
    std::size_t maxInterests = 4096;  ///< enabled at a time; the first ones in document order count
    std::size_t maxGroups = 4096;     ///< of parts that the same interests speak of in the same way; of more, see `leftOut`
};

/// Follows an aspect; lays tentative transforms over it. Hidden nodes are not there. Not thread-safe.
class ObjectHandler {
public:
    explicit ObjectHandler(std::shared_ptr<ShapeCache> shapes, HandlerLimits limits = {})
        : shapes_(std::move(shapes)), limits_(limits) {}

    /// After each list applied to the aspect, with that list; null: anything may have changed.
    void update(const Aspect& aspect, const ChangeList* list);
    /// Grows with each time that the tables were made anew: numbers of parts, bodies and places of an earlier generation
    /// mean nothing; node ids and pose versions still do.
    [[nodiscard]] std::uint64_t generation() const { return generation_; }

    [[nodiscard]] std::span<const Place> places() const { return places_; }
    [[nodiscard]] std::span<const Part> parts() const { return parts_; }    ///< in document order
    [[nodiscard]] std::span<const Body> bodies() const { return bodies_; }  ///< by their first part
    [[nodiscard]] std::span<const InterestTerms> interests() const { return interests_; }
    /// Parts at or below a place: [first, second).
    [[nodiscard]] std::pair<std::uint32_t, std::uint32_t> partsBelow(std::uint32_t place) const;
    /// The visible places of a Transform core, ascending.
    [[nodiscard]] std::span<const std::uint32_t> placesOf(ObjectId transform) const;
    /// The free body that a Transform core carries, or kNobody.
    [[nodiscard]] std::uint32_t freeBodyOf(ObjectId transform) const;
    [[nodiscard]] const InteractionTable& interactions() const { return interactions_; }
    /// Parts of one body are nothing to each other.
    [[nodiscard]] Relation relation(std::uint32_t a, std::uint32_t b) const;
    /// Enabled interests beyond the limits: not looked at.
    [[nodiscard]] std::size_t interestsLeftOut() const { return interestsLeftOut_; }
    [[nodiscard]] std::size_t partsSkipped() const;
    /// Of the first Environment in document order.
    [[nodiscard]] const Vec3d& gravity() const { return gravity_; }

    /// Gives a Transform another local value until `dropOverlay`, or until the scene has that value itself.
    void overlay(ObjectId transform, const Affine3d& local);
    void dropOverlay(const Aspect& aspect);
    /// Parts whose world pose or shape has changed since the last call, ascending.
    [[nodiscard]] std::vector<std::uint32_t> takeMoved();

    /// What the scene has deformed since the last settling; the shapes are still as before.
    [[nodiscard]] std::span<const Deformation> deformations() const { return deformations_; }
    void settleDeformations();

private:
    // (the object handler's author fills this in)
    std::shared_ptr<ShapeCache> shapes_;
    HandlerLimits limits_;
    std::vector<Place> places_;
    std::vector<Part> parts_;
    std::vector<Body> bodies_;
    std::vector<InterestTerms> interests_;
    std::vector<Deformation> deformations_;
    InteractionTable interactions_;
    Vec3d gravity_ = Vec3d::Zero();
    std::uint64_t generation_ = 0;
    std::size_t interestsLeftOut_ = 0;
};

/// Whether queries can work with this map: finite, and far enough from flat that it has an inverse.
[[nodiscard]] bool invertible(const Affine3d& m);

}  // namespace tessera

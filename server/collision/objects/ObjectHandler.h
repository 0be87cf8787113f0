/// The object handler: who takes part in collision detection, of interest to whom, and where it is now.
///
/// Follows an aspect through its change lists and keeps what collision needs as data beside the nodes: bodies (what
/// takes part as one), their parts (nodes that bear geometry), world poses, shapes, and what each pair is to each
/// other.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <unordered_map>
#include <vector>

#include "common/scene/Aspect.h"
#include "server/collision/neighbours/NeighbourFinder.h"
#include "server/collision/objects/Body.h"
#include "server/collision/objects/CollisionObjectTable.h"
#include "server/collision/objects/DeformingShapes.h"
#include "server/collision/objects/IdTable.h"
#include "server/collision/objects/Part.h"
#include "server/collision/objects/Place.h"
#include "server/collision/objects/Relation.h"
#include "server/collision/objects/RelationTable.h"
#include "server/collision/objects/SceneEffects.h"
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
/// A list costs as much as it changes: the nodes that come, go, move or are something else now, and what is below them.
/// Places, parts and bodies have numbers that stay as long as they are there; a number that has become free is given
/// again, so a row may hold numbers that nobody has. Order among them is asked for by `before`.
class ObjectHandler {
public:
    explicit ObjectHandler(std::shared_ptr<ShapeCache> shapes, HandlerLimits limits = {})
        : shapes_(std::move(shapes)), limits_(limits) {}

    /// After each list applied to the aspect, with that list; null: anything may have changed.
    void update(const Aspect& aspect, const ChangeList* list);
    /// Whether `update` with this list would leave anything of poses, shapes, interests, or of who takes part, other
    /// than it is now; poses that the overlay has already are no change.
    [[nodiscard]] bool wouldChange(const Aspect& aspect, const ChangeList& list) const;
    /// Grows with each time that everything was made anew: numbers of an earlier generation mean nothing; node ids and
    /// pose versions still do.
    [[nodiscard]] std::uint64_t generation() const { return generation_; }

    /// Another one after each change of who takes part, and with whom.
    [[nodiscard]] std::uint64_t structure() const { return structure_; }

    // Rows by number; what has no node is free.
    [[nodiscard]] const PagedRow<Place>& places() const { return tree_.places(); }
    [[nodiscard]] std::span<const Part> parts() const { return parts_; }
    [[nodiscard]] std::span<const Body> bodies() const { return bodies_; }
    [[nodiscard]] std::size_t placeCount() const { return tree_.size(); }
    [[nodiscard]] std::size_t partCount() const { return parts_.size() - freeParts_.size(); }
    [[nodiscard]] std::size_t bodyCount() const { return bodies_.size() - freeBodyNumbers_.size(); }
    /// In document order.
    [[nodiscard]] std::span<const InterestTerms> interests() const { return interests_; }
    /// Another one after each change of them.
    [[nodiscard]] std::uint64_t interestsVersion() const { return interestsVersion_; }

    /// Whether one part comes before another in document order.
    [[nodiscard]] bool before(std::uint32_t partA, std::uint32_t partB) const {
        return tree_.order().before(parts_[partA].place, parts_[partB].place);
    }
    /// Grows in document order. Good until the scene changes.
    [[nodiscard]] std::uint64_t rank(std::uint32_t part) const { return tree_.order().rank(parts_[part].place); }
    /// Of two places: whether one is the other or above it.
    [[nodiscard]] bool holds(std::uint32_t above, std::uint32_t place) const {
        return tree_.order().holds(above, place);
    }
    /// Of two places: in document order.
    [[nodiscard]] bool precedes(std::uint32_t placeA, std::uint32_t placeB) const {
        return tree_.order().before(placeA, placeB);
    }
    /// Of a place: ascending in document order, until the scene changes.
    [[nodiscard]] std::uint64_t rankOf(std::uint32_t place) const { return tree_.order().rank(place); }
    [[nodiscard]] std::uint32_t placeOf(ObjectId node) const { return tree_.find(node); }
    /// The part that a node is, or kNobody.
    [[nodiscard]] std::uint32_t partOf(ObjectId node) const {
        const std::uint32_t place = tree_.find(node);
        return place == Place::kNone ? kNobody : standings_[place].part;
    }
    /// Visits the visible places of a Transform core, by its number, in document order: visit(place).
    template <typename Visit>
    void forPlacesOf(std::uint32_t number, const Visit& visit) const {
        tree_.forBearers(number, visit);
    }
    /// The same by its id, listed.
    [[nodiscard]] std::vector<std::uint32_t> placesOf(ObjectId transform) const;
    /// The one visible node that has a core, of whatever kind; none: none has it, or several have.
    [[nodiscard]] ObjectId bearerOf(ObjectId core) const;
    /// Visits the parts at or below all places of a Transform, by number: visit(part, place). A part that is below two
    /// of them is visited for each, the nearer one last.
    template <typename Visit>
    void forPartsCarried(std::uint32_t number, const Visit& visit) const {
        forPlacesOf(number, [&](std::uint32_t place) {
            tree_.walk(place, [&](std::uint32_t at) {
                if (at != place && tree_.at(at).absolute) return false;  // it stands in the world
                if (standings_[at].part != kNobody) visit(standings_[at].part, place);
                return tree_.at(at).parts > 0;
            });
        });
    }
    /// Transforms by number, for those who ask much about one; kNobody where no visible place has it. Numbers are below
    /// transformNumbers(). The number `guess` is tried first: wishes come in the order of the scene.
    [[nodiscard]] std::uint32_t transformNumber(ObjectId transform, std::uint32_t guess = 0) const;
    [[nodiscard]] std::size_t transformNumbers() const { return tree_.bearers().size(); }
    [[nodiscard]] ObjectId transformAt(std::uint32_t number) const { return tree_.bearers()[number].core; }
    [[nodiscard]] bool carriesParts(std::uint32_t number) const;
    /// The free body that a Transform core carries, or kNobody.
    [[nodiscard]] std::uint32_t freeBodyOf(ObjectId transform) const;
    [[nodiscard]] std::uint32_t freeBodyOf(std::uint32_t number) const;
    [[nodiscard]] std::span<const std::uint32_t> freeBodies() const { return freeBodies_; }  ///< in any order
    /// Numbers of bodies that are free now, or no longer, and of free ones that have another pose, shape or terms,
    /// since the last call, ascending; nothing where everything was made anew.
    [[nodiscard]] std::vector<std::uint32_t> takeFreeChanged();

    /// The first interest (an index) that wants to know what of a part runs into itself, or kNobody.
    [[nodiscard]] std::uint32_t selfInterestOf(std::uint32_t part) const;
    /// The parts that one asks so about, in any order.
    [[nodiscard]] std::vector<std::uint32_t> partsWithSelfInterest() const;

    [[nodiscard]] const InteractionTable& interactions() const { return relations_.interactions(); }
    [[nodiscard]] const RelationTable& relations() const { return relations_; }
    /// Parts of one body are nothing to each other. The list of interests lives until the next update. Two groups of
    /// parts are asked about for the first time by one thread at a time, and then by any number of threads.
    [[nodiscard]] Relation relation(std::uint32_t a, std::uint32_t b) const;
    /// Enabled interests beyond the limits: not looked at.
    [[nodiscard]] std::size_t interestsLeftOut() const { return interestsLeftOut_; }
    [[nodiscard]] std::size_t partsSkipped() const { return skipped_; }
    /// How near to each other two parts may be when a motion stops: what their objects say, the smaller one; where
    /// neither does, `relative` sizes. World units.
    [[nodiscard]] double toleranceOf(std::uint32_t a, std::uint32_t b, double size, double relative) const;
    /// Parts whose geometry is not, or cannot be, what their object asks for, by number.
    [[nodiscard]] const std::set<std::uint32_t>& standIns() const { return standIns_; }
    /// Of a stand-in, in words: a shape, or "level" and a number.
    [[nodiscard]] std::string_view askedShape(std::uint32_t part) const;
    /// Of the first Environment in document order.
    [[nodiscard]] const Vec3d& gravity() const { return gravity_; }

    /// Gives a Transform another local value until `dropOverlay` or the next `update`. Where the scene has that very
    /// value by then, nothing has moved.
    void overlay(ObjectId transform, const Affine3d& local);
    void overlay(std::uint32_t number, const Affine3d& local);
    void dropOverlay(const Aspect& aspect);
    /// Parts whose world pose or shape has changed since the last call, ascending; all of them where everything was
    /// made anew.
    [[nodiscard]] std::vector<std::uint32_t> takeMoved();
    /// Whether nothing of that, nor of the next two, waits to be told.
    [[nodiscard]] bool nothingNew() const {
        return movedParts_.empty() && regroupedParts_.empty() && rewordedParts_.empty();
    }
    /// Numbers of parts that came, went, or are of another body or group since the last call, ascending; nothing where
    /// everything was made anew.
    [[nodiscard]] std::vector<std::uint32_t> takeRegrouped();
    /// Parts of interests that ask something else of their pairs, and parts that stand elsewhere in document order,
    /// since the last call, ascending.
    [[nodiscard]] std::vector<std::uint32_t> takeReworded();
    /// Places of drawables that came, went, moved or look different since the last call, in any order. Only after the
    /// first call; null: all of them.
    [[nodiscard]] std::optional<std::vector<std::uint32_t>> takeDrawn();

    /// What the scene has deformed since the last settling; the shapes are still as before. Ascending by part.
    [[nodiscard]] std::span<const PartDeformation> deformations() const { return deformations_; }
    void settleDeformations();

    /// How much was looked at in all updates and overlays so far.
    struct Work {
        std::uint64_t places = 0, parts = 0, groups = 0, anew = 0;
    };
    [[nodiscard]] const Work& work() const { return work_; }

private:
    /// What shape a body's geometries have.
    struct BodyShape {
        ShapeChoice choice;
        bool deforms = false;
        bool operator==(const BodyShape&) const = default;
    };
    struct BodyTerms {
        BodyShape shape;
        double mass = 0;         ///< of a body that is free unless what is above it speaks against it
        bool candidate = false;  ///< it may be free: its Transform is its alone
        bool touched = false;    ///< to be looked at again at the end of an update
        std::uint32_t object = kNobody, inObject = 0;  ///< its CollisionObject, and where it stands among its bodies
        std::uint32_t solids = 0;                      ///< parts that are
        std::uint32_t inFree = kNobody;                ///< where it stands among those that are free
        bool freeChanged = false;                      ///< listed
        struct Share {
            std::uint32_t group = 0, parts = 0;
        };
        std::vector<Share> shares;  ///< parts by group
    };
    struct PartTerms {
        ObjectId geometry;
        BodyShape shape;
        std::uint32_t inBody = 0;                                 ///< where it stands among its body's parts
        bool moved = false, regrouped = false, reworded = false;  ///< listed
    };
    /// What a place is to collisions. What is below a place inherits what it has not of its own.
    struct Standing {
        std::uint32_t named = kNobody;              ///< the CollisionObject that names this node
        std::uint32_t wasNamed = kNobody;           ///< when inheritance was last looked at
        std::uint32_t object = kNobody;             ///< the one that it belongs to: the nearest named place's
        std::uint32_t top = kNobody;                ///< of what belongs to one: the topmost place of its item
        std::uint32_t made = kNobody;               ///< the nearest place that an interest made an object
        std::uint32_t side = kNobody;               ///< the nearest place where a side of an interest begins
        std::uint32_t group = kNobody, member = 0;  ///< of a drawable
        std::uint32_t part = kNobody;
        std::uint32_t body = kNobody;  ///< the body whose topmost place it is
        bool makes = false, begins = false;
        bool isTop = false;         ///< of an object or an item of one
        bool drawn = false;         ///< listed
        std::uint64_t changed = 0;  ///< in which update its inheritance did
        std::uint64_t newHere = 0;  ///< in which update it was placed
    };
    /// Beside indices into interests_, what a visible Interest core can be.
    static constexpr std::uint32_t kDisabled = 0xfffffffeu, kLeftOut = 0xfffffffdu;

    // ObjectHandler.cpp: following the scene
    void begin(const Aspect& aspect, bool jump);
    void seeAll(const Aspect& aspect);
    void settleStructure(const Aspect& aspect);
    [[nodiscard]] bool beyondLimits() const;
    void applyTerms(const Aspect& aspect, const SceneEffects& effects);
    void findGravity(const Aspect& aspect);
    void endUpdate();

    // ObjectHandlerInheritance.cpp: what belongs to whom
    void removeGone();
    void welcomePlaced();
    void welcomeBelow(std::uint32_t top);
    [[nodiscard]] std::vector<std::uint32_t> heirs();
    void inheritObjects();
    [[nodiscard]] std::vector<InterestSides> findInterests(const Aspect& aspect);
    void inheritSides();
    [[nodiscard]] std::uint32_t sideAbove(std::uint32_t place) const;
    void settle(std::uint32_t place);
    void leaveGroup(std::uint32_t place);

    // ObjectHandlerParts.cpp: parts and bodies
    void addPart(std::uint32_t place);
    void removePart(std::uint32_t part);
    void assign(std::uint32_t part, std::uint32_t group, std::uint32_t top);
    void joinBody(std::uint32_t part, std::uint32_t group, std::uint32_t body);
    void leaveBody(std::uint32_t part);
    void share(std::uint32_t body, std::uint32_t group, bool comes);
    [[nodiscard]] std::uint32_t makeBody(std::uint32_t place);
    void touchBody(std::uint32_t body);
    void settleBodies(const Aspect& aspect);
    void settleBody(const Aspect& aspect, std::uint32_t body);
    void removeBody(std::uint32_t body);
    void setObject(std::uint32_t body, std::uint32_t object);
    void copyTerms(const CollisionObject& core, std::uint32_t body);
    void shapeParts(const Aspect& aspect, bool jump);
    [[nodiscard]] DeformingShapes::Key deformingKey(std::uint32_t part) const {
        return {partTerms_[part].geometry, partTerms_[part].shape.choice};
    }
    [[nodiscard]] std::shared_ptr<const CollisionShape> shapeOf(const Aspect& aspect, std::uint32_t part, bool jump);
    void reshapePart(std::uint32_t part);
    void noteStandIn(std::uint32_t part, const CollisionShape* shape);
    void setBox(std::uint32_t part, const Box& box);
    void noteMoved(std::uint32_t part);
    void noteRegrouped(std::uint32_t part);
    void noteReworded(std::uint32_t part);
    void noteReworded(std::span<const InterestTerms> before);
    void noteDrawn(std::uint32_t place);
    void noteFree(std::uint32_t body);
    void listFree(std::uint32_t body, bool free);
    void listDeformations();
    void askBelow(std::uint32_t place);
    void findFreeBodies();
    [[nodiscard]] bool mayBeFree(const Body& body, const BodyTerms& terms) const;

    // ObjectHandlerPoses.cpp
    void reloadOverlaid(const Aspect& aspect);
    void reload(const Aspect& aspect, ObjectId transform);
    [[nodiscard]] bool standsElsewhere(const Aspect& aspect, ObjectId transform) const;
    void moveTouched();
    void movePlacesBelow(std::uint32_t top);
    void movePart(std::uint32_t part);

    std::shared_ptr<ShapeCache> shapes_;
    HandlerLimits limits_;
    std::uint64_t generation_ = 0, update_ = 0, structure_ = 0;
    std::uint64_t nextVersion_ = 1;
    Work work_;

    VisibleTree tree_;
    PagedRow<Standing> standings_;  // per place
    CollisionObjectTable objects_;
    std::vector<ObjectId> overlaid_;  // Transforms
    std::vector<std::uint32_t> movedPlaces_;

    // Of one update.
    std::vector<std::uint32_t> inheriting_;  // places from which on inheritance is looked at again
    std::vector<std::uint32_t> unsettled_;   // places of drawables that may belong elsewhere
    std::vector<std::uint32_t> touchedBodies_, touchedParts_, candidates_;
    bool interestsDirty_ = false, deformingDirty_ = false;

    std::vector<Part> parts_;
    std::vector<PartTerms> partTerms_;
    std::vector<std::uint32_t> freeParts_, partsGone_;
    struct Remembered {
        std::shared_ptr<const CollisionShape> shape;
        Affine3d world;
        Box worldBox;
        std::uint64_t poseVersion;
    };
    std::unordered_map<ObjectId, Remembered> remembered_;  // of parts, while everything is made anew
    std::vector<std::uint32_t> movedParts_, regroupedParts_, rewordedParts_;
    std::vector<std::uint32_t> drawn_;
    bool drawnAsked_ = false, drawnAll_ = true;
    std::size_t skipped_ = 0;  // parts that are not solid
    std::set<std::uint32_t> standIns_;

    std::vector<Body> bodies_;
    std::vector<BodyTerms> bodyTerms_;
    std::vector<std::uint32_t> freeBodyNumbers_;
    std::vector<std::uint32_t> freeBodies_, freeChanged_;

    std::vector<InterestTerms> interests_;
    std::uint64_t interestsVersion_ = 0;
    IdTable interestNumbers_;            // visible Interest cores: index, kDisabled or kLeftOut
    IdTable interestNodes_;              // nodes that enabled interests name
    std::vector<std::uint32_t> marked_;  // places where a side begins
    std::size_t interestsLeftOut_ = 0, interestCap_ = 0;
    RelationTable relations_;

    DeformingShapes deforming_;
    std::vector<std::uint32_t> deformingParts_;
    std::vector<PartDeformation> deformations_;
    Vec3d gravity_ = Vec3d::Zero();
};

}  // namespace tessera

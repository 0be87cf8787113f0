/// The pairwise stage: the five questions that two shapes are asked, answered by the entry of a table for what the two
/// are looked at as.
///
/// A new representation is a new row and a new column; a pair without an entry does not compile. What nothing that the
/// two are looked at as answers better is answered by the trees of their triangles, and `byTrees` says which questions
/// these are.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "server/collision/convex/ConvexQuery.h"
#include "server/collision/pairwise/CollisionShape.h"
#include "server/collision/query/DistanceQuery.h"
#include "server/collision/query/TimeOfImpact.h"
#include "server/collision/query/TouchFront.h"

namespace tessera {

class Workers;

/// world_T_shape, where it stands. Both outlive what they are handed to.
struct PlacedShape {
    const CollisionShape& shape;
    const Affine3d& world;
};

/// In place of a face: a solid as a whole.
inline constexpr std::uint32_t kWhole = 0xffffffffu;

/// What the last queries about a pair found, to look there first. They change no answer.
struct PairHints {
    TouchFront front;
    ConvexCache hulls;
    std::optional<FacePair> nearest;
};

/// With what a question is asked.
struct PairEffort {
    QueryWork& work;
    PairHints* hints = nullptr;
    Workers* workers = nullptr;  ///< null: the calling thread alone
    // Of trees of k-DOPs; neither changes an answer (TouchOptions).
    Realignment realignment = Realignment::kThreePlanes;
    PlacedVolumes* placed = nullptr;
};

/// A place on a smooth surface, by its own faces and parameters (FreeformShape: ptex faces; surfaces and their knots).
struct PatchPlace {
    std::uint32_t face = kWhole;  ///< kWhole: the shape is none
    Vec2d uv = Vec2d::Zero();
};

/// Where two shapes meet, of what knows better than the faces that are named.
struct MeetingPlace {
    Vec3d point = Vec3d::Zero();
    Vec3d normal = Vec3d::UnitX();  ///< of unit length, from A to B
    PatchPlace onA, onB;
};

struct PairTouch {
    Touch touch = Touch::kNo;  ///< kUnknown: the work was exhausted before anything was found
    bool complete = true;      ///< false: the work was exhausted, there may be more
    /// Pairs of faces that meet; 1 where solids meet as wholes: two hulls, or a hull and what is within it.
    std::uint64_t count = 0;
    std::vector<FacePair> faces;  ///< ascending, the first of them; none where solids meet as wholes
    std::vector<MeetingPlace> places =
        {};  ///< of smooth surfaces one for each of `faces`; in A's frame, from touchOf and contactsOf in the world
};

struct PairDepth {
    /// By so much B would have to go along `normal`, at least, to be free (Penetration.h says what that is of surfaces:
    /// the deepest of their regions; of hulls it is the least way at all). Nothing where that cannot be told: a surface
    /// without an inside, exhausted work. 0 where they are apart. World units.
    std::optional<double> depth;
    Vec3d normal = Vec3d::Zero();  ///< of unit length, world, from A to B
    Vec3d point = Vec3d::Zero();   ///< world, in the middle of what both share
    /// Of approximations: the truth is within this of `depth`, world units. Then the point is the deepest, or nearly.
    double error = 0;
};

// The five questions, as every entry of the table answers them.

/// Touching counts, and solids are full: a hull touches what is inside it. Decided on A's vertices and B's mapped to
/// A's frame. At most one pair of faces is named.
using TouchMethod = PairTouch(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b,
                              const PairEffort& effort);
/// The same with all pairs of faces, the first `most` of which are named.
using ContactsMethod = PairTouch(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b,
                                 std::size_t most, const PairEffort& effort);
/// As distanceBetween: lengths and points in A's frame. Of solids that meet as wholes 0.
using DistanceMethod = Distance(const CollisionShape& a, const CollisionShape& b, const Affine3d& a_T_b,
                                QueryWork& work, const DistanceOptions& options);
/// As timeOfImpact. Hulls by their surfaces; beside points they are solid.
using FirstContactMethod = Impact(const CollisionShape& a, const BodyMotion& motionA, const CollisionShape& b,
                                  const BodyMotion& motionB, QueryWork& work, const ImpactOptions& options);
using DepthMethod = PairDepth(const PlacedShape& a, const PlacedShape& b, QueryWork& work);

/// Some of the five questions.
enum Questions : std::uint8_t {
    kNoQuestion = 0,
    kTouchQuestion = 1,
    kContactsQuestion = 2,
    kDistanceQuestion = 4,
    kFirstContactQuestion = 8,
    kDepthQuestion = 16,
    kEveryQuestion = 31,
};
[[nodiscard]] constexpr Questions operator|(Questions a, Questions b) {
    return static_cast<Questions>(static_cast<unsigned>(a) | static_cast<unsigned>(b));
}

/// All in double; every yes and no by the exact predicates, of what the shapes are looked at as. Thread-safe.
struct PairMethods {
    std::string_view name;
    TouchMethod* touch = nullptr;
    ContactsMethod* contacts = nullptr;
    DistanceMethod* distance = nullptr;
    FirstContactMethod* firstContact = nullptr;
    DepthMethod* depth = nullptr;
    /// Answered by trees of the two's triangles, although they are not both looked at as these.
    Questions byTrees = kNoQuestion;
    /// These answers are wrong by at most what they say (Distance::error, PairDepth::error). All others are exact
    /// (lengths to rounding) of what the shapes are looked at as; points: PointPairs.h; covers of surfaces: coverError.
    Questions approximate = kNoQuestion;
};

[[nodiscard]] const PairMethods& pairMethods(Representation a, Representation b);
[[nodiscard]] inline const PairMethods& pairMethods(const CollisionShape& a, const CollisionShape& b) {
    return pairMethods(a.representation(), b.representation());
}
/// Exact answers about surfaces: hulls by their faces, not as solids; distance fields and smooth surfaces by their
/// triangles.
[[nodiscard]] const PairMethods& surfaceMethods(const CollisionShape& a, const CollisionShape& b);

[[nodiscard]] std::string_view nameOf(Representation representation);

/// How far what is told of two may be from the surfaces that they cover, world units: what is farther apart is not told
/// to touch, and distances are too small by at most this, never too large. Nothing bounds the depth. 0: neither is a
/// cover.
[[nodiscard]] double coverError(const PlacedShape& a, const PlacedShape& b);

/// What is told to touch is no farther apart than this, world units: coverError, or the tolerance of smooth surfaces.
/// 0: it meets.
[[nodiscard]] double touchError(const PlacedShape& a, const PlacedShape& b);

// The questions as the pipeline and the responses ask them: of shapes in the world. The frame of the predicates is that
// of points, else of the one with more faces, so that no answer depends on who is called A.

[[nodiscard]] PairTouch touchOf(const PlacedShape& a, const PlacedShape& b, const PairEffort& effort);
[[nodiscard]] PairTouch contactsOf(const PlacedShape& a, const PlacedShape& b, std::size_t most,
                                   const PairEffort& effort);
[[nodiscard]] inline PairDepth depthOf(const PlacedShape& a, const PlacedShape& b, QueryWork& work) {
    return pairMethods(a.shape, b.shape).depth(a, b, work);
}
/// As touchOf, but smooth surfaces by their triangles.
[[nodiscard]] Touch drawnTouching(const PlacedShape& a, const PlacedShape& b, QueryWork& work);
/// Do the surfaces meet? Hulls by their faces.
[[nodiscard]] Touch surfacesTouching(const PlacedShape& a, const PlacedShape& b, QueryWork& work);
/// All pairs of faces that meet, ascending.
[[nodiscard]] FacePairs surfaceFacesTouching(const PlacedShape& a, const PlacedShape& b, QueryWork& work);

/// Faces of a shape whose boxes overlap a box, in its frame, as FacesNear.h. False: the work was exhausted.
[[nodiscard]] bool facesNear(const CollisionShape& shape, const Box& box, QueryWork& work,
                             std::vector<std::uint32_t>& faces);

/// How far two are apart in the world, whatever maps take them there.
struct WorldDistance {
    double distance = 0;
    FacePair faces;
    Vec3d pointA = Vec3d::Zero(), pointB = Vec3d::Zero();
    bool farther = false;  ///< nothing is nearer than the bound
    bool complete = true;
    double error = 0;  ///< of approximations; as Distance::error
};
[[nodiscard]] WorldDistance distanceInWorld(const PlacedShape& a, const PlacedShape& b, const DistanceOptions& options,
                                            QueryWork& work);

}  // namespace tessera

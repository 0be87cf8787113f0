/// What applications are told of collisions, as plain values. World coordinates and units; normals point from A to B.
///
/// Interests and transforms are named by their cores, everything else by its node.
#pragma once

#include <cstdint>
#include <vector>

#include "common/change/Value.h"
#include "common/math/Pose.h"
#include "common/math/Types.h"

namespace tessera {

/// One touching pair of faces.
struct ContactValue {
    static constexpr std::uint32_t kNoFace = 0xffffffffu;  ///< of a convex hull: no triangle of the mesh
    static constexpr double kNoDepth = -1;

    ObjectId objectA, objectB;  ///< the nodes that bear the geometry
    std::uint32_t faceA = 0, faceB = 0;
    Vec3d point = Vec3d::Zero();
    Vec3d normal = Vec3d::UnitY();
    /// How deep the two are in each other along the normal; kNoDepth: not known (a surface without an inside, faces that
    /// only touch).
    double depth = kNoDepth;
    /// Where on the faces: corner 0 + u · (corner 1 - corner 0) + v · (corner 2 - corner 0).
    Vec2d uvA = Vec2d::Zero(), uvB = Vec2d::Zero();
    /// Of a body that is looked at as the smooth surface that it is: the surface's own face (of a subdivision surface its ptex face,
    /// u and v from 0 to 1; of a NurbsSurface 0, and the parameters of its knots). kNoFace: looked at as something else.
    std::uint32_t patchA = kNoFace, patchB = kNoFace;
    Vec2d patchUvA = Vec2d::Zero(), patchUvB = Vec2d::Zero();
    double error = 0;   ///< the point may be off by so much; 0: exact to rounding
    ObjectId interest;  ///< the one that decides about the pair; none: not known
    double time = 1;    ///< when in the frame's motion, 0 to 1; less than 1 for what stopped a motion on its way
};

enum class TouchPhase : std::uint8_t { kBegan, kStays, kEnded };

/// Two objects of an interest touch, or have just ceased to.
struct PairEventValue {
    ObjectId interest, objectA, objectB;  ///< the objects' topmost nodes
    TouchPhase phase = TouchPhase::kBegan;
    double firstTime = 1;  ///< of a dynamic interest: when they first touched within this frame's motion, 0 to 1
    Vec3d point = Vec3d::Zero(), normal = Vec3d::Zero();  ///< of a dynamic interest, of a contact that began: where
    bool through = false;  ///< touched on the way and apart again at its end; the phase is kEnded
};

/// How far apart two objects are that are nearer than the threshold of their interest; kEnded: they no longer are, and
/// the numbers are those of the last time.
struct PairDistanceValue {
    ObjectId interest, objectA, objectB;
    TouchPhase phase = TouchPhase::kBegan;
    double distance = 0;    ///< 0: they touch
    ObjectId nodeA, nodeB;  ///< that bear the nearest faces
    std::uint32_t faceA = 0, faceB = 0;
    Vec3d pointA = Vec3d::Zero(), pointB = Vec3d::Zero();
    double error = 0;  ///< the truth is within this of `distance`; 0: exact to rounding
};

/// A motion was stopped by an interest that asks: what shall become of it? Whoever answers first decides
/// (request::AnswerQuestion); after the interest's patience it stays stopped.
struct QuestionValue {
    std::uint64_t id = 0;
    ObjectId interest, objectA, objectB;
    ObjectId transform;    ///< that wanted to move
    Pose present, wanted;  ///< its values: where it stopped, where it wanted to be
    Vec3d point = Vec3d::Zero(), normal = Vec3d::Zero();
};

namespace answer {

/// All that touched in a frame, as far as the server lists it.
struct Contacts {
    FrameNumber frame;
    std::uint64_t begun = 0;  ///< pairs of objects that came to touch, over the run
    std::vector<ContactValue> contacts;
    std::uint64_t leftOut = 0;      ///< found in this frame, but more than are listed
    std::uint64_t notLookedAt = 0;  ///< pairs and motions of this frame left undecided because a limit was reached
};
struct PairEvents {
    FrameNumber frame;
    std::vector<PairEventValue> events;
    std::uint64_t leftOut = 0;  ///< events of this frame beyond what is listed; those of pairs that go on touching are the first to go
};
struct Distances {
    FrameNumber frame;
    std::vector<PairDistanceValue> distances;
    std::uint64_t leftOut = 0;
};
struct Questions {
    FrameNumber frame;
    std::vector<QuestionValue> questions;  ///< new ones in a notice, all that are open in an answer; ids ascending
    std::vector<std::uint64_t> closed;     ///< in a notice: no longer open, answered or not; ascending
    std::uint64_t unanswered = 0;          ///< of this frame: closed because nobody answered in time
};

}  // namespace answer

}  // namespace tessera

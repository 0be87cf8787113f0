/// What applications ask, and are told, of collisions. World coordinates and units; normals point from A to B.
///
/// Interests and transforms are named by their cores, everything else by its node.
#pragma once

#include "common/request/EditRequests.h"

namespace tessera {

/// One touching pair of faces.
struct ContactValue {
    static constexpr std::uint32_t kNoFace = 0xffffffffu;  ///< of a convex hull: no triangle of the mesh
    static constexpr double kNoDepth = -1;

    ObjectId objectA, objectB;  ///< the nodes that bear the geometry
    std::uint32_t faceA = 0, faceB = 0;
    Vec3d point = Vec3d::Zero();
    Vec3d normal = Vec3d::UnitY();
    /// How deep the two are in each other along the normal; kNoDepth: not known (a surface without an inside, faces
    /// that only touch).
    double depth = kNoDepth;
    /// Where on the faces: corner 0 + u · (corner 1 - corner 0) + v · (corner 2 - corner 0).
    Vec2d uvA = Vec2d::Zero(), uvB = Vec2d::Zero();
    /// Of a body that is looked at as the smooth surface that it is: the surface's own face (of a subdivision surface
    /// its ptex face, u and v from 0 to 1; of a NurbsSurface 0, and the parameters of its knots). kNoFace: looked at as
    /// something else.
    std::uint32_t patchA = kNoFace, patchB = kNoFace;
    Vec2d patchUvA = Vec2d::Zero(), patchUvB = Vec2d::Zero();
    double error = 0;   ///< the point may be off by so much; 0: exact to rounding
    ObjectId interest;  ///< the one that decides about the pair; none: not known
    double time = 1;    ///< when in the frame's motion, 0 to 1; less than 1 for what stopped a motion on its way

    static constexpr std::string_view kName = "Contact";
    static constexpr void members(auto&& take) {
        take(member<&ContactValue::objectA>("object_a").said("the nodes that bear the geometry"),
             member<&ContactValue::objectB>("object_b"),
             member<&ContactValue::faceA>("face_a").said("4294967295: of a hull, no triangle of the mesh"),
             member<&ContactValue::faceB>("face_b"), member<&ContactValue::point>("point").in("world units"),
             member<&ContactValue::normal>("normal").said("from A to B"),
             member<&ContactValue::depth>("depth")
                 .in("world units")
                 .atLeast(0)
                 .orExactly(kNoDepth)
                 .said("along the normal; -1: not known"),
             member<&ContactValue::error>("error").in("world units").atLeast(0).said("the point may be off by so much"),
             member<&ContactValue::uvA>("uv_a").between(0, 1).said(
                 "where on the faces, towards their second and third corners"),
             member<&ContactValue::uvB>("uv_b").between(0, 1),
             member<&ContactValue::interest>("interest").said("that decides about the pair; 0: not known"),
             member<&ContactValue::time>("time").in("of the frame").between(0, 1).said("when in its motion"),
             member<&ContactValue::patchA>("patch_a").said("of a smooth surface its own face; 4294967295: it is none"),
             member<&ContactValue::patchB>("patch_b"),
             member<&ContactValue::patchUvA>("patch_uv_a").said("where on that"),
             member<&ContactValue::patchUvB>("patch_uv_b"));
    }
};

enum class TouchPhase : std::uint8_t { kBegan, kStays, kEnded };
template <>
struct WordsOf<TouchPhase> {
    static constexpr std::array<std::string_view, 3> kWords{"began", "stays", "ended"};
};

/// Two objects of an interest touch, or have just ceased to.
struct PairEventValue {
    ObjectId interest, objectA, objectB;  ///< the objects' topmost nodes
    TouchPhase phase = TouchPhase::kBegan;
    double firstTime = 1;  ///< of a dynamic interest: when they first touched within this frame's motion, 0 to 1
    Vec3d point = Vec3d::Zero(), normal = Vec3d::Zero();  ///< of a dynamic interest, of a contact that began: where
    bool through = false;  ///< touched on the way and apart again at its end; the phase is kEnded

    static constexpr std::string_view kName = "PairEvent";
    static constexpr void members(auto&& take) {
        take(member<&PairEventValue::interest>("interest"),
             member<&PairEventValue::objectA>("object_a").said("the objects' topmost nodes"),
             member<&PairEventValue::objectB>("object_b"), member<&PairEventValue::phase>("phase"),
             member<&PairEventValue::through>("through").said("touched on the way, and apart again at its end"),
             member<&PairEventValue::firstTime>("first_time")
                 .in("of the frame")
                 .between(0, 1)
                 .said("of a dynamic interest: when they first touched"),
             member<&PairEventValue::point>("point")
                 .in("world units")
                 .said("of a dynamic interest, of a contact that began"),
             member<&PairEventValue::normal>("normal"));
    }
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

    static constexpr std::string_view kName = "PairDistance";
    static constexpr void members(auto&& take) {
        take(member<&PairDistanceValue::interest>("interest"), member<&PairDistanceValue::objectA>("object_a"),
             member<&PairDistanceValue::objectB>("object_b"),
             member<&PairDistanceValue::nodeA>("node_a").said("that bear the nearest faces"),
             member<&PairDistanceValue::nodeB>("node_b"), member<&PairDistanceValue::faceA>("face_a"),
             member<&PairDistanceValue::faceB>("face_b"), member<&PairDistanceValue::phase>("phase"),
             reservedMember<PairDistanceValue, 4>(),
             member<&PairDistanceValue::distance>("distance").in("world units").atLeast(0).said("0: they touch"),
             member<&PairDistanceValue::error>("error").in("world units").atLeast(0).said("the truth is within it"),
             member<&PairDistanceValue::pointA>("point_a").in("world units"),
             member<&PairDistanceValue::pointB>("point_b").in("world units"));
    }
};

/// A motion was stopped by an interest that asks: what shall become of it? Whoever answers first decides
/// (QuestionReply); after the interest's patience it stays stopped.
struct QuestionValue {
    std::uint64_t id = 0;
    ObjectId interest, objectA, objectB;
    ObjectId transform;    ///< that wanted to move
    Pose present, wanted;  ///< its values: where it stopped, where it wanted to be
    Vec3d point = Vec3d::Zero(), normal = Vec3d::Zero();

    static constexpr std::string_view kName = "Question";
    static constexpr void members(auto&& take) {
        take(member<&QuestionValue::id>("id"), member<&QuestionValue::interest>("interest"),
             member<&QuestionValue::objectA>("object_a"), member<&QuestionValue::objectB>("object_b"),
             member<&QuestionValue::transform>("transform").said("that wanted to move"),
             member<&QuestionValue::present>("present").said("where it stopped"),
             member<&QuestionValue::wanted>("wanted").said("where it wanted to be"),
             member<&QuestionValue::point>("point").in("world units"), member<&QuestionValue::normal>("normal"));
    }
};

/// An answer to a question that is open; the first one counts, whoever gives it.
struct QuestionReply {
    enum class Decision : std::uint8_t {
        kStop,  ///< it stays where it was stopped
        kPass,  ///< it goes where it wanted to be
        kMove,  ///< it goes to `pose` instead
    };
    std::uint64_t question = 0;
    Decision decision = Decision::kStop;
    Pose pose = {};  ///< with kMove: value of the question's transform; no zero in its scale

    static constexpr std::string_view kName = "QuestionReply";
    static constexpr void members(auto&& take) {
        take(member<&QuestionReply::question>(1, "question").said("its id"),
             member<&QuestionReply::decision>(2, "decision"),
             spreadMember<&QuestionReply::pose>(3).onlyWhen(
                 [](const QuestionReply& reply) { return reply.decision == Decision::kMove; }, "with decision move"));
    }
    [[nodiscard]] std::optional<std::string> fault() const {
        if (decision != Decision::kMove || (pose.scale.array() != 0).all()) return std::nullopt;
        return "a scale of zero";
    }
};
template <>
struct WordsOf<QuestionReply::Decision> {
    static constexpr std::array<std::string_view, 3> kWords{"stop", "pass", "move"};
};

namespace answer {

/// All that touched in a frame, as far as the server lists it.
struct Contacts {
    FrameNumber frame;
    std::uint64_t begun = 0;  ///< pairs of objects that came to touch, over the run
    std::vector<ContactValue> contacts;
    std::uint64_t leftOut = 0;      ///< found in this frame, but more than are listed
    std::uint64_t notLookedAt = 0;  ///< pairs and motions of this frame left undecided because a limit was reached

    static constexpr ToldInfo kInfo{.name = "Contacts", .answer = 6, .notice = 2, .help = "What touches in a frame"};
    static constexpr void members(auto&& take) {
        take(member<&Contacts::frame>(1, "frame"),
             member<&Contacts::begun>(2, "begun").said("pairs of objects that came to touch, over the run"),
             member<&Contacts::leftOut>(3, "left_out").said("found, but more than are listed"),
             member<&Contacts::notLookedAt>(4, "not_looked_at").said("left undecided because a limit was reached"),
             partMember<&Contacts::contacts>("contacts")
                 .atMost(&ApplicationLimits::maxContacts)
                 .ofBytes(&ApplicationLimits::maxCollisionBytes));
    }
};
struct PairEvents {
    FrameNumber frame;
    std::vector<PairEventValue> events;
    std::uint64_t leftOut =
        0;  ///< events of this frame beyond what is listed; those of pairs that go on touching are the first to go

    static constexpr ToldInfo kInfo{
        .name = "PairEvents", .answer = 8, .notice = 4, .help = "Which objects begin or cease to touch in a frame"};
    static constexpr void members(auto&& take) {
        take(member<&PairEvents::frame>(1, "frame"),
             member<&PairEvents::leftOut>(2, "left_out").said("found, but more than are listed"),
             partMember<&PairEvents::events>("events")
                 .atMost(&ApplicationLimits::maxEvents)
                 .ofBytes(&ApplicationLimits::maxCollisionBytes));
    }
};
struct Distances {
    FrameNumber frame;
    std::vector<PairDistanceValue> distances;
    std::uint64_t leftOut = 0;

    static constexpr ToldInfo kInfo{
        .name = "Distances", .answer = 9, .notice = 5, .help = "How far apart objects are that are near each other"};
    static constexpr void members(auto&& take) {
        take(member<&Distances::frame>(1, "frame"),
             member<&Distances::leftOut>(2, "left_out").said("found, but more than are listed"),
             partMember<&Distances::distances>("distances")
                 .atMost(&ApplicationLimits::maxDistances)
                 .ofBytes(&ApplicationLimits::maxCollisionBytes));
    }
};
struct Questions {
    FrameNumber frame;
    std::vector<QuestionValue> questions;  ///< new ones in a notice, all that are open in an answer; ids ascending
    std::vector<std::uint64_t> closed;     ///< in a notice: no longer open, answered or not; ascending
    std::uint64_t unanswered = 0;          ///< of this frame: closed because nobody answered in time

    static constexpr ToldInfo kInfo{
        .name = "Questions", .answer = 10, .notice = 6, .help = "Motions that wait for a decision"};
    static constexpr void members(auto&& take) {
        take(member<&Questions::frame>(1, "frame"),
             member<&Questions::unanswered>(2, "unanswered")
                 .said("closed in this frame because nobody answered in time"),
             partMember<&Questions::questions>("questions")
                 .atMost(&ApplicationLimits::maxQuestions)
                 .ofBytes(&ApplicationLimits::maxCollisionBytes)
                 .said("as a notice new ones, as an answer all that are open"),
             partMember<&Questions::closed>("closed")
                 .atMost(&ApplicationLimits::maxQuestions)
                 .said("ids of those that are no longer open"));
    }
};

}  // namespace answer

namespace request {

/// What the newest frame's collision detection found.
struct GetContacts {
    using Answer = answer::Contacts;
    static constexpr RequestInfo kInfo{.number = 7, .name = "GetContacts", .help = "What touches in the newest frame"};
    static constexpr void members(auto&& take) { take(); }
};
/// Those that stay included.
struct GetEvents {
    using Answer = answer::PairEvents;
    static constexpr RequestInfo kInfo{
        .number = 10, .name = "GetEvents", .help = "Which objects began, go on or ceased to touch in the newest frame"};
    static constexpr void members(auto&& take) { take(); }
};
struct GetDistances {
    using Answer = answer::Distances;
    static constexpr RequestInfo kInfo{
        .number = 11, .name = "GetDistances", .help = "How far apart objects are that are near each other"};
    static constexpr void members(auto&& take) { take(); }
};
/// All that are open.
struct GetQuestions {
    using Answer = answer::Questions;
    static constexpr RequestInfo kInfo{
        .number = 12, .name = "GetQuestions", .help = "Motions that were stopped and wait for a decision"};
    static constexpr void members(auto&& take) { take(); }
};

struct AnswerQuestion {
    QuestionReply reply;

    using Answer = answer::Done;
    static constexpr RequestInfo kInfo{.number = 13,
                                       .name = "AnswerQuestion",
                                       .role = Role::kEditor,
                                       .changes = Changes::kScene,
                                       .help = "Decides about a motion that was stopped",
                                       .example = R"({"question":1,"decision":"pass"})"};
    static constexpr void members(auto&& take) { take(spreadMember<&AnswerQuestion::reply>(1)); }
};

using OfCollisions = std::variant<GetContacts, GetEvents, GetDistances, GetQuestions, AnswerQuestion>;

}  // namespace request
}  // namespace tessera

#include "server/import/CollisionCores.h"

#include <fmt/format.h>

#include "server/import/TableCores.h"

namespace tessera {
namespace {

using InterestMessage = proto::scene::Interest;
using ObjectMessage = proto::scene::CollisionObject;

// One number in code, on the wire and in files.
static_assert(InterestMessage::REPORT == Interest::kReport && InterestMessage::STOP == Interest::kStop &&
              InterestMessage::SLIDE == Interest::kSlide && InterestMessage::BOUNCE == Interest::kBounce &&
              InterestMessage::ROLLBACK == Interest::kRollback && InterestMessage::ASK == Interest::kAsk);
static_assert(InterestMessage::PSEUDO_DYNAMIC == Interest::kPseudoDynamic &&
              InterestMessage::STATIC == Interest::kStatic && InterestMessage::DYNAMIC == Interest::kDynamic &&
              InterestMessage::DISTANCE == Interest::kDistance && InterestMessage::IGNORE == Interest::kIgnore &&
              InterestMessage::SELF == Interest::kSelf);
static_assert(ObjectMessage::STATIC == CollisionObject::kStatic && ObjectMessage::RIGID == CollisionObject::kRigid &&
              ObjectMessage::DEFORMING == CollisionObject::kDeforming);
static_assert(ObjectMessage::WHOLE == CollisionObject::kWhole &&
              ObjectMessage::EACH_CHILD == CollisionObject::kEachChild &&
              ObjectMessage::EACH_GEOMETRY == CollisionObject::kEachGeometry);
static_assert(ObjectMessage::TRIANGLES == CollisionObject::kTriangles &&
              ObjectMessage::HULL == CollisionObject::kHull &&
              ObjectMessage::HEIGHTFIELD == CollisionObject::kHeightField &&
              ObjectMessage::POINTS == CollisionObject::kPoints &&
              ObjectMessage::AUTO_SHAPE == CollisionObject::kAutoShape &&
              ObjectMessage::SPHERICAL == CollisionObject::kSpherical &&
              ObjectMessage::DISTANCE_FIELD == CollisionObject::kDistanceField &&
              ObjectMessage::FREEFORM == CollisionObject::kFreeform &&
              ObjectMessage::SPHERICAL_BEZIER == CollisionObject::kSphericalBezier);
static_assert(ObjectMessage::AUTO == CollisionObject::kAuto && ObjectMessage::SPHERE == CollisionObject::kSphere &&
              ObjectMessage::DOP26 == CollisionObject::kDop26);

constexpr std::uint32_t kMostFaces = 1'000'000;

}  // namespace

Expected<Interest> readInterest(const InterestMessage& message) {
    if (message.yes_or_no() && message.most_faces() != 0)
        return fail(ErrorCode::kBadInput, "an interest: yes_or_no lists no faces, most_faces some; which is it?");
    if (message.most_faces() > kMostFaces)
        return fail(ErrorCode::kBadInput, fmt::format("an interest: most_faces must be between 0 and {}, not {}",
                                                      kMostFaces, message.most_faces()));
    Expected<Interest> interest = readTableObject<Interest>(message);
    if (!interest) return failWith("an interest", interest.error());
    interest->enabled = !message.disabled();
    interest->detail = message.yes_or_no() ? Interest::kYesOrNo : message.most_faces();
    interest->show = (message.show_points() ? Interest::kShowPoints : 0) |
                     (message.show_normals() ? Interest::kShowNormals : 0) |
                     (message.show_faces() ? Interest::kShowFaces : 0);
    return interest;
}

Expected<CollisionObject> readCollisionObject(const ObjectMessage& message) {
    Expected<CollisionObject> object = readTableObject<CollisionObject>(message);
    if (!object) return failWith("a collision object", object.error());
    return object;
}

}  // namespace tessera

#include "server/import/CollisionCores.h"

#include <fmt/format.h>

#include <cmath>

#include "common/scene/FieldTable.h"

namespace tessera {
namespace {

using InterestMessage = proto::scene::Interest;
using ObjectMessage = proto::scene::CollisionObject;

/// Every value within the bounds that the scene will hold it to. The fields have the same names in files.
template <typename Core>
Expected<void> checkFields(const Core& core) {
    const Object object = Object::of(core);
    for (const FieldEntry& field : object.info().fields)
        if (Expected<void> good = checkValue(field, field.load(object)); !good) return good;
    return {};
}

Vec3d vectorOf(const proto::scene::Vector& message) {
    return Vec3d(message.x(), message.y(), message.z());
}

// One number in code, on the wire and in files.
static_assert(InterestMessage::REPORT == Interest::kReport && InterestMessage::STOP == Interest::kStop && InterestMessage::SLIDE == Interest::kSlide &&
              InterestMessage::BOUNCE == Interest::kBounce && InterestMessage::ROLLBACK == Interest::kRollback &&
              InterestMessage::ASK == Interest::kAsk);
static_assert(InterestMessage::PSEUDO_DYNAMIC == Interest::kPseudoDynamic && InterestMessage::STATIC == Interest::kStatic &&
              InterestMessage::DYNAMIC == Interest::kDynamic && InterestMessage::DISTANCE == Interest::kDistance &&
              InterestMessage::IGNORE == Interest::kIgnore && InterestMessage::SELF == Interest::kSelf);
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
    Interest interest;
    if (message.has_response()) interest.response = message.response();
    interest.enabled = !message.disabled();
    interest.mode = message.mode();
    if (message.yes_or_no() && message.most_faces() != 0)
        return fail(ErrorCode::kBadInput, "an interest: yes_or_no lists no faces, most_faces some; which is it?");
    if (message.most_faces() > kMostFaces)
        return fail(ErrorCode::kBadInput, fmt::format("an interest: most_faces must be between 0 and {}, not {}",
                                                      kMostFaces, message.most_faces()));
    interest.detail = message.yes_or_no() ? Interest::kYesOrNo : message.most_faces();
    if (message.has_object_layers()) interest.objectLayers = message.object_layers();
    if (message.has_against_layers()) interest.againstLayers = message.against_layers();
    interest.threshold = message.threshold();
    interest.show = (message.show_points() ? Interest::kShowPoints : 0) |
                    (message.show_normals() ? Interest::kShowNormals : 0) |
                    (message.show_faces() ? Interest::kShowFaces : 0);
    if (message.has_patience()) interest.patience = message.patience();
    if (Expected<void> good = checkFields(interest); !good) return failWith("an interest", good.error());
    return interest;
}

Expected<CollisionObject> readCollisionObject(const ObjectMessage& message) {
    CollisionObject object;
    if (message.has_kind()) object.kind = message.kind();
    object.division = message.division();
    object.shape = message.shape();
    object.volume = message.volume();
    object.tolerance = message.tolerance();
    object.level = message.level();
    object.error = message.error();
    if (message.has_layers()) object.layers = message.layers();
    object.mass = message.mass();
    if (message.has_restitution()) object.restitution = message.restitution();
    if (message.has_friction()) object.friction = message.friction();
    if (message.has_velocity()) object.velocity = vectorOf(message.velocity());
    if (message.has_spin()) object.spin = vectorOf(message.spin());
    if (Expected<void> good = checkFields(object); !good) return failWith("a collision object", good.error());
    return object;
}

}  // namespace tessera

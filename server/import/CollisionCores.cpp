#include "server/import/CollisionCores.h"

#include <fmt/format.h>

#include <cmath>

#include "common/scene/FieldTable.h"

namespace tessera {
namespace {

using Message = proto::scene::Interest;
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

/// A number that names no response is kept, for the check of the bounds to refuse.
std::int64_t responseOf(Message::Response response) {
    switch (response) {
        case Message::STOP:
            return Interest::kStop;
        case Message::REPORT:
            return Interest::kReport;
        case Message::SLIDE:
            return Interest::kSlide;
        case Message::BOUNCE:
            return Interest::kBounce;
        case Message::ROLLBACK:
            return Interest::kRollback;
        case Message::ASK:
            return Interest::kAsk;
        default:
            return response;
    }
}

static_assert(Message::PSEUDO_DYNAMIC == Interest::kPseudoDynamic && Message::STATIC == Interest::kStatic &&
              Message::DYNAMIC == Interest::kDynamic && Message::DISTANCE == Interest::kDistance &&
              Message::IGNORE == Interest::kIgnore);
static_assert(ObjectMessage::RIGID != CollisionObject::kRigid, "kinds are numbered differently in files");
static_assert(ObjectMessage::WHOLE == CollisionObject::kWhole &&
              ObjectMessage::EACH_CHILD == CollisionObject::kEachChild &&
              ObjectMessage::EACH_GEOMETRY == CollisionObject::kEachGeometry);
static_assert(ObjectMessage::TRIANGLES == CollisionObject::kTriangles && ObjectMessage::HULL == CollisionObject::kHull);

std::int64_t kindOf(ObjectMessage::Kind kind) {
    switch (kind) {
        case ObjectMessage::RIGID:
            return CollisionObject::kRigid;
        case ObjectMessage::STATIC:
            return CollisionObject::kStatic;
        case ObjectMessage::DEFORMING:
            return CollisionObject::kDeforming;
        default:
            return kind;
    }
}

constexpr std::uint32_t kMostFaces = 1'000'000;

}  // namespace

Expected<Interest> readInterest(const Message& message) {
    Interest interest;
    interest.response = responseOf(message.response());
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
    object.kind = kindOf(message.kind());
    object.division = message.division();
    object.shape = message.shape();
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

#include "server/collision/pipeline/PairQueries.h"

#include <utility>

#include "server/collision/pairwise/ConservativeBox.h"
#include "server/collision/pairwise/FreeformPairs.h"
#include "server/collision/pairwise/PairContact.h"

namespace tessera {
namespace {

static_assert(kWhole == Contact::kNoFace);

void tellPatches(Contact& contact, const PatchPlace& onA, const PatchPlace& onB) {
    contact.patchA = onA.face;
    contact.patchUvA = onA.uv;
    contact.patchB = onB.face;
    contact.patchUvB = onB.uv;
}

/// What is told by its triangles is told by the place on the surface that is nearest.
PatchPlace patchNear(const PlacedShape& of, const Vec3d& point) {
    if (of.shape.smoothSurface() == nullptr || !invertible(of.world)) return {};
    return freeform_pairs::patchAt(of.shape, of.world.inverse() * point);
}

}  // namespace

void askTouch(PairState& state, const Part& a, const Part& b, bool all, std::size_t most, QueryWork& work) {
    TouchAnswer& known = state.touch;
    if (known.holds(a, b, all)) return;
    const PlacedShape placedA{*a.shape, a.world}, placedB{*b.shape, b.world};
    const PairEffort effort{work, &state.hints};
    PairTouch found = all ? contactsOf(placedA, placedB, most, effort) : touchOf(placedA, placedB, effort);
    known.touching = found.touch == Touch::kYes;
    known.complete = found.complete;
    known.faceCount = found.count;
    known.faces = std::move(found.faces);
    known.places = std::move(found.places);
    // Solids that meet as wholes have told all.
    known.all = all || (known.touching && known.faces.empty());
    // An answer that the work was not enough for is asked again.
    known.versionA = known.complete ? a.poseVersion : 0;
    known.versionB = known.complete ? b.poseVersion : 0;
}

void askDistance(PairState& state, const Part& a, const Part& b, double upperBound, QueryWork& work) {
    DistanceAnswer& known = state.distance;
    if (known.versionA == a.poseVersion && known.versionB == b.poseVersion && known.versionA != 0 &&
        known.upperBound == upperBound)
        return;
    const WorldDistance found = distanceInWorld({*a.shape, a.world}, {*b.shape, b.world},
                                                {.upperBound = upperBound, .start = state.hints.nearest}, work);
    known.upperBound = upperBound;
    known.complete = found.complete;
    known.farther = found.farther;
    known.distance = found.distance;
    known.faces = found.faces;
    known.pointA = found.pointA;
    known.pointB = found.pointB;
    known.error = found.error;
    if (known.complete && !known.farther && known.faces.a != kWhole) state.hints.nearest = known.faces;
    known.versionA = known.complete ? a.poseVersion : 0;
    known.versionB = known.complete ? b.poseVersion : 0;
}

Contact contactOfFaces(const Part& a, const Part& b, const Affine3d& worldA, const Affine3d& worldB,
                       const FacePair& faces) {
    const PlacedShape placedA{*a.shape, worldA}, placedB{*b.shape, worldB};
    // What runs into itself does so as the surface that it is, whatever covers it.
    const bool itself = &a == &b;
    const PairContact found = itself ? contactWithItself(placedA, faces) : contactOfFaces(placedA, placedB, faces);
    Contact contact;
    contact.error = itself ? 0 : coverError(placedA, placedB);
    contact.point = found.point;
    contact.normal = found.normal;
    contact.depth = found.depth.value_or(Contact::kNoDepth);
    contact.faceA = a.shape->hull() ? Contact::kNoFace : found.faces.a;
    contact.faceB = b.shape->hull() ? Contact::kNoFace : found.faces.b;
    contact.uvA = a.shape->hull() ? Vec2d::Zero() : found.uvA;
    contact.uvB = b.shape->hull() ? Vec2d::Zero() : found.uvB;
    // Both sides of what runs into itself are near the point: whose place it is would be chance.
    if (!itself) tellPatches(contact, patchNear(placedA, found.point), patchNear(placedB, found.point));
    return contact;
}

Contact contactOfPlace(const Part& a, const Part& b, const Affine3d& worldA, const Affine3d& worldB,
                       const FacePair& faces, const MeetingPlace& place) {
    const PlacedShape placedA{*a.shape, worldA}, placedB{*b.shape, worldB};
    Contact contact;
    contact.error = touchError(placedA, placedB);
    contact.point = place.point;
    contact.normal = place.normal;
    const auto on = [&](const PlacedShape& of, std::uint32_t face, std::uint32_t& told, Vec2d& uv) {
        told = of.shape.hull() ? Contact::kNoFace : face;
        if (!of.shape.hull()) uv = placeOn(transformed(of.world, of.shape.triangle(face)), place.point);
    };
    on(placedA, faces.a, contact.faceA, contact.uvA);
    on(placedB, faces.b, contact.faceB, contact.uvB);
    tellPatches(contact, place.onA, place.onB);
    return contact;
}

Contact contactOfHulls(const Part& a, const Part& b, const Affine3d& worldA, const Affine3d& worldB) {
    const PairContact found = contactOfHulls({*a.shape, worldA}, {*b.shape, worldB});
    Contact contact;
    contact.point = found.point;
    contact.normal = found.normal;
    contact.depth = found.depth.value_or(Contact::kNoDepth);
    contact.faceA = contact.faceB = Contact::kNoFace;
    return contact;
}

}  // namespace tessera

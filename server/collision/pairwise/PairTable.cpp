#include "server/collision/pairwise/PairTable.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

#include "server/collision/pairwise/ConservativeBox.h"
#include "server/collision/pairwise/DistanceFieldPairs.h"
#include "server/collision/pairwise/FieldPairs.h"
#include "server/collision/pairwise/FreeformPairs.h"
#include "server/collision/pairwise/HullPairs.h"
#include "server/collision/pairwise/PointPairs.h"
#include "server/collision/pairwise/SphericalBezierPairs.h"
#include "server/collision/pairwise/SphericalPairs.h"
#include "server/collision/pairwise/SurfacePairs.h"
#include "server/collision/query/FacesNear.h"
#include "server/collision/representation/BallPairs.h"
#include "server/collision/representation/HeightFieldQueries.h"
#include "server/collision/representation/PointSetQueries.h"

namespace tessera {
namespace {

constexpr PairMethods kSurfaces{
    .name = "triangles",
    .touch = surface_pairs::touch,
    .contacts = surface_pairs::contacts,
    .distance = surface_pairs::distance,
    .firstContact = surface_pairs::firstContact,
    .depth = surface_pairs::depth,
};
constexpr PairMethods kHulls{
    .name = "hulls",
    .touch = hull_pairs::touch,
    .contacts = hull_pairs::contacts,
    .distance = hull_pairs::distance,
    .firstContact = surface_pairs::firstContact,
    .depth = hull_pairs::depth,
    .byTrees = kFirstContactQuestion,
};
constexpr PairMethods kHullAndSurface{
    .name = "hull and triangles",
    .touch = hull_pairs::touchSurface,
    .contacts = hull_pairs::contactsWithSurface,
    .distance = hull_pairs::distanceToSurface,
    .firstContact = surface_pairs::firstContact,
    .depth = surface_pairs::depth,
    .byTrees = kFirstContactQuestion | kDepthQuestion,
};

constexpr PairMethods kFields{
    .name = "height field",
    .touch = field_pairs::touch,
    .contacts = field_pairs::contacts,
    .distance = field_pairs::distance,
    .firstContact = field_pairs::firstContact,
    .depth = field_pairs::depth,
};
constexpr PairMethods kHullAndField{
    .name = "hull and height field",
    .touch = hull_pairs::touchSurface,
    .contacts = hull_pairs::contactsWithSurface,
    .distance = hull_pairs::distanceToSurface,
    .firstContact = field_pairs::firstContact,
    .depth = field_pairs::depth,
};

template <point_pairs::Hulls kHulls>
constexpr PairMethods pointMethods(std::string_view name) {
    using Of = point_pairs::Methods<kHulls>;
    return {.name = name,
            .touch = Of::touch,
            .contacts = Of::contacts,
            .distance = Of::distance,
            .firstContact = Of::firstContact,
            .depth = Of::depth};
}

constexpr PairMethods kSphericals{
    .name = "spherical",
    .touch = spherical_pairs::touch,
    .contacts = spherical_pairs::contacts,
    .distance = surface_pairs::distance,
    .firstContact = surface_pairs::firstContact,
    .depth = surface_pairs::depth,
    .byTrees = kDistanceQuestion | kFirstContactQuestion | kDepthQuestion,
};

constexpr PairMethods kDistanceFields{
    .name = "distance field",
    .touch = surface_pairs::touch,
    .contacts = surface_pairs::contacts,
    .distance = distance_field_pairs::distance,
    .firstContact = surface_pairs::firstContact,
    .depth = distance_field_pairs::depth,
    .byTrees = kTouchQuestion | kContactsQuestion | kFirstContactQuestion,
    .approximate = kDistanceQuestion | kDepthQuestion,
};
constexpr PairMethods kHullAndDistanceField{
    .name = "hull and distance field",
    .touch = hull_pairs::touchSurface,
    .contacts = hull_pairs::contactsWithSurface,
    .distance = distance_field_pairs::distanceToHull,
    .firstContact = surface_pairs::firstContact,
    .depth = distance_field_pairs::depth,
    .byTrees = kFirstContactQuestion,
    .approximate = kDistanceQuestion | kDepthQuestion,
};

constexpr PairMethods kFreeforms{
    .name = "freeform",
    .touch = freeform_pairs::touch,
    .contacts = freeform_pairs::contacts,
    .distance = freeform_pairs::distance,
    .firstContact = freeform_pairs::firstContact,
    .depth = freeform_pairs::depth,
    .approximate = kEveryQuestion,
};

constexpr PairMethods kSphericalBeziers{
    .name = "spherical Bézier patches",
    .touch = spherical_bezier_pairs::touch,
    .contacts = spherical_bezier_pairs::contacts,
    .distance = surface_pairs::distance,
    .firstContact = surface_pairs::firstContact,
    .depth = surface_pairs::depth,
    .byTrees = kDistanceQuestion | kFirstContactQuestion | kDepthQuestion,
};

/// What is said of triangles, said by a representation whose trees are asked.
constexpr PairMethods byTreesOf(PairMethods methods) {
    methods.byTrees = kEveryQuestion;
    return methods;
}

using Table = std::array<std::array<PairMethods, kRepresentations>, kRepresentations>;

constexpr Table makeTable() {
    using enum Representation;
    Table table;
    const auto set = [&](Representation a, Representation b, const PairMethods& methods) {
        table[static_cast<std::size_t>(a)][static_cast<std::size_t>(b)] = methods;
        table[static_cast<std::size_t>(b)][static_cast<std::size_t>(a)] = methods;
    };
    set(kTriangles, kTriangles, kSurfaces);
    set(kHull, kHull, kHulls);
    set(kHull, kTriangles, kHullAndSurface);
    set(kHeightField, kTriangles, kFields);
    set(kHeightField, kHeightField, kFields);
    set(kHull, kHeightField, kHullAndField);
    constexpr PairMethods points = pointMethods<point_pairs::Hulls::kSurfaces>("points"),
                          pointsAndHull = pointMethods<point_pairs::Hulls::kSolids>("hull and points");
    for (const Representation other : {kTriangles, kHeightField, kPoints}) set(kPoints, other, points);
    set(kHull, kPoints, pointsAndHull);
    // By directions yes and no, where the other is triangles; hulls, grids and balls know better what they are.
    set(kSpherical, kTriangles, kSphericals);
    set(kSpherical, kSpherical, kSphericals);
    set(kSpherical, kHull, byTreesOf(kHullAndSurface));
    set(kSpherical, kHeightField, kFields);
    set(kSpherical, kPoints, points);
    // A grid has no tree, and a ball is looked up in a tree as fast as in a lattice.
    for (const Representation other : {kTriangles, kSpherical, kDistanceField})
        set(kDistanceField, other, kDistanceFields);
    set(kDistanceField, kHull, kHullAndDistanceField);
    set(kDistanceField, kHeightField, kFields);
    set(kDistanceField, kPoints, points);
    for (const Representation other : {kTriangles, kHull, kSpherical, kDistanceField, kFreeform})
        set(kFreeform, other, kFreeforms);
    // A smooth surface would have to walk along all of a grid, or a cloud: its triangles do.
    set(kFreeform, kHeightField, byTreesOf(kFields));
    set(kFreeform, kPoints, byTreesOf(points));
    // Patches reject beside triangles and their like; solids, fields, grids, balls and smooth surfaces know better what
    // they are.
    for (const Representation other : {kTriangles, kSphericalBezier}) set(kSphericalBezier, other, kSphericalBeziers);
    set(kSphericalBezier, kHull, byTreesOf(kHullAndSurface));
    set(kSphericalBezier, kHeightField, kFields);
    set(kSphericalBezier, kPoints, points);
    set(kSphericalBezier, kSpherical, kSphericals);
    set(kSphericalBezier, kDistanceField, kDistanceFields);
    set(kSphericalBezier, kFreeform, kFreeforms);
    return table;
}
constexpr Table kTable = makeTable();

constexpr bool complete(const Table& table) {
    for (const auto& row : table)
        for (const PairMethods& of : row)
            if (of.touch == nullptr || of.contacts == nullptr || of.distance == nullptr || of.firstContact == nullptr ||
                of.depth == nullptr)
                return false;
    return true;
}
static_assert(complete(kTable), "each two representations need an entry that answers all five questions");

Representation surfaceOf(const CollisionShape& shape) {
    return shape.hull() || shape.distanceField() || shape.smoothSurface() ? Representation::kTriangles
                                                                          : shape.representation();
}

/// A's world pose is a similarity.
WorldDistance measured(const PlacedShape& a, double scale, const PlacedShape& b, DistanceOptions options,
                       QueryWork& work) {
    options.upperBound /= scale;
    options.tolerance /= scale;
    const Distance found =
        pairMethods(a.shape, b.shape).distance(a.shape, b.shape, a.world.inverse() * b.world, work, options);
    return {found.distance * scale,           found.faces,    a.world * found.onA, a.world * found.onB,
            found.farther || !found.complete, found.complete, found.error * scale};
}

}  // namespace

const PairMethods& pairMethods(Representation a, Representation b) {
    return kTable[static_cast<std::size_t>(a)][static_cast<std::size_t>(b)];
}

const PairMethods& surfaceMethods(const CollisionShape& a, const CollisionShape& b) {
    return pairMethods(surfaceOf(a), surfaceOf(b));
}

std::string_view nameOf(Representation representation) {
    switch (representation) {
        case Representation::kTriangles:
            return "triangles";
        case Representation::kHull:
            return "hull";
        case Representation::kHeightField:
            return "heightfield";
        case Representation::kPoints:
            return "points";
        case Representation::kSpherical:
            return "spherical";
        case Representation::kDistanceField:
            return "distance-field";
        case Representation::kFreeform:
            return "freeform";
        case Representation::kSphericalBezier:
            return "spherical-bezier";
    }
    return "";
}

namespace {

/// Balls stay balls in their own frame, whatever the maps.
bool inFrameOfB(const PlacedShape& a, const PlacedShape& b) {
    if ((a.shape.points() != nullptr) != (b.shape.points() != nullptr)) return b.shape.points() != nullptr;
    return b.shape.faceCount() > a.shape.faceCount();
}

/// Faces ascending, each with its place.
void sortPlaces(PairTouch& found) {
    std::vector<std::size_t> order(found.faces.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::sort(order, {}, [&](std::size_t i) { return found.faces[i]; });
    PairTouch sorted = found;
    for (std::size_t i = 0; i < order.size(); ++i) {
        sorted.faces[i] = found.faces[order[i]];
        sorted.places[i] = found.places[order[i]];
    }
    found = std::move(sorted);
}

PairTouch turned(PairTouch found) {
    for (FacePair& faces : found.faces) std::swap(faces.a, faces.b);
    if (found.places.empty()) {
        std::ranges::sort(found.faces);
        return found;
    }
    for (MeetingPlace& place : found.places) {
        place.normal = -place.normal;
        std::swap(place.onA, place.onB);
    }
    sortPlaces(found);
    return found;
}

PairTouch inWorld(PairTouch found, const Affine3d& world) {
    if (found.places.empty()) return found;
    const Mat3d forms = world.linear().inverse().transpose();
    for (MeetingPlace& place : found.places) {
        place.point = world * place.point;
        place.normal = Vec3d(forms * place.normal).stableNormalized();
    }
    return found;
}

PairTouch touchBy(const PairMethods& methods, const PlacedShape& a, const PlacedShape& b, const PairEffort& effort) {
    return inWorld(methods.touch(a.shape, b.shape, a.world.inverse() * b.world, effort), a.world);
}

PairTouch contactsBy(const PairMethods& methods, const PlacedShape& a, const PlacedShape& b, std::size_t most,
                     const PairEffort& effort) {
    return inWorld(methods.contacts(a.shape, b.shape, a.world.inverse() * b.world, most, effort), a.world);
}

}  // namespace

double coverError(const PlacedShape& a, const PlacedShape& b) {
    if (!a.shape.isCover() && !b.shape.isCover()) return 0;
    const auto seenFrom = [](const PlacedShape& frame, const PlacedShape& other) {
        // Balls of the other that are stretched in this frame are taken for larger ones.
        const double stretch = other.shape.isCover() && invertible(frame.world)
                                   ? largestStretch(frame.world.linear().inverse() * other.world.linear())
                                   : 0;
        return largestStretch(frame.world.linear()) * (frame.shape.coverError() + stretch * other.shape.coverError());
    };
    if (a.shape.points() != nullptr && b.shape.points() != nullptr) return std::max(seenFrom(a, b), seenFrom(b, a));
    return a.shape.isCover() ? seenFrom(a, b) : seenFrom(b, a);
}

double touchError(const PlacedShape& a, const PlacedShape& b) {
    const bool ofB = inFrameOfB(a, b);
    const PlacedShape &frame = ofB ? b : a, &other = ofB ? a : b;
    if (pairMethods(frame.shape, other.shape).touch != freeform_pairs::touch) return coverError(a, b);
    return largestStretch(frame.world.linear()) *
           freeform_pairs::toleranceOf(frame.shape, other.shape, frame.world.inverse() * other.world);
}

PairTouch touchOf(const PlacedShape& a, const PlacedShape& b, const PairEffort& effort) {
    if (inFrameOfB(a, b)) return turned(touchBy(pairMethods(b.shape, a.shape), b, a, effort));
    return touchBy(pairMethods(a.shape, b.shape), a, b, effort);
}

PairTouch contactsOf(const PlacedShape& a, const PlacedShape& b, std::size_t most, const PairEffort& effort) {
    if (!inFrameOfB(a, b)) return contactsBy(pairMethods(a.shape, b.shape), a, b, most, effort);
    // The first in one order are not the first in the other.
    PairTouch found = turned(contactsBy(pairMethods(b.shape, a.shape), b, a, ~std::size_t{0}, effort));
    found.faces.resize(std::min(found.faces.size(), most));
    found.faces.shrink_to_fit();
    found.places.resize(std::min(found.places.size(), most));
    return found;
}

Touch drawnTouching(const PlacedShape& a, const PlacedShape& b, QueryWork& work) {
    const auto drawn = [](const CollisionShape& shape) {
        return shape.smoothSurface() ? Representation::kTriangles : shape.representation();
    };
    const PairEffort effort{work};
    if (inFrameOfB(a, b)) return touchBy(pairMethods(drawn(b.shape), drawn(a.shape)), b, a, effort).touch;
    return touchBy(pairMethods(drawn(a.shape), drawn(b.shape)), a, b, effort).touch;
}

Touch surfacesTouching(const PlacedShape& a, const PlacedShape& b, QueryWork& work) {
    if (inFrameOfB(a, b)) return touchBy(surfaceMethods(b.shape, a.shape), b, a, {work}).touch;
    return touchBy(surfaceMethods(a.shape, b.shape), a, b, {work}).touch;
}

FacePairs surfaceFacesTouching(const PlacedShape& a, const PlacedShape& b, QueryWork& work) {
    const bool swap = inFrameOfB(a, b);
    PairTouch found = swap ? turned(contactsBy(surfaceMethods(b.shape, a.shape), b, a, ~std::size_t{0}, {work}))
                           : contactsBy(surfaceMethods(a.shape, b.shape), a, b, ~std::size_t{0}, {work});
    return {std::move(found.faces), found.complete};
}

bool facesNear(const CollisionShape& shape, const Box& box, QueryWork& work, std::vector<std::uint32_t>& faces) {
    if (shape.heightField() != nullptr) return facesNear(*shape.heightField(), box, work, faces);
    if (shape.points() != nullptr) return facesNear(*shape.points(), box, work, faces);
    return facesNear(shape.tree(), box, work, faces);
}

WorldDistance distanceInWorld(const PlacedShape& a, const PlacedShape& b, const DistanceOptions& options,
                              QueryWork& work) {
    if (const std::optional<double> scale = similarityScale(a.world)) return measured(a, *scale, b, options, work);
    if (const std::optional<double> scale = similarityScale(b.world)) {
        DistanceOptions swapped = options;
        if (swapped.start) std::swap(swapped.start->a, swapped.start->b);
        WorldDistance out = measured(b, *scale, a, swapped, work);
        std::swap(out.faces.a, out.faces.b);
        std::swap(out.pointA, out.pointB);
        return out;
    }
    // Neither frame keeps the world's lengths: A's vertices are taken to the world. Rare, and dear.
    const std::shared_ptr<const CollisionShape> inWorld = a.shape.placed(a.world);
    if (!inWorld) return {.farther = true, .complete = false};
    const Affine3d same = Affine3d::Identity();
    return measured({*inWorld, same}, 1, b, options, work);
}

}  // namespace tessera

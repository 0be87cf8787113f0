#include "server/collision/pairwise/PairTable.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "server/collision/pairwise/ConservativeBox.h"
#include "server/collision/pairwise/FieldPairs.h"
#include "server/collision/pairwise/HullPairs.h"
#include "server/collision/pairwise/PointPairs.h"
#include "server/collision/pairwise/SurfacePairs.h"
#include "server/collision/query/FacesNear.h"
#include "server/collision/representation/BallPairs.h"
#include "server/collision/representation/HeightFieldQueries.h"
#include "server/collision/representation/PointSetQueries.h"

namespace tessera {
namespace {

constexpr PairMethods kSurfaces{"triangles",
                                0,
                                false,
                                surface_pairs::touch,
                                surface_pairs::contacts,
                                surface_pairs::distance,
                                surface_pairs::firstContact,
                                surface_pairs::depth};
constexpr PairMethods kHulls{"hulls",
                             0,
                             false,
                             hull_pairs::touch,
                             hull_pairs::contacts,
                             hull_pairs::distance,
                             surface_pairs::firstContact,
                             hull_pairs::depth};
constexpr PairMethods kHullAndSurface{"hull and triangles",
                                      0,
                                      false,
                                      hull_pairs::touchSurface,
                                      hull_pairs::contactsWithSurface,
                                      hull_pairs::distanceToSurface,
                                      surface_pairs::firstContact,
                                      surface_pairs::depth};

constexpr PairMethods kFields{"height field",
                              0,
                              false,
                              field_pairs::touch,
                              field_pairs::contacts,
                              field_pairs::distance,
                              field_pairs::firstContact,
                              field_pairs::depth};
constexpr PairMethods kHullAndField{"hull and height field",
                                    0,
                                    false,
                                    hull_pairs::touchSurface,
                                    hull_pairs::contactsWithSurface,
                                    hull_pairs::distanceToSurface,
                                    field_pairs::firstContact,
                                    field_pairs::depth};

template <point_pairs::Hulls kHulls>
constexpr PairMethods pointMethods(std::string_view name) {
    using Of = point_pairs::Methods<kHulls>;
    return {name, 0, false, Of::touch, Of::contacts, Of::distance, Of::firstContact, Of::depth};
}

constexpr PairMethods byTriangles() {
    PairMethods methods = kSurfaces;
    methods.fallsBack = true;
    return methods;
}

using Table = std::array<std::array<PairMethods, kRepresentations>, kRepresentations>;

constexpr Table makeTable() {
    using enum Representation;
    Table table;
    for (auto& row : table) row.fill(byTriangles());
    const auto set = [&](Representation a, Representation b, const PairMethods& methods) {
        table[static_cast<std::size_t>(a)][static_cast<std::size_t>(b)] = methods;
    };
    set(kTriangles, kTriangles, kSurfaces);
    set(kHull, kHull, kHulls);
    set(kHull, kTriangles, kHullAndSurface);
    set(kTriangles, kHull, kHullAndSurface);
    for (const Representation surface : {kTriangles, kHeightField}) {
        set(kHeightField, surface, kFields);
        set(surface, kHeightField, kFields);
    }
    set(kHull, kHeightField, kHullAndField);
    set(kHeightField, kHull, kHullAndField);
    constexpr PairMethods points = pointMethods<point_pairs::Hulls::kSurfaces>("points"),
                          pointsAndHull = pointMethods<point_pairs::Hulls::kSolids>("hull and points");
    for (const Representation other : {kTriangles, kHeightField, kPoints}) {
        set(kPoints, other, points);
        set(other, kPoints, points);
    }
    set(kHull, kPoints, pointsAndHull);
    set(kPoints, kHull, pointsAndHull);
    return table;
}
constexpr Table kTable = makeTable();

Representation surfaceOf(const CollisionShape& shape) {
    return shape.hull() ? Representation::kTriangles : shape.representation();
}

/// The factor by which a similarity stretches lengths; nothing for other maps.
std::optional<double> similarityOf(const Affine3d& m) {
    const Mat3d square = m.linear().transpose() * m.linear();
    const double s2 = square.trace() / 3;
    if (!(s2 > 0) || !((square - s2 * Mat3d::Identity()).cwiseAbs().maxCoeff() <= 1e-12 * s2)) return std::nullopt;
    return std::sqrt(s2);
}

/// A's world pose is a similarity.
WorldDistance measured(const PlacedShape& a, double scale, const PlacedShape& b, DistanceOptions options,
                       QueryWork& work) {
    options.upperBound /= scale;
    options.tolerance /= scale;
    const Distance found =
        pairMethods(a.shape, b.shape).distance(a.shape, b.shape, a.world.inverse() * b.world, work, options);
    return {found.distance * scale,           found.faces,   a.world * found.onA, a.world * found.onB,
            found.farther || !found.complete, found.complete};
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
    }
    return "";
}

namespace {

/// Balls stay balls in their own frame, whatever the maps.
bool inFrameOfB(const PlacedShape& a, const PlacedShape& b) {
    if ((a.shape.points() != nullptr) != (b.shape.points() != nullptr)) return b.shape.points() != nullptr;
    return b.shape.faceCount() > a.shape.faceCount();
}

PairTouch turned(PairTouch found) {
    for (FacePair& faces : found.faces) std::swap(faces.a, faces.b);
    std::ranges::sort(found.faces);
    return found;
}

PairTouch touchBy(const PairMethods& methods, const PlacedShape& a, const PlacedShape& b, const PairEffort& effort) {
    return methods.touch(a.shape, b.shape, a.world.inverse() * b.world, effort);
}

PairTouch contactsBy(const PairMethods& methods, const PlacedShape& a, const PlacedShape& b, std::size_t most,
                     const PairEffort& effort) {
    return methods.contacts(a.shape, b.shape, a.world.inverse() * b.world, most, effort);
}

}  // namespace

double coverError(const PlacedShape& a, const PlacedShape& b) {
    if (!a.shape.isCover() && !b.shape.isCover()) return 0;
    const auto seenFrom = [](const PlacedShape& frame, const PlacedShape& other) {
        // Balls of the other that are stretched in this frame are taken for larger ones.
        const double stretch = other.shape.isCover() && invertible(frame.world)
                                   ? largestStretch(frame.world.linear().inverse() * other.world.linear())
                                   : 0;
        return largestStretch(frame.world.linear()) *
               (frame.shape.coverError() + stretch * other.shape.coverError());
    };
    if (a.shape.points() != nullptr && b.shape.points() != nullptr)
        return std::max(seenFrom(a, b), seenFrom(b, a));
    return a.shape.isCover() ? seenFrom(a, b) : seenFrom(b, a);
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
    return found;
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
    if (const std::optional<double> scale = similarityOf(a.world)) return measured(a, *scale, b, options, work);
    if (const std::optional<double> scale = similarityOf(b.world)) {
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

#include "server/collision/pairwise/PairTable.h"

#include <array>
#include <cmath>
#include <utility>

#include "server/collision/pairwise/HullPairs.h"
#include "server/collision/pairwise/SurfacePairs.h"

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
    }
    return "";
}

Touch surfacesTouching(const PlacedShape& a, const PlacedShape& b, QueryWork& work) {
    PairHints none;
    return surfaceMethods(a.shape, b.shape).touch(a, b, none, work).touch;
}

FacePairs surfaceFacesTouching(const PlacedShape& a, const PlacedShape& b, QueryWork& work) {
    PairHints none;
    PairTouch found = surfaceMethods(a.shape, b.shape).contacts(a, b, ~std::size_t{0}, none, work);
    return {std::move(found.faces), found.complete};
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

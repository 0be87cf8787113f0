/// Two bodies' parts against each other, all in A's frame: which pairs of faces are near, and which are the nearest.
/// For the queries of this folder.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "server/collision/mesh/QueryWork.h"
#include "server/collision/mesh/TriangleContact.h"
#include "server/collision/mesh/TriangleMesh.h"
#include "server/collision/query/DistanceQuery.h"
#include "server/collision/representation/BodyParts.h"

namespace tessera {

/// A leaf's faces in A's frame.
struct PlacedFaces {
    LeafFaces faces;
    std::array<Triangle, LeafFaces::kMost> triangle;
    std::array<Box, LeafFaces::kMost> box;
};

/// A pair of bodies; B's parts are boxes in A's frame, and `a_T_b` maps its triangles there.
struct PartPair {
    const BodyParts& a;
    const BodyParts& b;
    const Affine3d& a_T_b;
    double reach;  ///< no coordinate in A's frame is larger

    PartPair(const BodyParts& partsA, const BodyParts& partsB, const Affine3d& map);
    /// By less than that distances are not told apart.
    [[nodiscard]] double rounding() const { return 1e-13 * reach; }
    void place(std::uint32_t leafA, std::uint32_t leafB, PlacedFaces& facesA, PlacedFaces& facesB) const;
};

/// A part of each.
struct PairOfParts {
    double bound;  ///< they are no nearer
    double size;
    std::uint32_t a, b;
    bool leafA, leafB;
    Box boxA, boxB;
};

[[nodiscard]] double gapBetween(const Box& a, const Box& b);
/// No point of one triangle is nearer to one of the other than this, but for rounding: the gap along the line between
/// their middles.
[[nodiscard]] double gapAlongMiddles(const Triangle& a, const Triangle& b);

/// found(PairOfParts) for what the larger part of a pair is made of, with the other.
template <typename Found>
void openLarger(const PartPair& pair, const PairOfParts& of, PartBoxes& boxes, Found&& found) {
    const bool intoA = of.leafB || (!of.leafA && of.boxA.size().sum() > of.boxB.size().sum());
    if (intoA)
        pair.a.open(of.a, boxes);
    else
        pair.b.open(of.b, boxes);
    for (unsigned i = 0; i < boxes.count; ++i) {
        PairOfParts next = of;
        (intoA ? next.a : next.b) = boxes.part[i];
        (intoA ? next.leafA : next.leafB) = boxes.leaf[i];
        (intoA ? next.boxA : next.boxB) = boxes.box(i);
        next.bound = gapBetween(next.boxA, next.boxB);
        next.size = next.boxA.size().sum() + next.boxB.size().sum();
        found(next);
    }
}

/// found(the whole of A and of B), where both have faces.
template <typename Found>
void wholePair(const PartPair& pair, PartBoxes& boxes, Found&& found) {
    PairOfParts all{};
    pair.a.whole(boxes);
    if (boxes.count == 0) return;
    all.a = boxes.part[0], all.leafA = boxes.leaf[0], all.boxA = boxes.box(0);
    pair.b.whole(boxes);
    if (boxes.count == 0) return;
    all.b = boxes.part[0], all.leafB = boxes.leaf[0], all.boxB = boxes.box(0);
    all.bound = gapBetween(all.boxA, all.boxB);
    all.size = all.boxA.size().sum() + all.boxB.size().sum();
    found(all);
}

/// meet(face of A, face of B, triangle of A, triangle of B) for all pairs of faces whose boxes are within `within` of
/// each other; it returns false to end the walk. False: the work was exhausted.
template <typename Meet>
[[nodiscard]] bool eachNearPair(const PartPair& pair, double within, QueryWork& work, Meet&& meet) {
    within += pair.rounding();
    std::vector<PairOfParts> open;
    PartBoxes boxes;
    PlacedFaces facesA, facesB;
    const auto keep = [&](const PairOfParts& next) {
        if (!(next.bound > within)) open.push_back(next);
    };
    if (pair.a.faceCount() == 0 || pair.b.faceCount() == 0) return true;
    if (work.exhausted()) return false;
    ++work.boxTests;
    wholePair(pair, boxes, keep);
    while (!open.empty()) {
        if (work.exhausted()) return false;
        const PairOfParts next = open.back();
        open.pop_back();
        if (!next.leafA || !next.leafB) {
            ++work.boxTests;
            openLarger(pair, next, boxes, keep);
            continue;
        }
        pair.place(next.a, next.b, facesA, facesB);
        for (unsigned i = 0; i < facesA.faces.count; ++i)
            for (unsigned j = 0; j < facesB.faces.count; ++j) {
                if (gapBetween(facesA.box[i], facesB.box[j]) > within) continue;
                ++work.triangleTests;
                if (!meet(facesA.faces.face[i], facesB.faces.face[j], facesA.triangle[i], facesB.triangle[j]))
                    return true;
            }
    }
    return !work.exhausted();
}

/// Branch and bound for the nearest pair of faces, nearest parts first. `measure(triangle of A, triangle of B)` gives
/// the nearest points. As distanceBetween, for bodies that do not touch; of equally near pairs the first. Any pair that
/// is no farther than `enough` ends the search.
template <typename Measure>
[[nodiscard]] Distance nearestPair(const PartPair& pair, QueryWork& work, const DistanceOptions& options, double enough,
                                   Measure&& measure) {
    Distance best;
    double limit = options.upperBound;
    const double rounding = pair.rounding();
    const auto offer = [&](const FacePair& faces, const Triangle& a, const Triangle& b) {
        ++work.triangleTests;
        const NearestPoints near = measure(a, b);
        if (near.distance > best.distance || (near.distance == best.distance && best.faces < faces)) return;
        best = {near.distance, faces, near.onA, near.onB};
        limit = std::min(limit, best.distance - options.tolerance);
    };
    if (options.start && options.start->a < pair.a.faceCount() && options.start->b < pair.b.faceCount())
        offer(*options.start, pair.a.triangle(options.start->a),
              transformed(pair.a_T_b, pair.b.triangle(options.start->b)));

    const auto later = [](const PairOfParts& x, const PairOfParts& y) {
        if (x.bound != y.bound) return x.bound > y.bound;
        if (x.size != y.size) return x.size > y.size;
        return x.a != y.a ? x.a > y.a : x.b > y.b;
    };
    std::vector<PairOfParts> open;
    PartBoxes boxes;
    PlacedFaces facesA, facesB;
    const auto keep = [&](const PairOfParts& next) {
        if (next.bound > limit + rounding) return;
        open.push_back(next);
        std::push_heap(open.begin(), open.end(), later);
    };
    ++work.boxTests;
    wholePair(pair, boxes, keep);
    while (!open.empty() && !(best.distance <= enough)) {
        std::pop_heap(open.begin(), open.end(), later);
        const PairOfParts next = open.back();
        open.pop_back();
        if (next.bound > limit + rounding) break;
        if (work.exhausted()) {
            Distance unknown;
            unknown.distance = std::max(0.0, std::min({next.bound - rounding, best.distance, options.upperBound}));
            unknown.complete = false;
            return unknown;
        }
        if (!next.leafA || !next.leafB) {
            ++work.boxTests;
            openLarger(pair, next, boxes, keep);
            continue;
        }
        pair.place(next.a, next.b, facesA, facesB);
        for (unsigned i = 0; i < facesA.faces.count; ++i)
            for (unsigned j = 0; j < facesB.faces.count; ++j) {
                if (gapBetween(facesA.box[i], facesB.box[j]) > limit + rounding) continue;
                if (gapAlongMiddles(facesA.triangle[i], facesB.triangle[j]) > limit + rounding) continue;
                offer({facesA.faces.face[i], facesB.faces.face[j]}, facesA.triangle[i], facesB.triangle[j]);
                if (best.distance <= enough) return best;
            }
    }
    if (best.distance < options.upperBound) return best;
    Distance none;
    none.distance = options.upperBound;
    none.farther = true;
    return none;
}

}  // namespace tessera

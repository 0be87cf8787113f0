// What of a height field meets what, and where.
#include <algorithm>
#include <concepts>

#include "server/collision/representation/BlockDistance.h"
#include "server/collision/representation/FieldTouch.h"
#include "server/collision/representation/HeightFieldQueries.h"
#include "server/collision/representation/PartPairs.h"
#include "server/collision/representation/PartsOf.h"

namespace tessera {

namespace {

const Box& boundsOf(const TriangleTree& tree) {
    return tree.mesh().bounds();
}
const Box& boundsOf(const HeightField& field) {
    return field.bounds();
}
Triangle triangleOf(const TriangleTree& tree, std::uint32_t face) {
    return tree.mesh().triangle(face);
}
Triangle triangleOf(const HeightField& field, std::uint32_t face) {
    return field.triangle(face);
}

/// As found. Nothing where the field is the wrong one to walk over.
template <typename Other>
std::optional<FacePairs> overField(const HeightField& field, const Other& other, bool fieldIsA, const Affine3d& a_T_b,
                                   FieldTouch::For what, QueryWork& work) {
    const std::optional<FieldTouchFrame> frame = FieldTouchFrame::make(field, fieldIsA, a_T_b, boundsOf(other));
    if (!frame) return std::nullopt;
    const auto parts = partsOf(other, frame->field_T_other);
    FieldTouch search(field, parts, boundsOf(other), *frame, what, work);
    const bool complete = search.run();
    return FacePairs{std::move(search.pairs()), complete};
}

std::optional<FacePairs> overOne(const HeightField& a, const TriangleTree& b, const Affine3d& a_T_b,
                                 FieldTouch::For what, QueryWork& work) {
    return overField(a, b, true, a_T_b, what, work);
}
std::optional<FacePairs> overOne(const TriangleTree& a, const HeightField& b, const Affine3d& a_T_b,
                                 FieldTouch::For what, QueryWork& work) {
    return overField(b, a, false, a_T_b, what, work);
}
/// The smaller one is walked down.
std::optional<FacePairs> overOne(const HeightField& a, const HeightField& b, const Affine3d& a_T_b,
                                 FieldTouch::For what, QueryWork& work) {
    if (b.faceCount() > a.faceCount())
        if (std::optional<FacePairs> found = overField(b, a, false, a_T_b, what, work)) return found;
    return overField(a, b, true, a_T_b, what, work);
}

template <typename BodyA, typename BodyB>
FacePairs touching(const BodyA& a, const BodyB& b, const Affine3d& a_T_b, FieldTouch::For what, QueryWork& work) {
    if (isEmpty(a) || isEmpty(b)) return {};
    if (work.exhausted()) return {{}, false};
    if (std::optional<FacePairs> found = overOne(a, b, a_T_b, what, work)) return *std::move(found);
    // B is flattened: both are walked down in A's frame.
    const auto partsA = partsOf(a, Affine3d::Identity());
    const auto partsB = partsOf(b, a_T_b);
    FacePairs out;
    out.complete = eachNearPair(PartPair(partsA, partsB, a_T_b), 0, work,
                                [&](std::uint32_t faceA, std::uint32_t faceB, const Triangle& x, const Triangle& y) {
                                    if (trianglesIntersect(x, y)) out.pairs.push_back({faceA, faceB});
                                    return what == FieldTouch::For::kAll || out.pairs.empty();
                                });
    return out;
}

template <typename BodyA, typename BodyB>
TouchedPair first(const BodyA& a, const BodyB& b, const Affine3d& a_T_b, QueryWork& work) {
    const FacePairs found = touching(a, b, a_T_b, FieldTouch::For::kAny, work);
    if (!found.pairs.empty()) return {Touch::kYes, found.pairs.front()};
    return {found.complete ? Touch::kNo : Touch::kUnknown, {}};
}

template <typename BodyA, typename BodyB>
FacePairs all(const BodyA& a, const BodyB& b, const Affine3d& a_T_b, QueryWork& work) {
    FacePairs found = touching(a, b, a_T_b, FieldTouch::For::kAll, work);
    std::ranges::sort(found.pairs);
    return found;
}

template <typename BodyA, typename BodyB>
BodyContacts contacts(const BodyA& a, const BodyB& b, const Affine3d& a_T_b, QueryWork& work, std::size_t most) {
    const FacePairs found = all(a, b, a_T_b, work);
    BodyContacts out;
    out.complete = found.complete && found.pairs.size() <= most;
    for (std::size_t i = 0; i < std::min(most, found.pairs.size()); ++i) {
        const FacePair& pair = found.pairs[i];
        out.contacts.push_back({pair, contactOf(triangleOf(a, pair.a), transformed(a_T_b, triangleOf(b, pair.b)))});
    }
    return out;
}

NearestPoints measure(const Triangle& a, const Triangle& b) {
    return nearestPoints(a, b);
}

/// Of bodies that do not touch.
template <typename BodyA, typename BodyB>
Distance nearest(const BodyA& a, const BodyB& b, const Affine3d& a_T_b, QueryWork& work,
                 const DistanceOptions& options) {
    if constexpr (std::same_as<BodyA, TriangleTree>) {
        if (canBeNearestTo(a))
            return nearestToTree({FieldParts(b), b.bounds()}, a, true, a_T_b, work, options, -1, measure);
    } else if constexpr (std::same_as<BodyB, TriangleTree>) {
        if (canBeNearestTo(b))
            return nearestToTree({FieldParts(a), a.bounds()}, b, false, a_T_b, work, options, -1, measure);
    }
    const auto partsA = partsOf(a, Affine3d::Identity());
    const auto partsB = partsOf(b, a_T_b);
    return nearestPair(PartPair(partsA, partsB, a_T_b), work, options, -1, measure);
}

template <typename BodyA, typename BodyB>
Distance distance(const BodyA& a, const BodyB& b, const Affine3d& a_T_b, QueryWork& work,
                  const DistanceOptions& options) {
    if (isEmpty(a) || isEmpty(b)) {
        Distance none;
        none.distance = options.upperBound;
        none.farther = true;
        return none;
    }
    // Edges and corners do not see a triangle that is pierced in its middle: whether they meet is asked first.
    const TouchedPair touched = first(a, b, a_T_b, work);
    if (touched.touch == Touch::kYes) {
        const Vec3d point =
            contactOf(triangleOf(a, touched.faces.a), transformed(a_T_b, triangleOf(b, touched.faces.b))).point;
        return {0, touched.faces, point, point};
    }
    if (touched.touch == Touch::kUnknown) {
        Distance unknown;
        unknown.distance = 0;
        unknown.complete = false;
        return unknown;
    }
    return nearest(a, b, a_T_b, work, options);
}

}  // namespace

TouchedPair firstTouching(const HeightField& a, const TriangleTree& b, const Affine3d& a_T_b, QueryWork& work) {
    return first(a, b, a_T_b, work);
}
TouchedPair firstTouching(const TriangleTree& a, const HeightField& b, const Affine3d& a_T_b, QueryWork& work) {
    return first(a, b, a_T_b, work);
}
TouchedPair firstTouching(const HeightField& a, const HeightField& b, const Affine3d& a_T_b, QueryWork& work) {
    return first(a, b, a_T_b, work);
}

FacePairs allTouching(const HeightField& a, const TriangleTree& b, const Affine3d& a_T_b, QueryWork& work) {
    return all(a, b, a_T_b, work);
}
FacePairs allTouching(const TriangleTree& a, const HeightField& b, const Affine3d& a_T_b, QueryWork& work) {
    return all(a, b, a_T_b, work);
}
FacePairs allTouching(const HeightField& a, const HeightField& b, const Affine3d& a_T_b, QueryWork& work) {
    return all(a, b, a_T_b, work);
}

BodyContacts contactsBetween(const HeightField& a, const TriangleTree& b, const Affine3d& a_T_b, QueryWork& work,
                             std::size_t most) {
    return contacts(a, b, a_T_b, work, most);
}
BodyContacts contactsBetween(const TriangleTree& a, const HeightField& b, const Affine3d& a_T_b, QueryWork& work,
                             std::size_t most) {
    return contacts(a, b, a_T_b, work, most);
}
BodyContacts contactsBetween(const HeightField& a, const HeightField& b, const Affine3d& a_T_b, QueryWork& work,
                             std::size_t most) {
    return contacts(a, b, a_T_b, work, most);
}

Distance distanceBetween(const HeightField& a, const TriangleTree& b, const Affine3d& a_T_b, QueryWork& work,
                         const DistanceOptions& options) {
    return distance(a, b, a_T_b, work, options);
}
Distance distanceBetween(const TriangleTree& a, const HeightField& b, const Affine3d& a_T_b, QueryWork& work,
                         const DistanceOptions& options) {
    return distance(a, b, a_T_b, work, options);
}
Distance distanceBetween(const HeightField& a, const HeightField& b, const Affine3d& a_T_b, QueryWork& work,
                         const DistanceOptions& options) {
    return distance(a, b, a_T_b, work, options);
}

}  // namespace tessera

/// What the numbers in fields of CollisionObject and Interest mean: for whoever reads such a number and holds neither.
#pragma once

#include <cstdint>

namespace tessera {

/// Of CollisionObject: its kind, division, shape and volume, in this order.
struct CollisionWords {
    static constexpr std::int64_t kStatic = 0, kRigid = 1, kDeforming = 2;
    static constexpr std::int64_t kWhole = 0, kEachChild = 1, kEachGeometry = 2;
    static constexpr std::int64_t kTriangles = 0, kHull = 1, kHeightField = 2, kPoints = 3, kAutoShape = 4,
                                  kSpherical = 5, kDistanceField = 6, kFreeform = 7, kSphericalBezier = 8;
    static constexpr std::int64_t kAuto = 0, kSphere = 1, kAabb = 2, kObb = 3, kDop6 = 4, kDop14 = 5, kDop18 = 6,
                                  kDop26 = 7;
};

/// Of Interest: its response, mode, detail and show, in this order.
struct InterestWords {
    static constexpr std::int64_t kReport = 0, kStop = 1, kSlide = 2, kBounce = 3, kRollback = 4, kAsk = 5;
    static constexpr std::int64_t kPseudoDynamic = 0, kStatic = 1, kDynamic = 2, kDistance = 3, kIgnore = 4, kSelf = 5;
    static constexpr std::int64_t kAllFaces = 0, kYesOrNo = -1;
    static constexpr std::int64_t kShowPoints = 1, kShowNormals = 2, kShowFaces = 4;
};

}  // namespace tessera

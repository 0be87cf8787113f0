#include "server/collision/query/RealignedPlanes.h"

#include <gtest/gtest.h>

#include "tests/unit/query/Bodies.h"
#include "tests/unit/volume/Realigned.h"

namespace tessera {
namespace {

using namespace bodies;

float roundedUp(double x) {
    const float f = static_cast<float>(x);
    return static_cast<double>(f) < x ? std::nextafterf(f, 2 * std::abs(f) + 1) : f;
}

// What a kernel makes of them in float holds every point, and is hardly looser than the same in double.
TEST(RealignedPlanes, HoldEveryPointAndLittleMore) {
    for (std::uint64_t seed = 1; seed <= 400; ++seed) {
        Random random(seed);
        std::vector<Vec3d> points;
        const Vec3d shape(between(random, 0, 1), between(random, 0, 1), between(random, 0, 1)),
            centre = inCube(random, 0.5);
        double radius = 0;
        for (int i = 0; i < 20; ++i) {
            points.push_back(centre + 0.4 * inCube(random, 1).cwiseProduct(shape));
            radius = std::max(radius, points.back().norm());
        }
        for (const NamedMap& m : everyKindOfMap(random)) {
            if (m.map.linear().norm() > 1e9) continue;
            for (const DirectionSet set : {DirectionSet::k6, DirectionSet::k14, DirectionSet::k18, DirectionSet::k26})
                for (const PlaneChoice choice : {PlaneChoice::kThreePlanes, PlaneChoice::kBoxEnclosure}) {
                    const KDop own = KDop::around(set, points);
                    const std::size_t n = own.count();
                    kernel::Realigned realigned{};
                    const double stretch = m.map.linear().norm();
                    realignPlanes(realigned, set, m.map, radius, stretch, choice);
                    const KDop inDouble = tessera::realigned(PlaneWeights::make(set, set, m.map, choice), own);
                    const double size = stretch * radius + m.map.translation().norm();
                    for (std::size_t i = 0; i < 2 * n; ++i) {
                        float bound = realigned.offset[i];
                        for (std::size_t j = 0; j < 3; ++j) {
                            ASSERT_GE(realigned.weight[i][j], 0);
                            bound +=
                                realigned.weight[i][j] * roundedUp(own.halfPlane(realigned.row[i][j] / kernel::kWidth));
                        }
                        const Vec3d d = i < n ? directions(set)[i] : Vec3d(-directions(set)[i - n]);
                        for (const Vec3d& p : points)
                            ASSERT_GE(static_cast<double>(bound), (m.map * p).dot(d))
                                << "seed " << seed << ", " << m.name << ", plane " << i;
                        ASSERT_LE(static_cast<double>(bound), inDouble.halfPlane(i) + 1e-5 * size + 1e-30)
                            << "seed " << seed << ", " << m.name << ", plane " << i;
                    }
                }
        }
    }
}

}  // namespace
}  // namespace tessera

/// Which faces the narrow phase leaves to the sweeps, and how wide it says that gaps are, beside the depth of the two
/// (collision/convex).
#include <limits>

#include "common/math/Compose.h"
#include "server/collision/convex/ConvexQuery.h"
#include "server/collision/rigid_bodies/FaceContacts.h"
#include "server/collision/rigid_bodies/ShapeMemory.h"
#include "tests/unit/rigid_bodies/World.h"

namespace tessera::rigidbodytest {
namespace {

using namespace rigid;

using Random = std::mt19937_64;
double amount(Random& random, double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
}
Vec3d someplace(Random& random) {
    return {amount(random, -1, 1), amount(random, -1, 1), amount(random, -1, 1)};
}
Quatd someTurn(Random& random) {
    return Quatd(amount(random, -1, 1), amount(random, -1, 1), amount(random, -1, 1), amount(random, -1, 1))
        .normalized();
}

/// A box, a plate, a polygon without thickness, a ball, a tetrahedron, a prism.
std::vector<Vec3d> somePoints(Random& random) {
    const double size = amount(random, 0.3, 1.5);
    std::vector<Vec3d> out;
    switch (random() % 6) {
        case 0:
            return boxPoints(size * Vec3d(1, 0.6, 0.8));
        case 1:
            return boxPoints(size * Vec3d(1, 0.02, 0.7));
        case 2:
            for (int i = 0; i < 7; ++i) out.emplace_back(size * std::cos(0.9 * i), 0, size * std::sin(0.9 * i));
            return out;
        case 3:
            return spherePoints(0.5 * size, 10 + static_cast<int>(random() % 60));
        case 4:
            return {{0, size, 0}, {size, -0.3, 0.3}, {-size, -0.3, 0.4}, {0, -0.3, -size}};
        default:
            for (int i = 0; i < 16; ++i)
                out.emplace_back(0.4 * size * std::cos(i / 2 * 0.785), (i % 2 == 0 ? -0.6 : 0.6) * size,
                                 0.4 * size * std::sin(i / 2 * 0.785));
            return out;
    }
}

/// A hull in place.
class PlacedHull {
public:
    PlacedHull(const std::vector<Vec3d>& points, const Affine3d& to)
        : hull(*ConvexHull::make(points)), world(to), shape_(solidShape(hull)) {
        corners_.resize(shape_.corners.size());
        sides_.resize(shape_.sides());
        edges_.resize(placedEdges(shape_));
        solid = place(shape_, world, corners_, sides_, edges_);
    }
    PlacedHull(const PlacedHull&) = delete;
    PlacedHull& operator=(const PlacedHull&) = delete;

    /// Below 0: so deep in each other.
    [[nodiscard]] double gapTo(const ConvexHull& other, const Affine3d& otherWorld) const {
        ConvexWork work;
        return -hullDepth(hull, other, world.inverse() * otherWorld, work).depth;
    }

    ConvexHull hull;
    Affine3d world;
    PlacedSolid solid;

private:
    SolidShape shape_;
    std::vector<Vec3d> corners_;
    std::vector<PlacedSide> sides_;
    std::vector<PlacedEdge> edges_;
};

Affine3d somePose(Random& random, double far) {
    return composeTransform(far * someplace(random), someTurn(random), Vec3d::Ones());
}

TEST(NearFaces, NoneWithinReachIsLeftOutAndNoneIsNearerThanItSays) {
    std::size_t listed = 0, near = 0, left = 0;
    for (std::uint64_t seed = 1; seed <= 1'500; ++seed) {
        Random random(seed);
        const double waves = seed % 3 == 0 ? 0.0 : 0.2;
        const Shape ground = terrain(1.5, 3 + static_cast<int>(seed % 6), [&](double x, double z) {
            return waves * std::sin(4 * x + double(seed)) * std::cos(5 * z);
        });
        PlacedHull body(somePoints(random), somePose(random, 0.5));
        // Deep in it, in touch, nearly, beyond reach.
        body.world.translation().y() += amount(random, -0.1, 0.6);
        PlacedHull solid({body.hull.vertices().begin(), body.hull.vertices().end()}, body.world);
        ShapeMemory memory;
        const PlacedSurface surface{&ground.tree->mesh(), memory.of(*ground.tree, nullptr, 1).topology.get(),
                                    Affine3d::Identity()};
        FaceQuery query;
        query.margin = amount(random, 0, 0.3);
        query.slack = amount(random, 0, 0.3);
        query.fine = 5e-4;
        query.near = 0.01;
        query.approach = seed % 4 == 0 ? Vec3d(Vec3d::Zero()) : Vec3d(0.3 * someplace(random));
        std::vector<std::uint32_t> faces(ground.tree->mesh().faceCount());
        for (std::uint32_t f = 0; f < faces.size(); ++f) faces[f] = f;
        ClipScratch scratch;
        std::vector<NearFace> found;
        std::vector<ContactPoint> points;
        contactsWithFaces(solid.solid, surface, faces, query, scratch, found, points);
        const double reach = std::min(query.margin, query.slack);
        auto next = found.begin();
        for (const std::uint32_t face : faces) {
            const Triangle t = ground.tree->mesh().triangle(face);
            const double gap =
                solid.gapTo(*ConvexHull::make(std::vector<Vec3d>{t[0], t[1], t[2]}), Affine3d::Identity());
            near += gap <= reach;
            if (next == found.end() || next->face != face) {
                ++left;
                ASSERT_GT(gap, reach - 1e-9) << "seed " << seed << ", face " << face << " is not listed";
                continue;
            }
            ++listed;
            // Hulls are made of what lies in a plane to a ten-thousandth of their size.
            ASSERT_LE(next->gap, gap + 2e-4) << "seed " << seed << ", face " << face;
            ++next;
        }
        ASSERT_EQ(next, found.end()) << "seed " << seed;
    }
    EXPECT_GT(near, 10'000U);
    EXPECT_GT(left, 10'000U);
    EXPECT_LT(listed, 3 * near);
}

TEST(WidestGap, IsThatOfTheDepthAndDependsOnNothingRemembered) {
    std::size_t deep = 0, apart = 0;
    constexpr double kAll = std::numeric_limits<double>::infinity();
    for (std::uint64_t seed = 1; seed <= 20'000; ++seed) {
        Random random(seed);
        PlacedHull a(somePoints(random), somePose(random, 0.1)), b(somePoints(random), somePose(random, 1.2));
        if (a.solid.shape->flat && b.solid.shape->flat) continue;
        const double gap = a.gapTo(b.hull, b.world);
        const double flat = 2e-4 * (a.solid.radius + b.solid.radius);
        ClipScratch scratch;
        const SolidAxis first = widestGap(a.solid, b.solid, kAll, 0, {}, scratch);
        ASSERT_LE(first.gap, gap + flat) << "seed " << seed;
        if (gap < 0) {
            ++deep;
            ASSERT_GE(first.gap, gap - flat) << "seed " << seed;
        } else {
            ++apart;
            ASSERT_GE(first.gap, -flat) << "seed " << seed;
        }
        // Where to look first: nothing, the right axis, or any other.
        for (const auto kind :
             {first.kind, SolidAxis::Kind::kSideOfA, SolidAxis::Kind::kSideOfB, SolidAxis::Kind::kEdges}) {
            SolidMemory memory;
            memory.kind = kind;
            memory.a = kind == first.kind ? first.a : static_cast<std::uint32_t>(random() % a.solid.edges.size());
            memory.b = kind == first.kind ? first.b : static_cast<std::uint32_t>(random() % b.solid.edges.size());
            const SolidAxis again = widestGap(a.solid, b.solid, kAll, 0, memory, scratch);
            ASSERT_EQ(again.gap, first.gap) << "seed " << seed;
            ASSERT_EQ(again.kind, first.kind) << "seed " << seed;
            // Any that is wider than a margin will do, if it parts them.
            const double margin = amount(random, 0, 0.3);
            const SolidAxis wide = widestGap(a.solid, b.solid, margin, 0, memory, scratch);
            ASSERT_EQ(wide.gap > margin, first.gap > margin) << "seed " << seed;
            ASSERT_LE(wide.gap, gap + flat) << "seed " << seed;
        }
    }
    EXPECT_GT(deep, 3'000U);
    EXPECT_GT(apart, 3'000U);
}

}  // namespace
}  // namespace tessera::rigidbodytest

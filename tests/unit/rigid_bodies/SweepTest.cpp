/// What a sweep says of two ways, beside the depth of the two bodies (collision/convex) at many times.
#include <limits>

#include "server/collision/convex/ConvexQuery.h"
#include "server/collision/rigid_bodies/PathSweep.h"
#include "tests/unit/rigid_bodies/World.h"

namespace tessera::rigidbodytest {
namespace {

using namespace rigid;

using Random = std::mt19937_64;
double between(Random& random, double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
}
Vec3d inBall(Random& random) {
    while (true) {
        const Vec3d p(between(random, -1, 1), between(random, -1, 1), between(random, -1, 1));
        if (p.norm() <= 1 && p.norm() > 1e-3) return p;
    }
}
Quatd turn(Random& random, double most) {
    return turnBy(between(random, 0, most) * inBall(random).normalized(), 1);
}

/// A body of one part on its way, as the guard passes it.
class Mover {
public:
    Mover(const Shape& shape, const Affine3d& world, const BodyPath& path) : path_(path) {
        given_.tree = shape.tree.get();
        given_.hull = shape.hull.get();
        given_.world = world;
        part_.given = &given_;
        part_.surface = &memory_.of(*shape.tree, shape.hull.get(), 1);
        part_.box = shape.tree->mesh().bounds().transformed(world);
        if (!shape.hull) return;
        const SolidShape& solid = *part_.surface->solid;
        corners_.resize(solid.corners.size());
        sides_.resize(solid.sides());
        edges_.resize(placedEdges(solid));
        solid_ = place(solid, world, corners_, sides_, edges_);
    }
    Mover(const Mover&) = delete;
    Mover& operator=(const Mover&) = delete;

    [[nodiscard]] SweptPart swept() const {
        return {&path_, &part_, solid_.shape != nullptr ? &solid_ : nullptr, part_.box.size().norm()};
    }
    [[nodiscard]] Affine3d at(double t) const { return path_.at(t) * given_.world; }
    [[nodiscard]] const ConvexHull& hull() const { return *given_.hull; }
    [[nodiscard]] const TriangleMesh& mesh() const { return given_.tree->mesh(); }
    [[nodiscard]] const BodyPath& path() const { return path_; }
    void go(const BodyPath& path) { path_ = path; }

private:
    ShapeMemory memory_;
    RigidPart given_;
    FramePart part_;
    BodyPath path_;
    std::vector<Vec3d> corners_;
    std::vector<PlacedSide> sides_;
    std::vector<PlacedEdge> edges_;
    PlacedSolid solid_;
};

/// Below 0: so deep in each other.
HullDepth depthOf(const ConvexHull& a, const Affine3d& worldA, const ConvexHull& b, const Affine3d& worldB) {
    ConvexWork work;
    return hullDepth(a, b, worldA.inverse(Eigen::Isometry) * worldB, work);
}

Shape solidOf(Random& random, unsigned kind) {
    const double size = between(random, 0.5, 1.5);
    switch (kind % 4) {
        case 0:
            return hullShape(boxPoints(size * Vec3d(1, 0.6, 0.8)));
        case 1:
            return hullShape(boxPoints(size * Vec3d(1, 0.02, 0.7)));
        case 2:
            return hullShape(spherePoints(0.5 * size, 10 + static_cast<int>(random() % 20)));
        default:
            return hullShape({{0, size, 0}, {size, -0.3, 0.3}, {-size, -0.3, 0.4}, {0, -0.3, -size}});
    }
}

/// Some turn fast, some hardly, some stand still; some go together.
BodyPath wayOf(Random& random, const Vec3d& centre, double far) {
    if (random() % 8 == 0) return {centre, Vec3d::Zero(), Quatd::Identity()};
    const double turning = std::array{0.01, 0.2, 2.5}[random() % 3];
    return {centre, far * inBall(random), random() % 5 == 0 ? Quatd::Identity() : turn(random, turning)};
}

constexpr int kTimes = 60;
constexpr double kRounding = 1e-9;

/// So deep may they get by what is written in PathSweep.h and README.md.
double limitOf(double allowed, double start) {
    return std::min(-allowed, start - 0.01 * allowed);
}

struct Count {
    std::size_t hits = 0, early = 0, free = 0, roomy = 0, letGo = 0;
};

/// `gap(t)` of one pair; nothing before a hit, nothing at all without one is deeper than the limit.
template <typename Gap>
void judge(const SweepHit& hit, double allowed, const Gap& gap, const std::string& story, bool& real) {
    const double start = gap(0.0), limit = limitOf(allowed, start);
    if (start < -2 * allowed) return;
    for (int i = 0; i <= kTimes; ++i) {
        const double t = i / double(kTimes);
        if (hit.hit && t > hit.t) break;
        ASSERT_GE(gap(t), limit - kRounding) << story << ", at " << t << (hit.hit ? ", hit at " : ", no hit ") << hit.t;
    }
    if (hit.hit && gap(hit.t) <= limit + 0.005 * allowed + kRounding) real = true;
}

/// A little other ways, as far as the room allows.
BodyPath aside(Random& random, const BodyPath& path, double room, double radius) {
    for (double by = room; by > 1e-3 * room; by *= 0.5) {
        const BodyPath out(path.centre, path.moved + by * inBall(random), turn(random, by / radius) * path.turned);
        if (out.strayedFrom(path, radius) <= room) return out;
    }
    return path;
}

TEST(Sweep, SolidsGetNoDeeperThanItSays) {
    Count count;
    for (std::uint64_t seed = 1; seed <= 10'000; ++seed) {
        Random random(seed);
        const Shape shapeA = solidOf(random, static_cast<unsigned>(random())),
                    shapeB = solidOf(random, static_cast<unsigned>(random()));
        Affine3d worldA = Affine3d::Identity(), worldB = Affine3d::Identity();
        worldA.linear() = turn(random, 3).toRotationMatrix();
        worldB.linear() = turn(random, 3).toRotationMatrix();
        worldB.translation() = 2 * inBall(random);
        // In touch, nearly, or so deep as they may be.
        const HullDepth first = depthOf(*shapeA.hull, worldA, *shapeB.hull, worldB);
        const Vec3d normal = worldA.linear() * first.normal;
        const double wanted = seed % 3 == 0 ? between(random, 0, 0.3) : between(random, -0.016, 0.004);
        worldB.translation() += (first.depth + wanted) * normal;
        const Vec3d centreA = worldA.translation() + 0.1 * inBall(random), centreB = worldB.translation();
        const double far = std::array{0.02, 0.3, 3.0}[random() % 3];
        BodyPath wayA = wayOf(random, centreA, far), wayB = wayOf(random, centreB, far);
        if (seed % 7 == 0) {
            // On a tray.
            const Quatd both = turn(random, 0.4);
            wayA = {centreA, wayA.moved, both};
            wayB = {centreB, wayA.at(1) * centreB - centreB, both};
        }
        Mover a(shapeA, worldA, wayA), b(shapeB, worldB, wayB);
        const HullDepth start = depthOf(a.hull(), worldA, b.hull(), worldB);
        KnownGap known{-std::numeric_limits<double>::infinity(), Vec3d::Zero(), 0, 0, {}, {}, 0};
        if (seed % 2 == 0) known = {-start.depth - kRounding, worldA.linear() * start.normal, 0, 0, {}, {}, 0};
        const auto gap = [&](double t) { return -depthOf(a.hull(), a.at(t), b.hull(), b.at(t)).depth; };
        const double allowed = allowedDepth(a.swept(), b.swept());
        SweepScratch scratch;
        QueryWork work;
        const SweepHit hit = sweep(a.swept(), b.swept(), known, scratch, work);
        const std::string story = "seed " + std::to_string(seed);
        bool real = false;
        judge(hit, allowed, gap, story, real);
        if (::testing::Test::HasFatalFailure()) return;
        if (-start.depth < -2 * allowed) {
            ++count.letGo;
            EXPECT_FALSE(hit.hit) << story;
            continue;
        }
        count.hits += hit.hit;
        count.early += hit.hit && !real;
        count.free += !hit.hit;
        if (hit.hit || !(hit.room > 0) || hit.room > 10) continue;
        ++count.roomy;
        for (int again = 0; again < 3; ++again) {
            a.go(aside(random, wayA, 0.5 * hit.room, farthestOf(a.swept())));
            b.go(aside(random, wayB, 0.5 * hit.room, farthestOf(b.swept())));
            judge(hit, allowed, gap, story + ", aside by " + std::to_string(hit.room), real);
            if (::testing::Test::HasFatalFailure()) return;
        }
    }
    EXPECT_GT(count.hits, 1'500U);
    EXPECT_GT(count.free, 3'000U);
    EXPECT_GT(count.roomy, 1'000U);
    // The advance may give up before it is there.
    EXPECT_LT(count.early, count.hits / 25);
}

TEST(Sweep, ASolidGetsNoDeeperIntoAnyFaceThanItSays) {
    Count count;
    for (std::uint64_t seed = 1; seed <= 1'500; ++seed) {
        Random random(seed);
        const double waves = seed % 3 == 0 ? 0.0 : 0.15;
        const Shape ground = terrain(
            1.5, 5, [&](double x, double z) { return waves * std::sin(3 * x + double(seed)) * std::cos(4 * z); });
        const Shape shape = solidOf(random, static_cast<unsigned>(random()));
        Affine3d world = Affine3d::Identity(), worldOfGround = Affine3d::Identity();
        world.linear() = turn(random, 3).toRotationMatrix();
        double low = std::numeric_limits<double>::infinity();
        for (const Vec3d& p : shape.hull->vertices()) low = std::min(low, (world * p).y());
        world.translation() =
            Vec3d(between(random, -1, 1), -low + between(random, -0.02, 0.25), between(random, -1, 1));
        const double far = std::array{0.02, 0.4, 3.0}[random() % 3];
        BodyPath way = wayOf(random, world.translation(), far),
                 wayOfGround{Vec3d(0.5, 0, 0), Vec3d::Zero(), Quatd::Identity()};
        if (seed % 4 == 0) wayOfGround = {wayOfGround.centre, 0.3 * far * inBall(random), turn(random, 0.3)};
        Mover solid(shape, world, way), faces(ground, worldOfGround, wayOfGround);
        const bool solidIsA = seed % 2 == 0;
        // Normals of anything may be tried.
        std::vector<ContactPoint> points;
        for (std::uint64_t i = 0; i < seed % 4; ++i)
            points.push_back({world.translation(), inBall(random).normalized(), 0});
        std::vector<ConvexHull> hulls;
        for (std::uint32_t face = 0; face < faces.mesh().faceCount(); ++face) {
            const Triangle t = faces.mesh().triangle(face);
            hulls.push_back(*ConvexHull::make(std::vector<Vec3d>{t[0], t[1], t[2]}));
        }
        KnownGap known{0, Vec3d::Zero(), 0, -std::numeric_limits<double>::infinity(), {}, points, 0};
        // Of some those that are near are known, to some way; others are not to be looked at.
        std::vector<NearFace> near;
        if (seed % 5 < 3) {
            known.slack = between(random, 0.1, 1.5) * far;
            known.nearest = known.slack;
            for (std::uint32_t face = 0; face < hulls.size(); ++face) {
                const double gap = -depthOf(solid.hull(), world, hulls[face], worldOfGround).depth - kRounding;
                if (gap <= known.slack) near.push_back({face, gap - (seed % 2 == 0 ? 0 : 0.02)});
                known.nearest = std::min(known.nearest, gap - 0.02);
            }
            known.faces = near;
        }
        SweepScratch scratch;
        QueryWork work;
        const auto look = [&] {
            return solidIsA ? sweep(solid.swept(), faces.swept(), known, scratch, work)
                            : sweep(faces.swept(), solid.swept(), known, scratch, work);
        };
        const SweepHit hit = look();
        const double allowed = allowedDepth(solid.swept(), faces.swept());
        const std::string story = "seed " + std::to_string(seed);
        bool real = false;
        const auto all = [&](const std::string& when) {
            for (std::uint32_t face = 0; face < hulls.size(); ++face) {
                const auto gap = [&](double t) {
                    return -depthOf(solid.hull(), solid.at(t), hulls[face], faces.at(t)).depth;
                };
                judge(hit, allowed, gap, when + ", face " + std::to_string(face), real);
                if (::testing::Test::HasFatalFailure()) return;
            }
        };
        all(story);
        if (::testing::Test::HasFatalFailure()) return;
        count.hits += hit.hit;
        count.early += hit.hit && !real;
        count.free += !hit.hit;
        if (hit.hit || !(hit.room > 0)) continue;
        ++count.roomy;
        solid.go(aside(random, way, 0.5 * hit.room, farthestOf(solid.swept())));
        faces.go(aside(random, wayOfGround, 0.5 * hit.room, farthestOf(faces.swept())));
        all(story + ", aside by " + std::to_string(hit.room));
        if (::testing::Test::HasFatalFailure()) return;
    }
    EXPECT_GT(count.hits, 300U);
    EXPECT_GT(count.free, 300U);
    EXPECT_GT(count.roomy, 100U);
    EXPECT_LT(count.early, count.hits / 20);
}

TEST(Sweep, NoPointStraysFartherFromAnotherWayThanIsSaid) {
    double tightest = 0;
    for (std::uint64_t seed = 1; seed <= 2000; ++seed) {
        Random random(seed);
        const Vec3d centre = 10 * inBall(random);
        const double by = std::pow(10.0, between(random, -6, 0)), radius = between(random, 0.1, 3);
        const BodyPath one(centre, 2 * inBall(random), turn(random, 0.49));
        const BodyPath other(centre, one.moved + by * inBall(random), turn(random, std::min(by, 0.3)) * one.turned);
        const double bound = one.strayedFrom(other, radius);
        if (!std::isfinite(bound)) continue;
        double most = 0;
        for (int i = 0; i < 20; ++i) {
            const Vec3d point = centre + radius * inBall(random).normalized();
            for (int k = 0; k <= 40; ++k)
                most = std::max(most, (one.at(k / 40.0) * point - other.at(k / 40.0) * point).norm());
        }
        ASSERT_LE(most, bound * (1 + 1e-9) + 1e-14) << "seed " << seed;
        tightest = std::max(tightest, most / bound);
    }
    EXPECT_GT(tightest, 0.7);
}

}  // namespace
}  // namespace tessera::rigidbodytest

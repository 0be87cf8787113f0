#include "server/collision/query/RayQuery.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "tests/unit/motion/Bodies.h"

namespace tessera {
namespace {

using bodies::Body;

constexpr VolumeKind kKinds[] = {VolumeKind::kSphere, VolumeKind::kAabb,  VolumeKind::kObb,  VolumeKind::kDop6,
                                 VolumeKind::kDop14,  VolumeKind::kDop18, VolumeKind::kDop26};

/// Where the ray pierces a face, by the plane and the signed volumes of the ray with the edges; far from how the query
/// does it.
std::optional<double> pierces(const Triangle& t, const Ray& ray) {
    const Vec3d n = (t[1] - t[0]).cross(t[2] - t[0]);
    const double along = n.dot(ray.direction);
    if (along == 0) return std::nullopt;
    const double at = n.dot(t[0] - ray.origin) / along;
    if (!(at >= 0)) return std::nullopt;
    double side[3];
    for (std::size_t i = 0; i < 3; ++i)
        side[i] = ray.direction.dot((t[i] - ray.origin).cross(t[(i + 1) % 3] - ray.origin));
    const bool in = (side[0] >= 0 && side[1] >= 0 && side[2] >= 0) || (side[0] <= 0 && side[1] <= 0 && side[2] <= 0);
    return in ? std::optional<double>(at) : std::nullopt;
}

std::optional<RayHit> bruteForce(const TriangleMesh& mesh, const Ray& ray, double maxT) {
    std::optional<RayHit> best;
    for (std::uint32_t f = 0; f < mesh.faceCount(); ++f)
        if (const auto t = pierces(mesh.triangle(f), ray); t && *t <= maxT && (!best || *t < best->t))
            best = RayHit{f, *t};
    return best;
}

/// Rays from near, from within and from far away, at the body and past it. Answers how many met something.
int compare(const Body& body, const TriangleTree& tree, unsigned seed, int rays) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> u(-1, 1);
    const TriangleMesh mesh = body.mesh();
    const Vec3d centre = mesh.bounds().center();
    const double size = mesh.bounds().size().norm();
    int hits = 0;
    for (int i = 0; i < rays; ++i) {
        const double from = i % 3 == 0 ? 0.3 : i % 3 == 1 ? 1.0 : 300.0;
        Ray ray;
        ray.origin = centre + from * size * Vec3d(u(random), u(random), u(random));
        ray.direction = centre + 0.5 * size * Vec3d(u(random), u(random), u(random)) - ray.origin;
        if (i % 7 == 0) ray.direction[i % 2] = 0;
        const double maxT = i % 5 == 0 ? 1.0 : std::numeric_limits<double>::infinity();
        const auto found = castRay(tree, ray, maxT), truth = bruteForce(mesh, ray, maxT);
        if (found.has_value() != truth.has_value() ||
            (found && std::abs(found->t - truth->t) > 1e-9 * (1 + truth->t))) {
            ADD_FAILURE() << "seed " << seed << ", ray " << i << ": " << (found ? found->t : -1) << " for "
                          << (truth ? truth->t : -1);
            continue;
        }
        if (!found) continue;
        ++hits;
        // Of the faces that are as near, the lowest; of one that is alone, itself.
        const auto own = pierces(mesh.triangle(found->face), ray);
        EXPECT_TRUE(own && std::abs(*own - truth->t) <= 1e-9 * (1 + truth->t)) << "seed " << seed << ", ray " << i;
    }
    return hits;
}

TEST(RayQuery, FindsWhatBruteForceFindsInEveryKindOfTree) {
    std::mt19937 random(5);
    const Body soup = bodies::soup(random, 300), ball = bodies::sphere(1, 20, 30),
               ring = bodies::torus(0.8, 0.3, 40, 24);
    for (const Body* body : {&soup, &ball, &ring})
        for (const VolumeKind kind : kKinds) {
            const TriangleTree tree(body->mesh(), {.volume = kind});
            const int hits = compare(*body, tree, 11 + static_cast<unsigned>(kind), 300);
            EXPECT_GT(hits, 80);
            EXPECT_LT(hits, 300);
        }
}

TEST(RayQuery, FindsWhatBruteForceFindsOnARealModel) {
    const auto file = bodies::dataFolder() / "meshes/spot/spot_low_resolution.obj";
    if (!std::filesystem::exists(file))
        GTEST_SKIP() << "no test data at " << bodies::dataFolder() << " (set TESSERA_TEST_DATA)";
    const Body spot = bodies::readObj(file);
    EXPECT_GT(compare(spot, spot.tree(), 21, 600), 150);
    const Body far = spot.moved(Vec3d(1e6, -2e6, 3e5));
    EXPECT_GT(compare(far, far.tree(), 22, 300), 50);
}

/// Where along the ray is the nearest of all triangles? In long double, and from a point near the mesh: of 1e9 sizes
/// away, 1e-10 of the size is left for what rounding does.
std::optional<long double> nearestOfAll(const TriangleMesh& mesh, const Ray& ray) {
    using Vec = Eigen::Matrix<long double, 3, 1>;
    const Vec direction = ray.direction.cast<long double>();
    const Vec away = mesh.bounds().center().cast<long double>() - ray.origin.cast<long double>();
    const long double before = away.dot(direction) / direction.dot(direction);
    const Vec origin = ray.origin.cast<long double>() + before * direction;
    std::optional<long double> best;
    for (std::uint32_t f = 0; f < mesh.faceCount(); ++f) {
        const Triangle t = mesh.triangle(f);
        const Vec a = t[0].cast<long double>() - origin, b = t[1].cast<long double>() - origin,
                  c = t[2].cast<long double>() - origin;
        const long double u = direction.dot(b.cross(c)), v = direction.dot(c.cross(a)), w = direction.dot(a.cross(b));
        if (!((u >= 0 && v >= 0 && w >= 0) || (u <= 0 && v <= 0 && w <= 0)) || u + v + w == 0) continue;
        const Vec on = (u * a + v * b + w * c) / (u + v + w);
        const long double at = before + on.dot(direction) / direction.dot(direction);
        if (at >= 0 && (!best || at < *best)) best = at;
    }
    return best;
}

/// Rays from `from` sizes away at points of the body and a little beside it. Answers how many met something.
int compareFromAfar(const Body& body, const TriangleTree& tree, double from, unsigned seed, int rays) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> u(-1, 1);
    std::normal_distribution<double> n;
    const TriangleMesh mesh = body.mesh();
    const Vec3d centre = mesh.bounds().center();
    const double size = mesh.bounds().size().norm();
    int hits = 0;
    for (int i = 0; i < rays; ++i) {
        Ray ray;
        ray.origin = centre + from * size * Vec3d(n(random), n(random), n(random)).normalized();
        // Beside edges: who passes one by less than a rounding may be told either way.
        Vec3d at = mesh.positions()[random() % mesh.vertexCount()];
        if (i % 2 == 0) at = 0.5 * (at + mesh.positions()[random() % mesh.vertexCount()]);
        at += (i % 3 != 0 ? 0.2 : 0.01) * size * Vec3d(u(random), u(random), u(random));
        ray.direction = (at - ray.origin) * std::pow(10.0, 3 * u(random));
        const auto found = castRay(tree, ray, std::numeric_limits<double>::infinity());
        const std::optional<long double> truth = nearestOfAll(mesh, ray);
        if (found.has_value() != truth.has_value()) {
            ADD_FAILURE() << from << " sizes away, ray " << i << " of seed " << seed << ": " << (found ? found->t : -1)
                          << " for " << double(truth.value_or(-1));
            continue;
        }
        if (!found) continue;
        ++hits;
        // The digits of t, and of the place on the mesh.
        const double rounding = 1e-15 * found->t + 1e-9 * size / ray.direction.norm();
        EXPECT_NEAR(found->t, double(*truth), rounding) << from << " sizes away, ray " << i << " of seed " << seed;
        EXPECT_TRUE(castRay(tree, ray, found->t)) << "as far is within";
        EXPECT_FALSE(castRay(tree, ray, found->t * (1 - 1e-15) - 2 * rounding)) << "beyond the end";
        EXPECT_FALSE(castRay(tree, {ray.origin, -ray.direction}, std::numeric_limits<double>::infinity()));
    }
    return hits;
}

TEST(RayQuery, FromVeryFarFindsWhatAllTrianglesSayInEveryKindOfTree) {
    std::mt19937 random(15);
    const Body soup = bodies::soup(random, 200), ball = bodies::sphere(1, 16, 24), wall = bodies::grid(12, 2),
               ring = bodies::torus(0.8, 0.05, 30, 12).moved(Vec3d(3, -5, 7));
    for (const Body* body : {&soup, &ball, &wall, &ring})
        for (const VolumeKind kind : kKinds) {
            const TriangleTree tree(body->mesh(), {.volume = kind});
            SCOPED_TRACE(testing::Message() << "volumes " << static_cast<int>(kind));
            for (const double from : {10.0, 30.0, 1e3, 1e5, 1e7, 1e9})
                EXPECT_GT(compareFromAfar(*body, tree, from, 31 + static_cast<unsigned>(kind), 30), 5);
        }
}

TEST(RayQuery, FromVeryFarFindsWhatAllTrianglesSayOnARealModel) {
    const auto file = bodies::dataFolder() / "meshes/spot/spot_low_resolution.obj";
    if (!std::filesystem::exists(file))
        GTEST_SKIP() << "no test data at " << bodies::dataFolder() << " (set TESSERA_TEST_DATA)";
    const Body spot = bodies::readObj(file);
    const TriangleTree tree(spot.mesh(), {.volume = VolumeKind::kObb});
    for (const double from : {1e3, 1e6, 1e9}) EXPECT_GT(compareFromAfar(spot, tree, from, 41, 60), 15);
}

TEST(RayQuery, OfEqualFacesTheLowest) {
    const Body ball = bodies::sphere(1, 12, 16);
    const TriangleTree once(ball.mesh()), thrice(ball.with(ball).with(ball).mesh());
    std::mt19937 random(6);
    std::normal_distribution<double> n;
    for (int i = 0; i < 100; ++i) {
        const Vec3d d = Vec3d(n(random), n(random), n(random)).normalized();
        const auto one = castRay(once, {-3 * d, d}, 10), three = castRay(thrice, {-3 * d, d}, 10);
        ASSERT_TRUE(one && three);
        EXPECT_EQ(three->t, one->t);
        EXPECT_EQ(three->face, one->face);
    }
}

TEST(RayQuery, DoesNotSlipThroughEdgesAndCorners) {
    const Body wall = bodies::grid(16, 2);  // edges along the axes and a diagonal per square
    for (int i = -15; i < 16; ++i)
        for (int j = -15; j < 16; ++j) {
            const auto hit = castRay(wall.tree(), {Vec3d(i / 16.0, j / 16.0, 4), -2 * Vec3d::UnitZ()}, 100);
            ASSERT_TRUE(hit) << i << ' ' << j;
            EXPECT_NEAR(hit->t, 2, 1e-14);
        }
}

TEST(RayQuery, WhatMissesLooksAtLittleHoweverFarItMayGo) {
    const Body wall = bodies::grid(64, 2);
    for (const double maxT : {100.0, std::numeric_limits<double>::infinity()})
        for (int i = 0; i < 20; ++i) {
            QueryWork work;
            EXPECT_FALSE(castRay(wall.tree(), {Vec3d(-4, 0.1 * i - 1, 0.1), Vec3d::UnitX()}, maxT, work));
            EXPECT_LT(work.boxTests + work.triangleTests, 1000u) << "of 8,192 faces";
            QueryWork little{.limit = 1};
            EXPECT_FALSE(castRay(wall.tree(), {Vec3d(0.1, 0.1, 4), -Vec3d::UnitZ()}, maxT, little)) << "exhausted";
            EXPECT_TRUE(little.exhausted());
        }
}

TEST(RayQuery, FromEitherSideAndFromWithinAndNotBehind) {
    const Body box = bodies::box(Vec3d(2, 2, 2));
    EXPECT_EQ(castRay(box.tree(), {Vec3d(0.1, 0.2, 0.3), Vec3d::UnitX()}, 10)->t, 0.9);
    EXPECT_EQ(castRay(box.tree(), {Vec3d(1, 0.2, 0.3), Vec3d::UnitX()}, 10)->t, 0) << "on the surface";
    EXPECT_FALSE(castRay(box.tree(), {Vec3d(3, 0, 0), Vec3d::UnitX()}, 10)) << "behind";
    EXPECT_FALSE(castRay(box.tree(), {Vec3d(0.1, 0.2, 3), -Vec3d::UnitZ()}, 1.9)) << "beyond the end";
    EXPECT_TRUE(castRay(box.tree(), {Vec3d(0.1, 0.2, 3), -Vec3d::UnitZ()}, 2)) << "at the end";
}

TEST(RayQuery, BadInputMeetsNothing) {
    const Body box = bodies::box(Vec3d(2, 2, 2)), nothing;
    const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
    const Ray good{Vec3d(0.1, 0.2, 3), -Vec3d::UnitZ()};
    EXPECT_TRUE(castRay(box.tree(), good, infinity));
    EXPECT_FALSE(castRay(nothing.tree(), good, infinity));
    EXPECT_FALSE(castRay(box.tree(), {good.origin, Vec3d::Zero()}, infinity));
    EXPECT_FALSE(castRay(box.tree(), {good.origin, Vec3d(0, 0, -infinity)}, infinity));
    EXPECT_FALSE(castRay(box.tree(), {Vec3d(nan, 0, 3), good.direction}, infinity));
    EXPECT_FALSE(castRay(box.tree(), good, nan));
    EXPECT_FALSE(castRay(box.tree(), good, -1));
}

}  // namespace
}  // namespace tessera

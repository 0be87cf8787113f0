#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "server/collision/mesh/TreeQueries.h"
#include "tests/unit/collision/BruteForce.h"
#include "tests/unit/collision/Shapes.h"

namespace tessera {
namespace {

using shapes::Soup;

Soup randomSoup(std::mt19937& random, std::size_t triangles, double size) {
    std::uniform_real_distribution<float> place(-1, 1);
    Soup soup;
    for (std::size_t i = 0; i < triangles; ++i) {
        const Vec3d center(place(random), place(random), place(random));
        for (int k = 0; k < 3; ++k) soup.vertex(center + size * Vec3d(place(random), place(random), place(random)));
        for (std::uint32_t k = 0; k < 3; ++k) soup.indices.push_back(static_cast<std::uint32_t>(3 * i) + k);
    }
    return soup;
}

Affine3d randomPose(std::mt19937& random, double reach) {
    std::normal_distribution<double> n;
    std::uniform_real_distribution<double> u(-reach, reach);
    return composeTransform(Vec3d(u(random), u(random), u(random)), Quatd(n(random), n(random), n(random), n(random)),
                            Vec3d::Ones());
}

TEST(TriangleMesh, SaysWhatIsWrong) {
    const std::vector<float> positions{0, 0, 0, 1, 0, 0, 0, 1, 0};
    const std::vector<std::uint32_t> indices{0, 1, 2};
    const auto make = [](std::span<const float> p, std::span<const std::uint32_t> i) {
        return TriangleMesh::make(p, i);
    };
    ASSERT_TRUE(make(positions, indices));
    EXPECT_EQ(make(positions, indices)->faceCount(), 1u);
    EXPECT_EQ(make(std::vector<float>{0, 0}, indices).error().message, "2 coordinates are no whole number of vertices");
    EXPECT_EQ(make(positions, std::vector<std::uint32_t>{0, 1}).error().message,
              "2 indices are no whole number of triangles");
    EXPECT_EQ(make(positions, std::vector<std::uint32_t>{0, 1, 3}).error().message, "triangle 0 names vertex 3 of 3");
    const std::vector<float> nan{0, 0, 0, 1, NAN, 0, 0, 1, 0};
    EXPECT_EQ(make(nan, indices).error().message, "vertex 1 has a coordinate that is not finite or too large");
    const std::vector<double> huge{0, 0, 0, 1e60, 0, 0, 0, 1, 0};
    EXPECT_FALSE(TriangleMesh::make(std::span<const double>(huge), indices));
    TriangleMeshLimits few;
    few.maxTriangles = 0;
    EXPECT_EQ(TriangleMesh::make(std::span<const float>(positions), indices, few).error().code, ErrorCode::kLimit);
}

TEST(AabbTree, HoldsEveryFaceOnceInBoxesThatFit) {
    std::mt19937 random(1);
    for (const std::size_t n : {1u, 2u, 4u, 5u, 100u, 3000u}) {
        const AabbTree tree = randomSoup(random, n, 0.1).tree();
        std::vector<int> seen(n, 0);
        for (const AabbTree::Node& node : tree.nodes()) {
            if (!node.leaf()) continue;
            EXPECT_LE(node.count, AabbTree::kMaxLeafFaces);
            for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
                ++seen[tree.faceOrder()[i]];
                for (const Vec3d& p : tree.mesh().triangle(tree.faceOrder()[i])) EXPECT_TRUE(node.box.contains(p));
            }
        }
        EXPECT_EQ(std::count(seen.begin(), seen.end(), 1), static_cast<std::ptrdiff_t>(n));
        for (std::size_t i = 0; i < tree.nodes().size(); ++i) {
            const AabbTree::Node& node = tree.nodes()[i];
            if (node.leaf()) continue;
            for (const std::size_t child : {i + 1, static_cast<std::size_t>(node.first)}) {
                EXPECT_TRUE(node.box.contains(tree.nodes()[child].box.lower));
                EXPECT_TRUE(node.box.contains(tree.nodes()[child].box.upper));
            }
        }
    }
}

TEST(AabbTree, StaysShallowWhateverTheMesh) {
    // Each triangle twice as far as the last, and ten thousand times the same one: the worst cases of surface splits.
    Soup growing, same;
    for (std::uint32_t i = 0; i < 120; ++i) {
        const double x = std::ldexp(1.0, static_cast<int>(i) - 60);
        growing.vertex(Vec3d(x, 0, 0));
        growing.vertex(Vec3d(x * 1.1, 0, 0));
        growing.vertex(Vec3d(x, x * 0.1, 0));
    }
    for (std::uint32_t i = 0; i < 360; ++i) growing.indices.push_back(i);
    same.vertex(Vec3d(0, 0, 0));
    same.vertex(Vec3d(1, 0, 0));
    same.vertex(Vec3d(0, 1, 0));
    for (int i = 0; i < 10'000; ++i) same.indices.insert(same.indices.end(), {0, 1, 2});
    EXPECT_LE(growing.tree().depth(), 56u);
    EXPECT_LE(same.tree().depth(), 14u);
}

TEST(AabbTree, OfNothingMeetsNothing) {
    const AabbTree nothing{TriangleMesh()};
    const AabbTree box = shapes::box(Vec3d::Ones()).tree();
    QueryWork work;
    EXPECT_EQ(anyTouching(nothing, box, Affine3d::Identity(), work), Touch::kNo);
    EXPECT_EQ(anyTouching(box, nothing, Affine3d::Identity(), work), Touch::kNo);
    EXPECT_FALSE(nothing.castRay({Vec3d(0, 0, 5), -Vec3d::UnitZ()}, 100));
    EXPECT_TRUE(nothing.facesNear(box.mesh().bounds()).empty());
}

TEST(TreeQueries, EqualBruteForceUnderAnyAffineMap) {
    std::mt19937 random(2);
    std::uniform_real_distribution<double> factor(0.3, 2.0);
    std::size_t met = 0;
    for (int trial = 0; trial < 150; ++trial) {
        const AabbTree a = randomSoup(random, 60 + trial % 90, 0.15).tree();
        const AabbTree b = randomSoup(random, 1 + trial, 0.15).tree();
        Affine3d pose = randomPose(random, 1.5);
        // Non-uniform scale every third time, mirrored every sixth, sheared every fifth.
        if (trial % 3 == 0)
            pose.linear() *= Vec3d(factor(random), factor(random), (trial % 6 ? -1 : 1) * factor(random)).asDiagonal();
        if (trial % 5 == 0) pose.linear()(0, 1) += 0.7;
        const std::vector<FacePair> truth = bruteForce(a.mesh(), b.mesh(), pose);
        QueryWork work;
        const FacePairs all = allTouching(a, b, pose, work);
        EXPECT_TRUE(all.complete);
        ASSERT_EQ(all.pairs, truth) << trial;
        EXPECT_EQ(anyTouching(a, b, pose, work), truth.empty() ? Touch::kNo : Touch::kYes);
        met += !truth.empty();
    }
    EXPECT_GT(met, 50u);
    EXPECT_LT(met, 150u);
}

TEST(TreeQueries, CubesTouchAtExactlyTheirSize) {
    const AabbTree cube = shapes::box(Vec3d::Ones()).tree();
    const auto at = [](double x, double y, double z) { return Affine3d(Eigen::Translation3d(x, y, z)); };
    QueryWork work;
    const auto touch = [&](const Affine3d& pose) { return anyTouching(cube, cube, pose, work) == Touch::kYes; };
    EXPECT_TRUE(touch(at(1, 0, 0))) << "face to face";
    EXPECT_TRUE(touch(at(1, 1, 0))) << "edge to edge";
    EXPECT_TRUE(touch(at(1, 1, 1))) << "corner to corner";
    EXPECT_TRUE(touch(at(0, 0, 0))) << "in the same place";
    EXPECT_FALSE(touch(at(std::nextafter(1.0, 2.0), 0, 0)));
    EXPECT_FALSE(touch(at(1, 1, std::nextafter(1.0, 2.0))));
    const AabbTree small = shapes::box(Vec3d::Constant(0.5)).tree();
    EXPECT_EQ(anyTouching(cube, small, at(0.1, 0, 0), work), Touch::kNo) << "surfaces: inside is not touching";
    // Far from the origin the last bit of the sum decides, and the boxes must not be tighter than the vertices.
    const double far = 1e6;
    EXPECT_EQ(touch(at(far, 0, 0)), false);
    const AabbTree there = [&] {
        Soup soup = shapes::box(Vec3d::Ones());
        return soup.tree();
    }();
    EXPECT_EQ(anyTouching(there, cube, Affine3d(Eigen::Translation3d(far, 0, 0)) * at(1 - far, 0, 0), work),
              Touch::kYes);
}

TEST(TreeQueries, SpheresTouchAtTheSumOfTheirRadii) {
    const AabbTree a = shapes::sphere(1.0, 60, 120).tree();
    const AabbTree b = shapes::sphere(0.5, 40, 80).tree();
    std::mt19937 random(3);
    std::normal_distribution<double> n;
    // A mesh of a sphere lies between the radius and radius·cos(half the steps).
    const double slack = 1.5 * (1 - std::cos(1.5 * std::numbers::pi / 40)) + 1e-6;
    for (int trial = 0; trial < 200; ++trial) {
        const Vec3d direction = Vec3d(n(random), n(random), n(random)).normalized();
        const Quatd turn = Quatd(n(random), n(random), n(random), n(random)).normalized();
        const auto at = [&](double distance) { return composeTransform(distance * direction, turn, Vec3d::Ones()); };
        QueryWork work;
        EXPECT_EQ(anyTouching(a, b, at(1.5 + 1e-6), work), Touch::kNo);
        EXPECT_EQ(anyTouching(a, b, at(1.5 - slack), work), Touch::kYes);
        EXPECT_EQ(anyTouching(a, b, at(0.5 + slack), work), Touch::kYes);
        EXPECT_EQ(anyTouching(a, b, at(0.5 - slack), work), Touch::kNo) << "wholly inside";
    }
}

TEST(TreeQueries, SwapExactMotionAndPermutedFacesChangeNothing) {
    std::mt19937 random(4);
    const Soup soupA = randomSoup(random, 200, 0.2), soupB = randomSoup(random, 150, 0.2);
    const AabbTree a = soupA.tree(), b = soupB.tree();
    QueryWork work;
    const std::vector<FacePair> straight = allTouching(a, b, Affine3d::Identity(), work).pairs;
    ASSERT_GT(straight.size(), 20u);

    std::vector<FacePair> swapped = allTouching(b, a, Affine3d::Identity(), work).pairs;
    for (FacePair& p : swapped) std::swap(p.a, p.b);
    std::sort(swapped.begin(), swapped.end());
    EXPECT_EQ(swapped, straight);

    // A quarter turn and a doubling are exact in floating point, so not one pair may differ.
    Affine3d turn = Affine3d::Identity();
    turn.linear() << 0, -2, 0, 2, 0, 0, 0, 0, 2;
    Soup turnedA;
    for (std::size_t v = 0; v < a.mesh().vertexCount(); ++v)
        turnedA.vertex(turn * Vec3d(soupA.positions[3 * v], soupA.positions[3 * v + 1], soupA.positions[3 * v + 2]));
    turnedA.indices = soupA.indices;
    EXPECT_EQ(allTouching(turnedA.tree(), b, turn, work).pairs, straight);

    std::vector<std::uint32_t> order(a.mesh().faceCount());
    for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = i;
    std::shuffle(order.begin(), order.end(), random);
    Soup permuted = soupA;
    for (std::size_t i = 0; i < order.size(); ++i)
        for (std::size_t k = 0; k < 3; ++k) permuted.indices[3 * i + k] = soupA.indices[3 * order[i] + (k + 1) % 3];
    std::vector<FacePair> renamed = allTouching(permuted.tree(), b, Affine3d::Identity(), work).pairs;
    for (FacePair& p : renamed) p.a = order[p.a];
    std::sort(renamed.begin(), renamed.end());
    EXPECT_EQ(renamed, straight);
}

TEST(TreeQueries, GiveUpWhereTheWorkIsUsedUpAndSaySo) {
    const AabbTree sphere = shapes::sphere(1, 40, 80).tree();
    const Affine3d pose = Affine3d(Eigen::Translation3d(0.3, 0.2, 0.1));
    QueryWork free;
    ASSERT_EQ(anyTouching(sphere, sphere, pose, free), Touch::kYes);
    QueryWork little{.limit = 3};
    EXPECT_EQ(anyTouching(sphere, sphere, pose, little), Touch::kUnknown);
    QueryWork some{.limit = 2000};
    const FacePairs part = allTouching(sphere, sphere, pose, some);
    EXPECT_FALSE(part.complete);
    EXPECT_LT(some.boxTests + some.triangleTests, 2100u);
}

TEST(TreeQueries, WorkFarLessThanBruteForce) {
    const AabbTree sphere = shapes::sphere(1, 100, 200).tree();  // 39,600 triangles
    QueryWork apart;
    EXPECT_EQ(anyTouching(sphere, sphere, Affine3d(Eigen::Translation3d(2.01, 0, 0)), apart), Touch::kNo);
    EXPECT_LT(apart.boxTests, 200u);
    EXPECT_EQ(apart.triangleTests, 0u);
    QueryWork crossing;
    const FacePairs pairs = allTouching(sphere, sphere, Affine3d(Eigen::Translation3d(1, 0.01, 0.02)), crossing);
    EXPECT_GT(pairs.pairs.size(), 200u);
    EXPECT_LT(crossing.triangleTests, 20 * pairs.pairs.size());
    EXPECT_LT(crossing.boxTests, 60 * pairs.pairs.size());
}

TEST(TreeQueries, OnAStraightWayNothingIsPassedBy) {
    std::mt19937 random(6);
    std::normal_distribution<double> n;
    std::size_t passedThrough = 0, met = 0;
    for (int trial = 0; trial < 80; ++trial) {
        const AabbTree fixed = randomSoup(random, 60, 0.1).tree();
        const AabbTree moving = randomSoup(random, 3, 0.1).tree();
        const Affine3d start = randomPose(random, 3);
        const Vec3d shift = -1.7 * start.translation() + 0.3 * Vec3d(n(random), n(random), n(random));
        const auto at = [&](double f) { return Affine3d(Eigen::Translation3d(f * shift) * start); };
        QueryWork work;
        if (anyTouching(fixed, moving, at(0), work) != Touch::kNo) continue;
        const StraightMotion way{at(0), at(1), 0};
        const Touch onTheWay = anyTouchingOnTheWay(fixed, moving, way, work);
        const FacePairs all = allTouchingOnTheWay(fixed, moving, way, work);
        EXPECT_EQ(all.pairs.empty(), onTheWay == Touch::kNo);
        bool sampled = false;
        for (int i = 1; i <= 400; ++i)
            for (const FacePair& hit : allTouching(fixed, moving, at(i / 400.0), work).pairs) {
                sampled = true;
                EXPECT_TRUE(std::binary_search(all.pairs.begin(), all.pairs.end(), hit)) << trial;
            }
        met += onTheWay == Touch::kYes;
        passedThrough += sampled && anyTouching(fixed, moving, at(1), work) == Touch::kNo;
        // And nothing is met that is not there: with the way cut short of the first touch it is free.
        if (onTheWay == Touch::kYes) {
            double free = 0, blocked = 1;
            for (int i = 0; i < 40; ++i) {
                const double middle = 0.5 * (free + blocked);
                (anyTouchingOnTheWay(fixed, moving, {at(0), at(middle), 0}, work) == Touch::kNo ? free : blocked) =
                    middle;
            }
            const FacePairs first = allTouchingOnTheWay(fixed, moving, {at(free), at(blocked), 0}, work);
            ASSERT_FALSE(first.pairs.empty());
            const NearestPoints near = nearestPoints(fixed.mesh().triangle(first.pairs[0].a),
                                                     transformed(at(free), moving.mesh().triangle(first.pairs[0].b)));
            EXPECT_LT(near.distance, 1e-9);
        }
    }
    EXPECT_GT(passedThrough, 5u);
    EXPECT_GT(met, 10u);
    EXPECT_LT(met, 78u);
}

TEST(AabbTree, RaysAgreeWithBruteForceAndTheSphere) {
    std::mt19937 random(8);
    std::normal_distribution<double> n;
    const AabbTree soup = randomSoup(random, 400, 0.3).tree();
    const AabbTree sphere = shapes::sphere(1, 80, 160).tree();
    int hits = 0;
    for (int trial = 0; trial < 500; ++trial) {
        const Vec3d from = 2.5 * Vec3d(n(random), n(random), n(random)).normalized();
        const Ray ray{from, Vec3d(n(random), n(random), n(random)) - from};
        std::optional<AabbTree::RayHit> best;
        for (std::uint32_t f = 0; f < soup.mesh().faceCount(); ++f) {
            const Triangle t = soup.mesh().triangle(f);
            // Another way than the library's: solve for the barycentric coordinates and t.
            Mat3d m;
            m << t[1] - t[0], t[2] - t[0], -ray.direction;
            const Vec3d x = m.inverse() * (ray.origin - t[0]);
            if (x[0] >= 0 && x[1] >= 0 && x[0] + x[1] <= 1 && x[2] >= 0 && (!best || x[2] < best->t))
                best = AabbTree::RayHit{f, x[2]};
        }
        const auto hit = soup.castRay(ray, 1e9);
        ASSERT_EQ(hit.has_value(), best.has_value()) << trial;
        if (!hit) continue;
        ++hits;
        EXPECT_EQ(hit->face, best->face);
        EXPECT_NEAR(hit->t, best->t, 1e-9);
        EXPECT_FALSE(soup.castRay(ray, 0.999 * hit->t));
    }
    EXPECT_GT(hits, 50);
    for (int trial = 0; trial < 200; ++trial) {
        const Vec3d from = Vec3d(n(random), n(random), n(random)).normalized();
        const auto hit = sphere.castRay({3 * from, -from}, 1e9);
        ASSERT_TRUE(hit);
        EXPECT_NEAR(hit->t, 2.0, 1e-3);
        const auto fromInside = sphere.castRay({Vec3d::Zero(), from}, 1e9);
        ASSERT_TRUE(fromInside);
        EXPECT_NEAR(fromInside->t, 1.0, 1e-3);
    }
    EXPECT_FALSE(sphere.castRay({Vec3d(3, 0, 0), Vec3d(1, 0, 0)}, 1e9)) << "behind";
    EXPECT_FALSE(sphere.castRay({Vec3d(3, 0, 0), Vec3d::Zero()}, 1e9));
    EXPECT_FALSE(sphere.castRay({Vec3d(NAN, 0, 0), Vec3d(1, 0, 0)}, 1e9));
}

TEST(AabbTree, FacesNearABoxOrAPoint) {
    std::mt19937 random(9);
    const AabbTree soup = randomSoup(random, 300, 0.2).tree();
    std::uniform_real_distribution<double> place(-1, 1);
    std::size_t found = 0;
    for (int trial = 0; trial < 100; ++trial) {
        Box box;
        box.extend(Vec3d(place(random), place(random), place(random)));
        if (trial % 2 == 0) box.extend(Vec3d(place(random), place(random), place(random)));
        std::vector<std::uint32_t> truth;
        for (std::uint32_t f = 0; f < soup.mesh().faceCount(); ++f) {
            Box own;
            for (const Vec3d& p : soup.mesh().triangle(f)) own.extend(p);
            if (own.overlaps(box)) truth.push_back(f);
        }
        EXPECT_EQ(soup.facesNear(box), truth);
        found += truth.size();
    }
    EXPECT_GT(found, 100u);
}

}  // namespace
}  // namespace tessera

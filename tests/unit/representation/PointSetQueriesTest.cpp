// Balls against surfaces, hulls and each other: beside distances in long double, closed forms and the trees of points.
#include "common/math/Compose.h"
#include "server/collision/representation/PointSetQueries.h"

#include <gtest/gtest.h>

#include <limits>

#include "server/collision/representation/HeightFieldQueries.h"
#include "tests/unit/query/Bodies.h"
#include "tests/unit/representation/BallOracle.h"
#include "tests/unit/representation/Terrains.h"

namespace tessera {
namespace {

using oracle::Real;

std::string ballSeed(std::uint64_t seed) {
    return "seed " + std::to_string(seed);
}

std::vector<Vec3d> ballCentres(bodies::Random& random, std::size_t count, double half) {
    std::vector<Vec3d> out;
    for (std::size_t i = 0; i < count; ++i) out.push_back(bodies::inCube(random, half));
    return out;
}

/// Faces whatever the body is, in its own frame.
std::size_t facesOf(const TriangleTree& tree) {
    return tree.mesh().faceCount();
}
std::size_t facesOf(const HeightField& field) {
    return field.faceCount();
}
std::size_t facesOf(const PointSet& points) {
    return points.size();
}
std::size_t facesOf(const ConvexHull&) {
    return 1;
}

Triangle faceOf(const TriangleTree& tree, std::uint32_t face) {
    return tree.mesh().triangle(face);
}
Triangle faceOf(const HeightField& field, std::uint32_t face) {
    return field.triangle(face);
}
Triangle faceOf(const PointSet& points, std::uint32_t face) {
    return {points.point(face), points.point(face), points.point(face)};
}

/// How far apart the centre and the other's face are in A's frame; below 0 within a hull.
template <typename A, typename B>
Real bare(const A& a, const B& b, const Affine3d& a_T_b, const FacePair& faces) {
    if constexpr (std::same_as<A, ConvexHull>)
        return oracle::fromHull(a_T_b * b.point(faces.b), a, Affine3d::Identity());
    else if constexpr (std::same_as<B, ConvexHull>)
        return oracle::fromHull(a.point(faces.a), b, a_T_b);
    else if constexpr (std::same_as<A, PointSet>)
        return oracle::fromTriangle(a.point(faces.a), transformed(a_T_b, faceOf(b, faces.b)));
    else
        return oracle::fromTriangle(a_T_b * b.point(faces.b), faceOf(a, faces.a));
}

template <typename A, typename B>
Real radii(const A& a, const B& b, const Affine3d& a_T_b) {
    Real out = 0;
    if constexpr (std::same_as<A, PointSet>) out += static_cast<Real>(a.radius());
    if constexpr (std::same_as<B, PointSet>)
        out += static_cast<Real>(b.radius()) * static_cast<Real>(oracle::largestSingularValue(a_T_b.linear()));
    return out;
}

/// All that is said of two bodies, against distances in long double. How many pairs touch.
template <typename A, typename B>
std::size_t expectRight(const A& a, const B& b, const Affine3d& a_T_b, const std::string& story) {
    const Real sum = radii(a, b, a_T_b);
    QueryWork work;
    const FacePairs found = allTouching(a, b, a_T_b, work);
    EXPECT_TRUE(found.complete) << story;
    EXPECT_TRUE(std::ranges::is_sorted(found.pairs)) << story;
    // A hair of coordinates.
    Real extent = sum;
    for (std::uint32_t i = 0; i < facesOf(b); ++i)
        if constexpr (!std::same_as<B, ConvexHull>)
            for (const Vec3d& p : transformed(a_T_b, faceOf(b, i)))
                extent = std::max<Real>(extent, p.cwiseAbs().maxCoeff());
    const Real hair = 1e-11L * std::max<Real>(extent, 4);
    Real least = std::numeric_limits<Real>::infinity();
    std::size_t certain = 0;
    for (std::uint32_t i = 0; i < facesOf(a); ++i)
        for (std::uint32_t j = 0; j < facesOf(b); ++j) {
            const Real apart = bare(a, b, a_T_b, {i, j});
            least = std::min(least, apart);
            const bool in = std::ranges::binary_search(found.pairs, FacePair{i, j});
            if (apart < sum - hair) {
                EXPECT_TRUE(in) << story << ", pair " << i << ", " << j;
                ++certain;
            }
            if (apart > sum + hair) {
                EXPECT_FALSE(in) << story << ", pair " << i << ", " << j;
            }
        }
    const TouchedPair first = firstTouching(a, b, a_T_b, work);
    EXPECT_EQ(first.touch, found.pairs.empty() ? Touch::kNo : Touch::kYes) << story;
    if (!found.pairs.empty()) {
        EXPECT_TRUE(std::ranges::binary_search(found.pairs, first.faces)) << story;
    }

    const BallContacts contacts = contactsBetween(a, b, a_T_b, work);
    EXPECT_EQ(contacts.contacts.size(), found.pairs.size()) << story;
    for (std::size_t i = 0; i < std::min(contacts.contacts.size(), found.pairs.size()); ++i) {
        const BallContact& c = contacts.contacts[i];
        EXPECT_EQ(c.faces, found.pairs[i]) << story;
        EXPECT_NEAR(static_cast<double>(sum - bare(a, b, a_T_b, c.faces)), c.depth, static_cast<double>(hair)) << story;
        EXPECT_NEAR(c.normal.norm(), 1, 1e-12) << story;
        // So far along the normal, and they just touch.
        Affine3d free = a_T_b;
        free.pretranslate(c.depth * c.normal);
        EXPECT_NEAR(static_cast<double>(bare(a, b, free, c.faces)), static_cast<double>(sum),
                    static_cast<double>(hair) * 10)
            << story;
    }
    if (contacts.contacts.size() > 1) {
        EXPECT_FALSE(contactsBetween(a, b, a_T_b, work, 1).complete) << story;
        EXPECT_EQ(contactsBetween(a, b, a_T_b, work, 1).contacts.size(), 1u) << story;
    }

    const Distance d = distanceBetween(a, b, a_T_b, work);
    EXPECT_TRUE(d.complete && !d.farther) << story;
    EXPECT_NEAR(d.distance, static_cast<double>(std::max<Real>(0, least - sum)), static_cast<double>(hair)) << story;
    EXPECT_EQ(d.distance == 0, first.touch == Touch::kYes) << story;
    EXPECT_NEAR((d.onB - d.onA).norm(), d.distance, static_cast<double>(hair)) << story;
    if (d.distance > 0) {
        EXPECT_TRUE(distanceBetween(a, b, a_T_b, work, {.upperBound = 0.9 * d.distance}).farther) << story;
        EXPECT_EQ(distanceBetween(a, b, a_T_b, work, {.upperBound = 1.1 * d.distance}).distance, d.distance) << story;
        EXPECT_NEAR(distanceBetween(a, b, a_T_b, work, {.start = d.faces}).distance, d.distance,
                    1e-14 * static_cast<double>(extent))
            << story;
        const double loose = distanceBetween(a, b, a_T_b, work, {.tolerance = 0.1 * d.distance}).distance;
        EXPECT_TRUE(loose >= d.distance && loose <= 1.1 * d.distance + static_cast<double>(hair)) << story;
    }

    const BallDepth depth = depthBetween(a, b, a_T_b, work);
    EXPECT_TRUE(depth.known && depth.complete) << story;
    EXPECT_EQ(depth.touching, first.touch == Touch::kYes) << story;
    EXPECT_NEAR(depth.deepest.depth, static_cast<double>(sum - least), static_cast<double>(hair)) << story;
    EXPECT_NEAR(static_cast<double>(bare(a, b, a_T_b, depth.deepest.faces)), static_cast<double>(least),
                static_cast<double>(hair))
        << story;
    return certain;
}

std::vector<bodies::NamedMap> ballMaps(bodies::Random& random) {
    std::vector<bodies::NamedMap> out = bodies::everyKindOfMap(random);
    for (int i = 0; i < 3; ++i)
        out.push_back({"similar", composeTransform(bodies::inCube(random, 1.5), bodies::anyRotation(random),
                                                   Vec3d::Constant(bodies::between(random, 0.3, 1.5)))});
    return out;
}

TEST(Balls, AndSurfacesAreAsFarApartAsInLongDouble) {
    std::size_t pairs = 0;
    for (std::uint64_t seed = 1; seed <= 6; ++seed) {
        bodies::Random random(seed);
        const PointSet points = *PointSet::make(ballCentres(random, 1 + random() % 150, 1.2), seed % 3 ? 0.1 : 0.4);
        const TriangleTree tree(seed % 2 ? bodies::bumpy(random, 6, 8) : bodies::strewn(random, 60, 0.5),
                                {.volume = bodies::kVolumes[seed % 7]});
        const TriangleMesh mesh = terrains::make(random, terrains::anyTerrain(random)).mesh();
        const HeightField field = *HeightField::recognise(mesh);
        const PointSet others = *PointSet::make(ballCentres(random, 1 + random() % 90, 1), seed % 2 ? 0.2 : 0);
        for (const bodies::NamedMap& m : ballMaps(random)) {
            const std::string story = ballSeed(seed) + ", " + m.name;
            pairs += expectRight(points, tree, m.map, story + ", points and tree");
            pairs += expectRight(tree, points, m.map, story + ", tree and points");
            pairs += expectRight(points, field, m.map, story + ", points and field");
            pairs += expectRight(field, points, m.map, story + ", field and points");
            pairs += expectRight(points, others, m.map, story + ", points and points");
        }
    }
    EXPECT_GT(pairs, 3'000u);
}

TEST(Balls, AndHullsAreAsFarApartAndAsDeepAsInLongDouble) {
    std::size_t pairs = 0;
    for (std::uint64_t seed = 1; seed <= 12; ++seed) {
        bodies::Random random(seed);
        const PointSet points = *PointSet::make(ballCentres(random, 1 + random() % 60, 1.2), seed % 3 ? 0.1 : 0.4);
        std::vector<Vec3d> corners = ballCentres(random, 4 + random() % 40, 0.9);
        if (seed % 5 == 0) corners.resize(3);
        if (seed % 5 == 1) corners.resize(2);
        if (seed % 11 == 2) corners.resize(1);
        const ConvexHull hull = *ConvexHull::make(corners);
        for (const bodies::NamedMap& m : ballMaps(random)) {
            // Flat, and huge against the balls: for the test of flat ones, and without a depth that long double would
            // tell.
            if (std::abs(m.map.linear().determinant()) < 1e-3 || m.map.linear().norm() > 1e3) continue;
            const std::string story = ballSeed(seed) + ", " + m.name;
            pairs += expectRight(points, hull, m.map, story + ", points and hull");
            pairs += expectRight(hull, points, m.map, story + ", hull and points");
        }
    }
    EXPECT_GT(pairs, 500u);
}

TEST(Balls, MeetAFlattenedHull) {
    bodies::Random random(7);
    const ConvexHull hull = *ConvexHull::make(ballCentres(random, 30, 1));
    const PointSet points =
        *PointSet::make(std::vector<Vec3d>{Vec3d(0, 0, 0.2), Vec3d(0, 0, 0.6), Vec3d(0.1, 0, -0.1)}, 0.25);
    const Affine3d flat = composeTransform(Vec3d::Zero(), Quatd::Identity(), Vec3d(1, 1, 0));
    QueryWork work;
    EXPECT_EQ(allTouching(points, hull, flat, work).pairs, (std::vector<FacePair>{{0, 0}, {2, 0}}));
    EXPECT_NEAR(depthBetween(points, hull, flat, work).deepest.depth, 0.15, 1e-12);
}

/// What a ball of radius 5 on whole coordinates touches it touches exactly.
TEST(Balls, TouchingCounts) {
    const PointSet ball = *PointSet::make(std::vector<Vec3d>{Vec3d::Zero()}, 5);
    shapes::Soup soup;
    const auto triangle = [&](const Vec3d& a, const Vec3d& b, const Vec3d& c) {
        const auto n = static_cast<std::uint32_t>(soup.positions.size() / 3);
        soup.vertex(a), soup.vertex(b), soup.vertex(c);
        soup.indices.insert(soup.indices.end(), {n, n + 1, n + 2});
    };
    triangle({-9, -9, 5}, {9, -9, 5}, {0, 9, 5});     // a side
    triangle({3, 4, -2}, {3, 4, 7}, {20, 20, 1});     // an edge
    triangle({0, -3, -4}, {0, -9, -9}, {4, -9, -9});  // a corner
    triangle({3, 4, 1}, {3, 4, 7}, {20, 20, 1});      // not quite
    triangle({4, 0, 3}, {4, 0, 3}, {4, 0, 3});        // a point
    const TriangleTree tree(bodies::meshOf(soup));
    QueryWork work;
    const BallContacts found = contactsBetween(ball, tree, Affine3d::Identity(), work);
    ASSERT_EQ(found.contacts.size(), 4u);
    const Vec3d places[] = {{0, 0, 5}, {3, 4, 0}, {0, -3, -4}, {4, 0, 3}};
    const std::uint32_t faces[] = {0, 1, 2, 4};
    for (std::size_t i = 0; i < 4; ++i) {
        EXPECT_EQ(found.contacts[i].faces.b, faces[i]);
        EXPECT_LT((found.contacts[i].point - places[i]).norm(), 1e-14);
        EXPECT_LT((found.contacts[i].normal - places[i] / 5).norm(), 1e-15);
        EXPECT_NEAR(found.contacts[i].depth, 0, 1e-14);
    }
    // Turned and scaled, where rounding has a word: touching still counts.
    bodies::Random random(4);
    for (int i = 0; i < 200; ++i) {
        const double scale = bodies::between(random, 0.1, 9);
        const Affine3d map = composeTransform(Vec3d::Zero(), bodies::anyRotation(random), Vec3d::Constant(scale));
        const PointSet scaled = *PointSet::make(std::vector<Vec3d>{Vec3d::Zero()}, 5 * scale);
        EXPECT_EQ(allTouching(scaled, tree, map, work).pairs.size(), 4u) << "pose " << i;
        const Affine3d turn(map.rotation());
        EXPECT_EQ(allTouching(tree, ball, turn, work).pairs.size(), 4u) << "pose " << i;
    }
    const PointSet two = *PointSet::make(std::vector<Vec3d>{Vec3d(3, 4, 0), Vec3d(9, 0, 0)}, 2.5);
    EXPECT_EQ(allTouching(two, two, Affine3d::Identity(), work).pairs, (std::vector<FacePair>{{0, 0}, {1, 1}}));
    const Affine3d aside(Eigen::Translation3d(3, 4, 0));
    EXPECT_EQ(allTouching(two, two, aside, work).pairs, (std::vector<FacePair>{{0, 0}, {1, 1}}));
    const ConvexHull box = *ConvexHull::make(std::vector<Vec3d>{
        {5, -1, -1}, {5, 1, -1}, {5, -1, 1}, {5, 1, 1}, {7, -1, -1}, {7, 1, -1}, {7, -1, 1}, {7, 1, 1}});
    EXPECT_EQ(firstTouching(ball, box, Affine3d::Identity(), work).touch, Touch::kYes);
    EXPECT_EQ(firstTouching(ball, box, Affine3d(Eigen::Translation3d(1e-10, 0, 0)), work).touch, Touch::kNo);
}

/// Points without radius are the points of a tree, exactly: on whole coordinates, where everything touches.
TEST(Balls, WithoutRadiusAreThePointsOfATree) {
    std::size_t pairs = 0;
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
        bodies::Random random(seed);
        const auto whole = [&] { return static_cast<double>(static_cast<int>(random() % 5) - 2); };
        std::vector<Vec3d> at;
        shapes::Soup pointSoup, soup;
        for (std::uint32_t i = 0; i < 60; ++i) {
            at.emplace_back(whole(), whole(), whole());
            pointSoup.vertex(at.back());
            pointSoup.indices.insert(pointSoup.indices.end(), {i, i, i});
            soup.vertex(Vec3d(whole(), whole(), whole()));
            soup.indices.push_back(i);
        }
        const PointSet points = *PointSet::make(at, 0);
        const TriangleTree asTree(bodies::meshOf(pointSoup)), tree(bodies::meshOf(soup));
        const ConvexHull hull = *ConvexHull::make(std::vector<Vec3d>(at.begin(), at.begin() + 8));
        for (const Affine3d& map : {Affine3d::Identity(), Affine3d(Eigen::Translation3d(1, 0, -1)),
                                    composeTransform(Vec3d(0.5, 0, 0), bodies::anyRotation(random), Vec3d::Ones())}) {
            QueryWork work;
            const FacePairs is = allTouching(points, tree, map, work), was = allTouching(asTree, tree, map, work);
            EXPECT_EQ(is.pairs, was.pairs) << ballSeed(seed);
            EXPECT_EQ(allTouching(tree, points, map, work).pairs, allTouching(tree, asTree, map, work).pairs)
                << ballSeed(seed);
            EXPECT_EQ(allTouching(points, points, map, work).pairs, allTouching(asTree, asTree, map, work).pairs)
                << ballSeed(seed);
            EXPECT_NEAR(distanceBetween(points, tree, map, work).distance,
                        distanceBetween(asTree, tree, map, work).distance, 1e-14);
            pairs += is.pairs.size();
        }
        QueryWork work;
        const FacePairs inside = allTouching(points, hull, Affine3d::Identity(), work);
        for (std::uint32_t i = 0; i < at.size(); ++i)
            EXPECT_EQ(std::ranges::binary_search(inside.pairs, FacePair{i, 0}), hull.contains(at[i]))
                << ballSeed(seed) << ", point " << i;
    }
    EXPECT_GT(pairs, 500u);
}

TEST(Balls, AFieldAnswersAsTheTreeOfItsMesh) {
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
        bodies::Random random(seed);
        const TriangleMesh mesh = terrains::make(random, terrains::anyTerrain(random)).mesh();
        const TriangleTree tree(mesh);
        const HeightField field = *HeightField::recognise(mesh);
        const PointSet points = *PointSet::make(ballCentres(random, 300, 1), seed % 4 ? 0.05 : 0);
        for (const bodies::NamedMap& m : ballMaps(random)) {
            QueryWork work;
            const std::string story = ballSeed(seed) + ", " + m.name;
            EXPECT_EQ(allTouching(points, field, m.map, work).pairs, allTouching(points, tree, m.map, work).pairs)
                << story;
            EXPECT_EQ(allTouching(field, points, m.map, work).pairs, allTouching(tree, points, m.map, work).pairs)
                << story;
            EXPECT_EQ(distanceBetween(field, points, m.map, work).distance,
                      distanceBetween(tree, points, m.map, work).distance)
                << story;
        }
    }
}

TEST(Balls, GiveUpWhereToldToAndSaySo) {
    bodies::Random random(5);
    const PointSet points = *PointSet::make(ballCentres(random, 500, 1), 0.05);
    const TriangleTree tree(bodies::bumpy(random, 12, 16));
    const ConvexHull hull = *ConvexHull::make(ballCentres(random, 40, 0.8));
    const Affine3d away(Eigen::Translation3d(3, 0.2, 0));
    const auto expect = [&](const auto& other, const char* story) {
        QueryWork all, far;
        const std::vector<FacePair> truth = allTouching(points, other, Affine3d::Identity(), all).pairs;
        const double distance = distanceBetween(points, other, away, far).distance;
        ASSERT_GT(distance, 0) << story;
        double least = -1;
        for (std::uint64_t limit = 0; limit < all.boxTests + all.triangleTests; limit = limit * 3 / 2 + 1) {
            QueryWork work{.limit = limit};
            const FacePairs found = allTouching(points, other, Affine3d::Identity(), work);
            EXPECT_FALSE(found.complete) << story << ", " << limit;
            EXPECT_TRUE(std::ranges::includes(truth, found.pairs)) << story << ", " << limit;
            work = {.limit = limit};
            EXPECT_NE(firstTouching(points, other, Affine3d::Identity(), work).touch, Touch::kNo)
                << story << ", " << limit;
        }
        for (std::uint64_t limit = 0; limit < far.boxTests + far.triangleTests; limit = limit * 4 / 3 + 1) {
            QueryWork work{.limit = limit};
            const Distance found = distanceBetween(points, other, away, work);
            EXPECT_LE(found.distance, distance) << story << ", " << limit;
            EXPECT_FALSE(found.farther) << story << ", " << limit;
            if (!found.complete) least = std::max(least, found.distance);
            work = {.limit = limit};
            const BallDepth depth = depthBetween(points, other, away, work);
            EXPECT_EQ(depth.complete, depth.known) << story << ", " << limit;
        }
        EXPECT_GT(least, 0) << story << ": a bound that is always 0 says nothing";
    };
    expect(tree, "tree");
    expect(hull, "hull");
    expect(points, "points");
}

TEST(Balls, NoPointsMeetNothing) {
    bodies::Random random(6);
    const PointSet none = *PointSet::make({}, 1), some = *PointSet::make(ballCentres(random, 5, 1), 1);
    const TriangleTree tree(bodies::bumpy(random, 4, 5)), noTree{TriangleMesh{}};
    const ConvexHull hull = *ConvexHull::make(ballCentres(random, 9, 1));
    QueryWork work;
    const auto expect = [&](const auto& a, const auto& b) {
        EXPECT_EQ(firstTouching(a, b, Affine3d::Identity(), work).touch, Touch::kNo);
        EXPECT_TRUE(allTouching(a, b, Affine3d::Identity(), work).complete);
        EXPECT_TRUE(distanceBetween(a, b, Affine3d::Identity(), work).farther);
        EXPECT_FALSE(depthBetween(a, b, Affine3d::Identity(), work).known);
        EXPECT_TRUE(depthBetween(a, b, Affine3d::Identity(), work).complete);
        const Impact impact = timeOfImpact(a, BodyMotion{}, b, BodyMotion{}, work);
        EXPECT_TRUE(!impact.hit && impact.complete && impact.t == 1);
    };
    expect(none, tree);
    expect(tree, none);
    expect(none, some);
    expect(none, hull);
    expect(hull, none);
    expect(some, noTree);
}

}  // namespace
}  // namespace tessera

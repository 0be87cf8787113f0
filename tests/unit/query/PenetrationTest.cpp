#include "common/math/Compose.h"
#include "server/collision/query/Penetration.h"

#include <gtest/gtest.h>

#include "tests/unit/query/Bodies.h"

namespace tessera {
namespace {

using namespace bodies;

std::vector<Penetration> between(const TriangleMesh& a, const TriangleMesh& b, const Affine3d& a_T_b) {
    const TriangleTree ta(a), tb(b);
    QueryWork work;
    return penetrations(a, SurfaceTopology(a), b, SurfaceTopology(b), a_T_b,
                        contactsBetween(ta, tb, a_T_b, work).contacts);
}

/// Every face has three vertices of its own.
shapes::Soup apart(const shapes::Soup& whole) {
    shapes::Soup out;
    for (const std::uint32_t v : whole.indices) {
        out.indices.push_back(static_cast<std::uint32_t>(out.positions.size() / 3));
        for (int k = 0; k < 3; ++k) out.positions.push_back(whole.positions[3 * v + static_cast<std::uint32_t>(k)]);
    }
    return out;
}

TEST(SurfaceTopology, HoldsWhileTheSameVerticesAreInOnePlace) {
    Random random(3);
    TriangleMesh mesh = meshOf(apart(shapes::sphere(1, 9, 14)));
    const SurfaceTopology topology(mesh);
    ASSERT_TRUE(topology.closed());
    EXPECT_TRUE(topology.holds(mesh));
    std::vector<Vec3d> at(mesh.positions().begin(), mesh.positions().end());
    const std::vector<Vec3d> before = at;
    for (std::uint32_t v = 0; v < at.size(); ++v) at[v] += Vec3d(0.1 * std::sin(5 * before[v].y()), 0, 3);
    ASSERT_TRUE(mesh.move(at));
    EXPECT_TRUE(topology.holds(mesh)) << "all in one place go together";
    for (int trial = 0; trial < 200; ++trial) {
        std::vector<Vec3d> others = at;
        const std::size_t u = random() % at.size(), v = random() % at.size();
        if (trial % 2 == 0)
            others[u].x() = std::nextafter(others[u].x(), 100.0);
        else
            for (std::size_t w = 0; w < at.size(); ++w)
                if (at[w] == at[u]) others[w] = at[v];
        ASSERT_TRUE(mesh.move(others));
        EXPECT_EQ(topology.holds(mesh), trial % 2 == 1 && at[u] == at[v]) << trial;
    }
    for (Vec3d& p : at) p.z() = std::copysign(0.0, p.x());
    at[0] = Vec3d(0.0, 1, 2);
    EXPECT_FALSE(topology.holds(mesh));
}

TEST(SurfaceTopology, KnowsWhatIsClosed) {
    Random random(1);
    const TriangleMesh box = meshOf(shapes::box(Vec3d::Ones()));
    const SurfaceTopology topology(box);
    EXPECT_TRUE(topology.closed());
    for (std::uint32_t face = 0; face < box.faceCount(); ++face)
        for (unsigned i = 0; i < 3; ++i) {
            const std::uint32_t other = topology.across(face, i);
            ASSERT_NE(other, SurfaceTopology::kNone);
            bool back = false;
            for (unsigned k = 0; k < 3; ++k) back = back || topology.across(other, k) == face;
            EXPECT_TRUE(back);
        }
    EXPECT_TRUE(SurfaceTopology(bumpy(random, 9, 14)).closed());
    EXPECT_FALSE(SurfaceTopology(meshOf(shapes::sheet(1, 1))).closed());
    EXPECT_FALSE(SurfaceTopology(TriangleMesh()).closed());
    shapes::Soup open = shapes::box(Vec3d::Ones());
    open.indices.resize(open.indices.size() - 3);
    EXPECT_FALSE(SurfaceTopology(meshOf(open)).closed());
    shapes::Soup turned = shapes::box(Vec3d::Ones());
    std::swap(turned.indices[0], turned.indices[1]);
    EXPECT_FALSE(SurfaceTopology(meshOf(turned)).closed()) << "one face wound the other way";
    // Every triangle with corners of its own, as many files have them.
    const shapes::Soup whole = shapes::box(Vec3d::Ones());
    shapes::Soup apart;
    for (const std::uint32_t index : whole.indices) {
        for (std::size_t k = 0; k < 3; ++k) apart.positions.push_back(whole.positions[3 * index + k]);
        apart.indices.push_back(static_cast<std::uint32_t>(apart.indices.size()));
    }
    EXPECT_TRUE(SurfaceTopology(meshOf(apart)).closed());
}

TEST(Penetration, ABoxInTheFaceOfABoxIsAsDeepAsItSank) {
    const TriangleMesh table = meshOf(shapes::box(Vec3d(4, 4, 1))), box = meshOf(shapes::box(Vec3d::Ones()));
    for (const double depth : {0.3, 0.01, 1e-5}) {
        Affine3d pose = composeTransform(Vec3d(0.13, -0.21, 1 - depth), Quatd(Eigen::AngleAxisd(0.3, Vec3d::UnitZ())),
                                         Vec3d::Ones());
        for (const bool swapped : {false, true}) {
            const std::vector<Penetration> found =
                swapped ? between(box, table, pose.inverse(Eigen::Affine)) : between(table, box, pose);
            ASSERT_EQ(found.size(), 1U) << depth;
            ASSERT_TRUE(found[0].depth);
            EXPECT_NEAR(*found[0].depth, depth, 1e-9);
            EXPECT_LT((found[0].normal - (swapped ? Vec3d(-Vec3d::UnitZ()) : Vec3d(Vec3d::UnitZ()))).norm(), 1e-9);
        }
    }
}

TEST(Penetration, ABallInAWallIsAsDeepAsItsLowestPoint) {
    const TriangleMesh wall = meshOf(shapes::box(Vec3d(6, 6, 2)));
    const shapes::Soup soup = shapes::sphere(1, 40, 60);
    const TriangleMesh ball = meshOf(soup);
    for (const double depth : {0.9, 0.3, 0.05}) {
        const Affine3d pose = composeTransform(Vec3d(0.01, 0.02, 2 - depth), Quatd::Identity(), Vec3d::Ones());
        const std::vector<Penetration> found = between(wall, ball, pose);
        ASSERT_EQ(found.size(), 1U);
        EXPECT_NEAR(found[0].depth.value(), depth, 1e-6) << "the south pole is a vertex";
        EXPECT_LT((found[0].normal - Vec3d::UnitZ()).norm(), 1e-6);
    }
}

TEST(Penetration, TwoBallsAreAsDeepAsTheirRadiiOverlap) {
    const TriangleMesh ball = meshOf(shapes::sphere(1, 60, 90));
    Random random(3);
    for (const double depth : {0.5, 0.1}) {
        const Vec3d way = inCube(random, 1).normalized();
        const Affine3d pose = composeTransform((2 - depth) * way, anyRotation(random), Vec3d::Ones());
        const std::vector<Penetration> found = between(ball, ball, pose);
        ASSERT_EQ(found.size(), 1U);
        EXPECT_NEAR(found[0].depth.value(), depth, 0.01) << "facets lie up to 0.002 inside the sphere";
        EXPECT_LT((found[0].normal - way).norm(), 0.02);
        Affine3d mirrored = pose;
        mirrored.linear() *= -1;
        const std::vector<Penetration> again = between(ball, ball, mirrored);
        ASSERT_EQ(again.size(), 1U);
        EXPECT_NEAR(again[0].depth.value(), depth, 0.01);
        EXPECT_LT((again[0].normal - way).norm(), 0.02);
    }
}

TEST(Penetration, EachPlaceHasItsOwn) {
    // A table whose four feet sink into the ground, each as deep as it is long.
    shapes::Soup feet;
    const double depths[] = {0.1, 0.2, 0.3, 0.4};
    for (int i = 0; i < 4; ++i) {
        const shapes::Soup foot = shapes::box(Vec3d(0.2, 0.2, 1));
        const auto offset = static_cast<std::uint32_t>(feet.positions.size() / 3);
        for (std::size_t k = 0; k < foot.positions.size(); k += 3)
            feet.vertex(
                Vec3d(foot.positions[k] + (i & 1), foot.positions[k + 1] + (i & 2), foot.positions[k + 2] - depths[i]));
        for (const std::uint32_t index : foot.indices) feet.indices.push_back(offset + index);
    }
    const TriangleMesh ground = meshOf(shapes::box(Vec3d(9, 9, 2)));
    const Affine3d pose = composeTransform(Vec3d(0.03, 0.04, 1.5), Quatd::Identity(), Vec3d::Ones());
    const std::vector<Penetration> found = between(ground, meshOf(feet), pose);
    ASSERT_EQ(found.size(), 4U);
    std::vector<double> sorted;
    for (const Penetration& p : found) sorted.push_back(p.depth.value());
    std::sort(sorted.begin(), sorted.end());
    for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(sorted[i], depths[i], 1e-6);
}

TEST(Penetration, ARodThroughAPlateHasNone) {
    const TriangleMesh plate = meshOf(shapes::box(Vec3d(4, 4, 0.2))), rod = meshOf(shapes::box(Vec3d(0.3, 0.3, 5)));
    const std::vector<Penetration> found =
        between(plate, rod,
                composeTransform(Vec3d(0.1, 0.23, 0), Quatd(Eigen::AngleAxisd(0.2, Vec3d::UnitZ())), Vec3d::Ones()));
    for (const Penetration& p : found) {
        // Its corners are all outside: each curve stands for itself, and there is nothing between.
        EXPECT_TRUE(!p.depth || *p.depth < 1e-9);
    }
}

TEST(Penetration, OpenAndFlattenedBodiesHaveNone) {
    Random random(2);
    const TriangleMesh ball = bumpy(random, 12, 16), sheet = meshOf(shapes::sheet(3, 3));
    EXPECT_TRUE(between(ball, sheet, Affine3d::Identity()).empty());
    EXPECT_TRUE(between(ball, ball, composeTransform(Vec3d(0.3, 0, 0), anyRotation(random), Vec3d(1, 1, 0))).empty());
}

// Closer to what is seen: a random bumpy ball in another, against a fine sampling of what both share.
TEST(Penetration, NeverReachesFurtherThanTheBodies) {
    for (std::uint64_t seed = 1; seed <= 30; ++seed) {
        Random random(seed);
        const TriangleMesh a = bumpy(random, 16, 24), b = bumpy(random, 16, 24);
        const Vec3d way = inCube(random, 1).normalized();
        const Affine3d pose = composeTransform(1.7 * way, anyRotation(random), Vec3d::Ones());
        for (const Penetration& p : between(a, b, pose)) {
            if (!p.depth) continue;
            double high = -1e9, low = 1e9;
            for (std::size_t i = 0; i < a.vertexCount(); ++i) high = std::max(high, p.normal.dot(a.positions()[i]));
            for (std::size_t i = 0; i < b.vertexCount(); ++i)
                low = std::min(low, p.normal.dot(pose * b.positions()[i]));
            EXPECT_LE(*p.depth, high - low + 1e-9)
                << "seed " << seed << ": more than a translation along it that surely parts them";
            EXPECT_GT(*p.depth, 0);
        }
    }
}

}  // namespace
}  // namespace tessera

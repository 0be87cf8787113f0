// Surfaces covered by balls: every point of every triangle, no ball for nothing, few of them.
#include "server/collision/representation/BallCover.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "tests/unit/query/Bodies.h"
#include "tests/unit/representation/BallOracle.h"

namespace tessera::ball_covers {
namespace {

using namespace bodies;
using oracle::exact;
using oracle::Real;
using oracle::Vec;

struct Covered {
    std::string name;
    TriangleMesh mesh;
};

TriangleMesh meshOfCorners(const std::vector<Triangle>& triangles, const Vec3d& shift, double scale) {
    std::vector<double> positions;
    std::vector<std::uint32_t> indices;
    for (const Triangle& t : triangles)
        for (const Vec3d& p : t) {
            indices.push_back(static_cast<std::uint32_t>(indices.size()));
            for (int k = 0; k < 3; ++k) positions.push_back(scale * (p[k] + shift[k]));
        }
    return *TriangleMesh::make(std::span<const double>(positions), indices);
}

std::vector<Triangle> trianglesOf(const TriangleMesh& mesh) {
    std::vector<Triangle> out;
    for (std::uint32_t f = 0; f < mesh.faceCount(); ++f) out.push_back(mesh.triangle(f));
    return out;
}

/// Thin, long, flat, without area, large and small ones; near the origin and far from it; of every size that numbers
/// have.
std::vector<Covered> everyKindOfSurface(Random& random) {
    std::vector<Triangle> needles, large, flat, line, crumbs;
    for (int i = 0; i < 12; ++i) {
        const Vec3d at = inCube(random, 1), along = inCube(random, 1), aside = inCube(random, 1e-7);
        needles.push_back({at, at + along, at + 0.3 * along + aside});
        line.push_back({Vec3d(i, 2 * i, -i), Vec3d(i + 3, 2 * i + 6, -i - 3), Vec3d(i + 1, 2 * i + 2, -i - 1)});
    }
    for (int i = 0; i < 4; ++i) large.push_back({inCube(random, 1), inCube(random, 1), inCube(random, 1)});
    for (int i = 0; i < 20; ++i)
        flat.push_back({Vec3d(between(random, -1, 1), 0.25, between(random, -1, 1)),
                        Vec3d(between(random, -1, 1), 0.25, between(random, -1, 1)),
                        Vec3d(between(random, -1, 1), 0.25, between(random, -1, 1))});
    for (int i = 0; i < 200; ++i) {
        const Vec3d at = inCube(random, 1);
        crumbs.push_back({at, at + inCube(random, 1e-6), at + inCube(random, 1e-6)});
    }
    const std::vector<Triangle> loose = trianglesOf(strewn(random, 60, 0.5)), ball = trianglesOf(bumpy(random, 12, 17));
    std::vector<Covered> out;
    const Vec3d here = Vec3d::Zero(), there(3e5, -2e4, 7e5);
    out.push_back({"needles", meshOfCorners(needles, here, 1)});
    out.push_back({"large", meshOfCorners(large, here, 1)});
    out.push_back({"flat", meshOfCorners(flat, here, 1)});
    out.push_back({"one line", meshOfCorners(line, here, 1)});
    out.push_back({"crumbs", meshOfCorners(crumbs, here, 1)});
    out.push_back({"strewn", meshOfCorners(loose, here, 1)});
    out.push_back({"closed", meshOfCorners(ball, here, 1)});
    out.push_back({"far away", meshOfCorners(loose, there, 1)});
    for (const double scale : {1e-30, 1e-6, 3.0e7, 1e30, 1e49}) {
        out.push_back({"strewn, times " + std::to_string(std::log10(scale)), meshOfCorners(loose, here, scale)});
        out.push_back({"closed, times " + std::to_string(std::log10(scale)), meshOfCorners(ball, here, scale)});
    }
    return out;
}

/// By the plainest way, in long double.
bool inSome(const std::vector<Vec>& centres, Real radius, const Vec& p, std::size_t& last) {
    if ((centres[last] - p).squaredNorm() <= radius * radius) return true;
    for (last = 0; last < centres.size(); ++last)
        if ((centres[last] - p).squaredNorm() <= radius * radius) return true;
    last = 0;
    return false;
}

void expectCovered(const TriangleMesh& mesh, const BallCover& cover, Random& random, int samples) {
    std::vector<Vec> centres;
    for (const Vec3d& c : cover.centres) centres.push_back(exact(c));
    std::size_t last = 0;
    for (std::uint32_t face = 0; face < mesh.faceCount(); ++face) {
        const Triangle t = mesh.triangle(face);
        for (int i = 0; i < samples; ++i) {
            Real u = between(random, 0, 1), v = between(random, 0, 1);
            if (i < 3) u = i == 1, v = i == 2;  // the corners
            if (i >= 3 && i < 10) v = 0;        // an edge
            if (u + v > 1) u = 1 - u, v = 1 - v;
            const Vec p = exact(t[0]) + u * (exact(t[1]) - exact(t[0])) + v * (exact(t[2]) - exact(t[0]));
            ASSERT_TRUE(inSome(centres, cover.radius, p, last)) << "face " << face << ", " << u << " " << v;
        }
    }
    ASSERT_EQ(cover.faces.size(), cover.centres.size());
    for (std::size_t ball = 0; ball < centres.size(); ++ball) {
        ASSERT_LT(cover.faces[ball], mesh.faceCount());
        ASSERT_LE(oracle::fromTriangle(cover.centres[ball], mesh.triangle(cover.faces[ball])),
                  cover.radius * (1 + 1e-15L))
            << "ball " << ball;
    }
}

/// What one triangle alone takes, in balls: its area, its sides, and one.
double mostBalls(const TriangleMesh& mesh, double radius) {
    double most = 0;
    for (const Triangle& t : trianglesOf(mesh)) {
        const Vec3d u = (t[1] - t[0]) / radius, v = (t[2] - t[0]) / radius;
        most += 0.5 * u.cross(v).norm() + u.norm() + v.norm() + (v - u).norm() + 1;
    }
    return most;
}

TEST(BallCover, HoldsEveryPointAndNoBallForNothing) {
    Random random(5);
    std::size_t balls = 0;
    for (int round = 0; round < 3; ++round)
        for (const Covered& it : everyKindOfSurface(random))
            for (const unsigned level : {1U, 2U, 3U, 4U, 5U, 6U}) {
                SCOPED_TRACE(it.name + ", level " + std::to_string(level));
                const double radius = coverRadius(it.mesh.bounds(), level);
                const Expected<BallCover> cover = coverOf(it.mesh, radius);
                ASSERT_TRUE(cover) << cover.error().message;
                ASSERT_EQ(cover->radius, radius);
                ASSERT_LE(static_cast<double>(cover->centres.size()), 1.5 * mostBalls(it.mesh, radius));
                balls += cover->centres.size();
                expectCovered(it.mesh, *cover, random, level < 5 ? 40 : 15);
                if (HasFatalFailure()) return;
            }
    EXPECT_GT(balls, 100'000u);
}

TEST(BallCover, AllLevelsOfOneLargeTriangle) {
    Random random(6);
    for (unsigned level = 1; level <= 9; ++level) {
        const TriangleMesh mesh =
            meshOfCorners({{inCube(random, 1), inCube(random, 1), inCube(random, 1)}}, Vec3d::Zero(), 1);
        const double radius = coverRadius(mesh.bounds(), level);
        const Expected<BallCover> cover = coverOf(mesh, radius);
        ASSERT_TRUE(cover);
        ASSERT_LE(static_cast<double>(cover->centres.size()), 1.5 * mostBalls(mesh, radius));
        expectCovered(mesh, *cover, random, 300);
        if (HasFatalFailure()) return;
    }
}

TEST(BallCover, TakesAsManyBallsAsTheAreaAsksForHoweverSmallTheTrianglesAre) {
    for (const unsigned level : {2U, 3U, 4U, 5U, 6U}) {
        std::size_t least = ~std::size_t{0}, most = 0;
        for (const std::uint32_t fineness : {1U, 4U, 16U}) {
            const TriangleMesh mesh = meshOf(shapes::sphere(1, 20 * fineness, 40 * fineness));
            const double radius = coverRadius(mesh.bounds(), level);
            const Expected<BallCover> cover = coverOf(mesh, radius);
            ASSERT_TRUE(cover);
            const std::size_t count = cover->centres.size();
            least = std::min(least, count);
            most = std::max(most, count);
            EXPECT_LT(static_cast<double>(count), 1.3 * 4 * std::numbers::pi / (radius * radius)) << level;
        }
        EXPECT_LT(static_cast<double>(most), 1.1 * static_cast<double>(least)) << level;
    }
}

/// Where a ball would just do, its centre as a float is beside the one that does.
TEST(BallCover, HoldsTheEndsOfWhatJustFits) {
    Random random(9);
    for (int round = 0; round < 300; ++round) {
        const Vec3d from = inCube(random, 1), to = inCube(random, 1);
        const TriangleMesh mesh = meshOfCorners({{from, to, from}}, Vec3d::Zero(), 1);
        const double radius = 0.5 * (to - from).norm() * (1 + std::pow(10.0, -round % 17));
        const Expected<BallCover> cover = coverOf(mesh, radius);
        ASSERT_TRUE(cover);
        expectCovered(mesh, *cover, random, 20);
        if (HasFatalFailure()) return;
    }
}

TEST(BallCover, RadiiHalveFromLevelToLevel) {
    const Box box = meshOf(shapes::box(Vec3d(3, 4, 12))).bounds();
    for (unsigned level = 1; level <= kFinestLevel; ++level)
        EXPECT_DOUBLE_EQ(coverRadius(box, level), 13 / std::pow(2.0, level + 1));
}

TEST(BallCover, IsTheSameEachTime) {
    Random random(7);
    const TriangleMesh mesh = bumpy(random, 30, 41);
    const double radius = coverRadius(mesh.bounds(), 5);
    const BallCover one = *coverOf(mesh, radius), other = *coverOf(TriangleMesh(mesh), radius);
    EXPECT_EQ(one.centres, other.centres);
    EXPECT_EQ(one.faces, other.faces);
    for (const Vec3d& p : one.centres) EXPECT_EQ(p, p.cast<float>().cast<double>()) << "there is room for floats";
}

TEST(BallCover, APointIsABallOfNoSize) {
    const Vec3d at(0.1, 1e20, -3);
    const TriangleMesh mesh = meshOfCorners({{at, at, at}, {at, at, at}}, Vec3d::Zero(), 1);
    const BallCover cover = *coverOf(mesh, coverRadius(mesh.bounds(), 3));
    EXPECT_EQ(cover.radius, 0);
    ASSERT_EQ(cover.centres.size(), 1u);
    EXPECT_EQ(cover.centres[0], at);
}

TEST(BallCover, SaysWhyThereIsNone) {
    Random random(8);
    const TriangleMesh ball = bumpy(random, 12, 17);
    EXPECT_EQ(coverOf(TriangleMesh(), 1).error().code, ErrorCode::kBadInput);
    EXPECT_EQ(coverOf(ball, 0.01, {.maxBalls = 100}).error().code, ErrorCode::kLimit);
    EXPECT_EQ(coverOf(ball, coverRadius(ball.bounds(), 12)).error().code, ErrorCode::kLimit);
    EXPECT_EQ(coverOf(ball, 0).error().code, ErrorCode::kBadInput);
    // A small thing far away: the balls' places would be no numbers.
    const TriangleMesh far = meshOfCorners(trianglesOf(ball), Vec3d::Constant(1e14), 1);
    EXPECT_TRUE(coverOf(far, coverRadius(far.bounds(), 1)));
    EXPECT_EQ(coverOf(far, coverRadius(far.bounds(), 7)).error().code, ErrorCode::kBadInput);
    const TriangleMesh tiny = meshOfCorners(trianglesOf(ball), Vec3d::Zero(), 1e-150);
    EXPECT_EQ(coverOf(tiny, coverRadius(tiny.bounds(), 3)).error().code, ErrorCode::kBadInput);
    // Large faces that lie upon each other: each is cut by every plane.
    const std::vector<Triangle> pile(3000, Triangle{Vec3d(0, 0, 0), Vec3d(1, 0, 0), Vec3d(0, 0, 1)});
    const TriangleMesh piled = meshOfCorners(pile, Vec3d::Zero(), 1);
    EXPECT_EQ(coverOf(piled, coverRadius(piled.bounds(), 8), {.maxCorners = 10'000'000}).error().code,
              ErrorCode::kLimit);
}

}  // namespace
}  // namespace tessera::ball_covers

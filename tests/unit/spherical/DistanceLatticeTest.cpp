// Bounds of distances hold the truth, which is brute force over all triangles in long double, or a closed form.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <numbers>
#include <string>

#include "common/base/Workers.h"
#include "server/collision/query/DistanceQuery.h"
#include "server/collision/query/SurfaceTopology.h"
#include "server/collision/spherical/DistanceLattice.h"
#include "tests/unit/spherical/FieldScenes.h"

namespace tessera {
namespace {

using Real = long double;
using Vec3l = Eigen::Matrix<Real, 3, 1>;

Real segmentSquare(const Vec3l& p, const Vec3l& a, const Vec3l& b) {
    const Vec3l d = b - a;
    const Real length = d.squaredNorm(), t = length > 0 ? std::clamp<Real>((p - a).dot(d) / length, 0, 1) : 0;
    return (p - a - t * d).squaredNorm();
}

/// By projection onto the plane and signs of sub-areas; else the sides.
Real triangleSquare(const Vec3l& p, const Vec3l& a, const Vec3l& b, const Vec3l& c) {
    Real least = std::min({segmentSquare(p, a, b), segmentSquare(p, b, c), segmentSquare(p, c, a)});
    const Vec3l n = (b - a).cross(c - a);
    if (n.squaredNorm() > 0 && (b - a).cross(p - a).dot(n) >= 0 && (c - b).cross(p - b).dot(n) >= 0 &&
        (a - c).cross(p - c).dot(n) >= 0)
        least = std::min(least, (p - a).dot(n) * (p - a).dot(n) / n.squaredNorm());
    return least;
}

/// With the winding number by solid angles (A. Van Oosterom, J. Strackee, 1983) where the surface is closed.
Real trueDistance(const TriangleMesh& mesh, bool isSigned, const Vec3d& place) {
    const Vec3l p = place.cast<Real>();
    Real least = 1e300L, angle = 0;
    for (std::uint32_t f = 0; f < mesh.faceCount(); ++f) {
        const Vec3l a = mesh.corner(f, 0).cast<Real>(), b = mesh.corner(f, 1).cast<Real>(),
                    c = mesh.corner(f, 2).cast<Real>();
        least = std::min(least, triangleSquare(p, a, b, c));
        const Vec3l x = a - p, y = b - p, z = c - p;
        const Real i = x.norm(), j = y.norm(), k = z.norm();
        angle += 2 * std::atan2(x.dot(y.cross(z)), i * j * k + x.dot(y) * k + y.dot(z) * i + z.dot(x) * j);
    }
    const bool inside = isSigned && std::abs(angle) > 2 * std::numbers::pi_v<Real>;
    return (inside ? -1 : 1) * std::sqrt(least);
}

/// A ball of vertices that meet: indices as `ballLike` makes them are one place each, which SurfaceTopology sees.
TriangleMesh ball(unsigned rings, double radius, const Vec3d& centre = Vec3d::Zero()) {
    FieldMesh mesh = ballLike(rings, [&](const Vec3d&) { return radius; });
    for (std::size_t i = 0; i < mesh.positions.size(); ++i)
        mesh.positions[i] += centre[static_cast<Eigen::Index>(i % 3)];
    // Poles and seams are computed, not copied: one place each.
    for (double& x : mesh.positions) x = std::round(x * 1e9) / 1e9;
    return mesh.make();
}

TEST(DistanceLattice, BoundsHoldTheTruthEverywhere) {
    std::size_t inside = 0;
    const auto check = [&](std::uint64_t seed) {
        FieldRandom random(seed);
        const TriangleMesh mesh = seed % 4 == 0 ? ball(6 + random.below(5), random.uniform(0.1, 50), random.inBox(10))
                                                : fieldMesh(static_cast<unsigned>(seed), random);
        const TriangleTree tree(mesh);
        const DistanceLattice lattice =
            DistanceLattice::make(tree, {.error = random.uniform(0.02, 0.1), .reach = random.uniform(0, 0.5)}).value();
        const double size = mesh.bounds().size().norm();
        for (int i = 0; i < 60; ++i) {
            Vec3d p = mesh.bounds().center() + random.inBox(i % 8 == 0 ? 5 * size : 0.6 * size);
            if (i % 5 == 0) p = mesh.corner(random.below(static_cast<unsigned>(mesh.faceCount())), 0);
            const DistanceBound bound = lattice.at(p).value();
            const auto truth = static_cast<double>(trueDistance(mesh, lattice.isSigned(), p));
            inside += truth < 0 ? 1 : 0;
            ASSERT_LE(bound.lower, truth + 1e-5 * size)
                << "seed " << seed << ": TESSERA_SEED=" << seed
                << " build/bin/unit_spherical --gtest_filter=DistanceLattice.Bounds*";
            ASSERT_GE(bound.upper, truth - 1e-5 * size)
                << "seed " << seed << ": TESSERA_SEED=" << seed
                << " build/bin/unit_spherical --gtest_filter=DistanceLattice.Bounds*";
            // The eight corners of a cell cannot be farther apart than its diagonal allows.
            if (mesh.bounds().contains(p)) {
                ASSERT_LE(bound.error(), 2.0 * lattice.spacing());
            }
        }
    };
    if (const char* only = std::getenv("TESSERA_SEED")) return check(std::strtoull(only, nullptr, 10));
    for (std::uint64_t seed = 0; seed < 80 && !HasFatalFailure(); ++seed) check(seed);
    EXPECT_GT(inside, 40U);  // or no side was ever told
}

TEST(DistanceLattice, IsTheSameForAnyNumberOfThreads) {
    const TriangleTree tree(ball(12, 1));
    Workers three(3);
    const DistanceLattice one = DistanceLattice::make(tree, {.error = 0.03}).value(),
                          other = DistanceLattice::make(tree, {.error = 0.03, .workers = &three}).value();
    ASSERT_EQ(one.placeCount(), other.placeCount());
    EXPECT_TRUE(std::equal(one.view().values, one.view().values + one.placeCount(), other.view().values));
}

TEST(DistanceLattice, RefusesWhatItCannotHold) {
    const TriangleTree nothing{TriangleMesh{}}, sphere(ball(8, 1));
    EXPECT_FALSE(DistanceLattice::make(nothing));
    EXPECT_FALSE(DistanceLattice::make(sphere, {.error = 0}));
    EXPECT_FALSE(DistanceLattice::make(sphere, {.error = std::nan("")}));
    EXPECT_FALSE(DistanceLattice::make(sphere, {.error = 0.001, .reach = 2}));
    EXPECT_FALSE(DistanceLattice::make(TriangleTree(ball(8, 1), {.volume = VolumeKind::kDop14})));
    const DistanceLattice lattice = DistanceLattice::make(sphere, {.error = 0.05}).value();
    EXPECT_FALSE(lattice.at(Vec3d(0, std::nan(""), 0)));
    QueryWork work;
    // Of a surface without a lattice.
    const TriangleTree other(ball(8, 1)), dops(ball(8, 1), {.volume = VolumeKind::kDop14});
    const double anyFar = std::numeric_limits<double>::infinity();
    EXPECT_TRUE(surfaceDistance(lattice, other, Affine3d::Identity(), anyFar, work));
    EXPECT_FALSE(surfaceDistance(lattice, dops, Affine3d::Identity(), anyFar, work));
    EXPECT_FALSE(surfaceDistance(lattice, nothing, Affine3d::Identity(), anyFar, work));
    for (const double bad : {std::nan(""), 1e300, 1e-300, 0.0}) {
        Affine3d map = Affine3d::Identity();
        map.linear() *= bad;
        EXPECT_FALSE(surfaceDistance(lattice, other, map, anyFar, work)) << bad;
        EXPECT_FALSE(signedDistance(lattice, other, map, work)) << bad;
        map = Affine3d::Identity();
        map.translation()[1] = bad > 1 ? 1e9 : std::nan("");
        EXPECT_FALSE(surfaceDistance(lattice, other, map, anyFar, work)) << bad;
    }
    Affine3d stretched = Affine3d::Identity();
    stretched.linear() = Vec3d(1, 2, 1).asDiagonal();
    EXPECT_TRUE(surfaceDistance(lattice, other, stretched, anyFar, work));
    EXPECT_FALSE(signedDistance(lattice, lattice, stretched, work));
    stretched.linear().setZero();
    EXPECT_FALSE(signedDistance(lattice, lattice, stretched, work));
    stretched.linear().setIdentity();
    stretched.translation()[0] = 1e12;
    EXPECT_FALSE(signedDistance(lattice, lattice, stretched, work));
}

TEST(SignedDistance, OfBallsIsTheClosedForm) {
    const TriangleMesh large = ball(48, 1), small = ball(48, 0.4);
    ASSERT_TRUE(SurfaceTopology(large).closed());
    const TriangleTree treeA(large), treeB(small);
    const DistanceLattice a = DistanceLattice::make(treeA, {.error = 0.01}).value(),
                          b = DistanceLattice::make(treeB, {.error = 0.01}).value();
    ASSERT_TRUE(a.isSigned() && b.isSigned());
    FieldRandom random(4);
    for (int i = 0; i < 300; ++i) {
        const double apart = random.uniform(0, 2.2), scale = i % 3 == 0 ? random.uniform(0.5, 2) : 1;
        const Vec3d d = random.inBox(1).normalized();
        Affine3d a_T_b = Affine3d::Identity();
        a_T_b.linear() = scale * random.rotation().toRotationMatrix();
        if (i % 2 == 0) a_T_b.linear() *= Vec3d(-1, 1, 1).asDiagonal();
        a_T_b.translation() = apart * d;
        QueryWork work;
        const SignedDistance found = signedDistance(a, b, a_T_b, work).value();
        // The least of |p| - R over the other's surface, both ways.
        const double r = 0.4 * scale, truth = std::min(std::abs(apart - 1) - r, std::abs(apart - r) - 1);
        EXPECT_NEAR(found.distance, truth, found.error + 3e-3)
            << "seed 4, " << i << ", " << apart << " apart, scaled " << scale;
        EXPECT_LE(found.error, 1.25 * 0.01 * 2 * std::sqrt(3.0) * std::max(1.0, 0.4 * scale));
        EXPECT_TRUE(found.complete);
        // The point's distance is within twice the error of the least, so its direction, seen from a ball's middle that
        // is 0.45 away, within 24 degrees; half of a box of that size adds 4, bounds 0.37 of the spacing wrong, two
        // spacings apart, 20 more: 48, whose cosine is 0.67.
        if (apart > 1.45 && r >= 0.4) {
            EXPECT_GT(found.normal.dot(d), 0.5) << i;
        }
    }
}

TEST(SignedDistance, SeesAPieceOfABodyThatIsInsideTheOther) {
    FieldMesh two;
    for (const Vec3d& middle : {Vec3d(3, 0, 0), Vec3d(0, 0, 0)}) {
        const TriangleMesh one = ball(16, 0.3, middle);
        for (std::uint32_t f = 0; f < one.faceCount(); ++f)
            two.triangle(one.corner(f, 0), one.corner(f, 1), one.corner(f, 2));
    }
    const TriangleTree treeA(ball(24, 1)), treeB(two.make());
    const DistanceLattice a = DistanceLattice::make(treeA, {.error = 0.02}).value(),
                          b = DistanceLattice::make(treeB, {.error = 0.01}).value();
    ASSERT_TRUE(a.isSigned() && b.isSigned());
    QueryWork work;
    // Every point of the small ball's surface is 0.3 from the large one's middle.
    EXPECT_NEAR(signedDistance(a, b, Affine3d::Identity(), work).value().distance, -0.7, 0.09);
    EXPECT_NEAR(signedDistance(b, a, Affine3d::Identity(), work).value().distance, -0.7, 0.09);
}

TEST(SignedDistance, HoldsTheTruthForAnyMeshes) {
    const auto check = [](std::uint64_t seed) {
        const std::string story = "seed " + std::to_string(seed) + ": TESSERA_SEED=" + std::to_string(seed) +
                                  " build/bin/unit_spherical --gtest_filter=SignedDistance.Holds*";
        FieldRandom random(seed);
        const bool solid = seed % 2 == 0;
        const TriangleMesh meshA = solid ? ball(8, 1) : fieldMesh(static_cast<unsigned>(seed), random);
        const TriangleMesh meshB =
            solid ? ball(6, random.uniform(0.3, 1)) : fieldMesh(static_cast<unsigned>(seed / 2), random);
        const TriangleTree treeA(meshA), treeB(meshB);
        const DistanceLattice a = DistanceLattice::make(treeA, {.error = 0.04, .reach = 0.3}).value(),
                              b = DistanceLattice::make(treeB, {.error = 0.04, .reach = 0.3}).value();
        for (int k = 0; k < 4; ++k) {
            const Affine3d a_T_b = fieldMap(k == 3 ? FieldMap::kScaled : FieldMap::kRigid, random);
            QueryWork work, ofTrees;
            const SignedDistance found = signedDistance(a, b, a_T_b, work).value();
            const Distance exact = distanceBetween(treeA, treeB, a_T_b, ofTrees);
            const double slack =
                1e-4 * (meshA.bounds().size().norm() + a_T_b.linear().norm() * meshB.bounds().size().norm() +
                        a_T_b.translation().norm());
            // Points of either surface: none is deeper in the other, or nearer, than told.
            for (int i = 0; i < 150; ++i) {
                const bool ofA = i % 2 == 0;
                const TriangleMesh& mesh = ofA ? meshA : meshB;
                const Triangle t = mesh.triangle(random.below(static_cast<unsigned>(mesh.faceCount())));
                const double u = random.uniform(0, 1), v = random.uniform(0, 1 - u);
                const Vec3d p = t[0] + u * (t[1] - t[0]) + v * (t[2] - t[0]);
                const double scale = std::cbrt(std::abs(a_T_b.linear().determinant()));
                const auto truth = static_cast<double>(
                    ofA ? static_cast<Real>(scale) * trueDistance(meshB, b.isSigned(), a_T_b.inverse(Eigen::Affine) * p)
                        : trueDistance(meshA, a.isSigned(), a_T_b * p));
                ASSERT_GE(truth, found.distance - found.error - slack) << story << ", map " << k;
            }
            if (exact.distance > 0 && found.distance - found.error > -slack) {
                // Apart, or one in the other without a sign.
                ASSERT_LE(found.distance - found.error, exact.distance + slack) << story << ", map " << k;
                ASSERT_GE(found.distance + found.error, exact.distance - slack) << story << ", map " << k;
            }
            if (exact.distance == 0) {
                ASSERT_LE(found.distance - found.error, slack) << story << ", map " << k;
            }
        }
    };
    if (const char* only = std::getenv("TESSERA_SEED")) return check(std::strtoull(only, nullptr, 10));
    for (std::uint64_t seed = 0; seed < 60 && !HasFatalFailure(); ++seed) check(seed);
}

TEST(SignedDistance, StatesALargerErrorWhereTheWorkEnds) {
    const TriangleTree treeA(ball(24, 1)), treeB(ball(24, 0.6));
    const DistanceLattice a = DistanceLattice::make(treeA, {.error = 0.02}).value(),
                          b = DistanceLattice::make(treeB, {.error = 0.02}).value();
    Affine3d a_T_b = Affine3d::Identity();
    a_T_b.translation()[0] = 1.3;
    bool stopped = false;
    for (std::uint64_t limit = 1; limit < 60; ++limit) {
        QueryWork work{0, 0, limit};
        const SignedDistance found = signedDistance(a, b, a_T_b, work).value();
        stopped = stopped || !found.complete;
        EXPECT_LE(found.distance - found.error, -0.3 + 0.02) << "limit " << limit;
        if (found.complete) {
            EXPECT_NEAR(found.distance, -0.3, found.error + 0.02);
        }
    }
    EXPECT_TRUE(stopped);
}

}  // namespace
}  // namespace tessera

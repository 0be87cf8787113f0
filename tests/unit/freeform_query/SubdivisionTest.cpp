// Catmull-Clark and Loop surfaces beside fine tessellations of their limit points, which trees answer for exactly.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "common/math/Compose.h"
#include "server/collision/query/DistanceQuery.h"
#include "server/collision/query/TouchQuery.h"
#include "tests/unit/freeform_query/SmoothBodies.h"

namespace tessera::test {
namespace {

/// A body and what judges it.
struct Judged {
    ControlMesh control;
    FreeformShape shape;
    double error;
    TriangleTree tree;
};
Judged judged(ControlMesh control, int n) {
    Tessellation t = tessellate(control, n);
    FreeformShape shape = FreeformShape::ofSubdivision(control).value();
    return {std::move(control), std::move(shape), t.error, TriangleTree(std::move(t.mesh))};
}

/// Where B is moved along a direction from far away until the tessellations first meet, less or more.
double firstTouch(const TriangleTree& a, const TriangleTree& b, const Vec3d& direction, Affine3d pose, double far) {
    double low = 0, high = far;
    for (int i = 0; i < 30; ++i) {
        const double middle = 0.5 * (low + high);
        pose.translation() = middle * direction;
        QueryWork work;
        (firstTouching(a, b, pose, work).touch == Touch::kYes ? low : high) = middle;
    }
    return high;
}

/// How far normals differ that are nearly there, from inside the face along both of its parameters and between these.
/// Where they tend to one they differ by little: at the slowest smooth vertex a refinement leaves 0.6 of that, and 1e-9
/// is thirty of them, ten of which semi-sharp edges may take.
double turningAt(LimitEvaluator& surface, const std::vector<Vec3d>& positions, const FreeformPlace& place) {
    constexpr double kStep = 1e-9;
    const double u = place.u < 0.5 ? kStep : -kStep, v = place.v < 0.5 ? kStep : -kStep;
    std::array<Vec3d, 3> normals;
    const std::array<Vec2d, 3> steps{Vec2d(u, 0.01 * v), Vec2d(0.01 * u, v), Vec2d(0.5 * u, 0.5 * v)};
    for (std::size_t i = 0; i < 3; ++i)
        normals[i] =
            surface.evaluate(positions, {place.face, place.u + steps[i].x(), place.v + steps[i].y()}).value().normal;
    return std::max({1 - normals[0].dot(normals[1]), 1 - normals[1].dot(normals[2]), 1 - normals[2].dot(normals[0])});
}

void judge(const Judged& a, const Judged& b, Chance& chance, int poses) {
    FreeformPair pair(a.shape, b.shape);
    LimitEvaluator onA(*a.shape.subdivision()->topology), onB(*b.shape.subdivision()->topology);
    const double off = a.error + b.error, size = a.shape.bounds().size().norm() + b.shape.bounds().size().norm();
    for (int i = 0; i < poses; ++i) {
        SCOPED_TRACE(i);
        const Vec3d direction = chance.direction();
        Affine3d pose = composeTransform(Vec3d::Zero(), chance.rotation(), Vec3d::Ones());
        const double meets = firstTouch(a.tree, b.tree, direction, pose, size);
        const double gaps[] = {0.2, 1e-2, 1e-4, 0, -1e-4, -1e-2, -0.5 * meets};
        pose.translation() = (meets + gaps[i % 7]) * direction;
        QueryWork work;
        const double truth = distanceBetween(a.tree, b.tree, pose, work).distance;
        const bool trianglesMeet = firstTouching(a.tree, b.tree, pose, work).touch == Touch::kYes;
        constexpr double kTolerance = 1e-5;
        const FreeformDistance d = pair.distance(pose, work, {.tolerance = kTolerance});
        EXPECT_TRUE(d.complete);
        EXPECT_LE(d.least, truth + off);
        EXPECT_GE(d.distance, truth - off);
        EXPECT_LE(d.distance - d.least, kTolerance * (1 + 1e-9));
        const SurfacePoint pa = onA.evaluate(a.control.positions, {d.a.face, d.a.u, d.a.v}).value(),
                           pb = onB.evaluate(b.control.positions, {d.b.face, d.b.u, d.b.v}).value();
        EXPECT_LT((pa.point - d.a.point).norm(), 1e-11);
        EXPECT_LT((pose * pb.point - d.b.point).norm(), 1e-11);
        const double turning = turningAt(onA, a.control.positions, d.a);
        if (turning < 1e-6) {
            EXPECT_GT(std::abs(pa.normal.dot(d.a.normal)), 1 - 1e-6);
        } else if (turning > 1e-2) {
            EXPECT_TRUE(d.a.normal.isZero()) << "normals do not tend to one: " << turning;
        }

        const double tolerance = 2 * off;
        const FreeformTouch told = pair.touch(pose, tolerance, work);
        const Touch touch = told.touch;
        if (touch == Touch::kYes) {
            EXPECT_LE((told.a.point - told.b.point).norm(), tolerance * (1 + 1e-9));
        }
        if (trianglesMeet) {
            EXPECT_EQ(touch, Touch::kYes);
        }
        if (truth > tolerance + off) {
            EXPECT_EQ(touch, Touch::kNo) << truth;
        }
        // What distance says is never belied.
        const FreeformTouch toldNarrow = pair.touch(pose, 1e-7, work);
        const Touch narrow = toldNarrow.touch;
        if (narrow == Touch::kYes) {
            EXPECT_LE((toldNarrow.a.point - toldNarrow.b.point).norm(), 1e-7 * (1 + 1e-9));
        }
        if (d.least > 1e-7) {
            EXPECT_EQ(narrow, Touch::kNo);
        }
        if (narrow == Touch::kNo) {
            EXPECT_GT(d.distance, 0);
        }

        const FreeformContacts contacts =
            pair.contacts(pose, work, {.tolerance = tolerance, .spacing = size / 50, .most = 2000});
        if (trianglesMeet) {
            EXPECT_FALSE(contacts.contacts.empty());
        }
        if (truth > tolerance + off) {
            EXPECT_TRUE(contacts.contacts.empty());
        }
        for (const FreeformContact& c : contacts.contacts)
            ASSERT_LE((c.a.point - c.b.point).norm(), tolerance * (1 + 1e-9));
    }
}

TEST(FreeformSubdivision, CatmullClarkBesideTessellations) {
    for (const std::uint64_t seed : seedsOf(6)) {
        SCOPED_TRACE(repeat(seed));
        Chance chance(seed);
        const Judged a = judged(lumpyCube(chance, 1 + static_cast<int>(seed % 3), 0.3), 12),
                     b = judged(lumpyCube(chance, 2, 0.3), 12);
        judge(a, b, chance, 14);
    }
}

TEST(FreeformSubdivision, LoopBesideTessellations) {
    for (const std::uint64_t seed : seedsOf(4)) {
        SCOPED_TRACE(repeat(seed));
        Chance chance(seed);
        const Judged a = judged(asTriangles(lumpyCube(chance, 2, 0.3)), 12), b = judged(lumpyCube(chance, 2, 0.3), 12);
        judge(a, b, chance, 14);
    }
}

TEST(FreeformSubdivision, CreasesAndHolesBesideTessellations) {
    for (const std::uint64_t seed : seedsOf(4)) {
        SCOPED_TRACE(repeat(seed));
        Chance chance(seed);
        ControlMesh creased = lumpyCube(chance, 2, 0.2);
        for (std::size_t f = 0; f < creased.faceSizes.size(); f += 3)
            creased.creases.push_back({creased.faceVertices[4 * f], creased.faceVertices[4 * f + 1],
                                       static_cast<float>(chance.uniform(0.5, 10))});
        creased.corners.push_back({0, 10});
        creased.holes.push_back(static_cast<std::uint32_t>(chance.uniform(0, 12)));
        const Judged a = judged(creased, 12), b = judged(lumpyCube(chance, 1, 0.3), 12);
        judge(a, b, chance, 7);
    }
}

TEST(FreeformSubdivision, SpikesHaveNoNormal) {
    // A cube with one vertex that stays where it is, which three faces meet at: a spike along the diagonal, and the
    // nearest to a ball out there. By symmetry any normal that were told would be one of three.
    ControlMesh cube;
    for (int i = 0; i < 8; ++i)
        cube.positions.emplace_back((i & 4) != 0 ? 1 : -1, (i & 2) != 0 ? 1 : -1, (i & 1) != 0 ? 1 : -1);
    cube.faceVertices = {0, 1, 3, 2, 4, 6, 7, 5, 0, 4, 5, 1, 2, 3, 7, 6, 0, 2, 6, 4, 1, 5, 7, 3};
    cube.faceSizes.assign(6, 4);
    cube.corners.push_back({7, 10});
    const FreeformShape spike = FreeformShape::ofSubdivision(cube).value(), ball = sphere(0.5);
    FreeformPair pair(spike, ball);
    QueryWork work;
    const FreeformDistance d =
        pair.distance(composeTransform({3, 3, 3}, Quatd::Identity(), Vec3d::Ones()), work, {.tolerance = 1e-6});
    EXPECT_TRUE(d.complete);
    EXPECT_NEAR(d.distance, 2 * std::sqrt(3) - 0.5, 1.1e-6);
    EXPECT_EQ(d.a.point, Vec3d(1, 1, 1));
    EXPECT_TRUE(d.a.normal.isZero()) << d.a.normal.transpose();
    // At an angle of p from the nearest point the ball is farther by r (d + r) p² / 2 d, which may be the tolerance.
    EXPECT_LT((d.b.normal + Vec3d::Constant(1 / std::sqrt(3))).norm(), 2e-3);
    // Where three edges there are infinitely sharp, each face has its own plane.
    for (const std::uint32_t end : {3U, 5U, 6U}) cube.creases.push_back({7, end, 10});
    const FreeformShape block = FreeformShape::ofSubdivision(cube).value();
    FreeformPair blocks(block, ball);
    const FreeformDistance corner =
        blocks.distance(composeTransform({3, 3, 3}, Quatd::Identity(), Vec3d::Ones()), work, {.tolerance = 1e-6});
    EXPECT_NEAR(corner.distance, 2 * std::sqrt(3) - 0.5, 1.1e-6);
    EXPECT_NEAR(corner.a.normal.norm(), 1, 1e-12);
}

TEST(FreeformSubdivision, DistancesOfFinerTessellationsTendToIts) {
    Chance chance(5);
    const ControlMesh ca = lumpyCube(chance, 2, 0.3), cb = lumpyCube(chance, 2, 0.3);
    const FreeformShape a = FreeformShape::ofSubdivision(ca).value(), b = FreeformShape::ofSubdivision(cb).value();
    FreeformPair pair(a, b);
    const Affine3d pose = composeTransform(2.3 * chance.direction(), chance.rotation(), Vec3d::Ones());
    QueryWork work;
    const double distance = pair.distance(pose, work, {.tolerance = 1e-10}).distance;
    double first = 0, last = 0;
    for (const int n : {6, 24}) {
        const Tessellation ta = tessellate(ca, n), tb = tessellate(cb, n);
        const double off =
            std::abs(distanceBetween(TriangleTree(ta.mesh), TriangleTree(tb.mesh), pose, work).distance - distance);
        EXPECT_LE(off, ta.error + tb.error);
        last = ta.error + tb.error;
        if (n == 6) first = last;
    }
    // At corners of valence 3 the surface goes as u to the power 1.29 (one refinement shrinks it to 0.41), which lines
    // miss by as much: cells a quarter as large leave a sixth.
    EXPECT_LT(last, first / 5);
}

TEST(FreeformSubdivision, FirstContactsAreNeverLate) {
    for (const std::uint64_t seed : seedsOf(12)) {
        SCOPED_TRACE(repeat(seed));
        Chance chance(seed);
        const Judged a = judged(lumpyCube(chance, 2, 0.3), 12),
                     b = judged(lumpyCube(chance, 1 + static_cast<int>(seed % 2), 0.3), 12);
        FreeformPair pair(a.shape, b.shape);
        BodyMotion still, moving;
        still.end.rotation = chance.rotation();
        moving.start = {.translation = 3 * chance.direction(), .rotation = chance.rotation()};
        moving.end = {.translation = chance.uniform(0, 2) * chance.direction(), .rotation = chance.rotation()};
        QueryWork work;
        constexpr double kTolerance = 1e-4;
        const FreeformImpact hit = pair.firstContact(still, moving, kTolerance, work);
        ASSERT_TRUE(hit.complete);
        const auto poseAt = [&](double t) { return Affine3d(still.placeAt(t).inverse() * moving.placeAt(t)); };
        // Before it no tessellations meet, farther than they are off; at it, what is told is that near.
        const double until = hit.hit ? hit.t : 1;
        for (int i = 0; i <= 50; ++i) {
            const double t = until * i / 50;
            const Touch touch = pair.touch(poseAt(t), 1e-9, work).touch;
            if (i < 50) {
                EXPECT_EQ(touch, Touch::kNo) << t;
            }
            if (firstTouching(a.tree, b.tree, poseAt(t), work).touch == Touch::kYes) {
                // Tessellations may meet a little earlier, by what they are off.
                EXPECT_LE(pair.distance(poseAt(t), work, {.tolerance = 1e-6}).least, a.error + b.error) << t;
            }
        }
        if (hit.hit) {
            EXPECT_LE(distanceBetween(a.tree, b.tree, poseAt(hit.t), work).distance, kTolerance + a.error + b.error);
            EXPECT_LE((hit.a.point - hit.b.point).norm(), kTolerance * (1 + 1e-9));
        }
    }
}

TEST(FreeformSubdivision, AnswersDoNotDependOnWhatWasAskedBefore) {
    for (const std::uint64_t seed : seedsOf(6)) {
        SCOPED_TRACE(repeat(seed));
        Chance chance(seed);
        const FreeformShape a = FreeformShape::ofSubdivision(lumpyCube(chance, 2, 0.3)).value(),
                            b = FreeformShape::ofSubdivision(lumpyCube(chance, 1, 0.3)).value();
        FreeformPair used(a, b);
        for (int i = 0; i < 24; ++i) {
            SCOPED_TRACE(i);
            // Rigid maps and others go down different parts of parts.
            const Vec3d scale = i % 3 == 1 ? Vec3d(0.9, 1.2, 1) : Vec3d(1, 1, 1);
            const Affine3d pose =
                composeTransform(chance.uniform(0.5, 2.2) * chance.direction(), chance.rotation(), scale);
            FreeformPair fresh(a, b);
            QueryWork work, freshWork;
            if (i % 4 == 2) (void)used.contacts(pose, work, {.tolerance = 1e-3, .most = 50});
            work = {};
            const FreeformTouch t = used.touch(pose, 1e-4, work), ft = fresh.touch(pose, 1e-4, freshWork);
            EXPECT_EQ(t.touch, ft.touch);
            EXPECT_EQ(t.a.point, ft.a.point);
            EXPECT_EQ(t.b.point, ft.b.point);
            const FreeformDistance d = used.distance(pose, work, {.tolerance = 1e-5}),
                                   fd = fresh.distance(pose, freshWork, {.tolerance = 1e-5});
            EXPECT_EQ(d.distance, fd.distance);
            EXPECT_EQ(d.least, fd.least);
            EXPECT_EQ(d.a.point, fd.a.point);
            EXPECT_EQ(d.a.u, fd.a.u);
            EXPECT_EQ(work.boxTests, freshWork.boxTests);
        }
    }
}

TEST(FreeformSubdivision, AMovedShapeIsAFreshOne) {
    for (const std::uint64_t seed : seedsOf(8)) {
        SCOPED_TRACE(repeat(seed));
        Chance chance(seed);
        ControlMesh control = lumpyCube(chance, 3, 0.2);
        FreeformShape moved = FreeformShape::ofSubdivision(control).value();
        const FreeformShape other = FreeformShape::ofSubdivision(lumpyCube(chance, 1, 0.3)).value();
        FreeformPair pair(moved, other);
        QueryWork work;
        const Affine3d pose = composeTransform(1.8 * chance.direction(), chance.rotation(), Vec3d::Ones());
        for (int step = 0; step < 6; ++step) {
            (void)pair.distance(pose, work, {.tolerance = 1e-6});
            if (step % 2 == 0) {
                std::vector<std::uint32_t> points;
                std::vector<Vec3d> places;
                for (int k = 0; k < 3; ++k) {
                    const auto p =
                        static_cast<std::uint32_t>(chance.uniform(0, static_cast<double>(control.positions.size())));
                    if (std::find(points.begin(), points.end(), p) != points.end()) continue;
                    points.push_back(p);
                    places.push_back(control.positions[p] += 0.2 * chance.direction());
                }
                ASSERT_TRUE(moved.move(points, places));
            } else {
                for (Vec3d& p : control.positions) p += 0.05 * chance.direction();
                ASSERT_TRUE(moved.move(control.positions));
            }
            const FreeformShape fresh = FreeformShape::ofSubdivision(control).value();
            EXPECT_EQ(moved.bounds().lower, fresh.bounds().lower);
            EXPECT_EQ(moved.bounds().upper, fresh.bounds().upper);
            FreeformPair freshPair(fresh, other);
            const FreeformDistance d = pair.distance(pose, work, {.tolerance = 1e-6}),
                                   f = freshPair.distance(pose, work, {.tolerance = 1e-6});
            EXPECT_LE(d.least, f.distance + 1e-13);
            EXPECT_LE(f.least, d.distance + 1e-13);
            EXPECT_LE(std::abs(d.distance - f.distance), 1.001e-6);
        }
    }
}

TEST(FreeformSubdivision, HighValencesAndPoints) {
    // A fan of n triangles around one vertex, twice: a spinning top. At its tips hulls shrink slowest.
    for (const std::uint32_t n : {3U, 5U, 16U, 60U}) {
        SCOPED_TRACE(n);
        ControlMesh top;
        top.positions = {{0, 0, 1}, {0, 0, -1}};
        for (std::uint32_t i = 0; i < n; ++i)
            top.positions.emplace_back(std::cos(6.283185307 * i / n), std::sin(6.283185307 * i / n), 0);
        for (std::uint32_t i = 0; i < n; ++i) {
            const std::uint32_t here = 2 + i, next = 2 + (i + 1) % n;
            top.faceVertices.insert(top.faceVertices.end(), {here, next, 0, next, here, 1});
            top.faceSizes.insert(top.faceSizes.end(), {3, 3});
        }
        const FreeformShape shape = FreeformShape::ofSubdivision(top).value();
        FreeformPair pair(shape, shape);
        LimitEvaluator limit(*shape.subdivision()->topology);
        double tip = 0;
        for (const double u : {0.0, 1.0})
            for (const double v : {0.0, 1.0})
                for (std::uint32_t f = 0; f < 3; ++f)
                    tip = std::max(tip, limit.evaluate(top.positions, {f, u, v}).value().point.z());
        // Tip on tip, which is where the surface is highest.
        const Affine3d above = composeTransform({0, 0, 2 * tip + 0.01}, Quatd::Identity(), Vec3d::Ones());
        QueryWork work;
        const FreeformDistance d = pair.distance(above, work, {.tolerance = 1e-5});
        EXPECT_TRUE(d.complete);
        EXPECT_NEAR(d.distance, 0.01, 1.1e-5);
        EXPECT_EQ(pair.touch(above, 1e-4, work).touch, Touch::kNo);
        const Affine3d into = composeTransform({0, 0, 2 * tip - 1e-6}, Quatd::Identity(), Vec3d::Ones());
        EXPECT_EQ(pair.touch(into, 1e-7, work).touch, Touch::kYes);
        EXPECT_LT(work.boxTests, 2'000'000U);
    }
}

TEST(FreeformSubdivision, FoldedFacesAreHalvedAcrossTheFold) {
    // A tetrahedron that is nearly flat, as a Loop surface: edges of its patches are folded, so that their ends meet
    // and their middles are far away. An edge of it is near a side of a cube.
    ControlMesh cube;
    for (int i = 0; i < 8; ++i)
        cube.positions.emplace_back((i & 4) != 0 ? 1 : -1, (i & 2) != 0 ? 1 : -1, (i & 1) != 0 ? 1 : -1);
    cube.faceVertices = {0, 1, 3, 2, 4, 6, 7, 5, 0, 4, 5, 1, 2, 3, 7, 6, 0, 2, 6, 4, 1, 5, 7, 3};
    cube.faceSizes.assign(6, 4);
    const FreeformShape block = FreeformShape::ofSubdivision(cube).value();
    for (const double thick : {1.0, 0.1, 0.03, 0.01, 0.001, 1e-6, 0.0})
        for (const double tolerance : {1e-2, 1e-3, 1e-4, 1e-5}) {
            SCOPED_TRACE("thickness " + std::to_string(thick) + ", tolerance " + std::to_string(tolerance));
            ControlMesh leaf{.scheme = SubdivisionScheme::kLoop};
            leaf.positions = {{1, 1, thick}, {-1, -1, thick}, {-1, 1, -thick}, {1, -1, -thick}};
            leaf.faceVertices = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
            leaf.faceSizes.assign(4, 3);
            const FreeformShape thin = FreeformShape::ofSubdivision(leaf).value();
            FreeformPair pair(block, thin);
            const Affine3d beside = composeTransform({1.2, 0.37, 0.1}, Quatd::Identity(), Vec3d::Ones());
            QueryWork work{.limit = 200'000};
            const FreeformDistance d = pair.distance(beside, work, {.tolerance = tolerance});
            EXPECT_TRUE(d.complete) << work.boxTests;
            EXPECT_LE(d.distance - d.least, 1.001 * tolerance);
            EXPECT_GT(d.distance, 0.12);
            EXPECT_LT(d.least, 0.1252);
            BodyMotion still, moving;
            moving.start.translation = {4, 0.37, 0.1};
            moving.end.translation = {-4, 0.37, 0.2};
            const FreeformImpact hit = pair.firstContact(still, moving, tolerance, work);
            EXPECT_TRUE(hit.hit && hit.complete);
        }
}

}  // namespace
}  // namespace tessera::test

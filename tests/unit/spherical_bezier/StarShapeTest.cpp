#include "server/collision/spherical_bezier/StarShape.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "server/collision/spherical_bezier/SphericalBezierTouch.h"
#include "tests/unit/spherical_bezier/DeformingShapes.h"

namespace tessera {
namespace {

using deforming::Random;
using deforming::seeds;
using deforming::Shape;

/// All of the faces, from one side.
void expectSeen(const TriangleMesh& mesh, const Vec3d& from) {
    int front = 0, back = 0;
    for (std::uint32_t face = 0; face < mesh.faceCount(); ++face) {
        const Triangle t = mesh.triangle(face);
        const Vec3d normal = (t[1] - t[0]).cross(t[2] - t[0]);
        if (!(normal.norm() > 1e-11 * mesh.bounds().size().squaredNorm())) continue;
        (normal.dot(t[0] - from) > 0 ? front : back) += 1;
    }
    EXPECT_TRUE(front == 0 || back == 0) << front << " " << back;
}

TEST(StarShape, IsFoundOfWhatIsOneWhereverItsMiddleIs) {
    for (const std::uint64_t seed : seeds(60)) {
        SCOPED_TRACE(deforming::repeat(seed, "StarShape.IsFound*"));
        Random random(seed);
        const Vec3d wave = random.inBox(5);
        const double strength = random.uniform(0, 0.3);
        Shape shape = deforming::wrapped(28, 14, false, [&](double u, double v) {
            const double phi = 2 * std::numbers::pi * u, theta = std::numbers::pi * v;
            const Vec3d d(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
            return Vec3d((1 + strength * std::sin(wave.dot(d))) * d);
        });
        const Vec3d shift = random.inBox(5);
        const double unit = std::exp(random.uniform(-20, 20));
        // A ball's poles are faces without an area; turned about, inside out, somewhere, in any unit, stretched.
        if (random.below(2) == 0)
            for (std::size_t i = 0; i + 2 < shape.indices.size(); i += 3)
                std::swap(shape.indices[i], shape.indices[i + 1]);
        for (Vec3d& p : shape.positions) p = unit * (p.cwiseProduct(Vec3d(1, 0.4, 3)) + shift);
        const TriangleMesh mesh = shape.mesh();
        const std::optional<Vec3d> centre = starCentreOf(mesh);
        ASSERT_TRUE(centre);
        expectSeen(mesh, *centre);
    }
}

TEST(StarShape, MayNeedAPlaceThatIsNotTheMiddle) {
    // A crooked L whose box' middle is outside of it: only the elbow sees both arms.
    Shape shape;
    const double corners[6][2] = {{0, 0}, {4, 0}, {4, 1}, {1, 1}, {1, 4}, {0, 4}};
    for (const double z : {0.0, 1.0})
        for (const auto& c : corners) shape.positions.emplace_back(c[0], c[1], z);
    const std::uint32_t caps[4][3] = {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 5}};
    for (const auto& t : caps) {
        shape.indices.insert(shape.indices.end(), {t[0], t[2], t[1]});
        shape.indices.insert(shape.indices.end(), {6 + t[0], 6 + t[1], 6 + t[2]});
    }
    for (std::uint32_t i = 0; i < 6; ++i) shape.quad(i, (i + 1) % 6, 6 + (i + 1) % 6, 6 + i);
    const TriangleMesh mesh = shape.mesh();
    const std::optional<Vec3d> centre = starCentreOf(mesh);
    ASSERT_TRUE(centre);
    expectSeen(mesh, *centre);
    EXPECT_LT(centre->x(), 1);
    EXPECT_LT(centre->y(), 1);
}

TEST(StarShape, IsNotFoundOfWhatIsNone) {
    Random random(1);
    EXPECT_FALSE(starCentreOf(TriangleMesh{}));
    EXPECT_FALSE(starCentreOf(deforming::shape(1, random).mesh())) << "a ring";
    EXPECT_TRUE(starCentreOf(deforming::shape(2, random).mesh())) << "a flat disc, from above";
    EXPECT_FALSE(starCentreOf(deforming::shape(3, random).mesh())) << "triangles anywhere";
    EXPECT_FALSE(starCentreOf(deforming::shape(5, random).mesh())) << "needles and points";
    Shape ball = deforming::shape(0, random), twice = ball;
    for (const Vec3d& p : ball.positions) twice.positions.push_back(0.5 * p);
    for (const std::uint32_t i : ball.indices)
        twice.indices.push_back(i + static_cast<std::uint32_t>(ball.positions.size()));
    EXPECT_FALSE(starCentreOf(twice.mesh())) << "a ball in a ball: each direction twice";
    std::swap(ball.indices[30], ball.indices[31]);
    EXPECT_FALSE(starCentreOf(ball.mesh())) << "a face that looks the other way";
}

TEST(SphericalBezierTouch, OfABallIsNeverMissed) {
    std::size_t touching = 0, rejected = 0;
    for (const std::uint64_t seed : seeds(200)) {
        SCOPED_TRACE(deforming::repeat(seed, "SphericalBezierTouch.OfABallIsNeverMissed"));
        Random random(seed);
        Shape shape = deforming::shape(random.below(deforming::kKinds), random, 8);
        SphericalBezierBound bound(shape.mesh(), {.levels = random.below(3)});
        deforming::deform(random.below(deforming::kDeformations), shape.positions, random);
        ASSERT_TRUE(bound.move(shape.positions));
        const TriangleMesh mesh = shape.mesh();
        const double size = mesh.bounds().size().norm() + 1e-3;
        for (int i = 0; i < 20; ++i) {
            const Vec3d at = mesh.bounds().center() + random.uniform(0, 1.2) * size * random.direction();
            // So small that it just meets a point of a face, or misses it by little.
            const Vec3d point = deforming::pointOf(mesh.triangle(random.below(mesh.faceCount())), random);
            const double radius = (point - at).norm() * (random.below(2) == 0 ? 1 + 1e-9 : random.uniform(0, 1));
            const bool meets = (point - at).norm() <= radius;
            QueryWork work;
            const bool may = mayMeetBall(bound, at, radius, work);
            if (meets) {
                ASSERT_TRUE(may);
            }
            touching += meets ? 1 : 0;
            rejected += may ? 0 : 1;
        }
    }
    EXPECT_GT(touching, 1000U);
    EXPECT_GT(rejected, 300U);
}

}  // namespace
}  // namespace tessera

/// Derived meshes that are finer than their fields say: what they are, and how far they are from their surface.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <limits>
#include <random>

#include "common/cores/Deformation.h"
#include "common/drawable/Drawable.h"
#include "common/drawable/NurbsArrays.h"
#include "common/freeform/nurbs/NurbsShapes.h"
#include "tests/unit/drawable/ControlCube.h"

namespace tessera {
namespace {

using test::controlGrid;

Vec3d cornerOf(const MeshArrays& mesh, std::size_t index) {
    const float* p = &mesh.positions.as<float>()[3 * std::size_t{mesh.indices.as<std::uint32_t>()[index]}];
    return {p[0], p[1], p[2]};
}

/// From a point to a triangle (Ericson, Real-Time Collision Detection, 5.1.5, by regions of its edges).
double distanceToTriangle(const Vec3d& p, const Vec3d& a, const Vec3d& b, const Vec3d& c) {
    const auto toEdge = [&p](const Vec3d& from, const Vec3d& to) {
        const Vec3d along = to - from;
        const double length2 = along.squaredNorm();
        const double t = length2 > 0 ? std::clamp((p - from).dot(along) / length2, 0.0, 1.0) : 0.0;
        return (p - from - t * along).norm();
    };
    const Vec3d normal = (b - a).cross(c - a);
    const bool inside = normal.norm() > 0 && (b - a).cross(p - a).dot(normal) >= 0 &&
                        (c - b).cross(p - b).dot(normal) >= 0 && (a - c).cross(p - c).dot(normal) >= 0;
    if (inside) return std::abs((p - a).dot(normal)) / normal.norm();
    return std::min({toEdge(a, b), toEdge(b, c), toEdge(c, a)});
}

double distanceToMesh(const Vec3d& p, const MeshArrays& mesh) {
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t t = 0; t < mesh.indices.as<std::uint32_t>().size(); t += 3)
        least = std::min(least, distanceToTriangle(p, cornerOf(mesh, t), cornerOf(mesh, t + 1), cornerOf(mesh, t + 2)));
    return least;
}

/// A cube, an open grid, or one with polygons, or triangles for Loop; points moved about, creases of all kinds.
SubdivisionSurface randomSurface(std::mt19937_64& random) {
    const auto uniform = [&random](double from, double to) {
        return std::uniform_real_distribution<double>(from, to)(random);
    };
    SubdivisionSurface surface = controlGrid(1 + static_cast<std::uint32_t>(random() % 2));
    std::vector<std::uint32_t> sizes, vertices;
    const auto old = surface.faceVertices.as<std::uint32_t>();
    const bool loop = random() % 4 == 0, some = random() % 3 == 0, open = random() % 3 == 0;
    for (std::size_t f = 0; f < old.size() / 4; ++f) {
        if (open && f % 5 == 4) continue;
        if (loop || (some && random() % 4 == 0)) {
            sizes.insert(sizes.end(), {3, 3});
            vertices.insert(vertices.end(),
                            {old[4 * f], old[4 * f + 1], old[4 * f + 2], old[4 * f], old[4 * f + 2], old[4 * f + 3]});
        } else {
            sizes.push_back(4);
            vertices.insert(vertices.end(), &old[4 * f], &old[4 * f] + 4);
        }
    }
    surface.faceSizes = Blob::of(std::span<const std::uint32_t>(sizes));
    surface.faceVertices = Blob::of(std::span<const std::uint32_t>(vertices));
    if (loop)
        surface.scheme = SubdivisionSurface::kLoop;
    else if (random() % 8 == 0)
        surface.scheme = SubdivisionSurface::kBilinear;
    std::vector<float> points(surface.points.as<float>().begin(), surface.points.as<float>().end());
    const double wild = uniform(0, 1);
    for (float& x : points) x += static_cast<float>(uniform(-wild, wild));
    surface.points = Blob::of(std::span<const float>(points));
    std::vector<std::uint32_t> creases, corners;
    std::vector<float> sharpness;
    if (random() % 2)
        for (std::size_t i = 0, begin = 0; i < sizes.size(); begin += sizes[i++])
            for (std::uint32_t k = 0; k < sizes[i]; ++k)
                if (vertices[begin + k] < vertices[begin + (k + 1) % sizes[i]] && random() % 4 == 0) {
                    creases.insert(creases.end(), {vertices[begin + k], vertices[begin + (k + 1) % sizes[i]]});
                    sharpness.push_back(random() % 3 == 0 ? 10.0F : static_cast<float>(uniform(0.2, 5)));
                }
    if (!creases.empty()) {
        surface.creases = Blob::of(std::span<const std::uint32_t>(creases));
        surface.creaseSharpness = Blob::of(std::span<const float>(sharpness));
    }
    surface.level = 0;
    return surface;
}

TEST(Fineness, AFinerMeshIsThatOfAHigherLevelAndNothingElseIsAnother) {
    SubdivisionSurface surface = controlGrid(2);
    surface.level = 1;
    const Drawable drawable = drawableOf(Object::of(surface));
    SubdivisionSurface higher = surface;
    higher.level = 3;
    EXPECT_EQ(drawable.at(2).key(), drawableOf(Object::of(higher)).key());
    EXPECT_EQ(drawable.at(2).at(0).key(), drawable.key());
    EXPECT_EQ(drawable.triangleCount(), 24u * 8) << "who counts, collides and picks has what the fields say";
    EXPECT_EQ(drawable.at(2).triangleCount(), 24u * 128);
    ASSERT_TRUE(drawable.byScreen());
    EXPECT_EQ(drawable.finest(), 5u);
    surface.screenError = 0;
    EXPECT_FALSE(drawableOf(Object::of(surface)).byScreen()) << "an author who wants one fineness";
    EXPECT_FALSE(drawableOf(Object::of(Geometry())).byScreen());
    EXPECT_FALSE(drawableOf(Object::of(Deformation())).byScreen());
    NurbsSurfaceCore sphere = coreOfSurface(*sphereSurface(1, {}));
    sphere.tolerance = 0.04;
    const Drawable ball = drawableOf(Object::of(sphere));
    NurbsSurfaceCore finer = sphere;
    finer.tolerance = 0.01;
    EXPECT_EQ(ball.at(1).key(), drawableOf(Object::of(finer)).key());
    EXPECT_LE(ball.at(1).deviation(), 0.01);
    EXPECT_GT(ball.at(1).deviation(), 0.001);
    std::shared_ptr<const void> keeper;
    const Drawable kept = ball.kept(keeper);
    sphere = {};
    EXPECT_EQ(kept.at(1).key(), drawableOf(Object::of(finer)).key());
}

/// From which a surface's place on a screen is judged: too small, and a step is not taken that could be seen.
TEST(Fineness, NoPointOfASubdivisionSurfaceIsFartherFromItsTrianglesThanIsSaid) {
    const char* one = std::getenv("TESSERA_SEED");
    const std::uint64_t first = one ? std::strtoull(one, nullptr, 10) : 1, last = one ? first : 20;
    double sumOfRatios = 0;
    std::size_t judged = 0;
    for (std::uint64_t seed = first; seed <= last; ++seed) {
        SCOPED_TRACE(::testing::Message()
                     << "TESSERA_SEED=" << seed << " build/bin/unit_drawable --gtest_filter=Fineness.*");
        std::mt19937_64 random(seed);
        const SubdivisionSurface surface = randomSurface(random);
        const Drawable drawable = drawableOf(Object::of(surface));
        ASSERT_TRUE(drawable.check()) << drawable.check().error().message;
        const MeshArrays truth = drawable.at(6).arrays();
        const auto points = truth.positions.as<float>();
        std::vector<Vec3d> samples;
        for (int i = 0; i < 150; ++i) {
            const std::size_t v = 3 * (random() % (points.size() / 3));
            samples.emplace_back(points[v], points[v + 1], points[v + 2]);
        }
        for (unsigned level = 0; level < 4; ++level) {
            const MeshArrays mesh = drawable.at(level).arrays();
            const double said = drawable.at(level).deviation();
            double farthest = 0;
            for (const Vec3d& p : samples) farthest = std::max(farthest, distanceToMesh(p, mesh));
            EXPECT_LE(farthest, said + 1e-6) << "level " << level;
            if (farthest > 1e-4) {
                sumOfRatios += said / farthest;
                ++judged;
            }
        }
    }
    if (!one) {
        EXPECT_GT(judged, 30u);
        // A step divides by four: about one too many, and never two, on the average.
        EXPECT_LT(sumOfRatios / static_cast<double>(judged), 8);
    }
}

TEST(Fineness, EachStepSaysLessUntilNothingIsOff) {
    SubdivisionSurface surface = controlGrid(2);
    surface.level = 0;
    const Drawable drawable = drawableOf(Object::of(surface));
    for (unsigned f = 0; f < 6; ++f) EXPECT_LT(drawable.at(f + 1).deviation(), 0.6 * drawable.at(f).deviation()) << f;
    // A flat one, however its points lie in the plane, is right as it is.
    std::vector<float> points(surface.points.as<float>().begin(), surface.points.as<float>().end());
    for (std::size_t i = 2; i < points.size(); i += 3) points[i] = 0;
    surface.points = Blob::of(std::span<const float>(points));
    EXPECT_LT(drawableOf(Object::of(surface)).at(3).deviation(), 1e-6);
}

}  // namespace
}  // namespace tessera

/// Bézier patches of subdivision surfaces beside points of them.
#include "common/freeform/subdivision/PatchExtraction.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/freeform/subdivision/LimitEvaluator.h"
#include "tests/unit/subdivision/SomeMesh.h"

namespace tessera {
namespace {

using test::Seeds;

bool isTriangle(const SurfacePatch& patch) {
    return std::holds_alternative<BezierTriangle>(patch.shape);
}

/// Points of every patch beside the surface's; the largest part of its error that any of them has.
double checkPatches(const ControlMesh& mesh, const SubdivisionTopology& topology,
                    const std::vector<SurfacePatch>& patches, std::mt19937_64& random) {
    LimitEvaluator evaluator(topology);
    double used = 0;
    for (const SurfacePatch& patch : patches) {
        for (int i = 0; i < 4; ++i) {
            const auto [s, t] = i == 0   ? std::pair(0.0, 0.0)
                                : i == 1 ? std::pair(0.0, 1.0)
                                         : test::somePlace(random, isTriangle(patch));
            const auto exact =
                evaluator.evaluate(mesh.positions, {patch.ptex, patch.u + patch.size * s, patch.v + patch.size * t});
            EXPECT_TRUE(exact.has_value());
            const double off = (evaluate(patch, s, t).point - exact->point).norm();
            EXPECT_LE(off, patch.error) << "face " << patch.ptex << " at " << patch.u << " " << patch.v << " size "
                                        << patch.size;
            used = std::max(used, off / patch.error);
        }
    }
    return used;
}

/// Of the faces that have a surface, 1 each, or 1/2 for a triangle.
double areaOf(const std::vector<SurfacePatch>& patches) {
    double area = 0;
    for (const SurfacePatch& patch : patches) area += patch.size * patch.size;
    return area;
}

TEST(PatchExtraction, IsNowhereFartherThanItsErrorAndCoversAll) {
    const Seeds seeds(60);
    double used = 0;
    for (std::uint64_t seed = seeds.first; seed < seeds.first + seeds.count; ++seed) {
        TESSERA_TRACE_SEED("unit_subdivision", seed);
        std::mt19937_64 random(seed);
        const ControlMesh mesh = test::someMesh(random);
        const auto topology = SubdivisionTopology::build(mesh);
        ASSERT_TRUE(topology.has_value());
        NeighbourhoodGraph graph(*topology);
        double faces = 0;
        for (std::uint32_t p = 0; p < topology->ptexFaceCount(); ++p)
            faces += topology->hasSurface(topology->ptexFace(p).face) ? 1 : 0;
        for (const bool approximate : {true, false}) {
            const PatchOptions options{.tolerance = approximate ? 0.01 : 0.3, .approximate = approximate};
            const auto patches = patchesOf(graph, mesh.positions, options);
            ASSERT_TRUE(patches.has_value()) << patches.error().message;
            EXPECT_DOUBLE_EQ(areaOf(*patches), faces);
            for (const SurfacePatch& patch : *patches) EXPECT_LE(patch.error, options.tolerance);
            const double here = checkPatches(mesh, *topology, *patches, random);
            if (approximate) used = std::max(used, here);
        }
    }
    // The check can fail: somewhere the error is mostly used.
    EXPECT_GT(used, 0.3);
}

TEST(PatchExtraction, RegularFacesAreOneExactPatchEach) {
    for (const SubdivisionScheme scheme : {SubdivisionScheme::kCatmullClark, SubdivisionScheme::kLoop}) {
        ControlMesh mesh = test::gridMesh(5, 5, false, scheme);
        mesh.boundary = scheme == SubdivisionScheme::kLoop ? BoundaryInterpolation::kEdgeOnly
                                                           : BoundaryInterpolation::kEdgeAndCorner;
        // A crease from side to side.
        for (std::uint32_t x = 0; x < 5; ++x) mesh.creases.push_back({2 * 6 + x, 2 * 6 + x + 1, kInfiniteSharpness});
        const auto topology = SubdivisionTopology::build(mesh);
        ASSERT_TRUE(topology.has_value());
        NeighbourhoodGraph graph(*topology);
        const auto patches = patchesOf(graph, mesh.positions, {.tolerance = 1e-9});
        ASSERT_TRUE(patches.has_value());
        std::size_t whole = 0;
        for (const SurfacePatch& patch : *patches) whole += patch.size == 1 ? 1 : 0;
        // In the quadrilateral grid all faces but where the crease meets the boundary; of triangles at corners and
        // there not all.
        EXPECT_GE(whole, scheme == SubdivisionScheme::kLoop ? 38U : 21U);
        std::mt19937_64 random(3);
        checkPatches(mesh, *topology, *patches, random);
    }
}

TEST(PatchExtraction, PolynomialsAreWhatRefinementOfThemIs) {
    // For every regular neighbourhood met: its children, refined by the scheme's masks, are the parts of its own
    // polynomial. This judges the extrapolation at boundaries and creases, and the box spline's table.
    std::size_t seen = 0;
    const Seeds seeds(40);
    for (std::uint64_t seed = seeds.first; seed < seeds.first + seeds.count; ++seed) {
        TESSERA_TRACE_SEED("unit_subdivision", seed);
        std::mt19937_64 random(seed);
        const ControlMesh mesh = test::someMesh(random);
        const auto topology = SubdivisionTopology::build(mesh);
        ASSERT_TRUE(topology.has_value());
        NeighbourhoodGraph graph(*topology);
        const bool triangle = mesh.scheme == SubdivisionScheme::kLoop;
        for (std::uint32_t f = 0; f < topology->mesh().faceCount(); ++f) {
            const auto& face = graph.faceOf(f);
            if (!face.node->spline) continue;
            ++seen;
            std::vector<Vec3d> points, finer;
            for (const std::uint32_t p : face.points) points.push_back(mesh.positions[p]);
            const auto at = [&](const SparseRows& spline, const std::vector<Vec3d>& from, double u, double v) {
                if (!triangle) {
                    std::array<Vec3d, 16> p;
                    for (std::size_t i = 0; i < 16; ++i) p[i] = spline.apply(i, from);
                    BezierPatch patch;
                    for (const Vec3d& b : bezierOfSpline(p)) patch.points.emplace_back(b.x(), b.y(), b.z(), 1);
                    return evaluate(patch, u, v).point;
                }
                std::array<Vec3d, 12> p;
                for (std::size_t i = 0; i < 12; ++i) p[i] = spline.apply(i, from);
                const auto b = bezierOfBoxSpline(p);
                return evaluate(BezierTriangle{.degree = 4, .points = {b.begin(), b.end()}}, u, v).point;
            };
            const std::array<Vec2d, 4> origins =
                triangle ? std::array<Vec2d, 4>{Vec2d(0, 0), Vec2d(0.5, 0), Vec2d(0, 0.5), Vec2d(0.5, 0.5)}
                         : std::array<Vec2d, 4>{Vec2d(0, 0), Vec2d(0.5, 0), Vec2d(0.5, 0.5), Vec2d(0, 0.5)};
            for (std::uint32_t c = 0; c < 4; ++c) {
                const auto& child = graph.childOf(*face.node, c);
                ASSERT_TRUE(child.node->spline.has_value());
                child.points.apply(points, finer);
                const auto [s, t] = test::somePlace(random, triangle);
                const double half = triangle && c == 3 ? -0.5 : 0.5;
                const Vec3d here = at(*face.node->spline, points, origins[c].x() + half * s, origins[c].y() + half * t);
                EXPECT_LT((at(*child.node->spline, finer, s, t) - here).norm(), 1e-13) << f << " child " << c;
            }
        }
    }
    EXPECT_GT(seen, 5 * seeds.count);
}

TEST(PatchExtraction, TakesFewPatchesBesideAnIrregularVertex) {
    for (const SubdivisionScheme scheme : {SubdivisionScheme::kCatmullClark, SubdivisionScheme::kLoop}) {
        const ControlMesh mesh = test::poleMesh(5, scheme);
        const auto topology = SubdivisionTopology::build(mesh);
        NeighbourhoodGraph graph(*topology);
        std::size_t before = 0;
        for (const double tolerance : {1e-2, 1e-3, 1e-4, 1e-5}) {
            const auto patches = patchesOf(graph, mesh.positions, {.tolerance = tolerance});
            ASSERT_TRUE(patches.has_value());
            // Each tenth of the tolerance costs at most five more levels of three patches at each corner.
            if (before > 0) {
                EXPECT_LT(patches->size(), before + topology->ptexFaceCount() * 4 * 15);
            }
            before = patches->size();
        }
    }
}

TEST(PatchExtraction, OfTouchedFacesIsThatOfAll) {
    std::mt19937_64 random(17);
    const ControlMesh mesh = test::gridMesh(6, 6, true, SubdivisionScheme::kCatmullClark);
    const auto topology = SubdivisionTopology::build(mesh);
    NeighbourhoodGraph graph(*topology);
    const auto touched = topology->touchedBy(std::array<std::uint32_t, 1>{7});
    EXPECT_EQ(touched.size(), 16U);
    const auto some = patchesOf(graph, mesh.positions, touched, {.tolerance = 1e-3});
    const auto all = patchesOf(graph, mesh.positions, {.tolerance = 1e-3});
    ASSERT_TRUE(some.has_value() && all.has_value());
    std::size_t next = 0;
    for (const SurfacePatch& patch : *all) {
        if (!std::binary_search(touched.begin(), touched.end(), patch.ptex)) continue;
        ASSERT_LT(next, some->size());
        EXPECT_EQ((*some)[next].u, patch.u);
        EXPECT_EQ(std::get<BezierPatch>((*some)[next].shape).points, std::get<BezierPatch>(patch.shape).points);
        ++next;
    }
    EXPECT_EQ(next, some->size());
}

TEST(PatchExtraction, RefusesInWords) {
    const ControlMesh mesh = test::poleMesh(5, SubdivisionScheme::kCatmullClark);
    const auto topology = SubdivisionTopology::build(mesh);
    NeighbourhoodGraph graph(*topology);
    for (const double bad : {0.0, -1.0, std::nan(""), HUGE_VAL})
        EXPECT_FALSE(patchesOf(graph, mesh.positions, {.tolerance = bad}).has_value());
    EXPECT_EQ(patchesOf(graph, mesh.positions, {.tolerance = 1e-6, .mostPatches = 10}).error().code, ErrorCode::kLimit);
    EXPECT_FALSE(patchesOf(graph, mesh.positions, std::array<std::uint32_t, 1>{99}, {}).has_value());
}

}  // namespace
}  // namespace tessera

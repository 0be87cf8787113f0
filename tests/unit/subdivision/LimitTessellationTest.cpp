#include "common/freeform/subdivision/LimitTessellation.h"

#include <gtest/gtest.h>

#include <cstring>
#include <map>

#include "common/freeform/subdivision/LimitEvaluator.h"
#include "common/freeform/subdivision/PortableTrigonometry.h"
#include "tests/support/words/Words.h"
#include "tests/unit/subdivision/SomeMesh.h"

namespace tessera {
namespace {

using namespace test;

struct Tessellated {
    std::vector<float> positions, normals;
};

std::vector<float> floatsOf(const ControlMesh& mesh) {
    std::vector<float> out;
    for (const Vec3d& p : mesh.positions)
        for (int k = 0; k < 3; ++k) out.push_back(static_cast<float>(p[k]));
    return out;
}
Tessellated tessellated(const LimitTessellation& tessellation, std::span<const float> points) {
    Tessellated out{std::vector<float>(3 * tessellation.vertexCount(), NAN),
                    std::vector<float>(3 * tessellation.vertexCount(), NAN)};
    tessellation.evaluate(points, out.positions, out.normals);
    return out;
}
Vec3d vectorAt(const std::vector<float>& numbers, std::uint32_t i) {
    return {numbers[3 * i], numbers[3 * i + 1], numbers[3 * i + 2]};
}

/// Calls with (ptex, u, v, vertex) for each corner of each triangle, in the order in which the header says that they
/// are made.
template <typename Visit>
void forEachCorner(const LimitTessellation& tessellation, Visit&& visit) {
    const SubdivisionTopology& topology = tessellation.topology();
    const bool triangular = topology.scheme() == SubdivisionScheme::kLoop;
    std::size_t next = 0;
    for (std::uint32_t p = 0; p < topology.ptexFaceCount(); ++p) {
        const PtexFace face = topology.ptexFace(p);
        if (!topology.hasSurface(face.face)) continue;
        const std::uint32_t n = 1U << (face.corner == kNoIndex ? tessellation.level() : tessellation.level() - 1);
        const auto corner = [&](std::uint32_t i, std::uint32_t j) {
            visit(p, double(i) / n, double(j) / n, tessellation.indices()[next++]);
        };
        for (std::uint32_t j = 0; j < n; ++j) {
            for (std::uint32_t i = 0; i < (triangular ? n - j : n); ++i) {
                corner(i, j), corner(i + 1, j), corner(i + (triangular ? 0 : 1), j + 1);
                if (!triangular)
                    corner(i, j), corner(i + 1, j + 1), corner(i, j + 1);
                else if (i + j + 2 <= n)
                    corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1);
            }
        }
    }
    EXPECT_EQ(next, tessellation.indices().size());
}

/// Where there is no tangent plane, or no formula for it: at fixed corners and the ends of sharp edges (CornerLimit.h),
/// and where the bilinear parts of a polygon meet.
bool isUndecided(const SubdivisionTopology& topology, std::uint32_t ptex, double u, double v) {
    const PtexFace face = topology.ptexFace(ptex);
    if (topology.scheme() == SubdivisionScheme::kBilinear) return face.corner != kNoIndex && (u == 1 || v == 1);
    const bool triangular = topology.scheme() == SubdivisionScheme::kLoop;
    if ((u != 0 && u != 1) || (v != 0 && v != 1) || (face.corner != kNoIndex && (u == 1 || v == 1))) return false;
    const std::uint32_t corner = face.corner != kNoIndex ? face.corner
                                 : u == 0                ? (v == 0       ? 0
                                                            : triangular ? 2
                                                                         : 3)
                                                         : (v == 0 ? 1 : 2);
    const std::uint32_t vertex = topology.mesh().verticesOf(face.face)[corner];
    std::size_t sharp = 0;
    for (const std::uint32_t e : topology.mesh().edgesAt(vertex))
        sharp += isInfinitelySharp(topology.mesh().edges[e].sharpness) ? 1 : 0;
    return sharp == 1 || isFixedCorner(topology.mesh(), vertex);
}

ControlMesh someMeshOfAnyScheme(std::mt19937_64& random) {
    ControlMesh mesh = someMesh(random);
    if (mesh.scheme == SubdivisionScheme::kCatmullClark && random() % 4 == 0)
        mesh.scheme = SubdivisionScheme::kBilinear;
    for (Vec3d& p : mesh.positions) p = p.cast<float>().cast<double>();
    return mesh;
}

TEST(LimitTessellation, LiesOnTheLimitSurfaceFromWhicheverFaceOneLooks) {
    const Seeds seeds(150);
    std::size_t normals = 0;
    for (std::uint64_t seed = seeds.first; seed < seeds.first + seeds.count; ++seed) {
        TESSERA_TRACE_SEED("unit_subdivision", seed);
        std::mt19937_64 random(seed);
        const ControlMesh mesh = someMeshOfAnyScheme(random);
        const auto made = LimitTessellation::build(mesh, static_cast<int>(random() % 4));
        ASSERT_TRUE(made) << made.error().message;
        const Tessellated out = tessellated(**made, floatsOf(mesh));
        LimitEvaluator evaluator((*made)->topology());
        forEachCorner(**made, [&](std::uint32_t ptex, double u, double v, std::uint32_t vertex) {
            ASSERT_LT(vertex, (*made)->vertexCount());
            const auto truth = evaluator.evaluate(mesh.positions, {ptex, u, v});
            ASSERT_TRUE(truth) << truth.error().message;
            // A float's rounding at coordinates below 8, thrice for three of them; the evaluator's own is 1e-9 of that.
            ASSERT_LT((vectorAt(out.positions, vertex) - truth->point).norm(), 3 * 8 * 6e-8)
                << ptex << ' ' << u << ' ' << v;
            const Vec3d normal = vectorAt(out.normals, vertex);
            ASSERT_NEAR(normal.norm(), 1, 1e-6);
            if (isUndecided((*made)->topology(), ptex, u, v)) return;
            // Where tangents are nearly parallel a normal says little; where the evaluator has none, any is good.
            if (truth->normal.isZero(0) ||
                truth->du.cross(truth->dv).norm() < 1e-4 * truth->du.norm() * truth->dv.norm())
                return;
            ++normals;
            ASSERT_LT((normal - truth->normal).norm(), 1e-5) << ptex << ' ' << u << ' ' << v;
        });
        if (HasFatalFailure()) return;
    }
    EXPECT_GT(normals, seeds.count * 100);
}

TEST(LimitTessellation, OfClosedMeshesIsClosedBitByBit) {
    for (const SubdivisionScheme scheme :
         {SubdivisionScheme::kCatmullClark, SubdivisionScheme::kLoop, SubdivisionScheme::kBilinear}) {
        for (std::uint32_t shape = 0; shape < 8; ++shape) {
            std::mt19937_64 random(shape + 1);
            ControlMesh mesh = shape == 0 ? gridMesh(5, 4, true, scheme) : poleMesh(2 + shape, scheme);
            for (Vec3d& p : mesh.positions)
                p += 1e-2 * Vec3d(double(random() % 97), double(random() % 97), double(random() % 97));
            for (int i = 0; i < 10; ++i) {
                const auto side = static_cast<std::uint32_t>(random() % mesh.faceVertices.size());
                std::uint32_t face = 0, begin = 0;
                while (begin + mesh.faceSizes[face] <= side) begin += mesh.faceSizes[face++];
                mesh.creases.push_back({mesh.faceVertices[side],
                                        mesh.faceVertices[begin + (side - begin + 1) % mesh.faceSizes[face]],
                                        i % 2 ? kInfiniteSharpness : 1.5F});
            }
            const auto made = LimitTessellation::build(mesh, 3);
            ASSERT_TRUE(made) << made.error().message;
            const Tessellated out = tessellated(**made, floatsOf(mesh));
            using Bits = std::array<std::uint32_t, 3>;
            const auto bitsOf = [&](std::uint32_t vertex) {
                Bits bits;
                std::memcpy(bits.data(), &out.positions[3 * vertex], sizeof bits);
                return bits;
            };
            std::map<std::pair<Bits, Bits>, int> ways;  // each edge is gone along once each way
            const auto& indices = (*made)->indices();
            for (std::size_t i = 0; i < indices.size(); ++i) {
                const Bits a = bitsOf(indices[i]), b = bitsOf(indices[i % 3 == 2 ? i - 2 : i + 1]);
                ways[std::minmax(a, b)] += a < b ? 1 : -1;
            }
            for (const auto& [edge, sum] : ways) ASSERT_EQ(sum, 0) << "scheme " << int(scheme) << ", shape " << shape;
            EXPECT_EQ(ways.size(), indices.size() / 2);
        }
    }
}

TEST(LimitTessellation, FollowsMovedPointsToTheBytesOfAFreshOne) {
    const Seeds seeds(200);
    std::size_t spared = 0;
    for (std::uint64_t seed = seeds.first; seed < seeds.first + seeds.count; ++seed) {
        TESSERA_TRACE_SEED("unit_subdivision", seed);
        std::mt19937_64 random(seed);
        const ControlMesh mesh = someMeshOfAnyScheme(random);
        const auto made = LimitTessellation::build(mesh, static_cast<int>(random() % 4));
        ASSERT_TRUE(made) << made.error().message;
        std::vector<float> points = floatsOf(mesh);
        Tessellated out = tessellated(**made, points);
        for (int step = 0; step < 4; ++step) {
            std::vector<std::uint32_t> moved;
            const auto first = static_cast<std::uint32_t>(random() % mesh.positions.size());
            for (std::uint32_t i = first; i < mesh.positions.size() && moved.size() <= random() % 3; ++i)
                moved.push_back(i);
            for (const std::uint32_t p : moved)
                for (std::uint32_t k = 0; k < 3; ++k) points[3 * p + k] += static_cast<float>(random() % 100) / 100.0F;
            const Tessellated before = out;
            const LimitTessellation::Range range = (*made)->update(moved, points, out.positions, out.normals);
            const Tessellated fresh = tessellated(**made, points);
            ASSERT_EQ(std::memcmp(out.positions.data(), fresh.positions.data(), 4 * out.positions.size()), 0);
            ASSERT_EQ(std::memcmp(out.normals.data(), fresh.normals.data(), 4 * out.normals.size()), 0);
            for (std::size_t i = 0; i < out.positions.size(); ++i)
                if (i < 3 * range.begin || i >= 3 * range.end) {
                    ASSERT_EQ(out.positions[i], before.positions[i]);
                    ASSERT_EQ(out.normals[i], before.normals[i]);
                }
            spared += (*made)->vertexCount() - (range.end - range.begin);
        }
    }
    EXPECT_GT(spared, 1000U) << "a part alone is said to have changed";
}

TEST(PortableTrigonometry, IsThatOfLongDoubles) {
    for (int k = 1; k <= 5000; ++k) {
        for (const double x :
             {3.14159265358979323846 / k, 6.283185307179586 * (k % 37 - 18) / (1 + k % 91), 0.001 * k, -0.0007 * k}) {
            // Of a unit in the last place of 1.
            EXPECT_NEAR(portableSin(x), static_cast<double>(sinl(static_cast<long double>(x))), 2.3e-16) << x;
            EXPECT_NEAR(portableCos(x), static_cast<double>(cosl(static_cast<long double>(x))), 2.3e-16) << x;
        }
    }
    EXPECT_EQ(portableSin(0), 0);
    EXPECT_EQ(portableCos(0), 1);
}

TEST(LimitTessellation, RefusesWhatWouldBeTooLargeInWords) {
    const ControlMesh mesh = poleMesh(7, SubdivisionScheme::kCatmullClark);
    const auto why = [&](int level, LimitTessellation::Limits limits) {
        const auto made = LimitTessellation::build(mesh, level, limits);
        return made ? std::string() : made.error().message;
    };
    EXPECT_WORDS(why(7, {}));
    EXPECT_WORDS(why(-1, {}));
    EXPECT_EQ(why(6, {}), "");
    EXPECT_WORDS(why(6, {.mostTriangles = 1000}));
    EXPECT_WORDS(why(4, {.mostWeights = 1000}));
    ControlMesh bad = mesh;
    bad.faceVertices[0] = 99;
    EXPECT_FALSE(LimitTessellation::build(bad, 2));
}

}  // namespace
}  // namespace tessera

/// Tessellations whose faces have levels of their own: no gaps, the surface's own points, followed as others are.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <map>
#include <set>

#include "common/freeform/subdivision/LimitTessellation.h"
#include "tests/support/words/Words.h"
#include "tests/unit/subdivision/SomeMesh.h"

namespace tessera {
namespace {

using namespace test;

using MixedBits = std::array<std::uint32_t, 3>;

struct MixedArrays {
    std::vector<float> positions, normals;
    [[nodiscard]] MixedBits bitsOf(std::uint32_t vertex) const {
        MixedBits bits;
        std::memcpy(bits.data(), &positions[3 * vertex], sizeof bits);
        return bits;
    }
    [[nodiscard]] Vec3d positionOf(std::uint32_t vertex) const {
        return {positions[3 * vertex], positions[3 * vertex + 1], positions[3 * vertex + 2]};
    }
    [[nodiscard]] Vec3d normalOf(std::uint32_t vertex) const {
        return {normals[3 * vertex], normals[3 * vertex + 1], normals[3 * vertex + 2]};
    }
};
MixedArrays mixedArrays(const LimitTessellation& tessellation, std::span<const float> points) {
    MixedArrays out{std::vector<float>(3 * tessellation.vertexCount(), NAN),
                    std::vector<float>(3 * tessellation.vertexCount(), NAN)};
    tessellation.evaluate(points, out.positions, out.normals);
    return out;
}
std::vector<float> mixedPoints(const ControlMesh& mesh) {
    std::vector<float> out;
    for (const Vec3d& p : mesh.positions)
        for (int k = 0; k < 3; ++k) out.push_back(static_cast<float>(p[k]));
    return out;
}
std::vector<std::uint8_t> anyLevels(std::mt19937_64& random, std::size_t faces, unsigned finest) {
    std::vector<std::uint8_t> levels(faces);
    for (std::uint8_t& level : levels) level = static_cast<std::uint8_t>(random() % (finest + 1));
    return levels;
}
std::shared_ptr<const LimitTessellation> mixedOf(const ControlMesh& mesh, const std::vector<std::uint8_t>& levels) {
    const auto plan = LimitPlan::build(mesh);
    EXPECT_TRUE(plan) << plan.error().message;
    const auto made = LimitTessellation::build(*plan, levels);
    EXPECT_TRUE(made) << made.error().message;
    return *made;
}
/// By ends' bits: how often an edge is gone along one way more than the other.
std::map<std::pair<MixedBits, MixedBits>, int> waysOf(const LimitTessellation& tessellation,
                                                      const MixedArrays& arrays) {
    std::map<std::pair<MixedBits, MixedBits>, int> ways;
    const auto& indices = tessellation.indices();
    for (std::size_t i = 0; i < indices.size(); ++i) {
        const MixedBits a = arrays.bitsOf(indices[i]), b = arrays.bitsOf(indices[i % 3 == 2 ? i - 2 : i + 1]);
        ways[std::minmax(a, b)] += a < b ? 1 : -1;
    }
    return ways;
}
/// Some creases, half of them sharp for good.
void creaseAtRandom(ControlMesh& mesh, std::mt19937_64& random, int count) {
    for (int i = 0; i < count; ++i) {
        const auto side = static_cast<std::uint32_t>(random() % mesh.faceVertices.size());
        std::uint32_t face = 0, begin = 0;
        while (begin + mesh.faceSizes[face] <= side) begin += mesh.faceSizes[face++];
        mesh.creases.push_back({mesh.faceVertices[side],
                                mesh.faceVertices[begin + (side - begin + 1) % mesh.faceSizes[face]],
                                i % 2 ? kInfiniteSharpness : 1.5F});
    }
}
constexpr std::array kMixedSchemes{SubdivisionScheme::kCatmullClark, SubdivisionScheme::kLoop,
                                   SubdivisionScheme::kBilinear};

TEST(MixedLevels, LeaveNoGapInWhatIsClosed) {
    const Seeds seeds(30);
    for (std::uint64_t seed = seeds.first; seed < seeds.first + seeds.count; ++seed) {
        TESSERA_TRACE_SEED("unit_subdivision", seed);
        std::mt19937_64 random(seed);
        const SubdivisionScheme scheme = kMixedSchemes[random() % 3];
        ControlMesh mesh = random() % 3 == 0 ? gridMesh(5, 4, true, scheme)
                                             : poleMesh(3 + static_cast<std::uint32_t>(random() % 8), scheme);
        for (Vec3d& p : mesh.positions)
            p += 1e-3 * Vec3d(double(random() % 97), double(random() % 97), double(random() % 97));
        creaseAtRandom(mesh, random, static_cast<int>(random() % 12));
        const std::vector<std::uint8_t> levels = anyLevels(random, mesh.faceSizes.size(), 4);
        const auto mixed = mixedOf(mesh, levels), even = mixedOf(mesh, std::vector<std::uint8_t>(levels.size(), 4));
        const MixedArrays out = mixedArrays(*mixed, mixedPoints(mesh));
        const auto ways = waysOf(*mixed, out);
        for (const auto& [edge, sum] : ways) ASSERT_EQ(sum, 0);
        ASSERT_EQ(ways.size(), mixed->indices().size() / 2) << "each edge has two triangles";
        for (std::size_t i = 0; i < mixed->indices().size(); i += 3)
            ASSERT_EQ(
                (std::set<std::uint32_t>{mixed->indices()[i], mixed->indices()[i + 1], mixed->indices()[i + 2]}.size()),
                3u);
        ASSERT_LT(mixed->indices().size(), even->indices().size());
    }
}

TEST(MixedLevels, OfAnOpenSheetEndWhereItDoes) {
    const Seeds seeds(40);
    for (std::uint64_t seed = seeds.first; seed < seeds.first + seeds.count; ++seed) {
        TESSERA_TRACE_SEED("unit_subdivision", seed);
        std::mt19937_64 random(seed);
        const SubdivisionScheme scheme = kMixedSchemes[random() % 3];
        ControlMesh mesh = gridMesh(4, 3, false, scheme);
        for (Vec3d& p : mesh.positions)
            p += 1e-3 * Vec3d(double(random() % 97), double(random() % 97), double(random() % 97));
        creaseAtRandom(mesh, random, static_cast<int>(random() % 5));
        const std::vector<std::uint8_t> levels = anyLevels(random, mesh.faceSizes.size(), 4);
        const auto mixed = mixedOf(mesh, levels);
        const MixedArrays out = mixedArrays(*mixed, mixedPoints(mesh));
        std::size_t open = 0;
        for (const auto& [edge, sum] : waysOf(*mixed, out)) open += static_cast<std::size_t>(std::abs(sum));
        const SubdivisionTopology& topology = mixed->topology();
        std::size_t wanted = 0, triangles = 0;
        for (std::uint32_t f = 0; f < levels.size(); ++f) {
            triangles += (std::size_t{scheme == SubdivisionScheme::kLoop ? 1U : 2U} << (2 * levels[f]));
            for (const std::uint32_t e : topology.mesh().edgesOf(f)) {
                const auto& faces = topology.mesh().edges[e].faces;
                const bool rim = faces[1] == kNoIndex;
                const unsigned finest = rim ? levels[f] : std::max(levels[faces[0]], levels[faces[1]]);
                if (rim) wanted += std::size_t{1} << levels[f];
                triangles += (std::size_t{1} << finest) - (std::size_t{1} << levels[f]);
            }
        }
        EXPECT_EQ(open, wanted) << "boundaries alone have one triangle";
        EXPECT_EQ(mixed->indices().size(), 3 * triangles);
    }
}

/// In a plane each triangle has to be the right way round and not overlap others: the areas tell.
TEST(MixedLevels, CoverAFlatSheetOnceTheRightWayRound) {
    const Seeds seeds(40);
    for (std::uint64_t seed = seeds.first; seed < seeds.first + seeds.count; ++seed) {
        TESSERA_TRACE_SEED("unit_subdivision", seed);
        std::mt19937_64 random(seed);
        ControlMesh mesh = gridMesh(4, 3, false, kMixedSchemes[random() % 3]);
        for (std::uint32_t i = 0; i < mesh.positions.size(); ++i)
            mesh.positions[i] = {double(i % 5) + double(random() % 6) / 100, double(i / 5) + double(random() % 6) / 100,
                                 0};
        creaseAtRandom(mesh, random, static_cast<int>(random() % 5));
        const std::vector<std::uint8_t> levels = anyLevels(random, mesh.faceSizes.size(), 4);
        const auto areaOf = [&](const LimitTessellation& tessellation) {
            const MixedArrays out = mixedArrays(tessellation, mixedPoints(mesh));
            double sum = 0;
            for (std::size_t i = 0; i < tessellation.indices().size(); i += 3) {
                const Vec3d a = out.positionOf(tessellation.indices()[i]),
                            b = out.positionOf(tessellation.indices()[i + 1]),
                            c = out.positionOf(tessellation.indices()[i + 2]);
                const double area = 0.5 * (b - a).cross(c - a).z();
                EXPECT_GT(area, 0);
                sum += area;
            }
            return sum;
        };
        const double mixed = areaOf(*mixedOf(mesh, levels)),
                     even = areaOf(*mixedOf(mesh, std::vector<std::uint8_t>(levels.size(), 4)));
        // Rims of coarser faces are shorter ways along the sheet's.
        EXPECT_NEAR(mixed, even, 0.05 * even);
    }
}

/// The oracle is the tessellation of the finest level, which other tests hold against the evaluator: a face that is
/// coarser has some of its vertices.
TEST(MixedLevels, HaveThePointsAndNormalsOfTheFinest) {
    const Seeds seeds(25);
    std::size_t compared = 0;
    for (std::uint64_t seed = seeds.first; seed < seeds.first + seeds.count; ++seed) {
        TESSERA_TRACE_SEED("unit_subdivision", seed);
        std::mt19937_64 random(seed);
        ControlMesh mesh = someMesh(random);
        creaseAtRandom(mesh, random, static_cast<int>(random() % 6));
        if (!SubdivisionTopology::build(mesh)) continue;
        const std::vector<std::uint8_t> levels = anyLevels(random, mesh.faceSizes.size(), 3);
        const auto mixed = mixedOf(mesh, levels), even = mixedOf(mesh, std::vector<std::uint8_t>(levels.size(), 3));
        const MixedArrays out = mixedArrays(*mixed, mixedPoints(mesh)), fine = mixedArrays(*even, mixedPoints(mesh));
        // Places of a grid much wider than rounding, each vertex in all that it may have been rounded to.
        const auto cellOf = [](const Vec3d& p, double dx, double dy, double dz) {
            return std::array<long, 3>{std::lround((p.x() + dx) * 1e4), std::lround((p.y() + dy) * 1e4),
                                       std::lround((p.z() + dz) * 1e4)};
        };
        std::multimap<std::array<long, 3>, std::uint32_t> known;
        for (std::uint32_t v = 0; v < even->vertexCount(); ++v) known.emplace(cellOf(fine.positionOf(v), 0, 0, 0), v);
        // At the ends of sharp edges and fixed corners there is no one normal (LimitTessellation.h).
        const auto coarsest = mixedOf(mesh, std::vector<std::uint8_t>(levels.size(), 0));
        const MixedArrays coarse = mixedArrays(*coarsest, mixedPoints(mesh));
        std::set<std::array<long, 3>> corners;
        for (std::uint32_t v = 0; v < coarsest->vertexCount(); ++v)
            for (int k = 0; k < 8; ++k)
                corners.insert(
                    cellOf(coarse.positionOf(v), k & 1 ? 2e-5 : -2e-5, k & 2 ? 2e-5 : -2e-5, k & 4 ? 2e-5 : -2e-5));
        for (std::uint32_t v = 0; v < mixed->vertexCount(); ++v) {
            double nearest = 1, straightest = 2;
            for (int k = 0; k < 8; ++k) {
                const double r = 2e-5;
                const auto [begin, end] =
                    known.equal_range(cellOf(out.positionOf(v), k & 1 ? r : -r, k & 2 ? r : -r, k & 4 ? r : -r));
                for (auto at = begin; at != end; ++at) {
                    const double apart = (fine.positionOf(at->second) - out.positionOf(v)).norm();
                    nearest = std::min(nearest, apart);
                    if (apart < 2e-5)
                        straightest = std::min(straightest, (fine.normalOf(at->second) - out.normalOf(v)).norm());
                }
            }
            ASSERT_LT(nearest, 1e-5) << "vertex " << v;
            if (!corners.contains(cellOf(out.positionOf(v), 0, 0, 0))) ASSERT_LT(straightest, 1e-3) << "vertex " << v;
            ++compared;
        }
    }
    if (seeds.count > 1) EXPECT_GT(compared, seeds.count * 50);
}

TEST(MixedLevels, FollowMovedPointsToTheBytesOfFreshOnes) {
    const Seeds seeds(25);
    std::size_t spared = 0;
    for (std::uint64_t seed = seeds.first; seed < seeds.first + seeds.count; ++seed) {
        TESSERA_TRACE_SEED("unit_subdivision", seed);
        std::mt19937_64 random(seed);
        ControlMesh mesh = someMesh(random);
        creaseAtRandom(mesh, random, static_cast<int>(random() % 6));
        if (!SubdivisionTopology::build(mesh)) continue;
        if (mesh.scheme == SubdivisionScheme::kCatmullClark && random() % 4 == 0)
            mesh.scheme = SubdivisionScheme::kBilinear;
        const auto plan = LimitPlan::build(mesh).value();
        std::vector<float> points = mixedPoints(mesh);
        for (int pattern = 0; pattern < 2; ++pattern) {
            const std::vector<std::uint8_t> levels = anyLevels(random, mesh.faceSizes.size(), 3);
            const auto mixed = LimitTessellation::build(plan, levels).value(), other = mixedOf(mesh, levels);
            MixedArrays out = mixedArrays(*mixed, points);
            ASSERT_EQ(mixed->indices(), other->indices()) << "whatever was asked of the plan before";
            for (int step = 0; step < 3; ++step) {
                const auto moved = static_cast<std::uint32_t>(random() % mesh.positions.size());
                for (std::uint32_t k = 0; k < 3; ++k)
                    points[3 * moved + k] += static_cast<float>(random() % 100) / 100.0F;
                const MixedArrays before = out;
                const LimitTessellation::Range range =
                    mixed->update(std::span(&moved, 1), points, out.positions, out.normals);
                const MixedArrays fresh = mixedArrays(*other, points);
                ASSERT_EQ(std::memcmp(out.positions.data(), fresh.positions.data(), 4 * out.positions.size()), 0);
                ASSERT_EQ(std::memcmp(out.normals.data(), fresh.normals.data(), 4 * out.normals.size()), 0);
                for (std::size_t i = 0; i < out.positions.size(); ++i)
                    if (i < 3 * range.begin || i >= 3 * range.end) ASSERT_EQ(out.positions[i], before.positions[i]);
                spared += mixed->vertexCount() - (range.end - range.begin);
            }
        }
    }
    if (seeds.count > 1) EXPECT_GT(spared, 1000U);
}

TEST(MixedLevels, AreRefusedWhereTheyAreNone) {
    const auto plan = LimitPlan::build(poleMesh(5, SubdivisionScheme::kCatmullClark)).value();
    std::vector<std::uint8_t> levels(plan->topology().mesh().faceCount(), 0);
    levels[0] = 7;
    const auto made = LimitTessellation::build(plan, levels);
    ASSERT_FALSE(made);
    EXPECT_WORDS(made.error().message);
    levels[0] = 6;
    EXPECT_TRUE(LimitTessellation::build(plan, levels));
    EXPECT_FALSE(LimitTessellation::build(plan, levels, {.mostTriangles = 1000, .mostWeights = 1 << 20}));
}

}  // namespace
}  // namespace tessera

// Eight pairs of triangles at once, in double: whatever is decided must be what the exact predicate says.
#include <gtest/gtest.h>

#include <random>
#include <string>

#include "common/math/Compose.h"
#include "server/collision/query/PairFrame.h"
#include "server/collision/tree/Kernels.h"
#include "tests/unit/query/Bodies.h"

namespace tessera {
namespace {

using bodies::anyRotation, bodies::between, bodies::inCube, bodies::instructionSets, bodies::Random;

/// Meshes of loose triangles; face i of one is compared with face i of the other.
struct Batch {
    std::vector<double> a, b;
    Affine3d a_T_b = Affine3d::Identity();

    static void add(std::vector<double>& to, const Triangle& t) {
        for (const Vec3d& p : t) to.insert(to.end(), p.data(), p.data() + 3);
    }
    void add(const Triangle& ofA, const Triangle& ofB) {
        add(a, ofA);
        add(b, ofB);
    }
    static TriangleMesh mesh(const std::vector<double>& corners) {
        std::vector<std::uint32_t> indices(corners.size() / 3);
        for (std::uint32_t i = 0; i < indices.size(); ++i) indices[i] = i;
        return *TriangleMesh::make(std::span<const double>(corners), indices);
    }
};

struct Tally {
    std::size_t pairs = 0, meeting = 0, open = 0;
};

Tally compare(const Batch& batch, const std::string& story) {
    Tally tally;
    const TriangleMesh ma = Batch::mesh(batch.a), mb = Batch::mesh(batch.b);
    const auto count = static_cast<std::uint32_t>(ma.faceCount());
    std::vector<std::uint32_t> faces(count);
    for (std::uint32_t i = 0; i < count; ++i) faces[i] = i;
    const TriangleTree ta(ma), tb(mb);
    for (const InstructionSet set : instructionSets()) {
        std::vector<std::uint8_t> meeting(count / 8 + 1), open(count / 8 + 1);
        kernel::treeKernels(set).decide(meshView(ma), meshView(mb), pairMap(ta, tb, batch.a_T_b), faces.data(),
                                        faces.data(), count, meeting.data(), open.data());
        for (std::uint32_t i = 0; i < count; ++i) {
            const bool meets = (meeting[i / 8] >> i % 8 & 1) != 0, unsure = (open[i / 8] >> i % 8 & 1) != 0;
            const bool exact = trianglesIntersect(ma.triangle(i), transformed(batch.a_T_b, mb.triangle(i)));
            if (unsure ? meets : meets != exact) {
                ADD_FAILURE() << story << ", " << name(set) << ", pair " << i << " of " << count << ": " << meets
                              << " for " << exact;
                return tally;
            }
            ++tally.pairs;
            tally.meeting += meets;
            tally.open += unsure;
        }
    }
    return tally;
}

Affine3d anyMap(Random& random, int kind) {
    switch (kind) {
        case 0:
            return Affine3d::Identity();
        case 1:
            return composeTransform(inCube(random, 0.3), anyRotation(random), Vec3d::Ones());
        case 2:
            return composeTransform(inCube(random, 0.3), anyRotation(random), Vec3d(-1.2, 0.7, 1.1));
        case 3:
            return composeTransform(inCube(random, 0.3), anyRotation(random), Vec3d(1, 1, 0));
        case 4:
            return composeTransform(1e6 * Vec3d(1, -2, 3), anyRotation(random), Vec3d::Ones());
        default: {
            Affine3d m = Affine3d::Identity();
            for (int i = 0; i < 3; ++i) m.linear().col(i) = inCube(random, 1.5);
            m.translation() = inCube(random, 0.3);
            return m;
        }
    }
}

constexpr int kMaps = 6;

TEST(PairsOfTriangles, RandomOnesAreNearlyAlwaysDecided) {
    Tally all;
    for (std::uint64_t seed = 0; seed < 60; ++seed) {
        Random random(seed);
        Batch batch;
        batch.a_T_b = anyMap(random, static_cast<int>(seed % 3));
        for (int i = 0; i < 10'000; ++i)
            batch.add({inCube(random, 1), inCube(random, 1), inCube(random, 1)},
                      {inCube(random, 1), inCube(random, 1), inCube(random, 1)});
        const Tally tally = compare(batch, "seed " + std::to_string(seed));
        all.pairs += tally.pairs;
        all.meeting += tally.meeting;
        all.open += tally.open;
    }
    EXPECT_GT(all.meeting, all.pairs / 50);
    EXPECT_LT(all.open, all.pairs / 100'000);
}

TEST(PairsOfTriangles, OnAGridWhereAllTouchesNothingIsDecidedWrongly) {
    for (std::uint64_t seed = 0; seed < 40; ++seed) {
        Random random(seed);
        Batch batch;
        std::uniform_int_distribution<int> step(0, 2 + static_cast<int>(seed % 3));
        const double size = std::ldexp(1.0, static_cast<int>(seed % 5) * 20 - 40);
        const auto point = [&] { return Vec3d(size * Vec3d(step(random), step(random), step(random))); };
        for (int i = 0; i < 5'000; ++i) batch.add({point(), point(), point()}, {point(), point(), point()});
        const Tally tally = compare(batch, "seed " + std::to_string(seed));
        EXPECT_GT(tally.open, 0U) << "touching pairs must be left to exact arithmetic";
        EXPECT_LT(tally.open, tally.pairs) << "some are clear all the same";
    }
}

// A corner, edge or plane in common, moved by a few units in the last place; needles; maps of every kind.
TEST(PairsOfTriangles, NearlyTouchingOnesAreNeverDecidedWrongly) {
    for (std::uint64_t seed = 0; seed < 120; ++seed) {
        Random random(seed);
        Batch batch;
        const int kind = static_cast<int>(seed % kMaps);
        batch.a_T_b = anyMap(random, kind);
        const bool invertible = kind != 3;
        const Affine3d b_T_a = invertible ? batch.a_T_b.inverse(Eigen::Affine) : Affine3d::Identity();
        const Vec3d about = kind == 4 ? Vec3d(1e6 * Vec3d(1, -2, 3)) : Vec3d::Zero();
        for (int i = 0; i < 2'000; ++i) {
            Triangle a{about + inCube(random, 1), about + inCube(random, 1), about + inCube(random, 1)};
            if (i % 4 == 1) a[2] = a[0] + between(random, 0, 1) * (a[1] - a[0]) + inCube(random, 1e-9);
            const double u = between(random, 0, 1), v = between(random, 0, 1) * (1 - u);
            const Vec3d onA = a[0] + u * (a[1] - a[0]) + v * (a[2] - a[0]), onEdge = a[0] + u * (a[1] - a[0]);
            const double off = std::pow(10.0, between(random, -18, -10));
            const auto nearby = [&](const Vec3d& p) { return Vec3d(b_T_a * (p + inCube(random, off))); };
            Triangle b{nearby(i % 3 == 0 ? onA : onEdge), b_T_a * (about + inCube(random, 1)),
                       b_T_a * (about + inCube(random, 1))};
            if (i % 5 == 0) b[1] = nearby(a[1]);
            if (i % 7 == 0) b[2] = nearby(a[2]);
            batch.add(a, b);
        }
        compare(batch, "seed " + std::to_string(seed));
    }
}

TEST(PairsOfTriangles, SizesFarFromOneChangeNothing) {
    for (const int power : {-600, -300, -180, -90, 90, 160}) {
        Random random(static_cast<std::uint64_t>(power + 1000));
        Batch batch;
        const double size = std::ldexp(1.0, power);
        for (int i = 0; i < 4'000; ++i) {
            const auto point = [&] { return Vec3d(size * inCube(random, 1)); };
            batch.add({point(), point(), point()}, {point(), point(), point()});
        }
        compare(batch, "2^" + std::to_string(power));
    }
}

TEST(PairsOfTriangles, AMapTooLargeForDoubleLeavesAllOpen) {
    Batch batch;
    Random random(1);
    batch.a_T_b.linear() *= 1e300;
    for (int i = 0; i < 100; ++i)
        batch.add({inCube(random, 1), inCube(random, 1), inCube(random, 1)},
                  {inCube(random, 1e20), inCube(random, 1e20), inCube(random, 1e20)});
    const Tally tally = compare(batch, "1e300");
    EXPECT_EQ(tally.meeting, 0U);
}

}  // namespace
}  // namespace tessera

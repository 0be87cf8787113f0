/// The vector kernels for triangles whose corners go straight: what they leave out has nothing to meet.
#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <random>
#include <vector>

#include "server/collision/query/ImpactKernelTable.h"
#include "server/collision/query/StraightLeaf.h"
#include "tests/unit/motion/Bodies.h"

namespace tessera {
namespace {

using kernel::ImpactKernels;
using kernel::kLeafFaces;

constexpr double kMargin = 1e-3;

struct Leaf {
    std::array<Triangle, kLeafFaces> start, end;
    kernel::StraightLeaf rows;

    [[nodiscard]] Triangle at(std::size_t face, double t) const {
        Triangle out;
        for (std::size_t i = 0; i < 3; ++i) out[i] = (1 - t) * start[face][i] + t * end[face][i];
        return out;
    }
};

/// Small faces and long ones, needles, segments and points; each goes its own way, and deforms.
Leaf randomLeaf(std::mt19937& random) {
    std::uniform_real_distribution<double> u(-1, 1);
    const auto any = [&] { return Vec3d(u(random), u(random), u(random)); };
    Leaf leaf;
    for (std::size_t f = 0; f < kLeafFaces; ++f) {
        const double size = random() % 3 == 0 ? 2 : 0.3, way = random() % 2 == 0 ? 0.1 : 1;
        const Vec3d middle = any(), shift = way * any();
        for (std::size_t i = 0; i < 3; ++i) {
            leaf.start[f][i] = middle + size * any();
            leaf.end[f][i] = leaf.start[f][i] + shift + 0.2 * way * any();
        }
        if (random() % 8 == 0) leaf.start[f][1] = leaf.start[f][0];
        if (random() % 16 == 0) leaf.start[f][2] = leaf.start[f][0], leaf.end[f] = leaf.start[f];
        setTriangle(leaf.rows.start, f, leaf.start[f]);
        setTriangle(leaf.rows.end, f, leaf.end[f]);
    }
    return leaf;
}

double distance(const Triangle& a, const Triangle& b) {
    return trianglesIntersect(a, b) ? 0 : nearestPoints(a, b).distance;
}

TEST(StraightKernels, LeaveOutNoPairThatMeets) {
    constexpr unsigned kSeed = 61;
    std::mt19937 random(kSeed);
    const ImpactKernels& kernels = kernel::impactKernels();
    int met = 0, leftOut = 0, leftOutAtStart = 0;
    for (int i = 0; i < 600; ++i) {
        const Leaf a = randomLeaf(random), b = randomLeaf(random);
        const std::uint32_t onTheWay = kernels.meetingOnTheWay(a.rows, b.rows, kMargin),
                            atStart = kernels.meetingAtStart(a.rows, b.rows, kMargin);
        for (std::size_t k = 0; k < kLeafFaces * kLeafFaces; ++k) {
            const std::size_t x = k / kLeafFaces, y = k % kLeafFaces;
            const auto again = [&] {
                return testing::Message() << "seed " << kSeed << ", trial " << i << ", pair " << k;
            };
            double least = 1;
            for (int s = 0; s <= 40; ++s) least = std::min(least, distance(a.at(x, s / 40.0), b.at(y, s / 40.0)));
            if (least <= kMargin) {
                ++met;
                ASSERT_EQ(onTheWay >> k & 1u, 1u) << again();
            }
            if (distance(a.start[x], b.start[y]) <= kMargin) {
                ASSERT_EQ(atStart >> k & 1u, 1u) << again();
            }
            leftOut += (onTheWay >> k & 1u) == 0;
            leftOutAtStart += (atStart >> k & 1u) == 0;
        }
    }
    EXPECT_GT(met, 300);
    EXPECT_GT(leftOut, 3000);
    EXPECT_GT(leftOutAtStart, leftOut);
}

/// What triangles that do not move have between them is found by one of the directions, to the margin's share of it.
TEST(StraightKernels, LeaveOutWhatIsPlainlyApart) {
    std::mt19937 random(62);
    const ImpactKernels& kernels = kernel::impactKernels();
    for (int i = 0; i < 300; ++i) {
        Leaf a = randomLeaf(random), b = randomLeaf(random);
        const std::uint32_t left = kernels.meetingAtStart(a.rows, b.rows, 1e-9);
        for (std::size_t k = 0; k < kLeafFaces * kLeafFaces; ++k) {
            const Triangle &x = a.start[k / kLeafFaces], &y = b.start[k % kLeafFaces];
            // Of flat ones square to a face or to two edges may show nothing.
            const auto area = [](const Triangle& t) { return (t[1] - t[0]).cross(t[2] - t[0]).norm(); };
            if (area(x) < 1e-3 || area(y) < 1e-3 || distance(x, y) < 1e-3) continue;
            ASSERT_EQ(left >> k & 1u, 0u) << "trial " << i << ", pair " << k;
        }
    }
}

TEST(StraightKernels, NoPartBesideThePlanesReachesTheirFaces) {
    constexpr unsigned kSeed = 63;
    std::mt19937 random(kSeed);
    std::uniform_real_distribution<double> u(-1, 1);
    const ImpactKernels& kernels = kernel::impactKernels();
    const auto any = [&] { return Vec3d(u(random), u(random), u(random)); };
    int beside = 0, besideAtStart = 0;
    for (int i = 0; i < 4000; ++i) {
        const Leaf leaf = randomLeaf(random);
        kernel::LeafPlanes planes;
        for (std::size_t f = 0; f < kLeafFaces; ++f) setPlane(planes, f, leaf.start[f], leaf.end[f], kMargin);
        const Vec3d centre[2] = {2.5 * any(), 2.5 * any()}, half[2] = {0.2 * any().cwiseAbs(), 0.2 * any().cwiseAbs()};
        kernel::StraightBox box;
        for (int k = 0; k < 3; ++k)
            for (int s = 0; s < 2; ++s) box.centre[k][s] = centre[s][k], box.half[k][s] = half[s][k];
        const auto cornerAt = [&](unsigned corner, double t) {
            const Vec3d sign(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
            return Vec3d((1 - t) * (centre[0] + sign.cwiseProduct(half[0])) +
                         t * (centre[1] + sign.cwiseProduct(half[1])));
        };
        const auto reaches = [&](double t) {
            // Its edges, and its faces.
            for (unsigned x = 0; x < 8; ++x)
                for (unsigned y = 0; y < x; ++y)
                    for (std::size_t f = 0; f < kLeafFaces; ++f)
                        if (distance({cornerAt(x, t), cornerAt(y, t), cornerAt((x + y) % 8, t)}, leaf.at(f, t)) <=
                            kMargin)
                            return true;
            return false;
        };
        if (kernels.besidePlanes(planes, box, true)) {
            ++beside;
            for (int s = 0; s <= 10; ++s) ASSERT_FALSE(reaches(s / 10.0)) << "seed " << kSeed << ", trial " << i;
        }
        if (kernels.besidePlanes(planes, box, false)) {
            ++besideAtStart;
            ASSERT_FALSE(reaches(0)) << "seed " << kSeed << ", trial " << i;
        }
    }
    EXPECT_GT(beside, 50);
    EXPECT_GT(besideAtStart, beside);
}

TEST(StraightKernels, AnswerAlikeOnEveryInstructionSet) {
    std::mt19937 random(64);
    for (int i = 0; i < 2000; ++i) {
        const Leaf a = randomLeaf(random), b = randomLeaf(random);
        std::vector<std::array<std::uint32_t, 2>> answers;
        for (const InstructionSet set : {InstructionSet::kSse41, InstructionSet::kAvx2, InstructionSet::kAvx512}) {
            if (set > instructionSet()) continue;
            const ImpactKernels& k = kernel::impactKernels(set);
            answers.push_back({k.meetingOnTheWay(a.rows, b.rows, kMargin), k.meetingAtStart(a.rows, b.rows, kMargin)});
        }
        for (const auto& answer : answers) ASSERT_EQ(answer, answers[0]) << "trial " << i;
    }
}

}  // namespace
}  // namespace tessera

// Bounds of distances, eight pairs of faces at a time: they hold what nearestPoints says, on every instruction set.
#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "server/collision/mesh/TriangleContact.h"
#include "server/collision/query/PairFrame.h"
#include "server/collision/tree/Kernels.h"
#include "tests/unit/query/Bodies.h"

namespace tessera {
namespace {

/// Triangles of every shape: slivers, segments and points too, and edges that are parallel to each other's.
/// `size` about `place`; every thirteenth is smaller by `tiny`.
TriangleMesh soup(std::mt19937& random, int faces, double size, const Vec3d& place, double tiny) {
    std::uniform_real_distribution<double> u(-1, 1);
    std::vector<double> positions;
    std::vector<std::uint32_t> indices;
    const auto add = [&](const Vec3d& p) {
        indices.push_back(static_cast<std::uint32_t>(positions.size() / 3));
        positions.insert(positions.end(), {p.x(), p.y(), p.z()});
    };
    for (int i = 0; i < faces; ++i) {
        const Vec3d a(u(random), u(random), u(random)), e(u(random), u(random), u(random)),
            f(u(random), u(random), u(random));
        const double thin = i % 3 == 0 ? 1 : std::pow(10.0, -3 - i % 12);
        const Vec3d b = i % 7 == 0 ? a : Vec3d(a + (i % 5 == 0 ? Vec3d(Vec3d::UnitX()) : e));
        const double less = i % 13 == 0 ? tiny : 1;
        add(place + size * a);
        add(place + size * (a + less * (b - a)));
        add(place + size * (i % 11 == 0 ? a : Vec3d(a + less * (b + thin * f - a))));
    }
    return *TriangleMesh::make(std::span<const double>(positions), indices);
}

TEST(MeasuredPairs, LieBetweenTheirBounds) {
    constexpr unsigned kSeed = 41;
    std::mt19937 random(kSeed);
    std::uniform_real_distribution<double> u(-1, 1);
    double widest = 0;
    struct Scene {
        double size;
        double place = 0;  ///< of B in its own frame, of that many sizes
        double tiny = 1;
    };
    for (const Scene& scene :
         {Scene{1}, Scene{1e-6}, Scene{1e7}, Scene{1e-42}, Scene{1e-150}, Scene{1e-300}, Scene{1e44}, Scene{1, 1e12},
          Scene{1, 1e14}, Scene{1, 0, 1e-30}, Scene{1, 0, 1e-72}, Scene{1, 0, 1e-140}, Scene{1e7, 1e3, 1e-80}}) {
        const double size = scene.size, place = scene.place, tiny = scene.tiny;
        const Vec3d inB = size * place * Vec3d(u(random), u(random), u(random));
        const TriangleTree a(soup(random, 120, size, Vec3d::Zero(), tiny)), b(soup(random, 120, size, inB, tiny));
        for (int pose = 0; pose < 6; ++pose) {
            Affine3d a_T_b = Affine3d::Identity();
            if (pose % 3 != 0)
                a_T_b.linear() = Quatd(u(random), u(random), u(random), u(random)).normalized().toRotationMatrix();
            a_T_b.translation() =
                size * std::pow(10.0, pose - 3) * Vec3d(u(random), u(random), u(random)) - a_T_b.linear() * inB;
            std::vector<std::uint32_t> facesA, facesB;
            for (int i = 0; i < 1003; ++i) {
                facesA.push_back(static_cast<std::uint32_t>(random() % 120));
                facesB.push_back(static_cast<std::uint32_t>(random() % 120));
            }
            for (const InstructionSet set : {InstructionSet::kSse41, InstructionSet::kAvx2, InstructionSet::kAvx512}) {
                if (set > instructionSet()) continue;
                std::vector<double> low(1008), high(1008);
                kernel::treeKernels(set).measure(meshView(a.mesh()), meshView(b.mesh()), pairMap(a, b, a_T_b),
                                                 facesA.data(), facesB.data(), 1003, low.data(), high.data());
                for (std::size_t i = 0; i < facesA.size(); ++i) {
                    const Triangle x = a.mesh().triangle(facesA[i]),
                                   y = transformed(a_T_b, b.mesh().triangle(facesB[i]));
                    const double distance = nearestPoints(x, y).distance;
                    const auto again = [&] {
                        return testing::Message() << "seed " << kSeed << ", size " << size << ", place " << place
                                                  << ", tiny " << tiny << ", pose " << pose << ", pair " << i;
                    };
                    ASSERT_LE(low[i], distance) << again();
                    ASSERT_GE(high[i], distance) << again();
                    if (size > 1e-40 && place < 1e6)
                        widest = std::max(widest, (high[i] - low[i]) / (distance + 4 * size));
                }
            }
        }
    }
    // Close enough to be of use.
    EXPECT_LT(widest, 1e-4);
}

TEST(MeasuredPairs, OfHugeNumbersNothingIsKnown) {
    const std::vector<double> positions{0, 0, 0, 1e49, 0, 0, 0, 1e49, 0};
    const std::vector<std::uint32_t> indices{0, 1, 2};
    const TriangleTree tree(*TriangleMesh::make(std::span<const double>(positions), indices));
    Affine3d far = Affine3d::Identity();
    far.linear() *= 1e30;
    far.translation() = Vec3d(1e60, 0, 3e60);
    double low[8], high[8];
    const std::uint32_t face = 0;
    kernel::treeKernels().measure(meshView(tree.mesh()), meshView(tree.mesh()), pairMap(tree, tree, far), &face, &face,
                                  1, low, high);
    EXPECT_LT(low[0], 0);
    EXPECT_EQ(high[0], std::numeric_limits<double>::infinity());
}

}  // namespace
}  // namespace tessera

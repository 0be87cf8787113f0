// Boxes of parts hold these; gaps of eight boxes and one are never more than boxes are apart, whatever the instruction
// set.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>

#include "server/collision/freeform/FreeformParts.h"
#include "tests/unit/freeform_query/SmoothBodies.h"

namespace tessera::test {
namespace {

PartBox anyBox(Chance& chance, double size, double spread) {
    PartBox box;
    box.axes = chance.rotation().toRotationMatrix();
    box.middle = spread * chance.uniform(0, 1) * chance.direction();
    for (Eigen::Index k = 0; k < 3; ++k)
        box.half[k] = chance.uniform(0, 1) < 0.2 ? 0 : size * std::pow(10, chance.uniform(-6, 0));
    return box;
}

kernel::BoxOfOne asOne(const PartBox& box, const Vec3d& hint) {
    kernel::BoxOfOne one;
    Eigen::Map<Vec3d>(one.middle) = box.middle;
    Eigen::Map<Mat3d>(one.axes) = box.axes;
    Eigen::Map<Vec3d>(one.half) = box.half;
    Eigen::Map<Vec3d>(one.hint) = hint;
    return one;
}

/// How far apart two boxes are, no more than this: the nearest points by turns, each clamped into its box.
double distanceByTurns(const PartBox& a, const PartBox& b) {
    const auto into = [](const PartBox& box, const Vec3d& p) {
        const Vec3d at = box.axes.transpose() * (p - box.middle);
        return Vec3d(box.middle + box.axes * at.cwiseMax(-box.half).cwiseMin(box.half));
    };
    Vec3d p = a.middle, q = b.middle;
    for (int turn = 0; turn < 400; ++turn) {
        q = into(b, p);
        p = into(a, q);
    }
    return (p - q).norm();
}

TEST(FreeformBoxGaps, AreNeverMoreThanBoxesAreApartAndTheSameBytesWithEveryInstructionSet) {
    int apart = 0, told = 0;
    for (const std::uint64_t seed : seedsOf(200)) {
        SCOPED_TRACE(repeat(seed));
        Chance chance(seed);
        const double scale = std::pow(10, chance.uniform(-8, 8)), spread = chance.uniform(0, 4);
        PartBlock block;
        for (std::size_t lane = 0; lane < kernel::kBoxLanes; ++lane)
            block.set(lane, anyBox(chance, scale, spread * scale));
        PartBox one = anyBox(chance, scale, spread * scale);
        if (seed % 5 == 0) one.middle = block.box(3).middle;
        if (seed % 7 == 0) one.axes = block.box(5).axes;
        const Vec3d hint = chance.direction();
        std::array<double, kernel::kBoxLanes> first{}, again{};
        kernel::gapsOfBoxes(InstructionSet::kSse41)(block.boxes.data(), kernel::kBoxLanes, asOne(one, hint),
                                                    first.data());
        // Coordinates are at most 5 scales large.
        const double rounding = 64 * std::numeric_limits<double>::epsilon() * 5 * scale;
        for (std::size_t lane = 0; lane < kernel::kBoxLanes; ++lane) {
            const PartBox box = block.box(lane);
            const double most = distanceByTurns(box, one);
            EXPECT_LE(first[lane], most + rounding) << lane;
            const double middles = (box.middle - one.middle).norm();
            // Spheres around boxes are no farther apart along the way between the middles.
            EXPECT_GE(first[lane], middles - box.half.norm() - one.half.norm() - rounding) << lane;
            EXPECT_GE(first[lane], std::abs((box.middle - one.middle).dot(hint)) -
                                       (box.axes.transpose() * hint).cwiseAbs().dot(box.half) -
                                       (one.axes.transpose() * hint).cwiseAbs().dot(one.half) - rounding);
            if (most > 1e-3 * scale) {
                ++apart;
                told += first[lane] > 0.5 * most ? 1 : 0;
            }
        }
        for (const InstructionSet set : {InstructionSet::kAvx2, InstructionSet::kAvx512}) {
            if (instructionSet() < set) continue;
            kernel::gapsOfBoxes(set)(block.boxes.data(), kernel::kBoxLanes, asOne(one, hint), again.data());
            EXPECT_EQ(std::memcmp(first.data(), again.data(), sizeof first), 0) << name(set);
        }
    }
    // Few boxes are apart along no direction that is tried: nothing else would be worth asking.
    if (std::getenv("TESSERA_SEED") == nullptr) {
        EXPECT_GT(told, apart * 9 / 10) << apart;
    }
}

/// Down through blocks: parts lie in the boxes that blocks have of them.
void expectPartsInTheirBoxes(const FreeformShape& shape, Chance& chance) {
    FreeformParts parts(shape);
    const Box whole = shape.bounds();
    const double far = whole.lower.cwiseAbs().cwiseMax(whole.upper.cwiseAbs()).maxCoeff(),
                 rounding = 32 * std::numeric_limits<double>::epsilon() * far;
    for (int walk = 0; walk < 20; ++walk) {
        std::uint32_t part = parts.root();
        for (int level = 0; level < 6; ++level) {
            const std::uint32_t block = parts.blockOf(part), count = parts.block(block).count;
            ASSERT_GT(count, 0U);
            part = parts.partOf(block, std::min(count - 1, static_cast<std::uint32_t>(chance.uniform(0, count))));
            const PartBox box = parts.boxOf(part);
            ASSERT_TRUE((box.axes.transpose() * box.axes).isIdentity(1e-14)) << box.axes;
            for (const Vec3d& p : parts.hullOf(parts[part])) {
                const Vec3d at = (box.axes.transpose() * (p - box.middle)).cwiseAbs() - box.half;
                ASSERT_LE(at.maxCoeff(), rounding) << level;
            }
            // No larger than it has to be: around a sphere that the hull is within.
            ASSERT_LE(box.half.maxCoeff(), 2 * parts[part].radius + rounding);
        }
    }
}

TEST(FreeformBoxGaps, PartsLieInTheirBoxes) {
    for (const std::uint64_t seed : seedsOf(20)) {
        SCOPED_TRACE(repeat(seed));
        Chance chance(seed);
        for (const Vec3d& squeezed :
             {Vec3d(1, 1, 1), Vec3d(1, 1, 0), Vec3d(0, 0, 1), Vec3d(1, 1e-9, 1e-3), Vec3d(0, 0, 0)}) {
            SCOPED_TRACE(testing::Message() << "squeezed by " << squeezed.transpose());
            const Mat3d turn = chance.rotation().toRotationMatrix() * std::pow(10, chance.uniform(-8, 8));
            const Vec3d off =
                chance.uniform(0, 1) < 0.5 ? Vec3d(Vec3d::Zero()) : Vec3d(1e3 * (turn * chance.direction()));
            ControlMesh quads = lumpyCube(chance, 2, 0.3);
            for (Vec3d& p : quads.positions) p = turn * p.cwiseProduct(squeezed) + off;
            expectPartsInTheirBoxes(FreeformShape::ofSubdivision(quads).value(), chance);
            expectPartsInTheirBoxes(FreeformShape::ofSubdivision(asTriangles(quads)).value(), chance);
        }
        expectPartsInTheirBoxes(sphere(std::pow(10, chance.uniform(-8, 8))), chance);
    }
}

TEST(FreeformBoxGaps, OfBoxesSideBySideAreExact) {
    PartBlock block;
    for (std::size_t lane = 0; lane < kernel::kBoxLanes; ++lane)
        block.set(lane, {Vec3d(static_cast<double>(lane), 0, 0), Mat3d::Identity(), {0.25, 2, 3}});
    std::array<double, kernel::kBoxLanes> least{};
    kernel::gapsOfBoxes()(block.boxes.data(), kernel::kBoxLanes,
                          asOne({Vec3d(-1, 0.5, 0), Mat3d::Identity(), {0.5, 1, 1}}, Vec3d::UnitY()), least.data());
    for (std::size_t lane = 0; lane < kernel::kBoxLanes; ++lane)
        EXPECT_EQ(least[lane], static_cast<double>(lane) + 0.25);
}

}  // namespace
}  // namespace tessera::test

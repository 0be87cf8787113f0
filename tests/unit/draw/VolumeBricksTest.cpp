/// What rays leave out of volumes: nothing that could be seen, and pictures are those of rays that look everywhere.
#include "client/draw/store/VolumeBricks.h"

#include <gtest/gtest.h>

#include "tests/unit/draw/VolumeStage.h"

namespace tessera {
namespace {

using VolumeBricksTest = VolumeStage;

/// Some balls in what is empty, noise on all of it now and then.
Volume sparseVolume(FieldDice& dice) {
    Volume v = someVolume(dice);
    v.sizeX = 2 + dice.below(45);
    v.sizeY = 2 + dice.below(45);
    v.sizeZ = 2 + dice.below(45);
    const double noise = dice.below(3) == 0 ? dice.any(0, 30) : 0;
    struct Ball {
        Vec3d middle;
        double radius;
    };
    const Vec3d size(static_cast<double>(v.sizeX), static_cast<double>(v.sizeY), static_cast<double>(v.sizeZ));
    std::vector<Ball> balls(dice.below(4));
    for (Ball& ball : balls)
        ball = {size.cwiseProduct(Vec3d(dice.any(0, 1), dice.any(0, 1), dice.any(0, 1))), dice.any(1, 9)};
    std::vector<double> values;
    for (std::int64_t z = 0; z < v.sizeZ; ++z)
        for (std::int64_t y = 0; y < v.sizeY; ++y)
            for (std::int64_t x = 0; x < v.sizeX; ++x) {
                const Vec3d at(static_cast<double>(x), static_cast<double>(y), static_cast<double>(z));
                double value = dice.any(0, noise);
                for (const Ball& ball : balls)
                    value = std::max(value, 250 * std::clamp(1.5 - (at - ball.middle).norm() / ball.radius, 0.0, 1.0));
                if (v.format == Volume::kFloat)
                    values.push_back(value / 50 - 2);
                else
                    values.push_back(std::floor(v.format == Volume::kUint8    ? value
                                                : v.format == Volume::kUint16 ? 200 * value
                                                                              : 200 * value - 25000));
            }
    v.voxels = v.format == Volume::kUint8    ? numbersFrom<std::uint8_t>(values)
               : v.format == Volume::kUint16 ? numbersFrom<std::uint16_t>(values)
               : v.format == Volume::kInt16  ? numbersFrom<std::int16_t>(values)
                                             : numbersFrom<float>(values);
    v.spacing *= 5 / size.maxCoeff();
    v.origin = -0.5 * v.spacing.cwiseProduct(size - Vec3d::Ones());
    const double least = v.format == Volume::kFloat ? -2 : v.format == Volume::kInt16 ? -25000 : 0;
    const double perValue = v.format == Volume::kFloat ? 0.02 : v.format == Volume::kUint8 ? 1 : 200;
    v.low = least + perValue * dice.any(-20, 40);
    v.high = v.low + perValue * dice.any(50, 250);
    // Nothing is seen of the first ones, nor of some others.
    std::vector<std::uint8_t> transfer(4 * (2 + dice.below(9)));
    for (std::size_t i = 0; i < transfer.size(); ++i)
        transfer[i] = i < 4 || (i % 4 == 3 && dice.below(3) == 0) ? 0 : static_cast<std::uint8_t>(dice.below(256));
    v.transfer = Blob::of(std::span<const std::uint8_t>(transfer));
    v.step = dice.any(0.2, 1.5);
    return v;
}

TEST(VolumeBricks, WhatIsEmptyIsEmptyAndNoFartherThanIsSaid) {
    std::size_t empty = 0, visible = 0, far = 0;
    for (const unsigned seed : volumeSeeds(100)) {
        FieldDice dice(seed);
        const Volume v = sparseVolume(dice);
        const VolumeBricks bricks(v);
        const std::vector<std::uint8_t> steps = bricks.emptySteps(v);
        const auto [nx, ny, nz] = bricks.counts();
        ASSERT_EQ(steps.size(), static_cast<std::size_t>(nx * ny * nz));
        const auto again = [&] {
            return "TESSERA_SEED=" + std::to_string(seed) + " build/bin/unit_draw --gtest_filter=VolumeBricks.*";
        };
        for (std::int64_t z = 0; z < nz; ++z)
            for (std::int64_t y = 0; y < ny; ++y)
                for (std::int64_t x = 0; x < nx; ++x) {
                    const auto at = static_cast<std::size_t>((z * ny + y) * nx + x);
                    // Places in it, its rims too.
                    for (int i = 0; i < 10; ++i) {
                        const auto place = [&](std::int64_t brick, std::int64_t size) {
                            const double within = dice.below(3) == 0
                                                      ? VolumeBricks::kSide * static_cast<double>(dice.below(2))
                                                      : dice.any(0, VolumeBricks::kSide);
                            return std::min(static_cast<double>(size - 1),
                                            static_cast<double>(VolumeBricks::kSide * brick) + within);
                        };
                        const double value =
                            gridOf(v).linearAt({place(x, v.sizeX), place(y, v.sizeY), place(z, v.sizeZ)});
                        ASSERT_LE(value, bricks.greatest()[at] + 1e-4 * std::abs(value)) << again();
                        ASSERT_GE(value, bricks.least()[at] - 1e-4 * std::abs(value)) << again();
                        ASSERT_TRUE(steps[at] == 0 || byTransfer(v, value).opacity == 0) << again();
                    }
                    unsigned nearest = 255;
                    for (std::int64_t oz = 0; oz < nz; ++oz)
                        for (std::int64_t oy = 0; oy < ny; ++oy)
                            for (std::int64_t ox = 0; ox < nx; ++ox)
                                if (steps[static_cast<std::size_t>((oz * ny + oy) * nx + ox)] == 0)
                                    nearest = std::min(
                                        nearest, static_cast<unsigned>(
                                                     std::max({std::abs(ox - x), std::abs(oy - y), std::abs(oz - z)})));
                    ASSERT_EQ(steps[at], nearest) << again();
                    ++(nearest == 0 ? visible : empty);
                    far += nearest > 1 && nearest < 255;
                }
    }
    if (!std::getenv("TESSERA_SEED")) {
        EXPECT_GT(empty, 1000u);
        EXPECT_GT(visible, 1000u);
        EXPECT_GT(far, 200u);
    }
}

TEST(VolumeBricks, OfEditedLayersAreThoseOfAFreshLook) {
    for (const unsigned seed : volumeSeeds(100)) {
        FieldDice dice(seed);
        Volume v = sparseVolume(dice);
        VolumeBricks bricks(v);
        const std::size_t all = v.voxels.sizeBytes(), layer = all / static_cast<std::size_t>(v.sizeZ);
        const std::size_t from = all / 4 * dice.below(4) / 4 * 4,
                          count = std::min<std::size_t>(all - from, 4 * (1 + dice.below(500)));
        std::vector<std::byte> edit(count);
        for (std::byte& byte : edit) byte = static_cast<std::byte>(v.format == Volume::kFloat ? 0x3f : dice.below(256));
        v.voxels = v.voxels.withRange(from / 4 * 4, edit).value();
        bricks.update(v, static_cast<std::int64_t>(from / layer),
                      static_cast<std::int64_t>((from + count + layer - 1) / layer));
        const VolumeBricks fresh(v);
        ASSERT_EQ(bricks.greatest(), fresh.greatest()) << "TESSERA_SEED=" << seed;
        ASSERT_EQ(bricks.least(), fresh.least()) << "TESSERA_SEED=" << seed;
    }
}

// Clouds, lit or not, and maxima; cut by planes, ended by what is solid; eyes within, beside, far away; edited and
// coloured anew.
TEST_F(VolumeBricksTest, PicturesAreThoseOfRaysThatLookEverywhere) {
    int seen = 0;
    for (const int samples : {1, 4}) {
        restart({.samples = samples});
        const auto otherSurface = makeSurface("osmesa").value();
        const auto other = Renderer::create(*otherSurface, {.samples = samples, .leaveOutEmpty = false}).value();
        for (const unsigned seed : volumeSeeds(samples == 1 ? 60 : 12)) {
            FieldDice dice(seed);
            Volume v = sparseVolume(dice);
            v.mode = seed % 3 == 0 ? Volume::kMaximum : Volume::kCloud;
            v.shaded = seed % 2 == 0;
            Stage stage = someStage(dice, v);
            if (dice.below(5) == 0) stage.camera = cameraOf(kSidePx, kSidePx, {0, 0, dice.any(3, 300)});
            const ObjectId core = [&] {
                for (std::uint64_t id = 1;; ++id)
                    if (stage.aspect.get<Volume>(ObjectId(id))) return ObjectId(id);
            }();
            for (int edit = 0; edit < 2; ++edit) {
                const DrawList list = listOf(stage.aspect, stage.camera);
                const Picture one = renderer_->draw(stage.aspect, list, stage.camera, whole(stage.camera)).value();
                const Picture all = other->draw(stage.aspect, list, stage.camera, whole(stage.camera)).value();
                const auto [at, from] = std::ranges::mismatch(one.rgb, all.rgb);
                ASSERT_EQ(at, one.rgb.end())
                    << "byte " << at - one.rgb.begin() << " is " << int{*at} << ", not " << int{*from} << ", "
                    << samples << " samples, edit " << edit << ", mode " << v.mode << "\nTESSERA_SEED=" << seed
                    << " unit_draw --gtest_filter=VolumeBricksTest.*";
                for (std::size_t i = 0; i < one.rgb.size(); i += 3) seen += one.rgb[i] != one.rgb[0];
                ChangeListBuilder next;
                if (dice.below(2) == 0) {
                    next.set(core, typeOf<Volume>(), fieldId<&Volume::low>, toValue(v.low - 0.3 * (v.high - v.low)));
                } else {
                    const std::vector<std::byte> bright(std::min<std::size_t>(400, v.voxels.sizeBytes() / 8 * 4),
                                                        std::byte{0x40});
                    next.set(core, typeOf<Volume>(), fieldId<&Volume::voxels>,
                             toValue(v.voxels.withRange(v.voxels.sizeBytes() / 8 * 4, bright).value()));
                }
                ASSERT_TRUE(stage.aspect.apply(next.take()));
            }
        }
    }
    if (!std::getenv("TESSERA_SEED")) {
        EXPECT_GT(seen, 10'000);
    }
}

}  // namespace
}  // namespace tessera

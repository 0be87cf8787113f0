/// Images at grazing angles: sharp along the way and across, in any part of the picture alike; what a step of detail
/// leaves of it, and which images want none.
#include <gtest/gtest.h>

#include "tests/unit/draw/MaterialStage.h"

namespace tessera {
namespace {

constexpr int kFloorWidthPx = 320, kFloorHeightPx = 192;

class AnisotropyTest : public MaterialTest {
protected:
    /// Stripes that run away from the eye, on a floor.
    static TestScene stripedFloor(std::int64_t minification = Image::kTrilinear) {
        TestScene scene;
        scene.setDark();
        Image stripes = imageOf(64, [](int x, int) {
            return x / 8 % 2 == 0 ? Rgba{255, 255, 255, 255} : Rgba{0, 0, 0, 255};
        });
        stripes.minification = minification;
        Material material = of({1, 1, 1});
        material.unlit = true;
        material.baseColorImage = scene.add(stripes);
        MeshData sheet = makeSheet(40, 40, 20);
        scene.place(scene.add(sheet, scene.add(material)), {0, -1, -20},
                    Quatd(Eigen::AngleAxisd(-1.5707963, Vec3d::UnitX())));
        return scene;
    }
    static ScreenCamera camera(unsigned detail = 0) {
        ScreenCamera seen = cameraOf(kFloorWidthPx, kFloorHeightPx, {0.1, 0, 2.4});
        seen.detail = detail;
        return seen;
    }
    Picture drawn(const Aspect& aspect, int anisotropy, unsigned detail = 0) {
        restart({.samples = 1, .anisotropy = anisotropy});
        return draw(aspect, camera(detail));
    }
    /// How much neighbours in a row differ, in rows far away.
    static double contrast(const Picture& picture) {
        double sum = 0;
        for (int y = kFloorHeightPx / 2 + 8; y < kFloorHeightPx / 2 + 20; ++y)
            for (int x = 1; x < kFloorWidthPx; ++x)
                sum += std::abs(pixel(picture, x, y).g - pixel(picture, x - 1, y).g);
        return sum / (12 * kFloorWidthPx);
    }
};

TEST_F(AnisotropyTest, KeepsStripesThatRunAway) {
    const Aspect aspect = stripedFloor().take();
    const double plain = contrast(drawn(aspect, 1)), fine = contrast(drawn(aspect, 16));
    EXPECT_GT(fine, 3 * plain + 5) << plain;
    EXPECT_EQ(drawn(aspect, 0).rgb, drawn(aspect, 1).rgb) << "Mesa's software is given one sample";
}

TEST_F(AnisotropyTest, PartsOfAPictureAreAlike) {
    const Aspect aspect = stripedFloor().take();
    const Picture all = drawn(aspect, 16);
    const DrawList list = listOf(aspect, camera());
    for (const PixelRect& rect : {PixelRect{.x = 0, .y = 0, .width = 101, .height = kFloorHeightPx},
                                  PixelRect{.x = 101, .y = 37, .width = 150, .height = 60},
                                  PixelRect{.x = 251, .y = 90, .width = 69, .height = 102}}) {
        const auto part = renderer_->draw(aspect, list, camera(), rect);
        ASSERT_TRUE(part) << part.error().message;
        for (int y = 0; y < rect.height; ++y)
            for (int x = 0; x < rect.width; ++x) {
                const int fromTop = kFloorHeightPx - rect.y - rect.height + y;
                const Rgb is = pixel(*part, x, y), should = pixel(all, rect.x + x, fromTop);
                ASSERT_TRUE(is.r == should.r && is.g == should.g && is.b == should.b) << x << ' ' << y;
            }
    }
}

TEST_F(AnisotropyTest, StepsOfDetailLeaveItAway) {
    const Aspect aspect = stripedFloor().take();
    const auto plain = drawn(aspect, 1).rgb;
    EXPECT_NE(drawn(aspect, 16, 1).rgb, plain);
    EXPECT_EQ(drawn(aspect, 16, 3).rgb, plain);
}

TEST_F(AnisotropyTest, ImagesThatWantSteppedFiltersKeepThem) {
    for (const std::int64_t filter : {Image::kNearestAlone, Image::kLinearAlone, Image::kLinearOfNearest}) {
        const Aspect aspect = stripedFloor(filter).take();
        EXPECT_EQ(drawn(aspect, 16).rgb, drawn(aspect, 1).rgb) << filter;
    }
}

}  // namespace
}  // namespace tessera

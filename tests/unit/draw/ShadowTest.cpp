// Shadows beside rays to the light.
#include <functional>
#include <random>

#include "tests/unit/draw/RendererStage.h"

namespace tessera {
namespace {

constexpr int kPx = 160;

class ShadowTest : public RendererTest {
protected:
    /// Looking down onto a floor at y = -1 that everything stands above.
    static ScreenCamera fromAbove() {
        View view;
        view.position = Vec3d(0, 3, -3);
        view.orientation = Quatd(Eigen::AngleAxisd(-0.5 * M_PI, Vec3d::UnitX()));
        return cameraOf(kPx, kPx, {0, 0, 2.4}, 3.2, view);
    }
    static Material matt() {
        Material material;
        material.baseColor = Vec4f(0.7f, 0.7f, 0.7f, 1);
        material.roughness = 1;
        return material;
    }
    static void addFloor(TestScene& scene) {
        scene.setEnvironment(Vec3f::Zero(), Vec3f::Zero(), Vec3f::Zero());
        scene.place(scene.add(makeSheet(16, 16), scene.add(matt())), {0, -1, -3},
                    Quatd(Eigen::AngleAxisd(-0.5 * M_PI, Vec3d::UnitX())));
    }
    /// The floor's point that a pixel shows: the eye is at (0, 5.4, -3), the screen 2.4 below it.
    static Vec3d floorAt(int x, int y) {
        const double metres = 3.2 / kPx * (6.4 / 2.4);
        return {(x + 0.5 - kPx / 2) * metres, -1, -3 + (y + 0.5 - kPx / 2) * metres};
    }
};

/// How much of the way from `from` to `to` lies in the box; below 0: how far it passes by, about.
double throughBox(const Vec3d& from, const Vec3d& to, const Box& box) {
    double enter = 0, leave = 1;
    for (int axis = 0; axis < 3; ++axis) {
        const double way = to[axis] - from[axis];
        double a = (box.lower[axis] - from[axis]) / way, b = (box.upper[axis] - from[axis]) / way;
        if (a > b) std::swap(a, b);
        enter = std::max(enter, a);
        leave = std::min(leave, b);
    }
    return leave - enter;
}

TEST_F(ShadowTest, WhatARayToTheLightMeetsIsDarkAndNothingElse) {
    std::mt19937 random(7);
    const auto between = [&](double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(random);
    };
    int shaded = 0;
    for (int round = 0; round < 24; ++round) {
        const bool spot = round % 2;
        const Vec3d light(between(-3, 3), between(4, 7), -3 + between(-3, 3));
        const Vec3d travels = (Vec3d(0, -1, -3) - light).normalized();
        const Vec3d size(between(0.3, 1), between(0.3, 1), between(0.3, 1)),
            at(between(-1, 1), between(-0.2, 0.8), -3 + between(-1, 1));
        const auto shown = [&](bool box, bool shadows) {
            TestScene scene;
            addFloor(scene);
            if (box) scene.place(scene.add(makeBox(size), scene.add(matt())), at);
            if (spot)
                scene.addSpotLight(light, travels, Vec3f::Ones(), 40, 0.9f, 1.0f, round % 4 == 1 ? 0.0f : 30.0f,
                                   shadows);
            else
                scene.addDirectionalLight(travels, Vec3f::Ones(), 1, shadows);
            return draw(scene.take(), fromAbove());
        };
        const Picture with = shown(true, true), plain = shown(true, false), empty = shown(false, false);
        int dark = 0, lit = 0;
        const Box outer{at - 0.5 * size - Vec3d::Constant(0.06), at + 0.5 * size + Vec3d::Constant(0.06)};
        const Box inner{at - 0.5 * size + Vec3d::Constant(0.06), at + 0.5 * size - Vec3d::Constant(0.06)};
        for (int y = 0; y < kPx; ++y) {
            for (int x = 0; x < kPx; ++x) {
                const Vec3d point = floorAt(x, y), to = spot ? light : Vec3d(point - 20 * travels);
                if (throughBox(Vec3d(0, 5.4, -3), point, outer) > 0) continue;  // the box itself is seen
                if (throughBox(point, to, inner) > 0) {
                    ++dark;
                    ASSERT_EQ(pixel(with, x, y).g, 0) << round << ": " << x << ' ' << y;
                } else if (throughBox(point, to, outer) < 0) {
                    ++lit;
                    ASSERT_EQ(pixel(with, x, y).g, pixel(empty, x, y).g) << round << ": " << x << ' ' << y;
                    ASSERT_EQ(pixel(with, x, y).g, pixel(plain, x, y).g);
                }
            }
        }
        shaded += dark;
        EXPECT_GT(lit, 10000) << round;
    }
    EXPECT_GT(shaded, 1000);
}

TEST_F(ShadowTest, NothingThatIsRoundOrFlatShadesItself) {
    for (const bool spot : {false, true}) {
        const auto shown = [&](bool shadows, double turn) {
            TestScene scene;
            scene.setEnvironment(Vec3f::Zero(), Vec3f::Zero(), Vec3f::Zero());
            scene.place(scene.add(makeSphere(1.1, 96), scene.add(matt())), {0, 0, -2});
            const Vec3d travels(std::sin(turn), -0.4, -std::cos(turn));
            if (spot)
                scene.addSpotLight(Vec3d(0, 0, -2) - 6 * travels.normalized(), travels, Vec3f::Ones(), 36, 0.4f, 0.5f,
                                   0, shadows);
            else
                scene.addDirectionalLight(travels, Vec3f::Ones(), 1, shadows);
            return draw(scene.take(), cameraOf(kPx, kPx));
        };
        for (const double turn : {0.0, 0.8, 1.5, 2.2}) {
            const Picture with = shown(true, turn), without = shown(false, turn);
            int darker = 0;
            for (std::size_t i = 0; i < with.rgb.size(); i += 3) darker += without.rgb[i] - with.rgb[i] > 24;
            // Where light all but passes by, its own back begins.
            EXPECT_LT(darker, 40) << turn << (spot ? " spot" : " directional");
        }
    }
}

/// A program of its own draws what a sun alone lights: by the same numbers as others.
TEST_F(ShadowTest, OfASunAloneIsThatOfASunAmongOthers) {
    for (const int samples : {1, 4}) {
        restart({.samples = samples});
        for (int round = 0; round < 6; ++round) {
            const auto shown = [&](bool another) {
                TestScene scene;
                scene.setEnvironment(Vec3f::Constant(0.1f), Vec3f::Constant(0.05f), Vec3f::Zero());
                Material material = matt();
                material.roughness = 0.2f + 0.1f * static_cast<float>(round);
                material.specular = round % 3 == 1 ? 0.5f : 1.0f;
                material.clearcoat = round % 3 == 2 ? 1.0f : 0.0f;
                const ObjectId look = scene.add(material);
                scene.place(scene.add(makeSheet(40, 40), look), {0, -1, -3},
                            Quatd(Eigen::AngleAxisd(-0.5 * M_PI, Vec3d::UnitX())));
                for (int i = 0; i < 8; ++i)
                    scene.place(scene.add(i % 2 ? makeSphere(0.4, 32) : makeBox({0.5, 0.8, 0.5}), look),
                                {1.6 * std::sin(1.9 * i), -0.4 + 0.1 * i, -2.0 - 2.5 * i});
                scene.addDirectionalLight({0.3 - 0.2 * round, -1, -0.4}, {1, 0.9f, 0.7f}, 1.2f, true);
                if (another) scene.addPointLight({0, 3, 0}, Vec3f::Ones(), 0);
                return draw(scene.take(), cameraOf(kPx, kPx));
            };
            EXPECT_EQ(shown(false).rgb, shown(true).rgb) << "round " << round << ", samples " << samples;
        }
    }
}

TEST_F(ShadowTest, MovesWithItsCaster) {
    const auto darkAt = [&](double x) {
        TestScene scene;
        addFloor(scene);
        scene.place(scene.add(makeBox({0.6, 0.2, 0.6}), scene.add(matt())), {x, 0.5, -3});
        scene.addDirectionalLight({0.6, -1, 0}, Vec3f::Ones(), 1, true);
        const Picture picture = draw(scene.take(), fromAbove());
        double sum = 0, count = 0;
        for (int c = 0; c < kPx; ++c)
            if (pixel(picture, c, kPx / 2).g == 0) sum += floorAt(c, 0).x(), ++count;
        return count > 0 ? sum / count : -100;
    };
    // 1.5 above the floor, less half a box: 0.9 to the side.
    EXPECT_NEAR(darkAt(-1), -0.1, 0.1);
    EXPECT_NEAR(darkAt(0.3), 1.2, 0.1);
}

TEST_F(ShadowTest, OfGlassThereIsNoneAndHolesLetLightThrough) {
    const auto shade = [&](const std::function<Material(TestScene&)>& make) {
        TestScene scene;
        addFloor(scene);
        MeshData sheet = makeSheet(2, 2);
        scene.place(scene.add(sheet, scene.add(make(scene))), {0, 0.5, -3},
                    Quatd(Eigen::AngleAxisd(-0.5 * M_PI, Vec3d::UnitX())));
        scene.addDirectionalLight({1.5, -1, 0}, Vec3f::Ones(), 1, true);
        const Picture picture = draw(scene.take(), fromAbove());
        const auto at = [&](double x) {
            return pixel(picture, static_cast<int>(kPx / 2 + x / (3.2 / kPx * 6.4 / 2.4)), kPx / 2).g;
        };
        // The sheet's shadow reaches from 1.25 to 3.25; its middle is at 2.25.
        return std::pair{at(1.75), at(2.75)};
    };
    const auto opaque = shade([](TestScene&) { return matt(); });
    EXPECT_EQ(opaque, (std::pair{0, 0}));
    const auto glass = shade([](TestScene&) {
        Material material = matt();
        material.baseColor.w() = 0.5f;
        return material;
    });
    EXPECT_GT(std::min(glass.first, glass.second), 100);
    const auto holed = shade([](TestScene& scene) {
        Material material = matt();
        material.alphaMode = Material::kMask;
        std::vector<std::uint8_t> pixels;
        for (int i = 0; i < 64; ++i)
            pixels.insert(pixels.end(), {255, 255, 255, static_cast<std::uint8_t>(i % 8 < 4 ? 255 : 0)});
        material.baseColorImage = scene.addImage(Blob::of(std::span<const std::uint8_t>(pixels)), 8, 8);
        return material;
    });
    EXPECT_EQ(holed.first, 0);
    EXPECT_GT(holed.second, 100);
}

TEST_F(ShadowTest, OfOneSunAndEightSpotsTheOthersAreCounted) {
    TestScene scene;
    addFloor(scene);
    for (int i = 0; i < 3; ++i) scene.addDirectionalLight(-Vec3d::UnitY(), Vec3f::Ones(), 0.1f, true);
    for (int i = 0; i < 10; ++i)
        scene.addSpotLight({0.1 * i, 3, -3}, -Vec3d::UnitY(), Vec3f::Ones(), 1, 0.2f, 0.5f, 0, true);
    (void)draw(scene.take(), fromAbove());
    EXPECT_EQ(renderer_->lastCounts().shadowsLeftOut, 4u);
}

}  // namespace
}  // namespace tessera

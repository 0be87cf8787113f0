// Exposure and tone maps: each curve as its source has it, in double precision; what a screen shows by it; and what
// exposure does not touch.
#include <cmath>

#include "client/draw/shaders/ToneCurves.h"
#include "common/math/Srgb.h"
#include "tests/unit/draw/MaterialStage.h"

namespace tessera {
namespace {

constexpr std::array<std::int64_t, 5> kAll = {Environment::kNeutral, Environment::kClamp, Environment::kReinhard,
                                              Environment::kAces, Environment::kAgx};

/// The sources' own formulas, one operation after the other.
Vec3d publishedNeutral(const Vec3d& c) {
    const double peak = c.maxCoeff();
    if (peak <= 0.8) return c;
    const double d = 1 - 0.8, newPeak = 1 - d * d / (peak + d - 0.8), g = 1 - 1 / (0.15 * (peak - newPeak) + 1);
    return (1 - g) * (c * (newPeak / peak)) + g * Vec3d::Constant(newPeak);
}
Vec3d publishedAces(const Vec3d& c) {
    Mat3d in, out;
    in << 0.59719, 0.35458, 0.04823, 0.07600, 0.90834, 0.01566, 0.02840, 0.13383, 0.83777;
    out << 1.60475, -0.53108, -0.07367, -0.10208, 1.10813, -0.00605, -0.00327, -0.07276, 1.07602;
    const Vec3d v = in * (c / 0.6);
    Vec3d fitted;
    for (int i = 0; i < 3; ++i)
        fitted[i] = (v[i] * (v[i] + 0.0245786) - 0.000090537) / (v[i] * (0.983729 * v[i] + 0.4329510) + 0.238081);
    return (out * fitted).cwiseMax(0).cwiseMin(1);
}
Vec3d publishedAgx(const Vec3d& c) {
    Mat3d toRec2020, toSrgb, inset, outset;
    toRec2020 << 0.6274, 0.3293, 0.0433, 0.0691, 0.9195, 0.0113, 0.0164, 0.0880, 0.8956;
    toSrgb << 1.6605, -0.5876, -0.0728, -0.1246, 1.1329, -0.0083, -0.0182, -0.1006, 1.1187;
    inset << 0.856627153315983, 0.0951212405381588, 0.0482516061458583, 0.137318972929847, 0.761241990602591,
        0.101439036467562, 0.11189821299995, 0.0767994186031903, 0.811302368396859;
    outset << 1.1271005818144368, -0.11060664309660323, -0.016493938717834573, -0.1413297634984383, 1.157823702216272,
        -0.016493938717834257, -0.14132976349843826, -0.11060664309660294, 1.2519364065950405;
    const Vec3d v = inset * (toRec2020 * c);
    Vec3d curved;
    for (int i = 0; i < 3; ++i) {
        const double x = std::clamp((std::log2(std::max(v[i], 1e-10)) + 12.47393) / (4.026069 + 12.47393), 0.0, 1.0);
        curved[i] = 15.5 * std::pow(x, 6) - 40.14 * std::pow(x, 5) + 31.96 * std::pow(x, 4) - 6.868 * std::pow(x, 3) +
                    0.4298 * x * x + 0.1191 * x - 0.00232;
    }
    const Vec3d linear = (outset * curved).cwiseMax(0);
    return (toSrgb * Vec3d(std::pow(linear[0], 2.2), std::pow(linear[1], 2.2), std::pow(linear[2], 2.2)))
        .cwiseMax(0)
        .cwiseMin(1);
}
Vec3d published(std::int64_t toneMap, const Vec3d& c) {
    switch (toneMap) {
        case Environment::kNeutral:
            return publishedNeutral(c);
        case Environment::kClamp:
            return c.cwiseMin(1);
        case Environment::kReinhard:
            return c.cwiseQuotient(Vec3d::Ones() + c);
        case Environment::kAces:
            return publishedAces(c);
        default:
            return publishedAgx(c);
    }
}

/// Greys and colours from far below what a screen can show to beyond any lamp, an eighth of a stop apart.
std::vector<Vec3d> radiances() {
    std::vector<Vec3d> all = {Vec3d::Zero()};
    for (double stops = -14; stops <= 20; stops += 0.125)
        for (const Vec3d& hue : {Vec3d(1, 1, 1), Vec3d(1, 0.5, 0.1), Vec3d(0, 0.2, 1), Vec3d(0.3, 1, 0)})
            all.push_back(hue * std::exp2(stops));
    return all;
}

Vec3d shownBy(std::int64_t toneMap, const Vec3d& radiance) {
    const Vec3d c = published(toneMap, radiance);
    const auto byte = [](double v) { return 255 * srgbOfLinear(std::clamp(v, 0.0, 1.0)); };
    return {byte(c.x()), byte(c.y()), byte(c.z())};
}

TEST(ToneCurves, AreAsTheirSourcesHaveThem) {
    for (const std::int64_t toneMap : kAll)
        for (const Vec3d& radiance : radiances())
            EXPECT_LT((toneMapped(toneMap, radiance) - published(toneMap, radiance)).cwiseAbs().maxCoeff(), 1e-9)
                << toneMap << " " << radiance.transpose();
}

class ToneMapTest : public RendererTest {
protected:
    static Environment with(std::int64_t toneMap, float exposure) {
        Environment environment;
        environment.sky = environment.ground = environment.background = Vec3f::Zero();
        environment.toneMap = toneMap;
        environment.exposure = exposure;
        return environment;
    }
    /// Squares of 8 pixels side by side, each of what it emits.
    Picture drawEmitted(const Environment& environment, std::span<const Vec3d> radiances, int columns, bool glass) {
        TestScene scene;
        scene.addEnvironment(environment);
        scene.addDirectionalLight(-Vec3d::UnitZ(), Vec3f::Ones(), 0);
        const int rows = (static_cast<int>(radiances.size()) + columns - 1) / columns;
        const double side = 3.2 / columns;
        for (std::size_t i = 0; i < radiances.size(); ++i) {
            Material material = unlit(radiances[i].cast<float>());
            // Seen through and as dense as can be: drawn, and lit, by the pass of what is transparent.
            if (glass) material.alphaMode = Material::kBlend;
            const double x = (static_cast<double>(i % static_cast<std::size_t>(columns)) + 0.5) * side - 1.6,
                         y = (0.5 * rows - static_cast<double>(i / static_cast<std::size_t>(columns)) - 0.5) * side;
            scene.place(scene.add(makeSheet(side, side), scene.add(material)), {x, y, -0.001});
        }
        return draw(scene.take(), cameraOf(8 * columns, 8 * rows));
    }
};

TEST_F(ToneMapTest, ScreensShowWhatTheCurvesSayOverTheWholeRange) {
    const std::vector<Vec3d> all = radiances();
    constexpr int kColumns = 40;
    for (const bool glass : {false, true})
        for (const std::int64_t toneMap : kAll) {
            const Picture picture = drawEmitted(with(toneMap, 0), all, kColumns, glass);
            for (std::size_t i = 0; i < all.size(); ++i) {
                const Rgb shown =
                    pixel(picture, 8 * static_cast<int>(i % kColumns) + 4, 8 * static_cast<int>(i / kColumns) + 4);
                const Vec3d expected = shownBy(toneMap, all[i]);
                // One for the arithmetic, and what 9 bits of emission lose: nothing where a channel is the largest.
                EXPECT_LT((Vec3d(shown.r, shown.g, shown.b) - expected).cwiseAbs().maxCoeff(), 2)
                    << toneMap << " " << all[i].transpose() << ": " << shown << ", not " << expected.transpose();
            }
        }
}

TEST_F(ToneMapTest, ABackgroundIsShownAsThePixelsOfItsEdgesAreAndNoExposureTouchesIt) {
    for (const std::int64_t toneMap : kAll)
        for (const double grey : {0.0, 0.06, 0.3, 0.9, 3.0}) {
            Environment environment = with(toneMap, 5);
            environment.background = Vec3f::Constant(static_cast<float>(grey));
            TestScene scene;
            scene.addEnvironment(environment);
            scene.addDirectionalLight(-Vec3d::UnitZ(), Vec3f::Ones(), 0);
            const int expected =
                static_cast<int>(std::lround(shownBy(toneMap, Vec3d::Constant(static_cast<float>(grey))).y()));
            EXPECT_EQ(center(draw(scene)).g, expected) << toneMap << " " << grey;
        }
}

TEST_F(ToneMapTest, ExposureIsLightSoManyTimesAsStrong) {
    const auto hall = [](float exposure, float strength) {
        TestScene scene;
        Environment environment = with(Environment::kNeutral, exposure);
        environment.sky = Vec3f(0.3f, 0.33f, 0.38f) * strength;
        environment.ground = Vec3f(0.12f, 0.11f, 0.1f) * strength;
        scene.addEnvironment(environment);
        scene.addDirectionalLight({-0.5, -0.7, -1}, Vec3f(1, 0.9f, 0.8f), 0.6f * strength);
        Material matt, gloss, glass, plain;
        gloss.roughness = 0.3f;
        gloss.clearcoat = 1;
        glass.baseColor = Vec4f(0.4f, 0.6f, 0.7f, 0.4f);
        plain.unlit = true;
        plain.baseColor = Vec4f(0.2f, 0.7f, 0.4f, 1);
        const std::array<Material, 4> materials = {matt, gloss, glass, plain};
        for (std::size_t i = 0; i < materials.size(); ++i)
            scene.place(scene.add(makeSphere(0.35, 24), scene.add(materials[i])),
                        {i % 2 == 0 ? -0.5 : 0.5, i < 2 ? 0.5 : -0.5, -0.4});
        return scene.take();
    };
    const ScreenCamera camera = cameraOf(kSidePx, kSidePx);
    const Picture one = draw(hall(0, 1), camera);
    for (const int stops : {-12, -1, 2, 16})
        EXPECT_EQ(draw(hall(static_cast<float>(stops), std::exp2(static_cast<float>(-stops))), camera).rgb, one.rgb)
            << stops << ": powers of two are exact";
    EXPECT_NE(draw(hall(1, 1), camera).rgb, one.rgb);
}

}  // namespace
}  // namespace tessera

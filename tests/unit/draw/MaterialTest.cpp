/// Materials by glTF 2.0: each property beside its formula (appendix B), computed here in double from its text.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <functional>
#include <numbers>
#include <random>
#include <set>
#include <tuple>

#include "tests/unit/draw/MaterialStage.h"
#include "tests/unit/draw/ShadedSurface.h"

namespace tessera {
namespace {

TEST_F(MaterialTest, MetalAndRoughnessAreThoseOfTheFormulas) {
    const Vec3d light = Vec3d(0.5, 0.4, 0.8).normalized();
    int worst = 0;
    for (const double metallic : {0.0, 0.5, 1.0})
        for (const double roughness : {0.3, 0.5, 0.7, 1.0})
            for (int k = 0; k < 6; ++k) {
                const Quatd turn(Eigen::AngleAxisd(0.12 * k - 0.2, Vec3d(1, 2, 0).normalized()));
                const Shaded surface{.base = {0.8, 0.5, 0.2}, .metallic = metallic, .roughness = roughness};
                Material material = of(surface.base);
                material.metallic = static_cast<float>(metallic);
                material.roughness = static_cast<float>(roughness);
                TestScene scene = lit(light);
                const Rgb is = middleOf(scene, material, turn);
                const Rgb should =
                    expectedOf((0.5 * surface.reflected(turn * Vec3d::UnitZ(), light, towardsEye())).cast<float>());
                for (const int off : {is.r - should.r, is.g - should.g, is.b - should.b})
                    worst = std::max(worst, std::abs(off));
            }
    // The shader takes Hammon's approximation of the visibility: at most 2 of 255 here.
    EXPECT_LE(worst, 2);
}

TEST_F(MaterialTest, WhatAnImageSaysIsWhatANumberSays) {
    const Vec3d light = Vec3d(0.3, 0.5, 0.8).normalized();
    for (const int samples : {1, 4}) {
        restart({.samples = samples});
        for (const auto& [rough, metal] : {std::pair(255, 0), {128, 0}, {77, 255}, {200, 130}}) {
            Material byNumber = of({0.7, 0.4, 0.3}), byImage = byNumber;
            byNumber.roughness = 0.8f * static_cast<float>(rough) / 255;
            byNumber.metallic = 0.9f * static_cast<float>(metal) / 255;
            byImage.roughness = 0.8f;
            byImage.metallic = 0.9f;
            TestScene one = lit(light), other = lit(light);
            byImage.metallicRoughnessImage =
                other.add(plain({9, static_cast<std::uint8_t>(rough), static_cast<std::uint8_t>(metal), 255}));
            expectNear(middleOf(other, byImage), middleOf(one, byNumber));
        }
        // Colours are sRGB, all else is not.
        Material byNumber = of({0, 0, 0}), byImage = byNumber;
        byNumber.emissive = Vec3f(0.9f * static_cast<float>(linearOf(200)), 0.5f * static_cast<float>(linearOf(90)), 0);
        byImage.emissive = Vec3f(0.9f, 0.5f, 0.7f);
        TestScene one, other;
        one.setDark();
        other.setDark();
        byImage.emissiveImage = other.add(plain({200, 90, 0, 255}));
        expectNear(middleOf(other, byImage), middleOf(one, byNumber));
    }
}

TEST_F(MaterialTest, EmissionIsAsBrightAsItIs) {
    // Beyond 1, and so dark that the common exponent is at its end.
    for (const float brightness : {1e-7f, 0.01f, 0.6f, 0.8f, 3.0f, 80.0f}) {
        Material material = of({0, 0, 0});
        material.emissive = brightness * Vec3f(1, 0.5f, 0.02f);
        TestScene scene;
        scene.setDark();
        material.emissiveImage = scene.add(plain({255, 255, 255, 255}));
        expectNear(middleOf(scene, material), expectedOf(material.emissive));
    }
}

// Samples of one surface whose material images differ: sorting pixels by whether their samples are alike must look at
// what images say, too. Two triangles fill the picture, alike but for the light that an image lets them give.
TEST_F(MaterialTest, APixelBetweenTwoEmissionsHasTheirMean) {
    restart({.samples = 4});
    const std::array<std::uint8_t, 8> halves{0, 0, 0, 255, 255, 255, 255, 255};
    TestScene scene;
    scene.setDark();
    Material material;
    material.baseColor = {0, 0, 0, 1};
    material.emissive = Vec3f::Constant(0.5f);
    material.emissiveImage = scene.addImage(Blob::of(std::span<const std::uint8_t>(halves)), 2, 1);
    MeshData mesh;
    mesh.positions = {-9, -8, 0, 9, -8, 0, 9, 10, 0, -9, -8, 0, 9, 10, 0, -9, 10, 0};
    mesh.normals = {0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1};
    mesh.texcoords = {0.25f, 0.5f, 0.25f, 0.5f, 0.25f, 0.5f, 0.75f, 0.5f, 0.75f, 0.5f, 0.75f, 0.5f};
    mesh.indices = {0, 1, 2, 3, 4, 5};
    scene.place(scene.add(mesh, scene.add(material)), Vec3d::Zero());
    const Picture picture = draw(scene.take(), cameraOf(kSidePx, kSidePx));
    const int bright = expectedOf(Vec3f::Constant(0.5f)).r;
    int dark = 0, lit = 0, between = 0;
    for (std::size_t i = 0; i < picture.rgb.size(); i += 3) {
        dark += picture.rgb[i] <= 1;
        lit += picture.rgb[i] >= bright - 1;
        between += picture.rgb[i] > 10 && picture.rgb[i] < bright - 10;
    }
    EXPECT_GT(dark, kSidePx * kSidePx / 4);
    EXPECT_GT(lit, kSidePx * kSidePx / 8);
    EXPECT_GT(between, kSidePx / 4) << "along the edge";
}

TEST_F(MaterialTest, OcclusionTakesTheSurroundingsLightAlone) {
    const auto shown = [&](float ambient, float lamp, int red, float strength) {
        TestScene scene;
        scene.setEnvironment(Vec3f::Constant(ambient), Vec3f::Constant(ambient), Vec3f::Zero());
        scene.addDirectionalLight(-Vec3d::UnitZ(), Vec3f::Ones(), lamp);
        Material material = of({0.5, 0.5, 0.5});
        material.occlusionStrength = strength;
        if (red >= 0) material.occlusionImage = scene.add(plain({static_cast<std::uint8_t>(red), 0, 0, 255}));
        return middleOf(scene, material);
    };
    expectNear(shown(0, 0.5f, 0, 1), shown(0, 0.5f, -1, 1));  // a lamp's light is not occluded
    expectNear(shown(0.5f, 0, 51, 1), shown(0.1f, 0, -1, 1));
    expectNear(shown(0.5f, 0, 0, 0.6f), shown(0.2f, 0, -1, 1));
    EXPECT_EQ(shown(0.5f, 0, 0, 1).r, 0);
}

TEST_F(MaterialTest, NormalMapsTiltAlongTheTextureCoordinates) {
    const Vec3d light = Vec3d(0.6, 0.3, 0.7).normalized();
    // Red: along u; green: against v.
    const Vec3d inMap = Vec3d(0.5, 0.25, 0.8).normalized();
    const auto byte = [](double x) { return static_cast<std::uint8_t>(std::lround(127.5 * x + 127.5)); };
    const Image map = plain({byte(inMap.x()), byte(inMap.y()), byte(inMap.z()), 255});
    const Shaded surface{.base = {0.6, 0.6, 0.6}, .roughness = 0.6};
    struct Case {
        const char* name;
        std::array<float, 4> uOfXY, vOfXY;  ///< u = [0] + [1] x + [2] y
        Vec3d alongU, againstV;
    };
    const std::array<Case, 4> cases = {{
        {"upright", {0.5f, 0.5f, 0}, {0.5f, 0, -0.5f}, Vec3d::UnitX(), Vec3d::UnitY()},
        {"mirrored", {0.5f, -0.5f, 0}, {0.5f, 0, -0.5f}, -Vec3d::UnitX(), Vec3d::UnitY()},
        {"upside down", {0.5f, 0.5f, 0}, {0.5f, 0, 0.5f}, Vec3d::UnitX(), -Vec3d::UnitY()},
        {"turned", {0.5f, 0, 0.5f}, {0.5f, 0.5f, 0}, Vec3d::UnitY(), -Vec3d::UnitX()},
    }};
    for (const Case& c : cases)
        for (const bool normals : {true, false})
            for (const bool fromBehind : {false, true}) {
                MeshData sheet = makeSheet(1.0, 1.0);
                sheet.texcoords.clear();
                for (std::size_t i = 0; i < sheet.positions.size(); i += 3) {
                    const float x = sheet.positions[i], y = sheet.positions[i + 1];
                    sheet.texcoords.insert(sheet.texcoords.end(), {c.uOfXY[0] + c.uOfXY[1] * x + c.uOfXY[2] * y,
                                                                   c.vOfXY[0] + c.vOfXY[1] * x + c.vOfXY[2] * y});
                }
                if (!normals) sheet.normals.clear();
                TestScene scene = lit(light, 0.7f);
                Material material = of(surface.base);
                material.roughness = 0.6f;
                material.doubleSided = true;
                material.normalImage = scene.add(map);
                const Quatd turn(Eigen::AngleAxisd(fromBehind ? std::numbers::pi : 0.0, Vec3d::UnitY()));
                scene.place(scene.add(sheet, scene.add(material)), {0, 0, -0.001}, turn);
                Vec3d n = turn * (inMap.x() * c.alongU + inMap.y() * c.againstV + inMap.z() * Vec3d::UnitZ());
                if (fromBehind) n = -n;  // glTF: back faces have their normals reversed
                SCOPED_TRACE(testing::Message()
                             << c.name << (normals ? "" : ", faceted") << (fromBehind ? ", from behind" : ""));
                const Rgb is = center(draw(scene));
                const Rgb should = expectedOf((0.7 * surface.reflected(n, light, towardsEye())).cast<float>());
                EXPECT_NEAR(is.g, should.g, 2);
            }
}

TEST_F(MaterialTest, NormalScaleFlattensAndZeroIsFlat) {
    const Vec3d light = Vec3d(0.6, 0.3, 0.7).normalized();
    for (const float scale : {0.0f, 0.5f, 2.0f}) {
        TestScene scene = lit(light, 0.7f);
        Material material = of({0.6, 0.6, 0.6});
        material.normalImage = scene.add(plain({191, 127, 230, 255}));
        material.normalScale = scale;
        const Vec3d n(scale * (191 / 127.5 - 1), scale * (127 / 127.5 - 1), 230 / 127.5 - 1);
        const Shaded surface{.base = {0.6, 0.6, 0.6}};
        const Rgb is = middleOf(scene, material);
        EXPECT_NEAR(is.g, expectedOf((0.7 * surface.reflected(n.normalized(), light, towardsEye())).cast<float>()).g,
                    3);
    }
}

// ---------------------------------------------------------------- alpha

TEST_F(MaterialTest, AlphaMeansWhatItsModeSays) {
    // A red sheet before a green light; alpha 0.2 by image in the left half, 0.7 in the right.
    const auto shown = [&](std::int64_t mode, float cutoff, float own) {
        TestScene scene;
        scene.setDark(Vec3f(0, 0.5f, 0));
        Material material = unlit({0.5f, 0, 0});
        material.baseColor.w() = own;
        material.alphaMode = mode;
        material.alphaCutoff = cutoff;
        Image image = imageOf(2, [](int x, int) {
            return Rgba{255, 255, 255, static_cast<std::uint8_t>(x == 0 ? 51 : 179)};
        });
        image.magnification = Image::kNearest;
        material.baseColorImage = scene.add(image);
        scene.place(scene.add(makeSheet(3.2, 3.2), scene.add(material)), {0, 0, -0.001});
        const Picture picture = draw(scene);
        return std::pair(pixel(picture, 12, 32), pixel(picture, 52, 32));
    };
    const Rgb red = expectedOf({0.5f, 0, 0}), green = expectedOf({0, 0.5f, 0});
    const auto mixed = [&](double alpha) {
        return Rgb{static_cast<int>(std::lround(alpha * red.r)), static_cast<int>(std::lround((1 - alpha) * green.g)),
                   0};
    };
    for (const int samples : {1, 4}) {
        restart({.samples = samples});
        const auto [opaqueLeft, opaqueRight] = shown(Material::kOpaque, 0.5f, 1);
        expectNear(opaqueLeft, red);
        expectNear(opaqueRight, red);
        const auto [maskLeft, maskRight] = shown(Material::kMask, 0.5f, 1);
        expectNear(maskLeft, green);
        expectNear(maskRight, red);
        const auto [moreLeft, moreRight] = shown(Material::kMask, 0.1f, 1);
        expectNear(moreLeft, red);
        const auto [lessLeft, lessRight] = shown(Material::kMask, 0.5f, 0.5f);
        expectNear(lessRight, green);  // 0.5 × 0.7
        const auto [blendLeft, blendRight] = shown(Material::kBlend, 0.5f, 1);
        expectNear(blendLeft, mixed(51 / 255.0));
        expectNear(blendRight, mixed(179 / 255.0));
        const auto [halfLeft, halfRight] = shown(Material::kBlend, 0.5f, 0.5f);
        expectNear(halfRight, mixed(0.5 * 179 / 255.0));
        const auto [autoLeft, autoRight] = shown(Material::kAutoAlpha, 0.5f, 1);
        expectNear(autoLeft, red);
    }
}

TEST_F(MaterialTest, WhatIsAsOpaqueAsTheCutoffIsThere) {
    for (const int samples : {1, 4}) {
        restart({.samples = samples});
        for (const auto& [own, cutoff, there] : {std::tuple(1.0f, 1.0f, true),
                                                 {0.5f, 0.5f, true},
                                                 {0.5f, 0.51f, false},
                                                 {1.0f, 1.5f, false},
                                                 {0.0f, 0.0f, true}}) {
            TestScene scene;
            scene.setDark(Vec3f(0, 0.5f, 0));
            Material material = unlit({0.5f, 0, 0});
            material.baseColor.w() = own;
            material.alphaMode = Material::kMask;
            material.alphaCutoff = cutoff;
            expectNear(middleOf(scene, material), expectedOf(there ? Vec3f(0.5f, 0, 0) : Vec3f(0, 0.5f, 0)));
        }
    }
}

TEST_F(MaterialTest, WhatIsWhollyClearCannotBeSeen) {
    TestScene scene;
    scene.setEnvironment(Vec3f::Zero(), Vec3f::Zero(), Vec3f(0, 0.5f, 0));
    scene.addDirectionalLight(-Vec3d::UnitZ(), Vec3f::Ones(), 0);
    Material material = of({1, 0, 0});
    material.alphaMode = Material::kBlend;
    material.baseColorImage = scene.add(plain({255, 255, 255, 0}));
    expectNear(middleOf(scene, material), expectedOf({0, 0.5f, 0}));
}

TEST_F(MaterialTest, CutOutEdgesAreSmoothAndTheirHolesShowWhatIsBehind) {
    restart({.samples = 4});
    TestScene scene;
    scene.setDark();
    Material cut = unlit({0.5f, 0.5f, 0.5f});
    cut.alphaMode = Material::kMask;
    // Alpha rises to the right: the edge is a line.
    cut.baseColorImage = scene.add(imageOf(64, [](int x, int y) {
        return Rgba{255, 255, 255, static_cast<std::uint8_t>(std::clamp(8 * (x - 32) + 2 * (y - 32) + 128, 0, 255))};
    }));
    const ObjectId front = scene.place(scene.add(makeSheet(3.2, 3.2), scene.add(cut)), {0, 0, -0.001});
    const ObjectId behind = scene.place(scene.add(makeSheet(4.5, 4.5), scene.add(unlit({0, 0, 0.5f}))), {0, 0, -0.5});
    const Aspect aspect = scene.take();
    const ScreenCamera camera = cameraOf(kSidePx, kSidePx);
    const Picture picture = draw(aspect, camera);
    std::set<int> tones;
    for (int y = 8; y < 56; ++y)
        for (int x = 20; x < 44; ++x) tones.insert(pixel(picture, x, y).g);
    EXPECT_GE(tones.size(), 5u) << "with four samples an edge has shades";
    expectNear(pixel(picture, 4, 32), expectedOf({0, 0, 0.5f}));
    const auto ids = renderer_->drawNodeIds(aspect, listOf(aspect, camera), camera, whole(camera));
    ASSERT_TRUE(ids);
    EXPECT_EQ((*ids)[32 * kSidePx + 4], behind.value);
    EXPECT_EQ((*ids)[32 * kSidePx + 60], front.value);
}

// ---------------------------------------------------------------- extensions

TEST_F(MaterialTest, UnlitIsItsBaseColourAndNoLightChangesIt) {
    for (const bool glass : {false, true})
        for (const float lamp : {0.0f, 3.0f}) {
            TestScene scene = lit(Vec3d::UnitZ(), lamp);
            Material material = of({1.0, 0.5, 0.25});
            material.unlit = true;
            material.alphaMode = glass ? Material::kBlend : Material::kAutoAlpha;
            material.baseColor.w() = glass ? 0.99f : 1.0f;
            const Rgb is = middleOf(scene, material);
            const auto byte = [](double v) {
                return static_cast<int>(std::lround(255 * (1.055 * std::pow(v, 1 / 2.4) - 0.055)));
            };
            // Not even white is toned down.
            EXPECT_NEAR(is.r, 255, glass ? 3 : 1);
            EXPECT_NEAR(is.g, byte(0.5), glass ? 3 : 1);
            EXPECT_NEAR(is.b, byte(0.25), glass ? 3 : 1);
        }
}

TEST_F(MaterialTest, LacquerAddsALayerOfItsOwn) {
    const Vec3d light = Vec3d(0.3, 0.2, 0.9).normalized();
    for (const double coat : {0.5, 1.0})
        for (const double roughness : {0.3, 0.6}) {
            const Shaded surface{
                .base = {0.7, 0.1, 0.1}, .roughness = 0.9, .clearcoat = coat, .clearcoatRoughness = roughness};
            Material material = of(surface.base);
            material.roughness = 0.9f;
            material.clearcoat = static_cast<float>(coat);
            material.clearcoatRoughness = static_cast<float>(roughness);
            for (int k = 0; k < 5; ++k) {
                const Quatd turn(Eigen::AngleAxisd(0.1 * k, Vec3d(-1, 2, 0).normalized()));
                TestScene scene = lit(light);
                const Rgb is = middleOf(scene, material, turn);
                const Rgb should =
                    expectedOf((0.5 * surface.reflected(turn * Vec3d::UnitZ(), light, towardsEye())).cast<float>());
                EXPECT_NEAR(is.r, should.r, 2);
                EXPECT_NEAR(is.g, should.g, 2);
            }
        }
}

// KHR_materials_clearcoat: what lies below is what the layer lets through, its own light too.
TEST_F(MaterialTest, LacquerTakesItsShareOfWhatShinesBelowIt) {
    for (const float coat : {0.0f, 0.5f, 1.0f})
        for (const float alpha : {1.0f, 0.9999f}) {
            TestScene scene;
            scene.setDark();
            Material material = of({0, 0, 0});
            material.baseColor.w() = alpha;
            material.emissive = Vec3f(0.4f, 0.2f, 0.1f);
            material.clearcoat = coat;
            const Quatd turn(Eigen::AngleAxisd(1.2, Vec3d::UnitY()));
            const double nv = (turn * Vec3d::UnitZ()).dot(towardsEye());
            const double below = 1 - static_cast<double>(coat) * (0.04 + 0.96 * std::pow(1 - nv, 5));
            expectNear(middleOf(scene, material, turn),
                       expectedOf((below * material.emissive.cast<double>()).cast<float>()));
        }
}

TEST_F(MaterialTest, LightGoesThroughWhatTransmitsIt) {
    const auto behind = [&](float transmission, const Vec3d& base, float metallic) {
        TestScene scene;
        scene.setDark(Vec3f(0, 0.5f, 0));
        Material material = of(base);
        material.transmission = transmission;
        material.metallic = metallic;
        return middleOf(scene, material);
    };
    const Rgb green = expectedOf({0, 0.5f, 0});
    EXPECT_NEAR(behind(1, {1, 1, 1}, 0).g, green.g, 2);
    EXPECT_NEAR(behind(0.5f, {1, 1, 1}, 0).g, 0.5 * green.g, 2);
    EXPECT_NEAR(behind(1, {0, 0, 0}, 0).g, 0, 1) << "black glass";
    EXPECT_NEAR(behind(1, {1, 1, 1}, 1).g, 0, 1) << "metals let nothing through";
}

// Of light that falls on it, what is not let through is scattered; its own light stays as it is.
TEST_F(MaterialTest, WhatTransmitsAPartScattersTheRest) {
    const Vec3d light = Vec3d(0.2, 0.3, 0.9).normalized();
    for (const float transmission : {0.25f, 0.5f}) {
        TestScene scene = lit(light);
        Material material = of({1, 1, 1});
        material.transmission = transmission;
        material.specular = 0;
        const Rgb is = middleOf(scene, material);
        const Vec3d solid = Vec3d::Constant(0.5 * light.z());
        EXPECT_NEAR(is.g, (1 - transmission) * static_cast<float>(expectedOf(solid.cast<float>()).g), 3);
        TestScene dark;
        dark.setDark();
        material.transmission = 1;
        material.emissive = Vec3f::Ones();
        EXPECT_NEAR(middleOf(dark, material).g, expectedOf(Vec3f::Ones()).g, 3);
    }
}

/// glTF 2.0, 3.9.4: BLEND puts the whole of a surface, as it is lit, over what is behind it. Light that goes through
/// (KHR_materials_transmission) takes nothing of what is reflected.
TEST_F(MaterialTest, AlphaWeakensAllOfASurfaceAndTransmissionLeavesItsHighlights) {
    const Vec3d light = Vec3d(0.1, 0.3, 0.9).normalized();
    const Vec3f behind(0.05f, 0.2f, 0.4f);
    const Rgb background = expectedOf(behind);
    const auto shown = [&](double metallic, float alpha, float transmission) {
        TestScene scene;
        scene.setEnvironment(Vec3f::Zero(), Vec3f::Zero(), behind);
        scene.addDirectionalLight(-light, Vec3f::Ones(), 0.5f);
        Material material = of({0.8, 0.5, 0.2});
        material.metallic = static_cast<float>(metallic);
        material.roughness = 0.5f;
        material.alphaMode = Material::kBlend;
        material.baseColor.w() = alpha;
        material.transmission = transmission;
        return middleOf(scene, material);
    };
    const auto over = [&](const Rgb& c, float alpha) {
        const auto mixed = [alpha](int front, int back) {
            return static_cast<int>(
                std::lround(alpha * static_cast<float>(front) + (1 - alpha) * static_cast<float>(back)));
        };
        return Rgb{mixed(c.r, background.r), mixed(c.g, background.g), mixed(c.b, background.b)};
    };
    const auto expectWithin2 = [](const Rgb& is, const Rgb& should, double metallic, float alpha) {
        for (const int off : {is.r - should.r, is.g - should.g, is.b - should.b})
            EXPECT_LE(std::abs(off), 2) << is << " for " << should << ", metallic " << metallic << ", alpha " << alpha;
    };
    for (const double metallic : {0.0, 0.5, 1.0}) {
        const Shaded surface{.base = {0.8, 0.5, 0.2}, .metallic = metallic, .roughness = 0.5};
        const Rgb solid = expectedOf((0.5 * surface.reflected(Vec3d::UnitZ(), light, towardsEye())).cast<float>());
        EXPECT_GT(solid.r, background.r + 40) << "something to be weakened";
        for (const float alpha : {0.0f, 0.1f, 0.5f, 0.9f})
            expectWithin2(shown(metallic, alpha, 0), over(solid, alpha), metallic, alpha);
    }
    const Rgb clear = shown(0, 0.999f, 1);
    EXPECT_GT(clear.r, background.r + 5) << "a highlight on glass";
    for (const float alpha : {0.0f, 0.5f}) expectWithin2(shown(0, alpha, 1), over(clear, alpha), 0, alpha);
}

TEST_F(MaterialTest, AnImageThatIsNotThereIsWhiteAndCounted) {
    for (const auto slot : {&Material::baseColorImage, &Material::metallicRoughnessImage, &Material::normalImage,
                            &Material::occlusionImage, &Material::emissiveImage}) {
        const Vec3d light = Vec3d(0.3, 0.2, 0.9).normalized();
        TestScene with = lit(light), without = lit(light);
        Material material = of({0.7, 0.5, 0.3});
        const Rgb should = middleOf(without, material);
        material.*slot = with.add(Image{.pixels = plain({0, 0, 0, 0}).pixels, .widthPx = 3, .heightPx = 2});
        expectNear(middleOf(with, material), should);
        EXPECT_EQ(renderer_->lastCounts().untextured, 1u);
    }
}

TEST_F(MaterialTest, AnImageOfAWrongSizeIsWhiteBesideOneOfTheSamePixels) {
    for (const std::int64_t height : {0, 1, 4}) {
        TestScene scene = lit(Vec3d::UnitZ());
        const Image right = plain({255, 0, 0, 255});
        Image wrong = right;
        wrong.heightPx = height;
        Material red = of({1, 1, 1}), white = red;
        red.baseColorImage = scene.add(right);
        white.baseColorImage = scene.add(wrong);
        scene.place(scene.add(makeSheet(1.6, 3.2), scene.add(red)), {-0.8, 0, -0.001});
        scene.place(scene.add(makeSheet(1.6, 3.2), scene.add(white)), {0.8, 0, -0.002});
        const Picture picture = draw(scene);
        EXPECT_LT(pixel(picture, 16, 32).g, 30);
        EXPECT_GT(pixel(picture, 48, 32).g, 100) << height;
        EXPECT_EQ(renderer_->lastCounts().untextured, 1u);
    }
}

}  // namespace
}  // namespace tessera

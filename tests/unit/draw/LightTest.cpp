// Any number of lights: what clusters leave away gives nothing, and nothing is compiled for more of them.
#include <cstdlib>
#include <optional>
#include <random>

#include "client/draw/passes/LightClusters.h"
#include "client/draw/passes/ScreenCells.h"
#include "tests/unit/draw/RendererStage.h"

namespace tessera {
namespace {

class LightTest : public RendererTest {
protected:
    /// The same list with every light at every pixel.
    Picture drawPart(const Aspect& aspect, const ScreenCamera& camera, const PixelRect& rect, RendererOptions options) {
        restart(options);
        auto picture = renderer_->draw(aspect, listOf(aspect, camera), camera, rect);
        EXPECT_TRUE(picture) << picture.error().message;
        return picture ? *picture : Picture();
    }
};

std::size_t differing(const Picture& a, const Picture& b) {
    if (a.rgb.size() != b.rgb.size()) return ~std::size_t{0};
    std::size_t count = 0;
    for (std::size_t i = 0; i < a.rgb.size(); ++i) count += a.rgb[i] != b.rgb[i];
    return count;
}

unsigned seedOr(unsigned otherwise) {
    const char* said = std::getenv("TESSERA_SEED");
    return said ? static_cast<unsigned>(std::atoi(said)) : otherwise;
}

class Random {
public:
    explicit Random(unsigned seed) : engine_(seed) {}
    double between(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine_); }
    int below(int count) { return std::uniform_int_distribution<int>(0, count - 1)(engine_); }
    Vec3d in(double side) { return {between(-side, side), between(-side, side), between(-side, side)}; }

private:
    std::mt19937 engine_;
};

/// Things near and far, some of them glass, among lights of all kinds, or of those without a cone: ranges from a
/// finger's width to all of it.
Aspect randomHall(Random& random, int lights, bool cones = true, bool sun = true) {
    TestScene scene;
    scene.setEnvironment(Vec3f::Constant(0.02f), Vec3f::Constant(0.01f), Vec3f::Zero());
    Material matt, gloss, glass;
    gloss.roughness = 0.2f;
    gloss.metallic = 1;
    glass.baseColor = Vec4f(0.4f, 0.6f, 0.7f, 0.4f);
    const std::array<ObjectId, 3> paints = {scene.add(matt), scene.add(gloss), scene.add(glass)};
    scene.place(scene.add(makeBox({30, 0.2, 60}), paints[0]), {0, -1.5, -20});
    scene.place(scene.add(makeBox({30, 12, 0.2}), paints[0]), {0, 3, -40});
    for (int i = 0; i < 25; ++i)
        scene.place(scene.add(makeSphere(random.between(0.2, 0.8), 12), paints[static_cast<std::size_t>(i % 3)]),
                    {random.between(-4, 4), random.between(-1.2, 2), random.between(-30, 1)});
    if (sun) scene.addDirectionalLight(-Vec3d::UnitZ(), Vec3f::Ones(), 0);
    for (int i = 0; i < lights; ++i) {
        const Vec3d at(random.between(-6, 6), random.between(-2, 4), random.between(-38, 4));
        const Vec3f color(static_cast<float>(random.between(0.2, 1)), static_cast<float>(random.between(0.2, 1)),
                          static_cast<float>(random.between(0.2, 1)));
        const auto range = static_cast<float>(random.below(12) == 0 ? 0 : std::exp(random.between(-4, 3.5)));
        const auto outer = static_cast<float>(random.between(0.01, 1.57));
        const auto strength = static_cast<float>(range > 0 ? 0.4 * range * range : 0.3);
        if (cones && random.below(3) == 0)
            scene.addSpotLight(at, random.in(1) + Vec3d(0, 1e-3, 0), color, strength, 0.5f * outer, outer, range);
        else
            scene.addPointLight(at, color, strength, range);
    }
    return scene.take();
}

TEST_F(LightTest, WhatClustersLeaveAwayGivesNothing) {
    int lit = 0;
    for (unsigned seed = seedOr(1), end = std::getenv("TESSERA_SEED") ? seed + 1 : 17; seed < end; ++seed) {
        SCOPED_TRACE(testing::Message() << "TESSERA_SEED=" << seed
                                        << " unit_draw --gtest_filter=LightTest.WhatClusters*");
        Random random(seed);
        const int lights = std::array{1, 5, 40, 300}[static_cast<std::size_t>(random.below(4))];
        const Aspect aspect = randomHall(random, lights);
        View view;
        view.position = Vec3d(random.between(-2, 2), random.between(-0.5, 1), random.between(-20, 2));
        view.orientation = Quatd(Eigen::AngleAxisd(random.between(-0.6, 0.6), Vec3d(0.2, 1, 0.1).normalized()));
        view.worldUnitsPerMetre = std::exp(random.between(-0.7, 0.7));
        // Two cells wide; the eye beside the middle.
        const ScreenCamera camera =
            cameraOf(1400, 330, Vec3d(random.between(-1, 1), random.between(-0.3, 0.3), 2.0), 3.2, view);
        const PixelRect part{.x = random.below(900), .y = random.below(100), .width = 500, .height = 230};
        const int samples = random.below(2) ? 4 : 1;
        const Picture clustered = drawPart(aspect, camera, part, {.samples = samples});
        const Picture all = drawPart(aspect, camera, part, {.samples = samples, .clusterLights = false});
        EXPECT_EQ(differing(clustered, all), 0u);
        for (const std::uint8_t byte : clustered.rgb) lit += byte > 60;
    }
    EXPECT_GT(lit, 100000) << "pictures of darkness prove nothing";
}

TEST_F(LightTest, FewLightsGiveWhatListsOfThemGive) {
    int lit = 0;
    for (unsigned seed = seedOr(1), end = std::getenv("TESSERA_SEED") ? seed + 1 : 9; seed < end; ++seed) {
        SCOPED_TRACE(testing::Message() << "TESSERA_SEED=" << seed << " unit_draw --gtest_filter=LightTest.Few*");
        Random random(seed);
        // As many lamps as there is room for, one more, fewer.
        const Aspect aspect = randomHall(random, 1 + static_cast<int>(seed % 5), false, seed % 3 != 0);
        const ScreenCamera camera = cameraOf(900, 330, Vec3d(random.between(-1, 1), 0.2, 2.0), 3.2, View());
        const PixelRect part{.x = random.below(400), .y = random.below(100), .width = 450, .height = 200};
        const int samples = random.below(2) ? 4 : 1;
        const Picture few = drawPart(aspect, camera, part, {.samples = samples});
        const Picture all = drawPart(aspect, camera, part, {.samples = samples, .clusterLights = false});
        EXPECT_EQ(differing(few, all), 0u);
        for (const std::uint8_t byte : few.rgb) lit += byte > 60;
    }
    EXPECT_GT(lit, 50000) << "pictures of darkness prove nothing";
}

/// Random balls and boxes of space beside the lists: whoever can reach a point of a cluster stands in its list.
TEST(LightClusters, NameWhoeverReachesAPixel) {
    Random random(seedOr(5));
    std::size_t reached = 0, named = 0;
    for (int round = 0; round < 40; ++round) {
        const View view{.position = random.in(3),
                        .orientation = Quatd(Eigen::AngleAxisd(random.between(-3, 3), random.in(1).normalized())),
                        .worldUnitsPerMetre = std::exp(random.between(-3, 3))};
        const ScreenCamera screen =
            cameraOf(2300, 1300, {random.between(-1, 1), random.between(-1, 1), 1.5}, 3.2, view);
        std::vector<LightItem> lights(200);
        for (LightItem& light : lights) {
            light.kind = random.below(2) ? LightItem::Kind::kSpot : LightItem::Kind::kPoint;
            light.position = view.position + view.worldUnitsPerMetre *
                                                 (view.orientation * Vec3d(random.between(-9, 9), random.between(-6, 6),
                                                                           random.between(-30, 3)));
            light.direction = random.in(1).normalized();
            light.outerAngle = static_cast<float>(random.between(0.01, 1.57));
            light.range = static_cast<float>(view.worldUnitsPerMetre * std::exp(random.between(-3, 2.5)));
        }
        LightClusters clusters;
        clusters.collect(lights, screen);
        ASSERT_EQ(clusters.everywhere(), 0u);
        for (const CellPart& cell : cellsOf(screen, {.x = 0, .y = 0, .width = 2300, .height = 1300})) {
            clusters.assign(cell.camera, {.x = 0, .y = 0, .width = 1024, .height = 576});
            const auto [scale, offset] = clusters.sliceScaleAndOffset();
            const Mat4d eye_T_clip = cell.camera.clip_T_eye.inverse();
            for (int i = 0; i < 300; ++i) {
                const double x = random.between(0, 1024), y = random.between(0, 576);
                Vec4d ray = eye_T_clip * Vec4d(2 * x / 1024 - 1, 2 * y / 576 - 1, 0, 1);
                const Vec3d towards = ray.head<3>() / ray.w();
                const double depth = std::exp(random.between(-3, 3.6));
                const Vec3d point = towards * (depth / -towards.z());
                const int slice = std::clamp(
                    static_cast<int>(std::floor(std::log2(static_cast<float>(depth)) * scale + offset)), 0, 31);
                const auto cluster =
                    static_cast<std::size_t>((slice * 9 + static_cast<int>(y) / 64) * 16 + static_cast<int>(x) / 64);
                const std::uint32_t from = clusters.lists()[2 * cluster], count = clusters.lists()[2 * cluster + 1];
                named += count;
                for (std::uint32_t k = 0; k < lights.size(); ++k) {
                    const Vec3d away = point - screen.eye_T_world * lights[k].position;
                    if (away.norm() >= lights[k].range / view.worldUnitsPerMetre) continue;
                    const Vec3d axis = (screen.eye_T_world.linear() * lights[k].direction).normalized();
                    if (lights[k].kind == LightItem::Kind::kSpot &&
                        away.normalized().dot(axis) < std::cos(lights[k].outerAngle))
                        continue;
                    ++reached;
                    bool found = false;
                    for (std::uint32_t at = 0; at < count; ++at) found = found || clusters.lists()[from + at] == k;
                    ASSERT_TRUE(found) << "round " << round << ", light " << k << ", TESSERA_SEED";
                }
            }
        }
    }
    EXPECT_GT(reached, 10000u);
    EXPECT_LT(named, 8 * reached) << "lists of everybody would be right, too";
}

TEST_F(LightTest, AHundredWeakLightsAreOneStrongOne) {
    const auto shade = [&](int count, float range) {
        TestScene scene;
        scene.setDark();
        Material matt;
        matt.baseColor = Vec4f(0.7f, 0.7f, 0.7f, 1);
        scene.place(scene.add(makeSheet(9, 9), scene.add(matt)), {0, 0, -3});
        for (int i = 0; i < count; ++i)
            scene.addPointLight({0, 0, -1.5}, Vec3f::Ones(), 1.0f / static_cast<float>(count), range);
        return center(draw(scene));
    };
    for (const float range : {0.0f, 4.0f}) {
        const Rgb one = shade(1, range);
        EXPECT_GT(one.g, 100);
        for (const int count : {17, 100, 1000}) expectNear(shade(count, range), one);
    }
}

/// What is infinitely far away has a way of its own as long as nothing else is there: a dark lamp somewhere takes it
/// away.
TEST_F(LightTest, SunsShineAloneAsAmongOthers) {
    Random random(seedOr(11));
    int lit = 0;
    for (const int samples : {1, 4}) {
        restart({.samples = samples});
        for (int suns = 1; suns <= 5; ++suns) {
            std::array<Picture, 2> pictures;
            std::vector<Vec3d> ways;
            for (int i = 0; i < suns; ++i) ways.push_back(random.in(1) + Vec3d(0, -0.2, -0.3));
            for (const bool lamp : {false, true}) {
                TestScene scene;
                Material gloss, glass;
                gloss.roughness = 0.3f;
                gloss.clearcoat = suns % 2 ? 0.7f : 0.0f;
                glass.baseColor = Vec4f(0.4f, 0.6f, 0.7f, 0.4f);
                scene.place(scene.add(makeSphere(0.8, 24), scene.add(gloss)), {-0.7, 0, -1});
                scene.place(scene.add(makeSphere(0.5, 24), scene.add(glass)), {0.8, 0, -0.8});
                for (const Vec3d& way : ways) scene.addDirectionalLight(way, Vec3f(1, 0.8f, 0.6f), 0.7f);
                if (lamp) scene.addPointLight({0, 0, 1}, Vec3f::Ones(), 0);
                pictures[lamp] = draw(scene);
            }
            for (std::size_t i = 0; i < pictures[0].rgb.size(); ++i) {
                ASSERT_NEAR(pictures[0].rgb[i], pictures[1].rgb[i], 1) << "byte " << i << ", " << suns << " suns";
                lit += pictures[0].rgb[i] > 150;
            }
        }
    }
    EXPECT_GT(lit, 5000) << "pictures of darkness prove nothing";
}

/// KHR_lights_punctual in double, beside a directional light of that strength.
TEST_F(LightTest, PointsAndSpotsFallOffAsGltfSays) {
    Random random(seedOr(3));
    const auto shade = [&](auto&& light) {
        TestScene scene;
        scene.setDark();
        Material matt;
        matt.baseColor = Vec4f(0.6f, 0.6f, 0.6f, 1);
        matt.roughness = 0.9f;
        scene.place(scene.add(makeSheet(40, 40), scene.add(matt)), {0, 0, -3});
        light(scene);
        return center(draw(scene));
    };
    for (int i = 0; i < 60; ++i) {
        const double distance = std::exp(random.between(1.5, 3)), range = i % 3 ? distance * random.between(0.9, 3) : 0;
        const double outer = random.between(0.1, 1.4), inner = outer * random.between(0, 0.95),
                     angle = outer * random.between(0, 1.1);
        const bool spot = i % 2;
        // What the pixel beside the middle shows, as the eye at 2.4 before the screen sees it.
        const double beside = 0.5 * (3.2 / kSidePx) * (5.4 / 2.4);
        const Vec3d at(0, 0, -3 + distance), way = Vec3d(beside, -beside, -3) - at;
        const Vec3d axis(std::sin(angle), 0, -std::cos(angle));
        const double x = way.norm() / range, cosine = way.normalized().dot(axis);
        const double window = range > 0 ? std::clamp(1 - x * x * x * x, 0.0, 1.0) : 1;
        const double cone =
            std::clamp((cosine - std::cos(outer)) / std::max(0.001, std::cos(inner) - std::cos(outer)), 0.0, 1.0);
        const double arrives = 0.8 * distance * distance / way.squaredNorm() * window * (spot ? cone * cone : 1);
        const auto strength = static_cast<float>(0.8 * distance * distance);
        const Rgb wanted = shade(
            [&](TestScene& scene) { scene.addDirectionalLight(way, Vec3f::Ones(), static_cast<float>(arrives)); });
        const Rgb is = shade([&](TestScene& scene) {
            if (spot)
                scene.addSpotLight(at, axis, Vec3f::Ones(), strength, static_cast<float>(inner),
                                   static_cast<float>(outer), static_cast<float>(range));
            else
                scene.addPointLight(at, Vec3f::Ones(), strength, static_cast<float>(range));
        });
        EXPECT_NEAR(is.g, wanted.g, 1) << "distance " << distance << " range " << range << " angle " << angle << " of "
                                       << inner << " to " << outer;
    }
}

// OpenGL's 1 / (x + y d + z d²), beside a directional light of that strength; all 0: no falloff.
TEST_F(LightTest, LightsFallOffAsTheirAttenuationSays) {
    Random random(seedOr(4));
    const auto shade = [&](auto&& light) {
        TestScene scene;
        scene.setDark();
        Material matt;
        matt.baseColor = Vec4f(0.6f, 0.6f, 0.6f, 1);
        matt.roughness = 0.9f;
        scene.place(scene.add(makeSheet(40, 40), scene.add(matt)), {0, 0, -3});
        light(scene);
        return center(draw(scene));
    };
    for (int i = 0; i < 30; ++i) {
        const double distance = std::exp(random.between(1.5, 3)), beside = 0.5 * (3.2 / kSidePx) * (5.4 / 2.4);
        const Vec3d at(0, 0, -3 + distance), way = Vec3d(beside, -beside, -3) - at;
        Vec3d attenuation(i & 1 ? random.between(0.1, 3) : 0, i & 2 ? random.between(0.1, 3) : 0,
                          i & 4 ? random.between(0.1, 3) : 0);
        const double d = way.norm();
        const double fallen =
            attenuation.isZero() ? 1 : 1 / (attenuation.x() + attenuation.y() * d + attenuation.z() * d * d);
        const auto strength = static_cast<float>(0.8 / fallen);
        const Rgb wanted = shade([&](TestScene& scene) { scene.addDirectionalLight(way, Vec3f::Ones(), 0.8f); });
        const Rgb is = shade([&](TestScene& scene) {
            scene.addPointLight(at, Vec3f::Ones(), strength, 0, Vec3f(attenuation.cast<float>()));
        });
        EXPECT_NEAR(is.g, wanted.g, 1) << "distance " << d << ", attenuation " << attenuation.transpose();
    }
}

// A wall may stand in a world of any scale: what shaders compute in metres is what the core says in world units.
TEST(LightClusters, AttenuationIsInWorldUnitsWhateverTheScale) {
    Random random(seedOr(6));
    for (int i = 0; i < 200; ++i) {
        const View view{.worldUnitsPerMetre = std::exp(random.between(-6, 6))};
        const ScreenCamera screen = cameraOf(2300, 1300, {0, 0, 1.5}, 3.2, view);
        LightItem light;
        light.kind = LightItem::Kind::kPoint;
        light.attenuation = Vec3f(static_cast<float>(random.between(0, 2)), static_cast<float>(random.between(0, 2)),
                                  static_cast<float>(i % 2 ? random.between(0, 2) : 0));
        LightClusters clusters;
        clusters.collect(std::span(&light, 1), screen);
        const LightTexels& texels = clusters.lights()[0];
        const double world = std::exp(random.between(-3, 6)), metres = world / view.worldUnitsPerMetre;
        const double shader =
            texels.radiance[0] / (texels.falloff[0] + texels.falloff[1] * metres + texels.falloff[2] * metres * metres);
        const Vec3d said = light.attenuation.cast<double>();
        const double wanted = 1 / (said.x() + said.y() * world + said.z() * world * world);
        ASSERT_NEAR(shader / wanted, 1, 1e-5);
    }
}

TEST_F(LightTest, OneChangeOfLightCompilesNothingOnceAllIsPrepared) {
    for (const int samples : {1, 4}) {
        restart({.samples = samples});
        EXPECT_FALSE(renderer_->prepare()) << "nothing was drawn";
        std::uint64_t programs = 0;
        for (int step = 0; step < 7; ++step) {
            TestScene scene;
            Material gloss, glass;
            gloss.clearcoat = 1;
            glass.baseColor = Vec4f(0.4f, 0.6f, 0.7f, 0.4f);
            scene.place(scene.add(makeSphere(0.5, 12), scene.add(gloss)), {0, 0, -1});
            scene.place(scene.add(makeSheet(2, 2), scene.add(glass)), {0, 0, 0});
            for (int i = 0; i < step; ++i) scene.addDirectionalLight(Vec3d(0.1 * i, 0, -1), Vec3f::Ones(), 0.5f);
            for (int i = 0; step > 1 && i < step * step * step; ++i)
                scene.addPointLight({0.1 * i, 1, 1}, Vec3f::Ones(), 0.1f, step > 2 ? 2.5f : 0);
            if (step > 3) scene.addSpotLight({0, 2, 0}, -Vec3d::UnitY(), Vec3f::Ones(), 3, 0.2f, 0.6f, 5, step > 4);
            if (step == 6) scene.addDirectionalLight(-Vec3d::UnitY(), Vec3f::Ones(), 1, true);
            (void)draw(scene);
            if (step == 0) {
                const std::uint64_t needed = renderer_->lastCounts().programs;
                int pieces = 0;
                while (pieces < 1000 && renderer_->prepare()) ++pieces;
                programs = renderer_->lastCounts().programs;
                EXPECT_LT(2 * needed, programs) << "a first picture waits for nothing that it does not need";
                EXPECT_LE(programs - needed, static_cast<std::uint64_t>(pieces)) << "one at a time";
            }
            EXPECT_EQ(renderer_->lastCounts().programs, programs) << "step " << step;
            // Other surroundings of what is lit in this way.
            while (renderer_->prepare()) {
            }
            programs = renderer_->lastCounts().programs;
        }
        EXPECT_GT(programs, 3u);
    }
}

// A lamp beside a wall of a galaxy's size lights it as one beside a house does.
TEST_F(LightTest, FallsTheSameWayHoweverFarAwayAndLargeAllIs) {
    std::optional<Picture> near;
    for (const double scale : {1e3, 1e7, 1e10, 1e13}) {
        TestScene scene;
        scene.setDark();
        scene.addPointLight({0.4 * scale, 0.2 * scale, -0.6 * scale}, Vec3f::Ones(), 0.8f, 0, {1, 0, 0});
        Material matt;
        matt.roughness = 1;
        scene.place(scene.add(makeSheet(4 * scale, 4 * scale), scene.add(matt)), {0, 0, -scale});
        const Picture picture = draw(scene.take(), cameraOf(kSidePx, kSidePx));
        EXPECT_GT(center(picture).r, 30) << scale;
        if (!near) near = picture;
        for (int y = 4; y < kSidePx; y += 8)
            for (int x = 4; x < kSidePx; x += 8)
                EXPECT_NEAR(pixel(picture, x, y).r, pixel(*near, x, y).r, 2) << scale << " at " << x << ' ' << y;
    }
}

// Tiles of several screens, or eyes, in turn: each finds again what its last turn made.
TEST_F(LightTest, ScreensInTurnPrepareTheirLightsOnce) {
    Random random(7);
    const Aspect aspect = randomHall(random, 40);
    std::vector<ScreenCamera> cameras;
    for (int i = 0; i < 4; ++i) cameras.push_back(cameraOf(kSidePx, kSidePx, {0.1 * i, 0, 2.4}));
    std::vector<Picture> expected;
    for (const ScreenCamera& camera : cameras)
        expected.push_back(drawPart(aspect, camera, whole(camera), {.samples = 1}));
    restart({.samples = 1});
    for (int frame = 0; frame < 3; ++frame)
        for (std::size_t i = 0; i < cameras.size(); ++i) {
            EXPECT_EQ(draw(aspect, cameras[i]), expected[i]);
        }
    EXPECT_EQ(renderer_->lastCounts().lightsPrepared, cameras.size());
    // More than are kept: the one that has waited for longest is made anew.
    for (int i = 4; i < 12; ++i) (void)draw(aspect, cameraOf(kSidePx, kSidePx, {0.1 * i, 0, 2.4}));
    EXPECT_EQ(draw(aspect, cameras[0]), expected[0]);
    EXPECT_EQ(renderer_->lastCounts().lightsPrepared, 13u);
}

}  // namespace
}  // namespace tessera

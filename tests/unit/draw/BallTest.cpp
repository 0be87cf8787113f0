// Points are drawn as the balls that they are. They are judged by meshes of triangles: one that lies in each ball, one
// that holds it. Where both of them are as deep the ball is, too, and where one is not seen the ball may be or not: so
// the bound is no guess, but what the two differ by: kPixels of a pixel each way, and the height of the finest
// triangles' chords.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <random>

#include "client/render/cull/VisibilityDevice.h"
#include "tests/unit/draw/FineBalls.h"
#include "tests/unit/draw/RendererStage.h"

namespace tessera {
namespace {

using test::ballsOf;
using test::fineBall;
using test::levelFor;

/// Corners of triangles lie on a grid of 1/256 of a pixel; what a shader finds out in single precision is as near.
constexpr double kPixels = 0.02;
/// Of the depth itself: rounding.
constexpr float kDepths = 2e-5f;

/// One cloud, at one place.
struct Cloud {
    MeshData points{.primitive = Primitive::kPoints};
    Quatd turn = Quatd::Identity();
    Vec3d scale = Vec3d::Ones(), at = Vec3d::Zero();
    bool bothSides = false;

    [[nodiscard]] Vec3d centre(std::size_t i) const {
        return at + turn * scale.cwiseProduct(Vec3d(points.positions[3 * i], points.positions[3 * i + 1],
                                                    points.positions[3 * i + 2]));
    }
    [[nodiscard]] std::size_t count() const { return points.positions.size() / 3; }
};

enum class BallsAs { kPoints, kInner, kOuter, kMean };

class BallTest : public RendererTest {
protected:
    double between(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
    std::size_t below(std::size_t count) { return static_cast<std::size_t>(random_() % count); }
    static std::pair<unsigned, unsigned> seeds(unsigned rounds) {
        const char* one = std::getenv("TESSERA_SEED");
        const auto from = one ? static_cast<unsigned>(std::atoi(one)) : 0u;
        return {from, one ? from + 1 : rounds};
    }

    static double depthOf(const ScreenCamera& camera, const Vec3d& world) { return -(camera.eye_T_world * world).z(); }
    static double pixelsPerUnitAt(const ScreenCamera& camera, double depth) {
        return 0.5 * camera.clip_T_eye(0, 0) * camera.pixels.width / depth;
    }

    /// The same things by the same numbers. Of normals a colour each, and nothing of light, where `normals`.
    static Aspect sceneOf(const std::vector<Cloud>& clouds, const ScreenCamera& camera, BallsAs as,
                          bool normals = false) {
        return sceneOf(clouds, camera, std::vector<BallsAs>(clouds.size(), as), normals);
    }
    static Aspect sceneOf(const std::vector<Cloud>& clouds, const ScreenCamera& camera,
                          const std::vector<BallsAs>& ways, bool normals) {
        TestScene scene;
        scene.setEnvironment(Vec3f::Constant(0.3f), Vec3f::Constant(0.1f), Vec3f(0, 0, 0.4f));
        scene.addDirectionalLight({0.4, -0.8, -0.5}, {1, 0.9f, 0.8f}, 1);
        const ObjectId program = scene.add(
            SurfaceProgram{.surface = "void surface(inout Surface s) { s.base.rgb = 0.5 + 0.5 * normalize(s.normal); }",
                           .verdict = SurfaceProgram::kGood});
        for (std::size_t which = 0; which < clouds.size(); ++which) {
            const Cloud& cloud = clouds[which];
            const BallsAs as = ways[which];
            Material material{.doubleSided = cloud.bothSides, .unlit = normals};
            if (normals) material.program = program;
            const ObjectId paint = scene.add(material);
            MeshData mesh = cloud.points;
            if (as != BallsAs::kPoints) {
                // As fine as the largest on the screen wants it.
                double largest = 0;
                const double radius = cloud.points.pointRadius;
                for (std::size_t i = 0; i < cloud.count(); ++i)
                    largest = std::max(
                        largest,
                        radius * cloud.scale.cwiseAbs().maxCoeff() *
                            pixelsPerUnitAt(camera, std::max(0.05, depthOf(camera, cloud.centre(i)) - radius)));
                const int level = levelFor(0.03 / std::max(largest, 1.0));
                mesh = ballsOf(cloud.points, level, [&](std::size_t i) {
                    const double pixel = std::max(0.05, depthOf(camera, cloud.centre(i))) / pixelsPerUnitAt(camera, 1);
                    const double more = kPixels * pixel / cloud.scale.cwiseAbs().minCoeff() + 1e-6 * radius;
                    return as == BallsAs::kInner   ? radius - more
                           : as == BallsAs::kOuter ? (radius + more) / fineBall(level).within
                                                   : 0.5 * radius * (1 + 1 / fineBall(level).within);
                });
            }
            scene.place(scene.add(mesh, paint), cloud.at, cloud.turn, cloud.scale);
        }
        return scene.take();
    }

    struct Seen {
        std::vector<float> depths;       ///< the farthest of each pixel's samples
        std::vector<std::uint64_t> ids;  ///< of pixels' middles, from above
    };
    Seen look(const Aspect& aspect, const ScreenCamera& camera) {
        Seen seen;
        const DrawList list = listOf(aspect, camera);
        VisibilityDevice& device = renderer_->visibility();
        const auto parts = device.partsOf(camera, whole(camera));
        EXPECT_EQ(parts.size(), 1u) << "one cell";
        EXPECT_TRUE(device.begin(parts[0]));
        EXPECT_TRUE(device.drawDepth(list.opaque));
        const auto depths = device.farthest();
        EXPECT_TRUE(depths);
        seen.depths.assign(depths->begin(), depths->end());
        seen.ids = renderer_->drawNodeIds(aspect, list, camera, whole(camera)).value();
        return seen;
    }

    /// A cloud may be where it is in front if it is as large as it may be, and all others as small: most often neither
    /// matters.
    std::size_t idsThatCannotBe(const std::vector<Cloud>& clouds, const ScreenCamera& camera,
                                const std::vector<std::uint64_t>& seen, const std::vector<std::uint64_t>& inner,
                                const std::vector<std::uint64_t>& outer) {
        std::vector<std::size_t> left;
        for (std::size_t i = 0; i < seen.size(); ++i)
            if (seen[i] != inner[i] && seen[i] != outer[i]) left.push_back(i);
        for (std::size_t k = 0; k < clouds.size() && !left.empty(); ++k) {
            std::vector<BallsAs> ways(clouds.size(), BallsAs::kInner);
            ways[k] = BallsAs::kOuter;
            const Seen one = look(sceneOf(clouds, camera, ways, false), camera);
            std::erase_if(left, [&](std::size_t i) { return one.ids[i] == seen[i]; });
        }
        return left.size();
    }

    /// `cut`: by the near plane.
    void expectBetween(const std::vector<Cloud>& clouds, const ScreenCamera& camera, bool cut = false) {
        const Seen inner = look(sceneOf(clouds, camera, BallsAs::kInner), camera),
                   outer = look(sceneOf(clouds, camera, BallsAs::kOuter), camera);
        const Seen seen = look(sceneOf(clouds, camera, BallsAs::kPoints), camera);
        std::size_t outside = 0, undecided = 0;
        float worst = 0;
        for (std::size_t i = 0; i < seen.depths.size(); ++i) {
            const float low = std::min(inner.depths[i], outer.depths[i]);
            // Where the near plane has cut open one of the two alone, the ball may reach up to that plane.
            const bool cutOpen = cut && low < 0.98f * std::max(inner.depths[i], outer.depths[i]);
            const float high = cutOpen ? 1.0f : std::max(inner.depths[i], outer.depths[i]);
            const float off = std::max(low - seen.depths[i], seen.depths[i] - high) - kDepths * high;
            outside += off > 0;
            worst = std::max(worst, off);
            undecided += high - low > 0.02f * high;
            shown_ += seen.depths[i] > 0;
        }
        EXPECT_EQ(outside, 0u) << "worst by " << worst;
        EXPECT_EQ(idsThatCannotBe(clouds, camera, seen.ids, inner.ids, outer.ids), 0u);
        undecided_ += undecided;
        pixels_ += seen.depths.size();
    }

    /// Its centre on a ray through the picture, so far before the eye.
    Vec3d inSight(const ScreenCamera& camera, double depth) {
        const Mat4d& clip = camera.clip_T_eye;
        const Vec3d eye((between(-1, 1) + clip(0, 2)) / clip(0, 0) * depth,
                        (between(-1, 1) + clip(1, 2)) / clip(1, 1) * depth, -depth);
        return camera.eye_T_world.inverse() * eye;
    }
    ScreenCamera someCamera() {
        View view;
        view.position = {between(-3, 3), between(-3, 3), between(-3, 3)};
        view.orientation = Quatd(
            Eigen::AngleAxisd(between(-3, 3), Vec3d(between(-1, 1), between(-1, 1), between(-1, 1)).normalized()));
        // Off the middle of its screen, on every other one far off.
        const double off = below(2) ? 0.4 : 2.0;
        return cameraOf(200, 130, {between(-off, off), between(-off, off), between(0.8, 2.4)}, 3.2, view);
    }
    /// Some balls of one size, beside and in each other.
    Cloud someCloud(const ScreenCamera& camera, double radiusPx, std::size_t count, bool stretched) {
        Cloud cloud;
        const double depth = std::exp(between(-0.5, 3));
        if (stretched)
            cloud.scale = Vec3d(between(0.2, 1), between(0.2, 1), below(2) ? 0.5 : -0.5);
        else if (below(2))
            cloud.scale = Vec3d::Constant(between(0.1, 3)).cwiseProduct(Vec3d(1, 1, below(2) ? 1 : -1));
        cloud.turn = Quatd(between(-1, 1), between(-1, 1), between(-1, 1), 0.3).normalized();
        cloud.at = inSight(camera, depth);
        const double radius = radiusPx / pixelsPerUnitAt(camera, depth) / cloud.scale.cwiseAbs().maxCoeff();
        cloud.points.pointRadius = radius;
        for (std::size_t i = 0; i < count; ++i) {
            const double reach = 0.5 * cloud.scale.cwiseAbs().maxCoeff() * depth;
            const Vec3d near = inSight(camera, depth + between(-0.1, 0.1) * reach);
            const Vec3d at = (cloud.turn.inverse() * (near - cloud.at)).cwiseQuotient(cloud.scale);
            // Nothing but those of `NearThePlane…` reach the near plane.
            if (depthOf(camera, near) - radius * cloud.scale.cwiseAbs().maxCoeff() < 0.1) continue;
            for (int k = 0; k < 3; ++k) cloud.points.positions.push_back(static_cast<float>(at[k]));
        }
        return cloud;
    }

    std::mt19937 random_;
    std::size_t shown_ = 0, undecided_ = 0, pixels_ = 0;
    double mean_ = 0;
};

// From a hundredth of a pixel to more than the screen; in each other, stretched, mirrored, seen from far aside.
TEST_F(BallTest, LieBetweenTheirFineMeshes) {
    const auto [from, to] = seeds(12);
    for (const int samples : {1, 4}) {
        restart({.samples = samples});
        for (unsigned seed = from; seed < to; ++seed) {
            SCOPED_TRACE(testing::Message() << samples << " samples; TESSERA_SEED=" << seed
                                            << " build/bin/unit_draw --gtest_filter='BallTest.LieBetween*'");
            random_.seed(seed);
            const ScreenCamera camera = someCamera();
            std::vector<Cloud> clouds;
            for (const double radiusPx : {0.05, 0.6, 3.0, 15.0, 60.0})
                clouds.push_back(someCloud(camera, radiusPx * between(0.5, 2),
                                           radiusPx < 1    ? 80
                                           : radiusPx < 10 ? 30
                                                           : 4,
                                           below(3) == 0));
            if (seed % 4 == 3) clouds = {someCloud(camera, 400, 2, below(2) == 0), clouds[2]};
            expectBetween(clouds, camera);
        }
    }
    if (std::getenv("TESSERA_SEED")) return;
    EXPECT_GT(shown_, pixels_ / 3) << "pictures of nothing prove nothing";
    EXPECT_LT(undecided_, pixels_ / 50) << "nor do bounds that hold everything";
}

// Cut by the near plane, or around the eye: what faces the eye ends there, and behind it is the inside, where that is
// shown.
TEST_F(BallTest, AtTheNearPlaneShowTheirInsidesIfBothSidesAreShown) {
    const auto [from, to] = seeds(24);
    std::size_t inside = 0;
    for (unsigned seed = from; seed < to; ++seed) {
        SCOPED_TRACE(testing::Message() << "TESSERA_SEED=" << seed
                                        << " build/bin/unit_draw --gtest_filter='BallTest.AtTheNear*'");
        restart({.samples = seed % 2 ? 4 : 1});
        random_.seed(seed);
        const ScreenCamera camera = someCamera();
        Cloud cloud;
        cloud.bothSides = seed % 3 != 0;
        cloud.at = inSight(camera, between(0.02, 0.4));
        cloud.turn = Quatd(between(-1, 1), between(-1, 1), between(-1, 1), 0.3).normalized();
        if (below(2)) cloud.scale = Vec3d(between(0.3, 1), between(0.3, 1), -0.6);
        cloud.points.positions = {0, 0, 0};
        cloud.points.pointRadius = std::exp(between(-3, 1));
        expectBetween({cloud}, camera, true);
        inside += cloud.bothSides && shown_ > 0;
    }
    if (!std::getenv("TESSERA_SEED")) {
        EXPECT_GT(inside, 8u);
    }
}

// Whoever stands on a planet sees ground, up to where something stands on it: from below upwards ground, that thing,
// and nothing of the ground again.
TEST_F(BallTest, FromRightAboveALargeOneItsSurfaceIsSmooth) {
    for (const double radius : {1e5, 1e7, 1e8, 1e9, 1e11})
        for (const bool stretched : {false, true}) {
            const double height = std::max(20.0, 4e-7 * radius);
            TestScene scene;
            scene.setDark();
            MeshData point{.primitive = Primitive::kPoints};
            point.positions = {0, 0, 0};
            point.pointRadius = stretched ? 0.5 * radius : radius;
            const ObjectId ground = scene.place(scene.add(point), {0, -radius - height, 0}, Quatd::Identity(),
                                                stretched ? Vec3d(2.2, 2, 2) : Vec3d(1, 1, 1));
            const ObjectId sheet = scene.place(scene.add(makeSheet(100 * height, 100 * height)), {0, 0, -10 * height});
            const Aspect aspect = scene.take();
            const ScreenCamera camera = cameraOf(128, 128);
            const auto ids = renderer_->drawNodeIds(aspect, listOf(aspect, camera), camera, whole(camera));
            ASSERT_TRUE(ids);
            int wrong = 0, grounds = 0;
            for (std::size_t x = 0; x < 128; ++x)
                for (std::size_t y = 1; y < 128; ++y) {
                    const std::uint64_t above = (*ids)[(y - 1) * 128 + x], here = (*ids)[y * 128 + x];
                    grounds += here == ground.value;
                    wrong += (above == ground.value && here != ground.value) ||
                             (here != ground.value && here != sheet.value);
                }
            EXPECT_EQ(wrong, 0) << radius << (stretched ? " stretched" : "");
            EXPECT_NEAR(grounds, 128 * 54, 128 * 12) << radius << (stretched ? " stretched" : "");
        }
}

// Each is a node, so that pixels are known to show the same one. A pixel shows the normal where its middle is: off by
// no more than its place on the ball is, which near the outline is by the root of it; and by two bytes' rounding.
TEST_F(BallTest, HaveTheirOwnNormals) {
    const auto [from, to] = seeds(6);
    std::size_t compared = 0;
    for (unsigned seed = from; seed < to; ++seed) {
        SCOPED_TRACE(testing::Message() << "TESSERA_SEED=" << seed
                                        << " build/bin/unit_draw --gtest_filter='BallTest.HaveTheir*'");
        random_.seed(seed);
        const ScreenCamera camera = someCamera();
        std::vector<Cloud> clouds;
        std::vector<double> radii;
        while (clouds.size() < 24) {
            radii.push_back(std::exp(between(0.7, 4)));
            clouds.push_back(someCloud(camera, radii.back(), 1, below(3) == 0));
            if (clouds.back().count() == 0) clouds.pop_back(), radii.pop_back();
        }
        struct Half {
            Picture picture;
            std::vector<std::uint64_t> ids;
        };
        const auto half = [&](BallsAs as) {
            const Aspect aspect = sceneOf(clouds, camera, as, true);
            const DrawList list = listOf(aspect, camera);
            return Half{renderer_->draw(aspect, list, camera, whole(camera)).value(),
                        renderer_->drawNodeIds(aspect, list, camera, whole(camera)).value()};
        };
        const Half balls = half(BallsAs::kPoints), meshes = half(BallsAs::kMean);
        std::size_t others = 0;
        for (std::size_t i = 0; i < balls.ids.size(); ++i) {
            if (balls.ids[i] == 0 || meshes.ids[i] == 0) continue;
            if (balls.ids[i] != meshes.ids[i]) {
                ++others;
                continue;
            }
            double apart = 0;
            for (std::size_t k = 0; k < 3; ++k) {
                const auto linear = [](std::uint8_t byte) {
                    return byte <= 10 ? byte / 255.0 / 12.92 : std::pow((byte / 255.0 + 0.055) / 1.055, 2.4);
                };
                apart +=
                    std::pow(2 * (linear(balls.picture.rgb[3 * i + k]) - linear(meshes.picture.rgb[3 * i + k])), 2);
            }
            const double off = 0.03 / 2 + kPixels / 2;  // of a pixel, and a ball has two at least
            ASSERT_LT(std::sqrt(apart), 0.05 + std::sqrt(2 * off)) << i % 200 << ' ' << i / 200;
            mean_ += std::sqrt(apart);
            ++compared;
        }
        EXPECT_LT(others, 30u) << "where two of them meet";
    }
    EXPECT_LT(mean_ / static_cast<double>(compared), 0.012);
    if (!std::getenv("TESSERA_SEED")) {
        EXPECT_GT(compared, 20'000u);
    }
}

// With light, shadows, images, holes, layers, programs; as glass, whose both halves are seen. A pixel may be another
// where an outline comes past a sample, so few may be, and all of them together little.
TEST_F(BallTest, LookLikeTheirFineMeshes) {
    const auto [from, to] = seeds(8);
    std::size_t shown = 0;
    for (unsigned seed = from; seed < to; ++seed) {
        SCOPED_TRACE(testing::Message() << "TESSERA_SEED=" << seed
                                        << " build/bin/unit_draw --gtest_filter='BallTest.LookLike*'");
        restart({.samples = seed % 2 ? 4 : 1});
        const ScreenCamera camera = cameraOf(200, 130, {0.3, 0.1, 2.4});
        const auto drawn = [&](bool balls) {
            random_.seed(seed);
            TestScene scene;
            scene.setEnvironment(Vec3f::Constant(0.3f), Vec3f::Constant(0.1f), Vec3f(0.1f, 0.2f, 0.5f));
            scene.addDirectionalLight({0.4, -0.8, -0.5}, {1, 0.9f, 0.8f}, 1, seed % 3 == 0);
            scene.addPointLight({0.5, 1, 1}, {0.6f, 0.8f, 1}, 2, 6);
            std::vector<std::uint8_t> pixels;
            for (int i = 0; i < 16 * 16; ++i)
                pixels.insert(pixels.end(), {static_cast<std::uint8_t>(16 * (i % 16)), static_cast<std::uint8_t>(i),
                                             128, static_cast<std::uint8_t>(i % 5 ? 255 : 40)});
            Image image{.pixels = Blob::of(std::span<const std::uint8_t>(pixels)), .widthPx = 16, .heightPx = 16};
            const ObjectId first = scene.add(image);
            image.texcoordSet = 1;
            const ObjectId second = scene.add(image);
            const ObjectId layer =
                scene.addCore(TextureLayer{.image = first, .strength = 0.7f, .source = TextureLayer::kPosition});
            const ObjectId program = scene.add(
                SurfaceProgram{.surface = "void surface(inout Surface s) { s.base.rgb *= 0.6 + 0.4 * sin(9.0 * "
                                          "nodePosition); s.roughness = 0.5 + 0.3 * sin(worldPosition.x); }",
                               .verdict = SurfaceProgram::kGood});
            scene.place(scene.add(makeSheet(6, 6)), {0, -0.9, -1.5}, Quatd(Eigen::AngleAxisd(-1.4, Vec3d::UnitX())));
            for (int kind = 0; kind < 7; ++kind) {
                Material m;
                m.baseColor = Vec4f(static_cast<float>(between(0.3, 1)), static_cast<float>(between(0.3, 1)), 0.8f,
                                    kind == 1 ? 0.5f : 1);
                m.metallic = static_cast<float>(between(0, 1));
                m.roughness = static_cast<float>(between(0.4, 1));
                m.doubleSided = seed / 2 % 2;
                if (kind == 1) m.alphaMode = Material::kBlend;
                if (kind == 2) m.alphaMode = Material::kMask;
                if (kind == 2 || kind == 3) m.baseColorImage = kind == 2 ? first : second;
                if (kind == 4) m.metallicRoughnessImage = m.emissiveImage = second;
                if (kind == 5) m.layers.push_back(layer);
                if (kind == 6) m.program = program;
                MeshData points{.primitive = Primitive::kPoints, .pointRadius = between(0.03, 0.25)};
                const bool normals = below(3) == 0, colors = below(3) > 0;
                for (int i = 0; i < 8; ++i) {
                    // Glass balls lie apart: triangles of two that meet are sorted otherwise than halves of balls.
                    const Vec3d at = kind == 1 ? Vec3d(0.55 * (i % 4) - 0.8, 0.55 * (i / 4) - 0.3, 0)
                                               : Vec3d(between(-0.7, 0.7), between(-0.7, 0.7), between(-0.7, 0.7));
                    for (int k = 0; k < 3; ++k) points.positions.push_back(static_cast<float>(at[k]));
                    for (int k = 0; normals && k < 3; ++k) points.normals.push_back(static_cast<float>(between(-1, 1)));
                    for (int k = 0; colors && k < 4; ++k)
                        points.colors.push_back(static_cast<std::uint8_t>(k < 3 ? random_() : 255));
                    for (int k = 0; k < 2; ++k) points.texcoords.push_back(static_cast<float>(between(-2, 2)));
                    for (int k = 0; k < 2; ++k) points.texcoords1.push_back(static_cast<float>(between(-2, 2)));
                }
                const double radius = points.pointRadius;
                const MeshData meshes = ballsOf(points, kind == 1 ? 4 : 5, [&](std::size_t) {
                    return 0.5 * radius * (1 + 1 / fineBall(kind == 1 ? 4 : 5).within);
                });
                const Quatd turn = Quatd(between(-1, 1), between(-1, 1), between(-1, 1), 0.3).normalized();
                const Vec3d scale = below(2) ? Vec3d(between(0.4, 1), between(0.4, 1), below(2) ? 0.6 : -0.6)
                                             : Vec3d::Constant(between(0.5, 1)).eval();
                scene.place(scene.add(balls ? points : meshes, scene.add(m)),
                            {between(-1, 1), between(-0.6, 0.6), between(-2, 0.5)}, turn, scale);
            }
            return draw(scene.take(), camera);
        };
        const Picture balls = drawn(true), meshes = drawn(false);
        std::size_t others = 0;
        double sum = 0;
        for (std::size_t i = 0; i < balls.rgb.size(); i += 3) {
            int apart = 0;
            for (std::size_t k = 0; k < 3; ++k) apart = std::max(apart, std::abs(balls.rgb[i + k] - meshes.rgb[i + k]));
            others += apart > 24;
            sum += apart;
        }
        const double count = 200 * 130;
        EXPECT_LT(static_cast<double>(others), 0.002 * count);
        EXPECT_LT(sum, 0.3 * count);
        for (std::size_t i = 0; i < balls.rgb.size(); i += 3) shown += balls.rgb[i] != balls.rgb[0];
    }
    if (!std::getenv("TESSERA_SEED")) {
        EXPECT_GT(shown, 50'000u);
    }
}

}  // namespace
}  // namespace tessera

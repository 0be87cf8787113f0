// Light from a picture of all around, beside sums over its pixels in double.
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>

#include "client/draw/store/EnvironmentLight.h"
#include "tests/support/words/Words.h"
#include "tests/unit/draw/RendererStage.h"

namespace tessera {
namespace {

constexpr double kPi = std::numbers::pi;
using Sky = std::function<Vec3d(const Vec3d&)>;

/// As shaders do: what a white surface with this normal reflects.
Vec3d diffuseOf(const EnvironmentLight& light, const Vec3d& n) {
    const std::array<double, 9> basis = {1,
                                         n.y(),
                                         n.z(),
                                         n.x(),
                                         n.x() * n.y(),
                                         n.y() * n.z(),
                                         3 * n.z() * n.z() - 1,
                                         n.x() * n.z(),
                                         n.x() * n.x() - n.y() * n.y()};
    Vec3d sum = Vec3d::Zero();
    for (std::size_t i = 0; i < 9; ++i) sum += basis[i] * light.harmonics()[i].cast<double>();
    return sum.cwiseMax(0.0);
}

/// The direction of a pixel, written out from what Environment::image says.
Vec3d directionAt(double x, double y, double width, double height) {
    const double round = (x / width - 0.5) * 2 * kPi, down = y / height * kPi;
    return {std::sin(down) * std::sin(round), std::cos(down), -std::sin(down) * std::cos(round)};
}

Image pictureOf(const Sky& sky, int width = 256) {
    const int height = width / 2;
    std::vector<std::uint8_t> pixels;
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const Vec3d value = sky(directionAt(x + 0.5, y + 0.5, width, height));
            int exponent = 0;
            (void)std::frexp(value.maxCoeff() * 1.002, &exponent);
            for (int c = 0; c < 3; ++c)
                pixels.push_back(static_cast<std::uint8_t>(std::lround(std::ldexp(value[c], 8 - exponent))));
            pixels.push_back(static_cast<std::uint8_t>(exponent + 128));
        }
    }
    return Image{.pixels = Blob::of(std::span<const std::uint8_t>(pixels)),
                 .widthPx = width,
                 .heightPx = height,
                 .encoding = Image::kRgbe};
}

/// Sum over the sphere of value · weight · solid angle, and of weight · solid angle.
struct Sums {
    Vec3d value = Vec3d::Zero();
    double weight = 0;
};
Sums integrate(const Sky& sky, const std::function<double(const Vec3d&)>& weight, int rows = 400) {
    Sums sums;
    for (int y = 0; y < rows; ++y) {
        const double solid = (std::cos(kPi * y / rows) - std::cos(kPi * (y + 1) / rows)) * kPi / rows;
        for (int x = 0; x < 2 * rows; ++x) {
            const Vec3d d = directionAt(x + 0.5, y + 0.5, 2 * rows, rows);
            const double w = weight(d) * solid;
            if (w <= 0) continue;
            sums.value += w * sky(d);
            sums.weight += w;
        }
    }
    return sums;
}

Vec3d smoothSky(const Vec3d& d) {
    return Vec3d(1 + 0.5 * d.y(), 1 + 0.4 * d.x() * d.z(), 1.5 - 0.4 * d.z() + 0.3 * (d.x() * d.x() - d.y() * d.y()));
}
Vec3d lampSky(const Vec3d& d) {
    const bool lamp = d.dot(Vec3d(0.48, 0.64, -0.6)) > std::cos(0.25);
    return lamp ? Vec3d(30, 24, 12) : Vec3d(0.1, 0.12, 0.2);
}

TEST(EnvironmentLight, InWhiteSurroundingsEverythingIsAsWhite) {
    const EnvironmentLight light =
        EnvironmentLight::of(pictureOf([](const Vec3d&) { return Vec3d(0.75, 0.75, 0.75); })).value();
    for (int i = 0; i < 50; ++i) {
        const Vec3d n = Vec3d(std::sin(1.3 * i), std::cos(2.1 * i), std::sin(0.7 * i + 1)).normalized();
        EXPECT_LT((diffuseOf(light, n) - Vec3d::Constant(0.75)).cwiseAbs().maxCoeff(), 2e-3) << i;
    }
    for (int level = 0; level < EnvironmentLight::kLevels; ++level)
        for (int at = 0; at < EnvironmentLight::kSides[static_cast<std::size_t>(level)]; ++at)
            EXPECT_LT((light.reflected(level, at, (7 * at) % 32) - Vec3d::Constant(0.75)).cwiseAbs().maxCoeff(), 2e-3)
                << level;
}

TEST(EnvironmentLight, DiffuseLightIsTheIntegralOverTheCosine) {
    const EnvironmentLight smooth = EnvironmentLight::of(pictureOf(smoothSky)).value();
    const EnvironmentLight lamp = EnvironmentLight::of(pictureOf(lampSky)).value();
    for (int i = 0; i < 12; ++i) {
        const Vec3d n = Vec3d(std::sin(1.3 * i), std::cos(2.1 * i), std::sin(0.7 * i + 1)).normalized();
        const auto cosine = [&](const Vec3d& d) { return std::max(0.0, d.dot(n)) / kPi; };
        // Of second order: the expansion is exact, but for the picture's bytes.
        EXPECT_LT((diffuseOf(smooth, n) - integrate(smoothSky, cosine).value).cwiseAbs().maxCoeff(), 0.01) << i;
        // A lamp's light is a cosine cut off at 0, of which orders 0 to 2 are off by up to 1/11 of its peak
        // (Ramamoorthi and Hanrahan 2001, of one direction).
        const Vec3d wanted = integrate(lampSky, cosine).value;
        const double peak = 30 * (1 - std::cos(0.25)) * 2;
        EXPECT_LT(std::abs(diffuseOf(lamp, n).x() - wanted.x()), peak / 11 + 0.01) << i;
    }
}

TEST(EnvironmentLight, ReflectionsAreMeansOverTheLobeOfTheirRoughness) {
    for (const Sky& sky : {Sky(smoothSky), Sky(lampSky)}) {
        const EnvironmentLight light = EnvironmentLight::of(pictureOf(sky, 512)).value();
        double brightest = 0, before = 1e9;
        for (int level = 1; level < EnvironmentLight::kLevels; ++level) {
            const int side = EnvironmentLight::kSides[static_cast<std::size_t>(level)];
            const double alpha2 = std::pow(EnvironmentLight::roughnessOf(level), 4);
            brightest = 0;
            for (int y = 0; y < side; ++y)
                for (int x = 0; x < side; ++x) brightest = std::max(brightest, light.reflected(level, x, y).x());
            EXPECT_LT(brightest, before) << "rougher, and brighter";
            before = brightest + 0.02;
            for (int i = 0; i < 6; ++i) {
                const int x = (11 * i + 3) % side, y = (17 * i + 9) % side;
                const Vec3d n = EnvironmentLight::directionOf(level, x, y);
                // GGX seen along the normal: half vectors lie half way.
                const Sums sums = integrate(sky, [&](const Vec3d& d) {
                    const double nl = d.dot(n), nh = std::sqrt(std::max(0.0, 0.5 * (1 + nl)));
                    const double q = nh * nh * (alpha2 - 1) + 1;
                    return nl > 0 ? nl * alpha2 / (q * q) : 0;
                });
                const Vec3d wanted = sums.value / sums.weight, is = light.reflected(level, x, y);
                EXPECT_LT((is - wanted).cwiseAbs().maxCoeff(), 0.02 * wanted.maxCoeff() + 0.02)
                    << "level " << level << " at " << x << ' ' << y << ": " << is.transpose() << " for "
                    << wanted.transpose();
            }
        }
    }
}

TEST(EnvironmentLight, PicturesThatAreNoneOfAllAroundAreRefusedWithTheReason) {
    Image image = pictureOf(smoothSky, 64);
    EXPECT_TRUE(EnvironmentLight::of(image));
    Image square = image;
    square.widthPx = square.heightPx = 45;
    EXPECT_WORDS(EnvironmentLight::of(square).error().message);
    square.widthPx = 32;
    square.heightPx = 64;
    EXPECT_WORDS(EnvironmentLight::of(square).error().message);
    image.pixels = Blob();
    EXPECT_FALSE(EnvironmentLight::of(image));
}

class EnvironmentTest : public RendererTest {
protected:
    static void surround(TestScene& scene, const Image& image, float strength = 1, float turn = 0) {
        Environment environment;
        environment.image = scene.add(image);
        environment.strength = strength;
        environment.turn = turn;
        environment.showImage = true;
        scene.addEnvironment(environment);
        scene.addDirectionalLight(-Vec3d::UnitZ(), Vec3f::Ones(), 0);
    }
};

TEST_F(EnvironmentTest, ThePictureIsSeenBehindEverythingAndTurns) {
    const Sky quarters = [](const Vec3d& d) {
        return Vec3d(d.x() > 0 ? 0.6 : 0.2, d.y() > 0 ? 0.5 : 0.1, d.z() > 0 ? 0.7 : 0.3);
    };
    for (const double turn : {0.0, 0.5 * kPi, 2.0}) {
        TestScene scene;
        surround(scene, pictureOf(quarters), 0.9f, static_cast<float>(turn));
        const ScreenCamera camera = cameraOf(kSidePx, kSidePx);
        const Picture picture = draw(scene.take(), camera);
        for (const auto& [x, y] : {std::pair{10, 10}, std::pair{50, 12}, std::pair{15, 55}, std::pair{53, 40}}) {
            const Vec3d away((x + 0.5 - 32) * 0.05, (32 - y - 0.5) * 0.05, -2.4);
            // Counter-clockwise seen from above; what is seen lay there before the turn.
            const Vec3d there = Eigen::AngleAxisd(-turn, Vec3d::UnitY()) * away.normalized();
            if (there.cwiseAbs().minCoeff() < 0.05) continue;
            expectNear(pixel(picture, x, y), expectedOf((0.9 * quarters(there)).cast<float>()));
        }
    }
}

TEST_F(EnvironmentTest, AMirrorShowsItAndAWhiteWallItsLight) {
    const EnvironmentLight light = EnvironmentLight::of(pictureOf(smoothSky)).value();
    for (const bool mirror : {true, false}) {
        TestScene scene;
        surround(scene, pictureOf(smoothSky), 0.4f);
        Material material;
        material.baseColor = mirror ? Vec4f(1, 1, 1, 1) : Vec4f(0.8f, 0.8f, 0.8f, 1);
        material.metallic = mirror ? 1 : 0;
        material.roughness = mirror ? 0 : 1;
        scene.place(scene.add(makeSheet(9, 9), scene.add(material)), {0, 0, -1});
        const Rgb is = center(draw(scene));
        const Vec3d back = (Vec3d(0.025, -0.025, 2.4)).normalized();
        if (mirror) {
            expectNear(is, expectedOf((0.4 * smoothSky(Vec3d(0, 0, 1))).cast<float>()));
            continue;
        }
        // What is not reflected at the surface: 4 % and a little more are, of about the same brightness.
        const Rgb least = expectedOf((0.4 * 0.8 * 0.93 * diffuseOf(light, Vec3d::UnitZ())).cast<float>());
        const Rgb most =
            expectedOf((0.4 * (0.8 * diffuseOf(light, Vec3d::UnitZ()) + 0.05 * smoothSky(back))).cast<float>());
        EXPECT_TRUE(is.r >= least.r - 1 && is.r <= most.r + 1) << is << ", " << least << " to " << most;
    }
}

TEST_F(EnvironmentTest, AWhiteFurnaceHidesWhateverIsNotDark) {
    TestScene scene;
    surround(scene, pictureOf([](const Vec3d&) { return Vec3d::Constant(0.5); }));
    for (int i = 0; i < 15; ++i) {
        Material white;
        white.baseColor = Vec4f(1, 1, 1, 1);
        white.roughness = 0.25f * static_cast<float>(i % 5);
        white.metallic = 0.5f * static_cast<float>(i / 5);
        scene.place(scene.add(makeSphere(0.25, 24), scene.add(white)),
                    {-1.2 + 0.6 * (i % 5), 0.8 - 0.7 * (i / 5) + 0.05 * (i % 5), -0.5});
    }
    const Picture picture = draw(scene);
    const Rgb white = expectedOf(Vec3f::Constant(0.5f));
    for (int y = 0; y < kSidePx; ++y)
        for (int x = 0; x < kSidePx; ++x) EXPECT_NEAR(pixel(picture, x, y).g, white.g, 2) << x << ' ' << y;
}

TEST_F(EnvironmentTest, WithoutAUsableImageSkyAndGroundStandInAndTheReasonIsSaid) {
    const auto with = [&](bool bad) {
        TestScene scene;
        Environment environment;
        if (bad)
            environment.image =
                scene.add(Image{.pixels = Blob::of(std::span<const std::uint8_t>(std::array<std::uint8_t, 16>{})),
                                .widthPx = 2,
                                .heightPx = 2});
        environment.showImage = bad;
        scene.addEnvironment(environment);
        scene.addDirectionalLight(-Vec3d::UnitZ(), Vec3f::Ones(), 0);
        scene.place(scene.add(makeSphere(0.5, 12)), {0, 0, -1});
        return draw(scene);
    };
    const Picture good = with(false);
    EXPECT_EQ(renderer_->lastCounts().trouble, "");
    while (renderer_->prepare()) {
    }
    const std::uint64_t programs = renderer_->lastCounts().programs;
    EXPECT_EQ(with(true), good);
    EXPECT_WORDS(renderer_->lastCounts().trouble);
    TestScene scene;
    surround(scene, pictureOf(smoothSky, 64));
    scene.place(scene.add(makeSphere(0.5, 12)), {0, 0, -1});
    EXPECT_NE(draw(scene), good);
    EXPECT_EQ(renderer_->lastCounts().programs, programs) << "a picture of surroundings compiles nothing";
}

}  // namespace
}  // namespace tessera

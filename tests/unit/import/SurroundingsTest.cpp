// Radiance pictures (.hdr), and surroundings in scene texts that take them.
#include <fmt/format.h>

#include <cmath>
#include <random>

#include "common/cores/DirectionalLight.h"
#include "common/cores/Environment.h"
#include "common/cores/Image.h"
#include "common/cores/PointLight.h"
#include "common/cores/SpotLight.h"
#include "server/import/reader/RadiancePicture.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/ImportFixture.h"

namespace tessera {
namespace {

using Pixels = std::vector<std::uint8_t>;

/// Rows with runs in them; no 1 1 1, which says something else in old files.
Pixels randomPixels(std::mt19937& random, std::size_t count) {
    Pixels pixels(4 * count);
    for (std::size_t i = 0; i < count; ++i)
        for (std::size_t c = 0; c < 4; ++c)
            pixels[4 * i + c] =
                i > 0 && random() % 3 != 0 ? pixels[4 * (i - 1) + c] : static_cast<std::uint8_t>(2 + random() % 253);
    return pixels;
}

std::string headOf(std::size_t width, std::size_t height, const std::string& more = "") {
    return fmt::format("#?RADIANCE\n# by hand\n{}FORMAT=32-bit_rle_rgbe\n\n-Y {} +X {}\n", more, height, width);
}

std::string flat(const Pixels& pixels) {
    return {reinterpret_cast<const char*>(pixels.data()), pixels.size()};
}

/// The newer runs: each of the four bytes by itself, lengths chosen at random.
std::string inRuns(const Pixels& pixels, std::size_t width, std::mt19937& random) {
    std::string out;
    for (std::size_t row = 0; row < pixels.size() / 4 / width; ++row) {
        out += {2, 2, static_cast<char>(width >> 8), static_cast<char>(width & 255)};
        for (std::size_t c = 0; c < 4; ++c) {
            const auto at = [&](std::size_t x) { return static_cast<char>(pixels[4 * (row * width + x) + c]); };
            for (std::size_t x = 0; x < width;) {
                std::size_t same = 1;
                while (x + same < width && same < 127 && at(x + same) == at(x)) ++same;
                if (same > 1 && random() % 4) {
                    out += {static_cast<char>(128 + same), at(x)};
                    x += same;
                    continue;
                }
                const std::size_t plain = std::min<std::size_t>(1 + random() % 128, width - x);
                out += static_cast<char>(plain);
                for (std::size_t i = 0; i < plain; ++i) out += at(x++);
            }
        }
    }
    return out;
}

/// The older ones: 1 1 1 n for the pixel before, n times.
std::string inOldRuns(const Pixels& pixels, std::size_t width) {
    std::string out;
    for (std::size_t i = 0; i < pixels.size() / 4;) {
        out.append(reinterpret_cast<const char*>(&pixels[4 * i]), 4);
        std::size_t same = 0;
        while ((i + 1 + same) % width != 0 && same < 600 && i + 1 + same < pixels.size() / 4 &&
               std::equal(&pixels[4 * i], &pixels[4 * i + 4], &pixels[4 * (i + 1 + same)]))
            ++same;
        if (same > 0) out += {1, 1, 1, static_cast<char>(same & 255)};
        if (same > 255) out += {1, 1, 1, static_cast<char>(same >> 8)};
        i += 1 + same;
    }
    return out;
}

Expected<DecodedImage> decoded(const std::string& file) {
    return decodeImage(asBytes(file), 1 << 20);
}

TEST(RadiancePictures, AreReadInAllTheirCodings) {
    std::mt19937 random(1);
    for (int round = 0; round < 60; ++round) {
        const std::size_t width = 1 + random() % 700, height = 1 + random() % 6;
        const Pixels pixels = randomPixels(random, width * height);
        std::vector<std::string> files = {flat(pixels), inOldRuns(pixels, width)};
        if (width >= 8) files.push_back(inRuns(pixels, width, random));
        for (const std::string& body : files) {
            const Expected<DecodedImage> image = decoded(headOf(width, height) + body);
            ASSERT_TRUE(image) << image.error().message << " round " << round;
            EXPECT_EQ(image->encoding, proto::scene::Image::RGBE);
            ASSERT_EQ(image->rgba.size(), pixels.size());
            EXPECT_TRUE(std::ranges::equal(image->rgba, std::as_bytes(std::span(pixels)))) << "round " << round;
        }
    }
}

TEST(RadiancePictures, WhatIsCutOffOrDamagedIsRefusedAndNothingElseHappens) {
    std::mt19937 random(2);
    const Pixels pixels = randomPixels(random, 40 * 6);
    for (const std::string& body : {flat(pixels), inRuns(pixels, 40, random), inOldRuns(pixels, 40)}) {
        const std::string file = headOf(40, 6) + body;
        for (std::size_t length = 0; length < file.size(); ++length) {
            const Expected<DecodedImage> image = decoded(file.substr(0, length));
            EXPECT_FALSE(image) << length << " of " << file.size();
        }
        for (int i = 0; i < 2000; ++i) {
            std::string other = file;
            for (int k = 0; k < 3; ++k) other[random() % other.size()] = static_cast<char>(random());
            (void)decoded(other);
        }
    }
    const auto why = [&](const std::string& file) { return decoded(file).error().message; };
    EXPECT_WORDS(why("#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\n...."));
    EXPECT_WORDS(why("#?RGBE\n\n+X 1 -Y 1\n...."));
    EXPECT_WORDS(why("#?RGBE\n\n-Y 99999 +X 99999\n...."));
    // By what its header says, whatever follows it: in a run's bytes this would be a gigabyte.
    const std::string large = why(headOf(32767, 8192) + std::string(1 << 20, '\2'));
    EXPECT_WORDS(large);
    for (const char* size : {"-Y -5 +X 3", "-Y 5 +X -3", "-Y +5 +X 3", "-Y 5 +X", "-Y 5 +X 3 2"})
        EXPECT_WORDS(why(fmt::format("#?RGBE\n\n{}\n....", size)));
    EXPECT_WORDS(why("#?RGBE\nEXPOSURE=0\n\n-Y 1 +X 1\n...."));
}

TEST(RadiancePictures, ExposuresAreTakenOutAndHalvesAreMeansOfLight) {
    const Pixels pixels = {200, 100, 50, 130, 20, 40, 80, 133, 200, 100, 50, 130, 20, 40, 80, 133};
    const auto linear = [](const DecodedImage& image, std::size_t pixel, int c) {
        return std::ldexp(std::to_integer<int>(image.rgba[4 * pixel + static_cast<std::size_t>(c)]),
                          std::to_integer<int>(image.rgba[4 * pixel + 3]) - 136);
    };
    const DecodedImage image = decoded(headOf(2, 2, "EXPOSURE=2\nEXPOSURE=1.5\n") + flat(pixels)).value();
    for (int c = 0; c < 3; ++c) {
        EXPECT_NEAR(linear(image, 0, c), std::ldexp(pixels[static_cast<std::size_t>(c)], -6) / 3, 0.01) << c;
        EXPECT_NEAR(linear(image, 1, c), std::ldexp(pixels[4 + static_cast<std::size_t>(c)], -3) / 3, 0.02) << c;
    }
    const DecodedImage half = decodeImage(asBytes(headOf(2, 2) + flat(pixels)), 1).value();
    ASSERT_EQ(half.widthPx, 1);
    for (int c = 0; c < 3; ++c) {
        const auto at = static_cast<std::size_t>(c);
        EXPECT_NEAR(linear(half, 0, c), 0.5 * (std::ldexp(pixels[at], -6) + std::ldexp(pixels[4 + at], -3)), 0.03) << c;
    }
}

constexpr char kText[] = R"(
    image { name: "studio" uri: "studio.hdr" }
    node { environment { image: "studio" strength: 0.5 turn_deg: 90 show_image: true gravity { y: -9.81 }
      exposure: -2.5 tone_map: AGX metered: true } }
    node { name: "sun" directional_light { intensity: 2 shadows: true } }
    node { name: "spot" spot_light { intensity: 3 range: 4 shadows: true } })";

TEST(Surroundings, TakeAnImageInASceneText) {
    std::mt19937 random(3);
    const Scratch scratch;
    const Pixels pixels = randomPixels(random, 16 * 8);
    scratch.write("studio.hdr", headOf(16, 8) + inRuns(pixels, 16, random));
    Expected<ImportedScene> scene = importScene(scratch.write("scene.tsct", kText), kRootNode, importOptions());
    ASSERT_TRUE(scene) << messageOf(scene);
    const ImportedAspect aspect(std::move(*scene));
    const auto* environment = aspect.core<Environment>("/environment");
    ASSERT_NE(environment, nullptr);
    EXPECT_FLOAT_EQ(environment->strength, 0.5f);
    EXPECT_NEAR(environment->turn, 0.5 * M_PI, 1e-6);
    EXPECT_TRUE(environment->showImage);
    EXPECT_FLOAT_EQ(environment->exposure, -2.5f);
    EXPECT_EQ(environment->toneMap, Environment::kAgx);
    EXPECT_TRUE(environment->metered);
    EXPECT_EQ(environment->gravity.y(), -9.81);
    const auto* image = aspect->get<Image>(environment->image);
    ASSERT_NE(image, nullptr);
    EXPECT_EQ(image->encoding, Image::kRgbe);
    EXPECT_EQ(image->widthPx, 16);
    EXPECT_TRUE(std::ranges::equal(image->pixels.bytes(), std::as_bytes(std::span(pixels))));
    EXPECT_TRUE(aspect.core<DirectionalLight>("/sun")->shadows);
    EXPECT_TRUE(aspect.core<SpotLight>("/spot")->shadows);
}

TEST(Surroundings, SayWhatIsWrongWithTheirImage) {
    std::mt19937 random(4);
    const Scratch scratch;
    const auto error = [&](const std::string& text) {
        return messageOf(importScene(scratch.write("scene.tsct", text), kRootNode, importOptions()));
    };
    scratch.write("studio.hdr", headOf(16, 16) + flat(randomPixels(random, 256)));
    const Expected<ImportedScene> square = importScene(scratch.write("scene.tsct", kText), kRootNode, importOptions());
    ASSERT_TRUE(square) << messageOf(square);
    ASSERT_EQ(square->faults.size(), 1u);
    EXPECT_WORDS(square->faults[0]);
    EXPECT_WORDS(error("node { environment { image: \"nowhere\" } }"));
    EXPECT_WORDS(error("node { environment { strength: -1 } }"));
}

// Light that takes light away is none: in a text, and in an edit.
TEST(Surroundings, AndLightsBelowNothingAreRefused) {
    const char* const cases[] = {"directional_light { color { r: 1 g: -0.5 } }",
                                 "directional_light { intensity: -2 }",
                                 "point_light { color { b: -1e-9 } }",
                                 "point_light { intensity: -1 }",
                                 "point_light { range: -1 }",
                                 "spot_light { color { r: -3 } }",
                                 "spot_light { intensity: -1 }",
                                 "environment { sky { r: -1 } }",
                                 "environment { ground { g: -1 } }",
                                 "environment { background { b: -1 } }"};
    const Scratch scratch;
    for (const char* const core : cases) {
        const std::string path = scratch.write("scene.tsct", fmt::format("node {{ name: \"x\" {} }}", core));
        const Expected<ImportedScene> scene = importScene(path, kRootNode, importOptions());
        ASSERT_FALSE(scene) << core;
        EXPECT_WORDS(scene.error().message) << core;
    }
    Aspect aspect;
    ChangeListBuilder list;
    list.create(ObjectId{2}, typeOf<PointLight>());
    list.set(ObjectId{2}, typeOf<PointLight>(), fieldId<&PointLight::color>, toValue(Vec3f(1, -1, 0)));
    const auto applied = aspect.apply(list.take());
    ASSERT_FALSE(applied);
    EXPECT_WORDS(applied.error().message);
}

}  // namespace
}  // namespace tessera

// What the first pass packs, and what it leaves of pictures before: beside the same things said another way.
#include <cstdlib>
#include <random>

#include "tests/unit/draw/RendererStage.h"

namespace tessera {
namespace {

class Packing : public RendererTest {
protected:
    double between(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
    static unsigned seedOr(unsigned otherwise) {
        const char* said = std::getenv("TESSERA_SEED");
        return said ? static_cast<unsigned>(std::atoi(said)) : otherwise;
    }

    std::mt19937 random_;
};

/// A thing of one colour has it from its material, packed before; one with colours of its own, all white, packs it
/// pixel by pixel.
TEST_F(Packing, OfOneColourIsThatOfWhiteVertices) {
    for (const int samples : {1, 4}) {
        restart({.samples = samples});
        for (unsigned seed = seedOr(1), end = std::getenv("TESSERA_SEED") ? seed + 1 : 9; seed < end; ++seed) {
            SCOPED_TRACE(testing::Message() << "TESSERA_SEED=" << seed << " unit_draw --gtest_filter=Packing.OfOne*");
            const auto things = [&](bool colored) {
                random_.seed(seed);
                TestScene scene;
                // More materials than the first word has room for.
                for (int i = 0; i < 150; ++i) {
                    Material paint;
                    const auto part = [&] {
                        return static_cast<float>(i % 9 == 0 ? std::round(between(0, 1)) : between(0, 1));
                    };
                    paint.baseColor = Vec4f(part(), part(), part(), 1);
                    paint.emissive = Vec3f::Constant(0.1f * part());
                    paint.metallic = part();
                    paint.roughness = part();
                    paint.unlit = i % 5 == 0;
                    MeshData ball = makeSphere(0.1, 8);
                    if (i % 3 == 0) ball.normals.clear();
                    if (colored) ball.colors.assign(ball.positions.size() / 3 * 4, 255);
                    scene.place(scene.add(ball, scene.add(paint)),
                                {between(-1.2, 1.2), between(-0.6, 0.6), between(-1, 0)});
                }
                scene.addDirectionalLight({0.4, -1, -0.5}, Vec3f::Ones(), 1);
                return scene.take();
            };
            const ScreenCamera camera = cameraOf(320, 160);
            const Picture one = draw(things(false), camera), white = draw(things(true), camera);
            ASSERT_TRUE(one == white);
        }
    }
}

/// Only what will be read is cleared, and that depends on whether the background is a picture.
TEST_F(Packing, KnowsNothingOfPicturesBefore) {
    const std::array<std::uint8_t, 32> texels{90, 120, 200, 128, 20, 70,  40, 128, 200, 30,  20, 129, 9,  9, 200, 128,
                                              70, 20,  60,  128, 20, 170, 40, 128, 20,  230, 20, 127, 90, 9, 20,  128};
    std::size_t pictures = 0;
    for (const int samples : {1, 4}) {
        restart({.samples = samples});
        // To make its light from a picture takes a renderer a second: this one never draws any other background.
        const auto surface = test::pooledSurface();
        const auto behindIsAPicture = Renderer::create(*surface, {.samples = samples}).value();
        for (unsigned seed = seedOr(1), end = std::getenv("TESSERA_SEED") ? seed + 1 : 8; seed < end; ++seed) {
            SCOPED_TRACE(testing::Message() << "TESSERA_SEED=" << seed << " unit_draw --gtest_filter=Packing.Knows*");
            random_.seed(seed);
            for (int round = 0; round < 4; ++round) {
                TestScene scene;
                Environment around;
                around.background = Vec3f(0.1f, 0.3f, 0.2f);
                const bool behind = between(0, 1) < 0.5;
                if (behind) {
                    around.image = scene.add(Image{.pixels = Blob::of(std::span<const std::uint8_t>(texels)),
                                                   .widthPx = 4,
                                                   .heightPx = 2,
                                                   .encoding = Image::kRgbe});
                    around.showImage = true;
                    ++pictures;
                }
                scene.addEnvironment(around);
                scene.addDirectionalLight({0.4, -1, -0.5}, Vec3f::Ones(), 1);
                const double size = std::exp(between(-3, 0.5));  // a part of the tile, or all of it
                scene.place(scene.add(makeSphere(size, 12)), {between(-1, 1), between(-0.5, 0.5), between(-1, 0)});
                const Aspect aspect = scene.take();
                const ScreenCamera camera = cameraOf(320, 160);
                RenderScene all;
                all.update(aspect, nullptr);
                const DrawList list = RenderAction(CullerKind::kFrustum).run(all, camera, whole(camera), nullptr);
                const auto freshSurface = test::pooledSurface();
                const auto fresh = Renderer::create(*freshSurface, {.samples = samples}).value();
                const auto expected = (behind ? behindIsAPicture : fresh)->draw(aspect, list, camera, whole(camera));
                const auto picture = renderer_->draw(aspect, list, camera, whole(camera));
                ASSERT_TRUE(expected && picture);
                ASSERT_TRUE(*expected == *picture) << "round " << round;
            }
        }
    }
    if (!std::getenv("TESSERA_SEED")) {
        EXPECT_GT(pictures, 10u);
    }
}

}  // namespace
}  // namespace tessera

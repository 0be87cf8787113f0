// What is left out because nothing is there: the picture is, to the bit, the one in which nothing is left out.
#include <cstdlib>
#include <random>

#include "client/draw/passes/ScreenBlocks.h"
#include "tests/unit/draw/RendererStage.h"

namespace tessera {
namespace {

unsigned emptySeedOr(unsigned otherwise) {
    const char* said = std::getenv("TESSERA_SEED");
    return said ? static_cast<unsigned>(std::atoi(said)) : otherwise;
}

class EmptyParts : public RendererTest {
protected:
    double between(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
    int below(int count) { return std::uniform_int_distribution<int>(0, count - 1)(random_); }
    Vec3d in(double side) { return {between(-side, side), between(-side, side), between(-side, side)}; }

    /// `none` says of no item where it is.
    static DrawList inFrustum(const Aspect& aspect, const ScreenCamera& camera) {
        RenderScene scene;
        scene.update(aspect, nullptr);
        return RenderAction(CullerKind::kFrustum).run(scene, camera, whole(camera), nullptr);
    }
    std::uint64_t pixelsGoneThrough(const Aspect& aspect, const ScreenCamera& camera) {
        EXPECT_TRUE(renderer_->draw(aspect, inFrustum(aspect, camera), camera, whole(camera)));
        return renderer_->lastCounts().pixels;
    }

    /// A few small things of each kind, on the screen, beside it, across its near plane, behind the eye.
    Aspect fewThings() {
        TestScene scene;
        scene.setEnvironment(Vec3f::Constant(0.3f), Vec3f::Constant(0.1f), Vec3f(0.1f, 0.2f, 1.3f));
        Material glass, holes;
        glass.baseColor = Vec4f(0.8f, 0.3f, 0.2f, 0.5f);
        glass.doubleSided = true;
        holes.alphaMode = Material::kMask;
        holes.emissive = Vec3f(0, 0.2f, 0);
        const std::array<ObjectId, 3> paints = {scene.add(Material()), scene.add(glass), scene.add(holes)};
        for (int i = 0, count = below(7); i < count; ++i) {
            const ObjectId paint = paints[static_cast<std::size_t>(below(3))];
            const double size = std::exp(between(-4, -0.5));
            ObjectId thing;
            if (const int kind = below(4); kind == 0) {
                const std::array<Vec3d, 4> ends{in(size), in(size), in(3 * size), in(size)};
                thing = scene.add(test::makeLines(ends, static_cast<float>(std::exp(between(-1, 4)))), paint);
            } else if (kind == 1) {
                MeshData points{.primitive = Primitive::kPoints, .pointRadius = std::exp(between(-5, -1))};
                for (int k = 0; k < 9; ++k)
                    for (const double value : in(size)) points.positions.push_back(static_cast<float>(value));
                thing = scene.add(points, paint);
            } else {
                thing = scene.add(kind == 2 ? makeSphere(size, 9) : makeSheet(3 * size, size), paint);
            }
            const double depth = below(5) ? -std::exp(between(-3, 3)) : between(-0.5, 4);
            const Vec3d scale(std::exp(between(-1, 1)), between(0.2, 2), below(4) ? 1 : -1);
            scene.place(thing, {between(-2.5, 2.5), between(-1.2, 1.2), depth},
                        Quatd(between(-1, 1), 0.3, between(-1, 1), 0.4).normalized(), scale);
        }
        return scene.take();
    }

    std::mt19937 random_;
};

TEST_F(EmptyParts, AreBackgroundToTheBit) {
    std::uint64_t shown = 0, pixels = 0;
    std::size_t items = 0;
    for (const int samples : {1, 4}) {
        const auto otherSurface = test::pooledSurface();
        const auto other = Renderer::create(*otherSurface, {.samples = samples, .leaveOutEmpty = false}).value();
        restart({.samples = samples});
        for (unsigned seed = emptySeedOr(1), end = std::getenv("TESSERA_SEED") ? seed + 1 : 120; seed < end; ++seed) {
            SCOPED_TRACE(testing::Message() << "TESSERA_SEED=" << seed << " unit_draw --gtest_filter=EmptyParts.Are*");
            random_.seed(seed);
            const Aspect aspect = fewThings();
            View view;
            view.orientation = Quatd(Eigen::AngleAxisd(between(-0.3, 0.3), in(1).normalized()));
            view.worldUnitsPerMetre = std::exp(between(-0.5, 0.5));
            // Four cells; a tile anywhere on them.
            const ScreenCamera camera = cameraOf(1290, 700, {between(-1, 1), between(-0.3, 0.3), 2}, 3.2, view);
            const PixelRect rect{
                .x = below(900), .y = below(400), .width = 100 + below(290), .height = 100 + below(200)};
            const DrawList list = inFrustum(aspect, camera);
            items += list.opaque.size() + list.transparent.size();
            const auto all = other->draw(aspect, list, camera, rect),
                       some = renderer_->draw(aspect, list, camera, rect);
            ASSERT_TRUE(all && some);
            ASSERT_TRUE(*all == *some);
            shown += renderer_->lastCounts().pixels;
            pixels += static_cast<std::uint64_t>(rect.width) * static_cast<std::uint64_t>(rect.height);
        }
    }
    if (std::getenv("TESSERA_SEED")) return;
    EXPECT_GT(items, 100u);
    EXPECT_GT(shown, pixels / 20) << "pictures of nothing prove nothing";
    EXPECT_LT(shown, pixels / 2) << "nothing left out proves nothing";
}

TEST_F(EmptyParts, AreNotGoneThrough) {
    const ScreenCamera camera = cameraOf(640, 320);
    TestScene nothing;
    nothing.setDark(Vec3f(0.2f, 0.5f, 0.02f));
    const Picture picture = draw(nothing.take(), camera);
    EXPECT_EQ(renderer_->lastCounts().pixels, 0u);
    expectNear(pixel(picture, 600, 20), expectedOf({0.2f, 0.5f, 0.02f}));
    TestScene ball;
    ball.place(ball.add(makeSphere(0.2, 9)), {0.16, 0.16, -0.1});
    const std::uint64_t gone = pixelsGoneThrough(ball.take(), camera);
    EXPECT_GT(gone, 64u * 64 - 1);
    EXPECT_LE(gone, 9u * 64 * 64) << "84 pixels across";
}

/// Beside blocks that are looked at one by one.
TEST_F(EmptyParts, BlocksAreThoseOfTheRectanglesInRectanglesThatLieApart) {
    for (int round = 0; round < 300; ++round) {
        random_.seed(emptySeedOr(7) + static_cast<unsigned>(round));
        const PixelRect within{
            .x = 64 * below(16), .y = 64 * below(9), .width = 64 * (1 + below(16)), .height = 64 * (1 + below(9))};
        const PixelRect tile{.x = within.x,
                             .y = within.y,
                             .width = std::min(within.width, 1024 - within.x),
                             .height = std::min(within.height, 576 - within.y)};
        ScreenBlocks blocks(tile);
        std::array<std::array<bool, 16>, 9> wanted{};
        for (int i = 0, count = below(6); i < count; ++i) {
            places::Rectangle f{};
            f.lowerX = between(-300, 1100), f.lowerY = between(-300, 700);
            f.upperX = f.lowerX + std::exp(between(0, 6)), f.upperY = f.lowerY + std::exp(between(0, 6));
            const bool anywhere = below(40) == 0;
            const int cellX = 1024 * below(5), cellY = 576 * below(5);
            places::Rectangle onScreen = f;
            onScreen.lowerX += cellX, onScreen.upperX += cellX, onScreen.lowerY += cellY, onScreen.upperY += cellY;
            if (anywhere) onScreen.upperX = std::numeric_limits<double>::quiet_NaN();
            blocks.add(onScreen, cellX, cellY);
            for (int row = 0; row < 9; ++row)
                for (int column = 0; column < 16; ++column) {
                    const bool meets = 64 * column <= f.upperX && 64 * (column + 1) > f.lowerX &&
                                       64 * row <= f.upperY && 64 * (row + 1) > f.lowerY;
                    const bool its = 64 * column >= tile.x && 64 * column < tile.x + tile.width && 64 * row >= tile.y &&
                                     64 * row < tile.y + tile.height;
                    if (its && (meets || anywhere))
                        wanted[static_cast<std::size_t>(row)][static_cast<std::size_t>(column)] = true;
                }
        }
        PixelRect pixels = tile;
        const int cut = below(60);
        pixels.x += cut, pixels.width -= cut, pixels.height -= below(60);
        std::vector<std::uint8_t> times(1024 * 576);
        for (const PixelRect& r : blocks.rectangles(pixels))
            for (int y = r.y; y < r.y + r.height; ++y)
                for (int x = r.x; x < r.x + r.width; ++x) ++times[static_cast<std::size_t>(1024 * y + x)];
        for (int y = 0; y < 576; ++y)
            for (int x = 0; x < 1024; ++x) {
                const bool own =
                    x >= pixels.x && y >= pixels.y && x < pixels.x + pixels.width && y < pixels.y + pixels.height;
                const bool is = own && wanted[static_cast<std::size_t>(y / 64)][static_cast<std::size_t>(x / 64)];
                ASSERT_EQ(times[static_cast<std::size_t>(1024 * y + x)], is) << x << ", " << y << " in round " << round;
            }
    }
}

}  // namespace
}  // namespace tessera

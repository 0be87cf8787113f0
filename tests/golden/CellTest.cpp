// The cells of which a screen's picture is made: huge walls, little memory, borders that nobody sees.
#include <array>
#include <cstdlib>
#include <random>

#include "client/draw/passes/ScreenCells.h"
#include "tests/golden/SeamScene.h"
#include "tests/golden/Stage.h"

namespace tessera::test {
namespace {

/// Of framebuffers with four samples: surface, depth, picture and its depth, what is blended, second colours.
constexpr double kBytesPerPixel = 4 * (8 + 4) + 4 + 4 + 4 * 4 + 4;

struct Scene {
    Aspect aspect;
    RenderScene scene;
    explicit Scene(bool coincident = true) : aspect(makeSeamScene(coincident)) { scene.update(aspect, nullptr); }
};

TEST(Cells, CoverARectangleOnceAndSeeWhatTheScreenSees) {
    std::mt19937 random(5);
    for (int i = 0; i < 200; ++i) {
        const auto upTo = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
        const int width = 1 + upTo(9000), height = 1 + upTo(5000);
        const ScreenCamera camera = cameraOf(width, height, {0.3, -0.2, 2});
        PixelRect rect{.x = upTo(width), .y = upTo(height), .width = 0, .height = 0};
        rect.width = 1 + upTo(width - rect.x);
        rect.height = 1 + upTo(height - rect.y);
        std::int64_t pixels = 0;
        for (const CellPart& cell : cellsOf(camera, rect)) {
            pixels += std::int64_t{cell.onScreen.width} * cell.onScreen.height;
            const int x = cell.onScreen.x - cell.inCell.x, y = cell.onScreen.y - cell.inCell.y;
            ASSERT_EQ(x % kCellWidthPx, 0);
            ASSERT_EQ(y % kCellHeightPx, 0);
            ASSERT_GE(cell.onScreen.x, rect.x);
            ASSERT_LE(cell.onScreen.x + cell.onScreen.width, rect.x + rect.width);
            ASSERT_LE(cell.inCell.x + cell.inCell.width, kCellWidthPx);
            ASSERT_LE(cell.inCell.y + cell.inCell.height, kCellHeightPx);
            const Vec4d p(0.4, -0.7, -3 - 0.1 * i, 1);
            const Vec4d all = camera.clip_T_eye * p, own = cell.camera.clip_T_eye * p;
            const double allX = (all.x() / all.w() + 1) / 2 * width, ownX = (own.x() / own.w() + 1) / 2 * kCellWidthPx;
            const double allY = (all.y() / all.w() + 1) / 2 * height;
            const double ownY = (own.y() / own.w() + 1) / 2 * kCellHeightPx;
            ASSERT_NEAR(ownX + x, allX, 1e-8);
            ASSERT_NEAR(ownY + y, allY, 1e-8);
            ASSERT_EQ(own.z(), all.z());
        }
        ASSERT_EQ(pixels, std::int64_t{rect.width} * rect.height);
    }
}

TEST(Cells, AWallOf32768By17280HasNoSeamsWhereFourTilesMeet) {
    const Scene scene;
    const ScreenCamera camera = cameraOf(32768, 17280, {0.1, 0.05, 2.4});
    Stage stage(4);
    // Tiles of 16384 × 8640: their common corner, which lies within a cell, and a corner of cells near it.
    for (const auto& [x, y] : {std::pair{16384, 8640}, std::pair{14 * kCellWidthPx, 14 * kCellHeightPx}}) {
        const PixelRect all{.x = x - 200, .y = y - 150, .width = 400, .height = 300};
        const Picture whole = drawPart(stage, scene.aspect, scene.scene, CullerKind::kNone, camera, all);
        EXPECT_GT(lookOf(whole).spread, 4) << "a picture without content proves nothing";
        for (int tile = 0; tile < 4; ++tile) {
            const PixelRect rect{.x = tile % 2 ? x : all.x, .y = tile / 2 ? y : all.y, .width = 200, .height = 150};
            Stage own(4);
            const Picture picture = drawPart(own, scene.aspect, scene.scene, CullerKind::kMasked, camera, rect);
            const Picture expected =
                cropOf(whole, {.x = rect.x - all.x, .y = rect.y - all.y, .width = 200, .height = 150});
            EXPECT_EQ(differingPixels(picture, expected), 0u) << x << ' ' << y << ", tile " << tile;
        }
    }
}

TEST(Cells, ARealCornerTileOfAHugeWallTakesTheMemoryOfItsPixels) {
    const Scene scene;
    const ScreenCamera camera = cameraOf(32768, 17280, {1.3, 0.75, 1.2});
    const PixelRect corner{.x = 32768 - 3840, .y = 17280 - 2160, .width = 3840, .height = 2160};
    Stage stage(4);
    const Picture tile = drawPart(stage, scene.aspect, scene.scene, CullerKind::kMasked, camera, corner);
    EXPECT_GT(lookOf(tile).spread, 2);
    EXPECT_LE(static_cast<double>(stage.renderer->bufferBytes()), 1.3 * kBytesPerPixel * 3840 * 2160);
    // Its lower left, as someone sees it who draws a window that reaches beyond it.
    const PixelRect window{.x = corner.x - 300, .y = corner.y - 200, .width = 900, .height = 700};
    Stage other(4);
    const Picture beside = drawPart(other, scene.aspect, scene.scene, CullerKind::kNone, camera, window);
    const Picture shared = cropOf(beside, {.x = 300, .y = 200, .width = 600, .height = 500});
    EXPECT_EQ(differingPixels(shared, cropOf(tile, {.x = 0, .y = 0, .width = 600, .height = 500})), 0u);
}

TEST(Cells, BuffersFollowTheTileAndNotTheWall) {
    const Scene scene;
    std::mt19937 random(1);
    for (const auto& [width, height] :
         {std::pair{960, 540}, std::pair{1280, 720}, std::pair{1920, 1080}, std::pair{2560, 1440}}) {
        for (const int wall : {2, 20}) {
            const ScreenCamera camera = cameraOf(wall * width, wall * height);
            const PixelRect corner{.x = (wall - 1) * width, .y = (wall - 1) * height, .width = width, .height = height};
            Stage stage(4);
            (void)drawPart(stage, scene.aspect, scene.scene, CullerKind::kFrustum, camera, corner);
            EXPECT_LE(static_cast<double>(stage.renderer->bufferBytes()), 1.3 * kBytesPerPixel * width * height)
                << width << " x " << height << " of " << wall;
        }
    }
}

/// The same part of the world within one cell and where four meet. What is rounded otherwise is so here and there, not
/// along the borders. (Of faces in one plane each cell shows another one in places, as each wall does.)
TEST(Cells, HaveBordersThatNobodySees) {
    const Scene scene(false);
    const PixelRect one{.x = 0, .y = 0, .width = kCellWidthPx, .height = kCellHeightPx};
    const PixelRect four{.x = kCellWidthPx / 2, .y = kCellHeightPx / 2, .width = one.width, .height = one.height};
    for (const int samples : {1, 4}) {
        Stage stage(samples);
        double anywhere = 0, beside = 0, all = 0, besideAll = 0;
        for (const Vec3d& eye : {Vec3d(0, 0, 2.4), Vec3d(0.3, 0.1, 2.2), Vec3d(-0.4, -0.2, 2.8), Vec3d(0.1, 0.35, 2),
                                 Vec3d(-0.2, 0.2, 3.1)}) {
            const ScreenCamera within = cameraOf(kCellWidthPx, kCellHeightPx, eye);
            const Picture expected = drawPart(stage, scene.aspect, scene.scene, CullerKind::kNone, within, one);
            const ScreenCamera across = cameraOf(2 * kCellWidthPx, 2 * kCellHeightPx, eye, 6.4);
            const Picture picture = drawPart(stage, scene.aspect, scene.scene, CullerKind::kNone, across, four);
            ASSERT_GT(lookOf(expected).spread, 25);
            for (int y = 0; y < one.height; ++y)
                for (int x = 0; x < one.width; ++x) {
                    const bool near = std::abs(2 * x + 1 - one.width) <= 3 || std::abs(2 * y + 1 - one.height) <= 3;
                    const std::size_t at = 3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(one.width) +
                                                static_cast<std::size_t>(x));
                    bool differs = false;
                    for (std::size_t c = 0; c < 3; ++c)
                        differs = differs || std::abs(picture.rgb[at + c] - expected.rgb[at + c]) > 2;
                    anywhere += differs;
                    beside += differs && near;
                    all += 1;
                    besideAll += near;
                }
        }
        std::printf("%d samples: %.4f %% of all pixels differ, %.4f %% beside the borders\n", samples,
                    100 * anywhere / all, 100 * beside / besideAll);
        EXPECT_LT(anywhere, 5e-4 * all);
        EXPECT_LT(beside, 1e-3 * besideAll);
    }
}

}  // namespace
}  // namespace tessera::test

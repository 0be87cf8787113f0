// Exposure and tone maps leave no seams, and what a wall meters does not depend on how it is divided.
#include <numeric>

#include "common/codec/WallCodec.h"
#include "tests/golden/SeamScene.h"
#include "tests/golden/Stage.h"

namespace tessera::test {
namespace {

/// The same for all tiles, as a frame says it.
View viewWith(ToneMap toneMap, std::int32_t found) {
    View view;
    view.exposure = {.wish = {.stops = 0.25, .metered = true, .toneMap = toneMap}, .found = found};
    return view;
}

/// Draws whatever it is given, as a host does whose scene changes.
struct Host {
    explicit Host(int samples) : stage(samples) {}
    Picture draw(const Aspect& aspect, const ScreenCamera& camera, const PixelRect& rect,
                 CullerKind culler = CullerKind::kFrustum) {
        RenderScene scene;
        scene.update(aspect, nullptr);
        return drawPart(stage, aspect, scene, culler, camera, rect);
    }
    Stage stage;
};

PixelRect whole(const ScreenCamera& camera) {
    return {.x = 0, .y = 0, .width = camera.pixels.width, .height = camera.pixels.height};
}

const Screen::Grid kOdd{.columns = 3, .rows = 2, .columnWidthsPx = {161, 97, 203}, .rowHeightsPx = {113, 151}};

TEST(ExposurePicture, LeavesNoSeamsForAnyToneMapMeteredOrNot) {
    const Wall wall = makeWall(kOdd);
    const Aspect aspect = makeSeamScene();
    Host big(4), own(4);
    std::vector<Picture> pictures;
    for (std::uint8_t toneMap = 0; toneMap <= static_cast<std::uint8_t>(kLastToneMap); ++toneMap) {
        const View view = viewWith(static_cast<ToneMap>(toneMap), -37);
        const ScreenCamera camera = screenCamera(wall.screens.front(), wall.users.front(), Eye::kCenter, view);
        pictures.push_back(big.draw(aspect, camera, whole(camera), CullerKind::kNone));
        EXPECT_GT(lookOf(pictures.back()).spread, 20);
        for (const Tile& tile : layoutTiles(wall))
            EXPECT_EQ(differingPixels(own.draw(aspect, camera, tile.rect), cropOf(pictures.back(), tile.rect)), 0u)
                << tile.name << " " << kToneMapNames[toneMap];
    }
    for (std::size_t i = 1; i < pictures.size(); ++i)
        EXPECT_GT(differingPixels(pictures[i], pictures[i - 1]), 100u) << i;
}

TEST(ExposurePicture, MeteringChangesNoByte) {
    const Wall wall = makeWall(kOdd);
    for (const auto& [samples, mapped] : {std::pair(1, false), std::pair(4, true)}) {
        const Aspect aspect = makeSeamScene(true, mapped, mapped);
        Host host(samples);
        const auto cameraOf = [&](bool metered) {
            View view;
            view.exposure.wish.metered = metered;
            return screenCamera(wall.screens.front(), wall.users.front(), Eye::kCenter, view);
        };
        const Picture plain = host.draw(aspect, cameraOf(false), whole(cameraOf(false)));
        EXPECT_EQ(host.stage.renderer->lastLight({}), LightHistogram());
        EXPECT_EQ(differingPixels(host.draw(aspect, cameraOf(true), whole(cameraOf(true))), plain), 0u);
        EXPECT_NE(host.stage.renderer->lastLight({}), LightHistogram());
    }
}

/// Of one picture, within rectangles that do not overlap.
LightHistogram lightWithin(const Renderer& renderer, const ScreenCamera& camera, std::span<const Tile> tiles) {
    LightHistogram light;
    const int w = camera.pixels.width, h = camera.pixels.height;
    for (const Tile& tile : tiles) {
        const PixelRect& r = tile.rect;
        const std::array<PixelRect, 4> outside = {{{.x = 0, .y = 0, .width = r.x, .height = h},
                                                   {.x = r.x + r.width, .y = 0, .width = w, .height = h},
                                                   {.x = 0, .y = 0, .width = w, .height = r.y},
                                                   {.x = 0, .y = r.y + r.height, .width = w, .height = h}}};
        light += renderer.lastLight(outside);
    }
    return light;
}

TEST(ExposurePicture, WhatIsMeteredIsTheSameForAnyDivision) {
    const Aspect aspect = makeSeamScene();
    const std::array<Screen::Grid, 4> grids = {
        {{.columns = 2, .rows = 2, .tileWidthPx = 601, .tileHeightPx = 333},  // across cells
         kOdd,
         {.columns = 2, .rows = 1, .tileWidthPx = 300, .tileHeightPx = 200, .overlapXPx = 37},
         {.columns = 3, .rows = 2, .tileWidthPx = 150, .tileHeightPx = 110, .bezelXPx = 17, .bezelYPx = 9}}};
    for (const int samples : {1, 4}) {
        Host big(samples), own(samples);
        for (const Screen::Grid& grid : grids) {
            const Wall wall = makeWall(grid);
            View view = viewWith(ToneMap::kNeutral, -100);
            view.position.z() = 5;  // from where one sees past everything
            const ScreenCamera camera = screenCamera(wall.screens.front(), wall.users.front(), Eye::kCenter, view);
            const std::vector<Tile> tiles = layoutTiles(wall);
            (void)big.draw(aspect, camera, whole(camera));
            // What no tile shows, behind bezels, counts for nobody.
            const LightHistogram all = big.stage.renderer->lastLight({});
            const LightHistogram expected = grid.bezelXPx == 0 ? all : lightWithin(*big.stage.renderer, camera, tiles);
            EXPECT_EQ(std::accumulate(all.pixels.begin(), all.pixels.end(), 0u),
                      static_cast<std::uint32_t>(LightHistogram::squareFrom(camera.pixels.width) *
                                                 LightHistogram::squareFrom(camera.pixels.height)));
            EXPECT_GT(expected.pixels[0], 0u) << "there is background";
            EXPECT_LT(expected.pixels[0], std::accumulate(expected.pixels.begin(), expected.pixels.end(), 0u) / 2);
            LightHistogram inTiles, inParts;
            for (const Tile& tile : tiles) {
                (void)own.draw(aspect, camera, tile.rect);
                inTiles += own.stage.renderer->lastLight(countedElsewhere(tiles, tile));
                // As neighbours draw them.
                const int half = (tile.rect.x + tile.rect.width / 2) / 64 * 64 - tile.rect.x;
                for (const bool right : {false, true}) {
                    PixelRect part = tile.rect;
                    if (half <= 0 && !right) continue;
                    if (half > 0) {
                        part.x += right ? half : 0;
                        part.width = right ? part.width - half : half;
                    }
                    (void)own.draw(aspect, camera, part);
                    inParts += own.stage.renderer->lastLight(countedElsewhere(tiles, tile));
                }
            }
            EXPECT_EQ(inTiles, expected) << samples;
            EXPECT_EQ(inParts, expected) << samples;
        }
    }
}

/// A sheet that fills the screen: its radiance is known.
TEST(ExposurePicture, MetersRadianceItselfWhateverIsShown) {
    const Wall wall = makeWall({.columns = 1, .rows = 1, .tileWidthPx = 128, .tileHeightPx = 72});
    for (const int samples : {1, 4}) {
        Host host(samples);
        for (const double stops : {-10.0, -1.5, 0.0, 6.25, 16.0}) {
            TestScene scene;
            scene.setEnvironment(Vec3f::Zero(), Vec3f::Zero(), Vec3f::Zero());
            scene.addDirectionalLight(-Vec3d::UnitZ(), Vec3f::Ones(), 0);
            Material glow;
            glow.baseColor = Vec4f(0, 0, 0, 1);
            glow.emissive = Vec3f::Constant(static_cast<float>(std::exp2(stops + 0.0625)));
            scene.place(scene.add(makeSheet(20, 20), scene.add(glow)), {0, 0, -0.5});
            const Aspect aspect = scene.take();
            const ScreenCamera camera =
                screenCamera(wall.screens.front(), wall.users.front(), Eye::kCenter, viewWith(ToneMap::kAgx, 640));
            (void)host.draw(aspect, camera, whole(camera));
            const auto at =
                static_cast<std::size_t>((stops - LightHistogram::kLeastStops) * LightHistogram::kClassesPerStop) + 1;
            EXPECT_EQ(host.stage.renderer->lastLight({}).pixels[at], 16u * 9u) << stops << " " << samples;
        }
    }
}

}  // namespace
}  // namespace tessera::test

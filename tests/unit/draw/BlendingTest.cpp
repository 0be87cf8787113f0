// What is transparent.
#include "tests/unit/draw/RendererStage.h"

namespace tessera {
namespace {

using Blending = RendererTest;

/// A dark sheet whose edge goes through the middle of a column of pixels stands before glass, that before something
/// bright: half of the samples show the one, half the other, and nothing shows both.
TEST_F(Blending, GlassBehindAnEdgeIsBlendedPerSample) {
    restart({.samples = 4});
    for (const bool mirrored : {false, true}) {
        TestScene scene;
        scene.setDark();
        const double edge = 0.5 * 0.05;  // the middle of pixel 32 of 64 that are 0.05 wide
        scene.place(scene.add(makeSheet(2, 9), scene.add(unlit({0.02f, 0.05f, 0.01f}))),
                    {mirrored ? edge + 1 : edge - 1, 0, 0});
        Material glass = unlit({0.1f, 0.2f, 0.7f});
        glass.baseColor.w() = 0.6f;
        const ObjectId pane = scene.add(makeSheet(9, 9), scene.add(glass));
        scene.place(pane, {0, 0, -0.5});
        scene.place(pane, {0, 0, -0.7});
        scene.place(scene.add(makeSheet(9, 9), scene.add(unlit({0.8f, 0.7f, 0.1f}))), {0, 0, -1});
        const Picture picture = draw(scene);
        for (int y = 20; y < 44; ++y) {
            const Rgb dark = pixel(picture, mirrored ? 34 : 30, y), bright = pixel(picture, mirrored ? 30 : 34, y);
            ASSERT_GT(bright.r, dark.r + 60);
            expectNear(pixel(picture, 32, y),
                       {(dark.r + bright.r) / 2, (dark.g + bright.g) / 2, (dark.b + bright.b) / 2});
        }
    }
}

TEST_F(Blending, BlendsWhatIsTransparentOverWhatIsBehind) {
    TestScene scene;
    scene.setDark();
    Material pane = unlit({0, 0.5f, 0});
    pane.baseColor.w() = 0.25f;
    scene.place(scene.add(makeSheet(9, 9), scene.add(unlit({0.5f, 0, 0}))), {0, 0, -1});
    scene.place(scene.add(makeSheet(9, 9), scene.add(pane)), {0, 0, -0.5});
    const Rgb c = center(draw(scene));
    const Rgb behind = expectedOf({0.5f, 0, 0}), front = expectedOf({0, 0.5f, 0});
    EXPECT_NEAR(c.r, 0.75 * behind.r, 2);
    EXPECT_NEAR(c.g, 0.25 * front.g, 2);
}

TEST_F(Blending, SolidThingsHideTransparentOnesBehindThem) {
    TestScene scene;
    scene.setDark();
    Material pane = unlit({0, 0.5f, 0});
    pane.baseColor.w() = 0.5f;
    scene.place(scene.add(makeSheet(9, 9), scene.add(pane)), {0, 0, -2});
    scene.place(scene.add(makeSheet(9, 9), scene.add(unlit({0.5f, 0, 0}))), {0, 0, -1});
    expectNear(center(draw(scene)), expectedOf({0.5f, 0, 0}));
}

}  // namespace
}  // namespace tessera

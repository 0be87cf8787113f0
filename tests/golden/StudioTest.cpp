// A model without a light of its own stands in a studio: one picture over all tiles, whoever culls; and no part of the
// scene.
#include <cmath>

#include "client/render/scene/StudioLook.h"
#include "common/codec/WallCodec.h"
#include "tests/golden/SeamScene.h"
#include "tests/golden/Stage.h"

namespace tessera::test {
namespace {

/// A ball and a plate of no material above the origin, a pane of glass before them; `lift` is how far it all is moved.
Aspect model(double lift = 0, bool lamp = false, bool surroundings = false) {
    TestScene scene;
    Material glass;
    glass.baseColor = Vec4f(0.5f, 0.7f, 0.9f, 0.4f);
    scene.place(scene.add(makeSphere(0.5, 24)), Vec3d(0, 0.5 + lift, 0));
    scene.place(scene.add(makeBox(Vec3d(0.8, 0.06, 0.5))), Vec3d(-0.7, 0.4 + lift, 0.1));
    scene.place(scene.add(makeBox(Vec3d(0.4, 0.5, 0.02)), scene.add(glass)), Vec3d(0.4, 0.25 + lift, 0.7));
    if (lamp) scene.place(scene.addCore(PointLight{}), Vec3d(0, 3, 1));
    if (surroundings) scene.place(scene.addCore(Environment{}), Vec3d::Zero());
    return scene.take();
}
constexpr double kReach = 1.2;
const Studio kStudio{.middle = Vec3d(0, 0, 0), .reach = kReach};

View viewOf(const Wall& wall, std::optional<Studio> studio = kStudio) {
    Box bounds;
    bounds.extend(Vec3d(-1, 0, -0.7));
    bounds.extend(Vec3d(1, 1, 0.7));
    View view = defaultView(wall, bounds);
    view.studio = studio;
    return view;
}

struct Drawn {
    Drawn(int samples, const Aspect& aspect, const ScreenCamera& camera, CullerKind culler = CullerKind::kNone)
        : stage(samples) {
        RenderScene scene;
        scene.update(aspect, nullptr);
        picture = drawPart(stage, aspect, scene, culler, camera,
                           {.x = 0, .y = 0, .width = camera.pixels.width, .height = camera.pixels.height});
    }
    Stage stage;
    Picture picture;
};

const Screen::Grid kSmall{.columns = 3, .rows = 2, .columnWidthsPx = {161, 97, 203}, .rowHeightsPx = {113, 151}};

TEST(StudioPicture, IsOneOverAllTilesForEveryCullerAndBothEyes) {
    const Aspect aspect = model();
    for (const int samples : {1, 4})
        for (const Eye eye : {Eye::kLeft, Eye::kRight}) {
            const Wall wall = makeWall(kSmall, eye);
            const View view = viewOf(wall);
            const ScreenCamera camera = screenCamera(wall.screens.front(), wall.users.front(), eye, view);
            const Picture whole = Drawn(samples, aspect, camera).picture;
            EXPECT_GT(lookOf(whole).spread, 15);
            for (const CullerKind culler : kAllCullers)
                for (const Tile& tile : layoutTiles(wall)) {
                    Stage own(samples);
                    RenderScene scene;
                    scene.update(aspect, nullptr);
                    const Picture part = drawPart(own, aspect, scene, culler, camera, tile.rect);
                    EXPECT_EQ(differingPixels(part, cropOf(whole, tile.rect)), 0u)
                        << tile.name << " " << samples << " " << static_cast<int>(culler);
                }
        }
}

TEST(StudioPicture, CrossesTheBordersOfCells) {
    const Wall wall = makeWall({.columns = 2, .rows = 2, .tileWidthPx = 640, .tileHeightPx = 360}, Eye::kCenter);
    const ScreenCamera camera = screenCamera(wall.screens.front(), wall.users.front(), Eye::kCenter, viewOf(wall));
    const Picture picture = Drawn(1, model(), camera).picture;
    // Neighbours on both sides of the border at 1024 pixels differ no more than those beside it, on the ground below.
    const auto at = [&](int x, int y) { return picture.rgb[3 * static_cast<std::size_t>(y * picture.widthPx + x)]; };
    for (int y = 500; y < 700; ++y)
        EXPECT_LE(std::abs(at(1023, y) - at(1024, y)), std::abs(at(1021, y) - at(1022, y)) + 3) << y;
}

TEST(StudioPicture, StandsStillWhileTheModelMovesAndItsShadowGoesAlong) {
    const Wall wall = makeWall(kSmall, Eye::kCenter);
    const ScreenCamera camera = screenCamera(wall.screens.front(), wall.users.front(), Eye::kCenter, viewOf(wall));
    const Picture on = Drawn(4, model(0), camera).picture, above = Drawn(4, model(0.4), camera).picture,
                  gone = Drawn(4, model(1e6), camera).picture;
    // The lower corners are ground in all three.
    const auto corner = [&](const Picture& picture, int x) {
        return cropOf(picture, {.x = x, .y = 0, .width = 40, .height = 20});
    };
    EXPECT_EQ(differingPixels(corner(on, 0), corner(above, 0)), 0u);
    EXPECT_EQ(differingPixels(corner(on, 0), corner(gone, 0)), 0u);
    EXPECT_GT(lookOf(corner(gone, 0)).mean, 60) << "it is lit";
    EXPECT_GT(differingPixels(above, gone), 1000u);
    // Darker than the ground without a model is what lies in its shadow.
    std::size_t shadow = 0;
    for (std::size_t i = 0; i < on.rgb.size(); i += 3) shadow += on.rgb[i] + 25 < gone.rgb[i];
    EXPECT_GT(shadow, 1000u);
}

TEST(StudioPicture, IsThereForWhatBringsNeitherLightNorSurroundingsAlone) {
    const Wall wall = makeWall(kSmall, Eye::kCenter);
    const auto cameraIn = [&](std::optional<Studio> studio) {
        return screenCamera(wall.screens.front(), wall.users.front(), Eye::kCenter, viewOf(wall, studio));
    };
    for (const bool lamp : {true, false}) {
        const Aspect aspect = model(0, lamp, !lamp);
        EXPECT_EQ(differingPixels(Drawn(4, aspect, cameraIn(kStudio)).picture, Drawn(4, aspect, cameraIn({})).picture),
                  0u);
    }
    // One renderer, first with, then without, then with it.
    const Aspect aspect = model();
    Stage stage(4);
    RenderScene scene;
    scene.update(aspect, nullptr);
    const PixelRect all{.x = 0, .y = 0, .width = cameraIn({}).pixels.width, .height = cameraIn({}).pixels.height};
    for (const auto& studio : {std::optional(kStudio), std::optional<Studio>(), std::optional(kStudio)})
        EXPECT_EQ(differingPixels(drawPart(stage, aspect, scene, CullerKind::kNone, cameraIn(studio), all),
                                  Drawn(4, aspect, cameraIn(studio)).picture),
                  0u);
}

TEST(StudioPicture, CountsNothing) {
    const Wall wall = makeWall(kSmall, Eye::kCenter);
    const Aspect aspect = model();
    const ScreenCamera with = screenCamera(wall.screens.front(), wall.users.front(), Eye::kCenter, viewOf(wall)),
                       without = screenCamera(wall.screens.front(), wall.users.front(), Eye::kCenter, viewOf(wall, {}));
    Drawn inStudio(4, aspect, with), plain(4, aspect, without);
    const DrawCounts a = inStudio.stage.renderer->lastCounts(), b = plain.stage.renderer->lastCounts();
    EXPECT_EQ(a.items, b.items);
    EXPECT_EQ(a.triangles, b.triangles);
    // Nobody stands where one sees the ground.
    RenderScene scene;
    scene.update(aspect, nullptr);
    const PixelRect all{.x = 0, .y = 0, .width = with.pixels.width, .height = with.pixels.height};
    const auto idsOf = [&](const ScreenCamera& camera) {
        RenderAction action(CullerKind::kFrustum);
        return plain.stage.renderer->drawNodeIds(aspect, action.run(scene, camera, all, nullptr), camera, all).value();
    };
    EXPECT_EQ(idsOf(with), idsOf(without));
}

TEST(StudioPicture, HasNoGroundForWhoLooksFromBelow) {
    const Wall wall = makeWall(kSmall, Eye::kCenter);
    View view = viewOf(wall);
    view.position.y() = -3;
    view.orientation = Quatd(Eigen::AngleAxisd(0.3, Vec3d::UnitX()));
    const ScreenCamera camera = screenCamera(wall.screens.front(), wall.users.front(), Eye::kCenter, view);
    const Picture picture = Drawn(1, model(), camera).picture;
    std::size_t bright = 0;
    for (const std::uint8_t v : picture.rgb) bright += v > 130;
    EXPECT_LT(bright, picture.rgb.size() / 10);
}

}  // namespace
}  // namespace tessera::test

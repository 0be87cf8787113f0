// Surfaces of control points, as fine as each screen wants them: no seams, no cracks, and smooth where the eye is near.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <map>

#include "client/render/scene/SceneItems.h"
#include "common/drawable/NurbsArrays.h"
#include "common/freeform/nurbs/NurbsShapes.h"
#include "common/image/Picture.h"
#include "tests/golden/Stage.h"
#include "tests/golden/TestScene.h"
#include "tests/unit/drawable/ControlCube.h"

namespace tessera::test {
namespace {

/// A pebble, a creased block, a ball with a hole, glass in front, on a ground with the shadows of a sun and a spot.
Aspect makeSoftScene(double screenError) {
    TestScene scene;
    Material red{.baseColor = Vec4f(0.8F, 0.25F, 0.2F, 1)}, blue{.baseColor = Vec4f(0.2F, 0.35F, 0.8F, 1)},
        clear{.baseColor = Vec4f(0.6F, 0.9F, 0.7F, 0.4F)}, grey{.baseColor = Vec4f(0.7F, 0.7F, 0.7F, 1)};
    blue.doubleSided = true;
    SubdivisionSurface pebble = controlGrid(1);
    pebble.level = 1;
    pebble.screenError = screenError;
    pebble.material = scene.add(red);
    scene.place(scene.add(pebble), {-0.7, 0, -0.5}, Quatd(1, 0.2, 0.3, 0.1).normalized());
    SubdivisionSurface block = controlGrid(2);
    const std::uint32_t creases[] = {0, 1, 1, 2, 3, 4};
    const float sharpness[] = {10, 2.5F, 1.5F};
    block.creases = Blob::of(std::span<const std::uint32_t>(creases));
    block.creaseSharpness = Blob::of(std::span<const float>(sharpness));
    block.level = 0;
    block.screenError = screenError;
    block.material = scene.add(grey);
    scene.place(scene.add(block), {1.2, -0.2, -2.5}, Quatd(1, 0.5, 0.1, 0).normalized(), {0.8, -0.8, 0.8});
    NurbsSurfaceCore ball = coreOfSurface(*sphereSurface(0.6, {{LoopRole::kHole, {circle({2, 1}, 0.5)}}}));
    ball.tolerance = 0.03;
    ball.screenError = screenError;
    ball.material = scene.add(blue);
    scene.place(scene.add(ball), {0.5, 0.3, -0.6}, Quatd(1, 0, 0.8, 0.2).normalized());
    SubdivisionSurface drop = controlGrid(1);
    drop.level = 1;
    drop.screenError = screenError;
    drop.material = scene.add(clear);
    scene.place(scene.add(drop), {0, -0.3, 0.1}, Quatd::Identity(), Vec3d::Constant(0.35));
    scene.place(scene.add(makeSheet(9, 9), scene.add(Material{})), {0, -1, -2},
                Quatd(Eigen::AngleAxisd(-1.5707963, Vec3d::UnitX())));
    scene.setEnvironment(Vec3f::Constant(0.35F), Vec3f::Constant(0.2F), Vec3f(0.1F, 0.15F, 0.25F));
    scene.addDirectionalLight({0.4, -1, -0.5}, Vec3f::Ones(), 0.6F, true);
    scene.addSpotLight({-1, 2.5, 1}, {0.3, -1, -0.6}, Vec3f(1, 0.9F, 0.7F), 4, 0.4F, 0.7F, 0, true);
    return scene.take();
}

struct SoftView {
    const char* name;
    Vec3d eye;
    Vec3d place;  ///< of the wall
};
const SoftView kSoftViews[] = {{"far", {0.2, 0.1, 2.2}, {0, 0, 6}},
                               {"near", {0.3, 0.15, 1.1}, {-0.3, 0, 0.8}},
                               {"within", {0, 0, 0.6}, {-0.7, 0, -0.9}}};

Screen softScreen(const Screen::Grid& grid) {
    Screen screen;
    screen.name = "front";
    screen.grid = grid;
    const ScreenPixels pixels = screenPixels(screen);
    const double half = 1.6 * pixels.height / pixels.width;
    screen.lowerLeft = {-1.6, -half, 0};
    screen.lowerRight = {1.6, -half, 0};
    screen.upperLeft = {-1.6, half, 0};
    return screen;
}
ScreenCamera softCamera(const Screen& screen, const SoftView& look, Eye eye) {
    User user;
    user.position = look.eye;
    View view;
    view.position = look.place;
    return screenCamera(screen, user, eye, view);
}
PixelRect wholeOf(const ScreenCamera& camera) {
    return {.x = 0, .y = 0, .width = camera.pixels.width, .height = camera.pixels.height};
}

void keepPicture(const Picture& picture, const std::string& name) {
    const char* folder = std::getenv("TESSERA_KEEP_PICTURES");
    if (!folder) return;
    const Bytes png = encodePng(picture, std::nullopt);
    std::ofstream(std::string(folder) + "/" + name + ".png", std::ios::binary)
        .write(reinterpret_cast<const char*>(png.data()), static_cast<std::streamsize>(png.size()));
}

TEST(FinenessByScreen, HasNoSeams) {
    const Aspect aspect = makeSoftScene(0.5);
    std::size_t k = 0;  // tiles, each with another culler
    for (const SoftView& look : kSoftViews) {
        for (const Eye eye : {Eye::kLeft, Eye::kRight}) {
            SCOPED_TRACE(::testing::Message() << look.name << (eye == Eye::kLeft ? ", left" : ", right"));
            const Screen screen = softScreen({.columns = 2, .rows = 2, .tileWidthPx = 403, .tileHeightPx = 229});
            const ScreenCamera camera = softCamera(screen, look, eye);
            // One host that has seen much, and one each that has just come.
            RenderScene old;
            old.update(aspect, nullptr);
            for (const SoftView& other : kSoftViews)
                (void)RenderAction(CullerKind::kFrustum)
                    .run(old, softCamera(screen, other, Eye::kCenter), wholeOf(camera), nullptr);
            Stage stage(4);
            const Picture whole = drawPart(stage, aspect, old, CullerKind::kNone, camera, wholeOf(camera));
            EXPECT_GT(lookOf(whole).spread, 15) << "a picture without content proves nothing";
            keepPicture(whole, std::string("soft-") + look.name);
            for (int row = 0; row < 2; ++row)
                for (int column = 0; column < 2; ++column) {
                    const PixelRect tile{column * 403, row * 229, 403, 229};
                    RenderScene fresh;
                    fresh.update(aspect, nullptr);
                    Stage own(4);
                    const CullerKind kind = kAllCullers[k++ % kAllCullers.size()];
                    EXPECT_EQ(differingPixels(drawPart(own, aspect, fresh, kind, camera, tile), cropOf(whole, tile)),
                              0u)
                        << column << ", " << row;
                }
        }
    }
}

/// Each step of detail that a wall leaves away is one picture however it is cut, culled, and whatever step a host drew
/// before.
TEST(StepsOfDetail, HaveNoSeamsAndEachIsItsOwnPicture) {
    const Aspect aspect = makeSoftScene(0.5);
    const Screen screen = softScreen({.columns = 2, .rows = 1, .tileWidthPx = 322, .tileHeightPx = 361});
    RenderScene shared;
    shared.update(aspect, nullptr);
    Stage old(4);
    std::vector<Picture> pictures;
    std::size_t k = 0;
    // There and back: what a step leaves behind is nothing to the next.
    for (const unsigned step : {0u, 1u, 2u, 3u, 4u, 5u, 6u, 3u, 0u}) {
        SCOPED_TRACE(::testing::Message() << "step " << step);
        ScreenCamera camera = softCamera(screen, kSoftViews[1], Eye::kCenter);
        camera.detail = step;
        RenderScene own;
        own.update(aspect, nullptr);
        Stage alone(4);
        const Picture whole = drawPart(alone, aspect, own, CullerKind::kNone, camera, wholeOf(camera));
        EXPECT_GT(lookOf(whole).spread, 15) << "a picture without content proves nothing";
        if (pictures.size() == step) {
            keepPicture(whole, "detail-" + std::to_string(step));
            pictures.push_back(whole);
        }
        EXPECT_EQ(differingPixels(whole, pictures[step]), 0u);
        for (const int column : {0, 1}) {
            const PixelRect tile{column * 322, 0, 322, 361};
            const CullerKind kind = kAllCullers[k++ % kAllCullers.size()];
            EXPECT_EQ(differingPixels(drawPart(old, aspect, shared, kind, camera, tile), cropOf(whole, tile)), 0u)
                << column;
        }
    }
    // Between the others there may be nothing to be coarser with: each step makes four triangles of one.
    for (const std::size_t step : {1u, 3u, 5u})
        EXPECT_GT(differingPixels(pictures[step - 1], pictures[step]), 100u) << step;
    // Whoever may have one sample alone has it at each step.
    Stage one(1);
    ScreenCamera camera = softCamera(screen, kSoftViews[1], Eye::kCenter);
    RenderScene own;
    own.update(aspect, nullptr);
    const Picture before = drawPart(one, aspect, own, CullerKind::kMasked, camera, wholeOf(camera));
    camera.detail = 3;
    const Picture after = drawPart(one, aspect, own, CullerKind::kMasked, camera, wholeOf(camera));
    EXPECT_EQ(differingPixels(after, pictures[3]), 0u);
    EXPECT_GT(differingPixels(before, after), 0u);
}

TEST(FinenessByScreen, IsItsOwnOfEachScreenThatMeetsAtAnAngle) {
    const Aspect aspect = makeSoftScene(0.5);
    // Two walls of a cave, one host for all tiles, that draws them in turn; beside it one that knows no other screen.
    Screen left = softScreen({.columns = 2, .rows = 1, .tileWidthPx = 200, .tileHeightPx = 230}), right = left;
    left.lowerRight = {0, left.lowerLeft.y(), -1};
    right.lowerLeft = {0, left.lowerLeft.y(), -1};
    right.upperLeft = {0, left.upperLeft.y(), -1};
    const SoftView look{"cave", {-0.4, 0.1, 1.2}, {1.1, 0, 0.9}};  // the pebble is before the left one alone
    RenderScene shared;
    shared.update(aspect, nullptr);
    Stage stage(1);
    std::map<ObjectId, BlobId> finenesses[2];
    for (const int column : {0, 1}) {
        for (std::size_t s = 0; s < 2; ++s) {
            const ScreenCamera camera = softCamera(s == 0 ? left : right, look, Eye::kCenter);
            const PixelRect tile{column * 200, 0, 200, 230};
            RenderScene own;
            own.update(aspect, nullptr);
            Stage alone(1);
            const Picture whole = drawPart(alone, aspect, own, CullerKind::kNone, camera, wholeOf(camera));
            EXPECT_EQ(differingPixels(drawPart(stage, aspect, shared, CullerKind::kMasked, camera, tile),
                                      cropOf(whole, tile)),
                      0u)
                << s << ", " << column;
            for (const DrawItem& item :
                 RenderAction(CullerKind::kNone).run(own, camera, wholeOf(camera), nullptr).opaque)
                finenesses[s][item.node] = item.mesh->key.arrays[0];
        }
    }
    EXPECT_NE(finenesses[0], finenesses[1]) << "screens that look elsewhere choose otherwise";
}

/// Beside a picture of the finest triangles: what the wanted half pixel leaves of a difference, and what no step at all
/// would.
TEST(FinenessByScreen, IsThePictureOfTheSurfaceAndNotOfItsTriangles) {
    const Aspect chosen = makeSoftScene(0.5), finest = makeSoftScene(0.02), coarse = makeSoftScene(0);
    for (const SoftView& look : kSoftViews) {
        SCOPED_TRACE(look.name);
        const ScreenCamera camera = softCamera(
            softScreen({.columns = 1, .rows = 1, .tileWidthPx = 800, .tileHeightPx = 450}), look, Eye::kCenter);
        const auto draw = [&](const Aspect& aspect, const char* name) {
            RenderScene scene;
            scene.update(aspect, nullptr);
            Stage stage(4);
            const Picture picture = drawPart(stage, aspect, scene, CullerKind::kAuto, camera, wholeOf(camera));
            keepPicture(picture, std::string("soft-") + look.name + "-" + name);
            return picture;
        };
        const Picture truth = draw(finest, "finest"), now = draw(chosen, "chosen"), before = draw(coarse, "coarse");
        const auto offBy = [&](const Picture& picture) {
            double sum = 0;
            for (std::size_t i = 0; i < truth.rgb.size(); ++i)
                sum += std::abs(static_cast<double>(picture.rgb[i]) - truth.rgb[i]);
            return sum / static_cast<double>(truth.rgb.size());
        };
        RecordProperty(look.name, std::to_string(offBy(now)) + " beside " + std::to_string(offBy(before)));
        EXPECT_LT(offBy(now), 0.5);
        EXPECT_LT(offBy(now), 0.5 * offBy(before));
    }
}

/// Waves from before one's feet to far away, all of it one surface.
SubdivisionSurface wavesToTheHorizon(std::int64_t level, double screenError) {
    constexpr std::uint32_t kWide = 8, kLong = 60;
    std::vector<float> points;
    std::vector<std::uint32_t> sizes, vertices;
    for (std::uint32_t j = 0; j <= kLong; ++j)
        for (std::uint32_t i = 0; i <= kWide; ++i) {
            const std::array<float, 3> at{static_cast<float>(i) - 4, (i + j) % 2 ? 0.3F : -0.3F,
                                          2 - static_cast<float>(j)};
            points.insert(points.end(), at.begin(), at.end());
        }
    for (std::uint32_t j = 0; j < kLong; ++j)
        for (std::uint32_t i = 0; i < kWide; ++i) {
            const std::uint32_t a = j * (kWide + 1) + i;
            sizes.push_back(4);
            vertices.insert(vertices.end(), {a, a + 1, a + kWide + 2, a + kWide + 1});
        }
    SubdivisionSurface surface;
    surface.points = Blob::of(std::span<const float>(points));
    surface.faceSizes = Blob::of(std::span<const std::uint32_t>(sizes));
    surface.faceVertices = Blob::of(std::span<const std::uint32_t>(vertices));
    surface.level = level;
    surface.screenError = screenError;
    return surface;
}

TEST(FinenessByScreen, OfALongSurfaceIsFineWhereItIsNear) {
    const auto sceneOf = [](std::int64_t level, double screenError) {
        TestScene scene;
        SubdivisionSurface waves = wavesToTheHorizon(level, screenError);
        waves.material = scene.add(Material{.baseColor = Vec4f(0.3F, 0.5F, 0.8F, 1)});
        scene.place(scene.add(waves), {0, -1, 0});
        scene.setEnvironment(Vec3f::Constant(0.35F), Vec3f::Constant(0.2F), Vec3f(0.1F, 0.15F, 0.25F));
        scene.addDirectionalLight({0.4, -1, -0.5}, Vec3f::Ones(), 0.6F, false);
        return scene.take();
    };
    const Screen screen = softScreen({.columns = 2, .rows = 2, .tileWidthPx = 400, .tileHeightPx = 225});
    const ScreenCamera camera = softCamera(screen, {"waves", {0, 0.4, 1.5}, {0, 0, 0}}, Eye::kCenter);
    struct Drawn {
        Picture picture;
        std::uint64_t triangles = 0;
    };
    const auto draw = [&](const Aspect& aspect) {
        RenderScene scene;
        scene.update(aspect, nullptr);
        Stage stage(4);
        Drawn out{.picture = drawPart(stage, aspect, scene, CullerKind::kNone, camera, wholeOf(camera))};
        for (const SceneItem& item : scene.seenFrom(camera).items)
            out.triangles += item.node ? item.mesh->triangles : 0;
        return out;
    };
    const Aspect chosen = sceneOf(1, 0.5);
    const Drawn now = draw(chosen), finest = draw(sceneOf(5, 0)), coarse = draw(sceneOf(1, 0));
    keepPicture(now.picture, "waves");
    const auto offBy = [&](const Picture& picture) {
        double sum = 0;
        for (std::size_t i = 0; i < picture.rgb.size(); ++i)
            sum += std::abs(static_cast<double>(picture.rgb[i]) - finest.picture.rgb[i]);
        return sum / static_cast<double>(picture.rgb.size());
    };
    RecordProperty("triangles", std::to_string(now.triangles) + " of " + std::to_string(finest.triangles) +
                                    ", off by " + std::to_string(offBy(now.picture)) + " of 255; " +
                                    std::to_string(coarse.triangles) + " off by " +
                                    std::to_string(offBy(coarse.picture)));
    EXPECT_GT(lookOf(now.picture).spread, 15) << "a picture without content proves nothing";
    EXPECT_LT(now.triangles, finest.triangles / 8);
    EXPECT_LT(offBy(now.picture), 0.3);
    EXPECT_LT(offBy(now.picture), 0.2 * offBy(coarse.picture));
    // Hosts that have just come, each with a tile.
    for (int row = 0; row < 2; ++row)
        for (int column = 0; column < 2; ++column) {
            const PixelRect tile{column * 400, row * 225, 400, 225};
            RenderScene fresh;
            fresh.update(chosen, nullptr);
            Stage own(4);
            EXPECT_EQ(
                differingPixels(drawPart(own, chosen, fresh,
                                         kAllCullers[static_cast<std::size_t>(2 * row + column) % kAllCullers.size()],
                                         camera, tile),
                                cropOf(now.picture, tile)),
                0u)
                << column << ", " << row;
        }
}

}  // namespace
}  // namespace tessera::test

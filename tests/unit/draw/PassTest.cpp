// Edges and corners in place of a surface, and materials that are drawn over one another.
#include "tests/unit/draw/RendererStage.h"

namespace tessera {
namespace {

Material flat(const Vec3f& color, float alpha = 1) {
    Material material;
    material.unlit = true;
    material.baseColor << color, alpha;
    return material;
}
const Vec3f kRed(1, 0, 0), kGreen(0, 1, 0), kBlue(0, 0, 1);

class PassTest : public RendererTest {
protected:
    /// How many pixels of a picture have this colour.
    static int count(const Picture& picture, const Rgb& color) {
        int found = 0;
        for (int y = 0; y < picture.heightPx; ++y)
            for (int x = 0; x < picture.widthPx; ++x) {
                const Rgb c = pixel(picture, x, y);
                found += c.r == color.r && c.g == color.g && c.b == color.b;
            }
        return found;
    }
};

TEST_F(PassTest, EdgesAreLinesOfTheirWidthAndWhatIsBetweenIsSeenThrough) {
    for (const float width : {1.0f, 5.0f}) {
        TestScene scene;
        Material edges = flat(kRed);
        edges.fill = Material::kEdges;
        edges.lineWidth = width;
        scene.setDark();
        scene.place(scene.add(makeSheet(1.6, 1.6), scene.add(edges)), Vec3d::Zero());
        scene.place(scene.add(makeSheet(3, 3), scene.add(flat(kBlue))), {0, 0, -0.5});
        const Picture picture = draw(scene);
        // Beside the diagonal.
        expectNear(pixel(picture, kSidePx / 2 - 10, kSidePx / 2 - 4), {0, 0, 255});
        expectNear(pixel(picture, kSidePx / 2 + 10, kSidePx / 2 + 4), {0, 0, 255});
        // The left side, 16 pixels from the middle: as wide as it is said, in a row that only it crosses.
        int red = 0;
        for (int x = 0; x < kSidePx / 2 - 8; ++x) red += pixel(picture, x, kSidePx / 2 + 3).r > 200;
        EXPECT_NEAR(red, width, 1);
    }
}

TEST_F(PassTest, CornersAreSquares) {
    TestScene scene;
    Material corners = flat(kGreen);
    corners.fill = Material::kCorners;
    corners.pointSize = 6;
    scene.setDark();
    scene.place(scene.add(makeSheet(1.6, 1.6), scene.add(corners)), Vec3d::Zero());
    EXPECT_NEAR(count(draw(scene), {0, 255, 0}), 4 * 36, 4 * 13);
}

// A screen may bear no more (client/render/scene/LineWidths.h): own lines, those that stand for a surface, and those
// over it.
TEST_F(PassTest, NoLineIsWiderThanItsItemMayHaveIt) {
    Material edges = flat(kRed);
    edges.fill = Material::kEdges;
    edges.lineWidth = 20;
    for (const int kind : {0, 1, 2}) {
        TestScene scene;
        scene.setDark();
        Material over = flat(kBlue);
        if (kind == 1) over.passes.push_back(scene.add(edges));
        const std::array<Vec3d, 2> side{Vec3d(-0.8, -0.8, 0), Vec3d(-0.8, 0.8, 0)};
        scene.place(kind == 2 ? scene.add(test::makeLines(side, 20), scene.add(flat(kRed)))
                              : scene.add(makeSheet(1.6, 1.6), scene.add(kind == 1 ? over : edges)),
                    Vec3d::Zero());
        const Aspect aspect = scene.take();
        const ScreenCamera camera = cameraOf(kSidePx, kSidePx);
        DrawList list = listOf(aspect, camera);
        for (DrawItem& item : list.opaque) {
            item.widestLinePx = 3;
            item.lineWidth = std::min(item.lineWidth, item.widestLinePx);
        }
        const auto picture = renderer_->draw(aspect, list, camera, whole(camera));
        ASSERT_TRUE(picture);
        int red = 0;
        for (int x = 0; x < kSidePx / 2 - 8; ++x) red += pixel(*picture, x, kSidePx / 2 + 3).r > 200;
        EXPECT_NEAR(red, 3, 1) << kind;
    }
}

TEST_F(PassTest, AnEdgeOfTwoTrianglesIsBlendedOnce) {
    TestScene scene;
    Material edges = flat(kRed, 0.5f);
    edges.fill = Material::kEdges;
    edges.lineWidth = 4;
    scene.setDark();
    MeshData cut = makeSheet(1.6, 1.6);
    // The same sheet of two triangles that share no vertex.
    cut.positions.insert(cut.positions.end(), cut.positions.begin(), cut.positions.end());
    cut.normals.insert(cut.normals.end(), cut.normals.begin(), cut.normals.end());
    cut.texcoords.insert(cut.texcoords.end(), cut.texcoords.begin(), cut.texcoords.end());
    cut.indices = {0, 1, 2, 4, 6, 7};
    scene.place(scene.add(cut, scene.add(edges)), Vec3d::Zero());
    const Rgb diagonal = pixel(draw(scene), kSidePx / 2 - 6, kSidePx / 2 + 5);
    EXPECT_NEAR(diagonal.r, 128, 3) << diagonal;
}

TEST_F(PassTest, TheLastOpaquePassIsSeenWhereItIsNotCut) {
    TestScene scene;
    Material base = flat(kRed), second = flat(kGreen), third = flat(kBlue);
    // The third pass has an image whose left half is not there.
    const std::array<std::uint8_t, 8> halves{255, 255, 255, 0, 255, 255, 255, 255};
    Image image{.pixels = Blob(Bytes(std::as_bytes(std::span(halves)).begin(), std::as_bytes(std::span(halves)).end())),
                .widthPx = 2,
                .heightPx = 1};
    image.magnification = Image::kNearest;
    third.baseColorImage = scene.add(image);
    third.alphaMode = Material::kMask;
    base.passes.push_back(scene.add(second));
    base.passes.push_back(scene.add(third));
    scene.setDark();
    scene.place(scene.add(makeSheet(1.6, 1.6), scene.add(base)), Vec3d::Zero());
    const Picture picture = draw(scene);
    expectNear(pixel(picture, kSidePx / 2 - 8, kSidePx / 2), {0, 255, 0});
    expectNear(pixel(picture, kSidePx / 2 + 8, kSidePx / 2), {0, 0, 255});
}

// At one depth the earlier thing is seen, with all its passes; nothing of the later one's.
TEST_F(PassTest, WhoseBaseIsHiddenHasNoPassInFront) {
    TestScene scene;
    Material first = flat(kRed), second = flat(kBlue);
    second.passes.push_back(scene.add(flat(kGreen)));
    scene.setDark();
    scene.place(scene.add(makeSheet(1.6, 1.6), scene.add(first)), Vec3d::Zero());
    scene.place(scene.add(makeSheet(1.6, 1.6), scene.add(second)), Vec3d::Zero());
    const Rgb c = center(draw(scene));
    EXPECT_TRUE((c.r > 250 && c.g < 5) || (c.g > 250 && c.r < 5)) << c;
}

TEST_F(PassTest, BlendedPassesLieOverAnOpaqueAndATransparentBase) {
    for (const bool glass : {false, true}) {
        TestScene scene;
        Material base = flat(kRed, glass ? 0.5f : 1.0f);
        base.passes.push_back(scene.add(flat(kGreen, 0.5f)));
        scene.setDark();
        scene.place(scene.add(makeSheet(1.6, 1.6), scene.add(base)), Vec3d::Zero());
        // Something else of glass in front, so that triangles are sorted.
        scene.place(scene.add(makeSheet(0.2, 0.2), scene.add(flat(kBlue, 0.5f))), {0.5, 0.5, 0.1});
        const Rgb c = center(draw(scene));
        EXPECT_NEAR(c.r, glass ? 64 : 128, 2) << c;
        EXPECT_NEAR(c.g, 128, 2) << c;
    }
}

TEST_F(PassTest, EdgesOverASurfaceAreWholeAndHiddenBehindIt) {
    TestScene scene;
    Material base = flat(kRed), edges = flat(kGreen);
    edges.fill = Material::kEdges;
    edges.lineWidth = 2;
    base.passes.push_back(scene.add(edges));
    scene.setDark();
    scene.place(scene.add(makeSheet(1.6, 1.6), scene.add(base)), Vec3d::Zero(),
                Quatd(Eigen::AngleAxisd(0.7, Vec3d::UnitY())));
    Material behind = flat(kBlue);
    behind.fill = Material::kEdges;
    behind.lineWidth = 8;
    scene.place(scene.add(makeSheet(0.5, 0.5), scene.add(behind)), {0, 0, -0.8});
    const Picture picture = draw(scene);
    EXPECT_EQ(count(picture, {0, 0, 255}), 0);
    // Up and down the middle lies the diagonal, and at top and bottom a side.
    int green = 0;
    for (int y = 0; y < kSidePx; ++y) green += pixel(picture, kSidePx / 2, y).g > 200;
    EXPECT_GE(green, 5);
    EXPECT_GT(count(picture, {255, 0, 0}), 300);
}

// A sheet of a metre is 20 pixels of this screen a metre behind it, and half as many three times as far from the eye.
TEST_F(PassTest, WhatIsSmallHasTheCoarserMaterial) {
    const auto colorAt = [&](double z, double below, bool circle) {
        TestScene scene;
        Material fine = flat(kRed), coarse = flat(kGreen), coarsest = flat(kBlue);
        fine.coarserBelow = below;
        coarse.coarserBelow = below / 2;
        // Where they name one another in a circle: the first object is number 2.
        if (circle) coarsest.coarser = ObjectId(4);
        coarsest.coarserBelow = 1e6;
        coarse.coarser = scene.add(coarsest);
        fine.coarser = scene.add(coarse);
        const ObjectId material = scene.add(fine);
        scene.setDark();
        scene.place(scene.add(makeSheet(1, 1), material), {0, 0, z});
        return center(draw(scene));
    };
    // The sphere around it has sqrt(2) units across; at the screen's own distance a unit is 20 pixels.
    const double across = std::sqrt(2.0) * 20;
    for (const bool circle : {false, true}) {
        expectNear(colorAt(0, across - 1, circle), {255, 0, 0});
        expectNear(colorAt(0, across + 1, circle), {0, 255, 0});
        expectNear(colorAt(-2.4, across / 2 - 1, circle), {255, 0, 0});
        expectNear(colorAt(-2.4, across - 1, circle), {0, 255, 0});
        expectNear(colorAt(-2.4, across + 1, circle), {0, 0, 255});
    }
}

// A wide line reaches into tiles that its surface's box does not.
TEST_F(PassTest, TilesAreCutFromOnePicture) {
    for (const int samples : {1, 4}) {
        restart({.samples = samples});
        TestScene scene;
        Material edges = flat(kRed), corners = flat(kGreen), base = flat({0.3f, 0.3f, 0.3f});
        edges.fill = Material::kEdges;
        edges.lineWidth = 21;
        corners.fill = Material::kCorners;
        corners.pointSize = 33;
        Material glass = flat({0.2f, 0.2f, 0.9f}, 0.4f);
        glass.passes.push_back(scene.add(corners));
        base.passes.push_back(scene.add(edges));
        base.passes.push_back(scene.add(flat({0.9f, 0.9f, 0.1f}, 0.3f)));
        const ObjectId materials[] = {scene.add(base), scene.add(edges), scene.add(corners), scene.add(glass)};
        scene.setDark();
        for (int i = 0; i < 12; ++i)
            scene.place(scene.add(makeSheet(0.3, 0.3), materials[i % 4]),
                        {-1.3 + 0.24 * i, 0.05 * (i % 5) - 0.1, -0.1 * (i % 3)},
                        Quatd(Eigen::AngleAxisd(0.3 * i, Vec3d(1, 2, 3).normalized())));
        const Aspect aspect = scene.take();
        const ScreenCamera camera = cameraOf(1200, 300);
        const Picture all = draw(aspect, camera);
        RenderScene shown;
        shown.update(aspect, nullptr);
        for (const CullerKind kind : {CullerKind::kFrustum, CullerKind::kMasked})
            for (int x0 = 0; x0 <= 1050; x0 += 150) {
                const PixelRect rect{.x = x0, .y = 100, .width = 100, .height = 100};
                RenderAction action(kind);
                const auto part = renderer_->draw(aspect, action.run(shown, camera, rect, nullptr), camera, rect);
                ASSERT_TRUE(part) << part.error().message;
                int differ = 0;
                for (int y = 0; y < 100; ++y)
                    for (int x = 0; x < 100; ++x) {
                        const Rgb a = pixel(*part, x, y), b = pixel(all, x0 + x, 100 + y);
                        differ += a.r != b.r || a.g != b.g || a.b != b.b;
                    }
                EXPECT_EQ(differ, 0) << samples << " samples, at " << x0;
            }
    }
}

}  // namespace
}  // namespace tessera

/// How wide lines are drawn where they would cover too much: the same on all tiles, whoever looked before, and nobody
/// else's narrower.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <optional>
#include <random>

#include "client/render/scene/LineWidths.h"
#include "client/render/scene/SceneItems.h"
#include "tests/unit/render/TestScene.h"

namespace tessera {
namespace {

/// A square of 2 x 2 of n x n quads: about 3 n n edges.
MeshData grid(std::uint32_t n) {
    MeshData mesh;
    for (std::uint32_t y = 0; y <= n; ++y)
        for (std::uint32_t x = 0; x <= n; ++x)
            mesh.positions.insert(mesh.positions.end(), {2 * static_cast<float>(x) / static_cast<float>(n) - 1,
                                                         2 * static_cast<float>(y) / static_cast<float>(n) - 1, 0});
    for (std::uint32_t y = 0; y < n; ++y)
        for (std::uint32_t x = 0; x < n; ++x) {
            const std::uint32_t a = y * (n + 1) + x, above = a + n + 1;
            mesh.indices.insert(mesh.indices.end(), {a, a + 1, above + 1, a, above + 1, above});
        }
    return mesh;
}

class LineScene : public TestScene {
public:
    ObjectId outlined(std::int64_t fill, double widthPx, float alpha = 1) {
        const ObjectId id = material(alpha);
        edit.set(id, typeOf<Material>(), fieldId<&Material::fill>, toValue(fill));
        edit.set(id, typeOf<Material>(), fieldId<&Material::lineWidth>, toValue(static_cast<float>(widthPx)));
        edit.set(id, typeOf<Material>(), fieldId<&Material::pointSize>, toValue(static_cast<float>(widthPx)));
        return id;
    }
    /// A surface with edges or corners over it.
    ObjectId surfaceWith(const std::vector<ObjectId>& passes) {
        const ObjectId id = create(typeOf<Material>());
        RefList refs;
        for (const ObjectId pass : passes) refs.push_back(pass);
        edit.set(id, typeOf<Material>(), fieldId<&Material::passes>, toValue(refs));
        return id;
    }
};

/// By node, of what a tile draws.
std::map<ObjectId, float> widthsOf(const DrawList& list) {
    std::map<ObjectId, float> widths;
    for (const auto* items : {&list.opaque, &list.transparent})
        for (const DrawItem& item : *items) widths[item.node] = std::min(item.lineWidth, item.widestLinePx);
    return widths;
}

/// What all edges of a mesh cover, each by itself, of a screen and half a width around it: from where its two ends are
/// on the screen.
double coveredBy(const MeshData& mesh, const Affine3d& world_T_item, const ScreenCamera& camera, double widthPx,
                 bool corners) {
    std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
    for (std::size_t i = 0; i < mesh.indices.size(); ++i) {
        const std::uint32_t a = mesh.indices[i], b = corners ? a : mesh.indices[i % 3 == 2 ? i - 2 : i + 1];
        edges.insert({std::min(a, b), std::max(a, b)});
    }
    const auto at = [&](std::uint32_t v) {
        const Vec3d p(mesh.positions[3 * v], mesh.positions[3 * v + 1], mesh.positions[3 * v + 2]);
        const Vec4d clip = camera.clip_T_eye * (camera.eye_T_world * world_T_item * p).homogeneous();
        return Vec2d(0.5 * camera.pixels.width * (clip.x() / clip.w() + 1),
                     0.5 * camera.pixels.height * (clip.y() / clip.w() + 1));
    };
    const auto inside = [&](const Vec2d& p) {
        return p.minCoeff() >= -widthPx / 2 && p.x() <= camera.pixels.width + widthPx / 2 &&
               p.y() <= camera.pixels.height + widthPx / 2;
    };
    double pixels = 0;
    for (const auto& [from, to] : edges) {
        const Vec2d a = at(from), b = at(to);
        // Short ones: in or out.
        if (inside(0.5 * (a + b))) pixels += widthPx * ((a - b).norm() + widthPx);
    }
    return pixels;
}

TEST(LineWidths, OrdinaryLinesAreAsWideAsTheySay) {
    LineScene scene;
    const ObjectId geometry = scene.geometry(grid(100), scene.outlined(Material::kEdges, 8));
    for (int i = 0; i < 8; ++i) scene.put(geometry, {0.1 * i - 0.4, 0, -3 - 0.3 * i});
    scene.put(scene.geometry(grid(500), scene.outlined(Material::kEdges, 1.5)), {0, 0, -2.5});
    scene.put(scene.geometry(grid(2), scene.outlined(Material::kEdges, 64)), {0, 0, -2});
    scene.apply();
    RenderScene shown;
    shown.update(scene.aspect, nullptr);
    const TestCamera camera(640, 360, 2, 2);
    const DrawList list = RenderAction(CullerKind::kNone).run(shown, camera.camera(), camera.tile(), nullptr);
    EXPECT_EQ(list.narrowed.items, 0u);
    ASSERT_EQ(list.opaque.size(), 10u);
    for (const DrawItem& item : list.opaque) EXPECT_EQ(item.widestLinePx, DrawItem::kAnyWidth);
}

TEST(LineWidths, WhatWouldCoverTooMuchIsNarrowedUntilItDoesNot) {
    for (const bool asPass : {false, true})
        for (const bool corners : {false, true}) {
            LineScene scene;
            const MeshData dense = grid(corners ? 1000 : 578);
            const ObjectId wide = scene.outlined(corners ? Material::kCorners : Material::kEdges, 64);
            const ObjectId node =
                scene.put(scene.geometry(dense, asPass ? scene.surfaceWith({wide}) : wide), {0, 0, -3});
            const ObjectId sparse =
                scene.put(scene.geometry(grid(4), scene.outlined(Material::kEdges, 40)), {0, 0, -2.5});
            scene.apply();
            RenderScene shown;
            shown.update(scene.aspect, nullptr);
            const TestCamera camera(640, 360);
            const DrawList list = RenderAction(CullerKind::kNone).run(shown, camera.camera(), camera.tile(), nullptr);
            auto widths = widthsOf(list);
            EXPECT_EQ(widths[sparse], 40) << "it covers little";
            EXPECT_EQ(list.narrowed.items, 1u);
            EXPECT_EQ(list.narrowed.node, node);
            EXPECT_EQ(list.narrowed.wantedPx, 64);
            EXPECT_EQ(list.narrowed.drawnPx, widths[node]);
            const Affine3d world_T_item(Eigen::Translation3d(0, 0, -3));
            EXPECT_GT(coveredBy(dense, world_T_item, camera.camera(), 64, corners), 20 * kMostLinePixels);
            const double covered =
                coveredBy(dense, world_T_item, camera.camera(), static_cast<double>(widths[node]), corners);
            EXPECT_LT(covered, 1.1 * kMostLinePixels) << widths[node];
            EXPECT_GT(covered, 0.6 * kMostLinePixels) << widths[node];
        }
}

TEST(LineWidths, WhatIsBlendedIsDearer) {
    std::map<bool, float> widths;
    for (const bool blended : {false, true}) {
        LineScene scene;
        const ObjectId node = scene.put(
            scene.geometry(grid(578), scene.outlined(Material::kEdges, 64, blended ? 0.5f : 1.0f)), {0, 0, -3});
        scene.apply();
        RenderScene shown;
        shown.update(scene.aspect, nullptr);
        const TestCamera camera(640, 360);
        widths[blended] =
            widthsOf(RenderAction(CullerKind::kNone).run(shown, camera.camera(), camera.tile(), nullptr))[node];
    }
    EXPECT_LT(widths[true], 0.6 * static_cast<double>(widths[false]));
    EXPECT_GT(widths[true], 0.4 * static_cast<double>(widths[false]));
}

TEST(LineWidths, ManyThingsShareWhatThereIs) {
    LineScene scene;
    // A thousand of 12,288 edges: each by itself is nothing.
    const ObjectId geometry = scene.geometry(grid(64), scene.outlined(Material::kEdges, 30));
    for (int i = 0; i < 1000; ++i) scene.put(geometry, {0, 0, -4 - 0.01 * i});
    scene.apply();
    RenderScene shown;
    shown.update(scene.aspect, nullptr);
    const TestCamera camera(640, 360);
    const DrawList list = RenderAction(CullerKind::kNone).run(shown, camera.camera(), camera.tile(), nullptr);
    EXPECT_EQ(list.narrowed.items, 1000u);
    for (const auto& [node, width] : widthsOf(list)) EXPECT_LE(width, 4);
    // Never below what a line is at least.
    for (const auto& [node, width] : widthsOf(list)) EXPECT_GE(width, 1);
}

// Seams: which lines are how wide may not rest on what a tile shows, who culls, or what was looked at before.
TEST(LineWidths, AreTheSameOnAllTilesAndWhoeverLookedBefore) {
    std::mt19937 random(5);
    const auto number = [&](double least, double most) { return std::uniform_real_distribution(least, most)(random); };
    LineScene scene;
    std::vector<ObjectId> transforms;
    const ObjectId geometries[] = {
        scene.geometry(grid(150), scene.outlined(Material::kEdges, 64)),
        scene.geometry(grid(400), scene.outlined(Material::kCorners, 30)),
        scene.geometry(grid(90), scene.surfaceWith(
                                     {scene.outlined(Material::kEdges, 12), scene.outlined(Material::kCorners, 50)}))};
    for (int i = 0; i < 30; ++i) {
        transforms.push_back(scene.transform({number(-3, 3), number(-2, 2), number(-8, -1)}));
        scene.node(geometries[i % 3], scene.node(transforms.back()));
    }
    scene.apply();
    RenderScene often;
    often.update(scene.aspect, nullptr);
    int narrowedViews = 0;
    for (int view = 0; view < 40; ++view) {
        TestCamera camera(320, 200, 3, 2);
        camera.view.position = Vec3d(number(-1, 1), number(-1, 1), number(-4, 0));
        if (view % 3 == 0) {
            scene.place(transforms[static_cast<std::size_t>(view) % transforms.size()],
                        {number(-3, 3), 0, number(-8, -1)}, Quatd::Identity(), Vec3d::Ones());
            const ChangeList list = scene.apply();
            often.update(scene.aspect, &list);
        }
        RenderScene once;
        once.update(scene.aspect, nullptr);
        const DrawList all = RenderAction(CullerKind::kNone).run(once, camera.camera(), camera.tile(), nullptr);
        const auto widths = widthsOf(all);
        narrowedViews += all.narrowed.items > 0;
        for (int column = 0; column < 3; ++column)
            for (int row = 0; row < 2; ++row) {
                const DrawList tile =
                    RenderAction(CullerKind::kFrustum).run(often, camera.camera(), camera.tile(column, row), nullptr);
                EXPECT_EQ(tile.narrowed.items, all.narrowed.items);
                for (const auto& [node, width] : widthsOf(tile)) EXPECT_EQ(width, widths.at(node)) << node.value;
            }
    }
    EXPECT_GT(narrowedViews, 10);
}

TEST(LineWidths, AFewOfTheLinesTellWhatAllCover) {
    std::mt19937 random(7);
    const auto number = [&](double least, double most) { return std::uniform_real_distribution(least, most)(random); };
    for (int trial = 0; trial < 20; ++trial) {
        const MeshData mesh = grid(200);
        LineScene scene;
        const Vec3d at(number(-2, 2), number(-1.5, 1.5), number(-4, -1.5));
        scene.put(scene.geometry(mesh, scene.outlined(Material::kEdges, 20)), at);
        scene.apply();
        RenderScene shown;
        shown.update(scene.aspect, nullptr);
        const ScreenCamera camera = TestCamera(640, 360).camera();
        const RenderMesh& known = *shown.seenFrom(camera).items.front().mesh;
        const Affine3d world_T_item(Eigen::Translation3d{at});
        const double truth = coveredBy(mesh, world_T_item, camera, 20, false);
        const LinesOnScreen seen =
            linesOnScreen(known, LineSource::kEdges, world_T_item, camera, 20, kMostSampledOfMesh);
        EXPECT_NEAR(seen.covered(20), truth, 0.15 * truth + 0.02 * 20 * 20 * 120000) << trial;
        if (seen.count > 0) {
            EXPECT_NEAR(seen.covered(seen.widthThatCovers(1e6)), 1e6, 1);
        }
    }
}

}  // namespace
}  // namespace tessera

// Parts of large meshes that are hidden, turned away or outside are left away, and nobody can tell from the pictures.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <memory>
#include <random>

#include "client/draw/passes/Renderer.h"
#include "client/render/order/RenderAction.h"
#include "common/geometry/TriangleOrder.h"
#include "tests/golden/TestScene.h"
#include "tests/support/surface/PooledSurface.h"

namespace tessera::test {
namespace {

/// Blobs whose triangles are from many pixels to far below one high, dented so that some lie flat on the screen, and
/// walls and lattices before them that hide parts.
Aspect makeBlobs(std::mt19937& random) {
    std::uniform_real_distribution<double> u(-1, 1);
    TestScene scene;
    std::vector<ObjectId> blobs, plain;
    for (int i = 0; i < 4; ++i) {
        MeshData mesh = i % 2 ? makeTorus(0.8, 0.3, 120 * (i + 1), 60) : makeSphere(0.8, 60 * (i + 1));
        for (std::size_t k = 0; k < mesh.positions.size(); k += 3) {
            const auto scale = static_cast<float>(1 + 0.004 * i * u(random));
            for (std::size_t axis = 0; axis < 3; ++axis) mesh.positions[k + axis] *= scale;
        }
        // Some as hard edges show them: where a triangle turns over is seen at once.
        if (i > 1) mesh.normals.clear();
        mesh.indices = inSpatialOrder(mesh.positions, mesh.indices);
        Material material;
        material.baseColor = {0.9f, static_cast<float>(0.5 + 0.4 * u(random)), 0.3f, i == 3 ? 0.6f : 1.0f};
        material.doubleSided = i == 2 && random() % 2 == 0 ? 1 : 0;
        blobs.push_back(scene.add(mesh, scene.add(material)));
    }
    plain.push_back(scene.add(makeBox({1, 1, 1})));
    plain.push_back(scene.add(makeCylinder(0.5, 1, 24)));
    for (int i = 0; i < 10; ++i) {
        const Quatd rotation(u(random), u(random), u(random), u(random));
        const double size = std::pow(3, u(random));
        Vec3d scale(size, size, (i % 3 == 0 ? -1 : 1) * size);
        if (i % 4 == 1) scale = size * Vec3d(1, 0.2 + std::abs(u(random)), 1);
        scene.place(blobs[random() % blobs.size()], {3 * u(random), 1.5 * u(random), -2 - 6 * std::abs(u(random))},
                    rotation.normalized(), scale);
    }
    for (int i = 0; i < 12; ++i)
        scene.place(plain[random() % plain.size()], {3 * u(random), 1.5 * u(random), -1 - 4 * std::abs(u(random))},
                    i % 2 ? Quatd(u(random), u(random), u(random), u(random)).normalized() : Quatd::Identity(),
                    {0.1 + std::abs(u(random)), 0.1 + 2 * std::abs(u(random)), 0.2});
    scene.addDirectionalLight({0.4, -1, -0.5}, Vec3f::Ones(), 2);
    return scene.take();
}

class CulledParts : public testing::TestWithParam<unsigned> {};

TEST_P(CulledParts, LeaveThePictureAndTheNodesAsTheyAre) {
    std::mt19937 random(GetParam());
    std::uniform_real_distribution<double> u(-1, 1);
    const Aspect blobs = makeBlobs(random);
    RenderScene all;
    all.update(blobs, nullptr);
    const auto surface = test::pooledSurface();
    const auto renderer = Renderer::create(*surface, {.samples = GetParam() % 2 ? 4 : 1}).value();
    std::uint64_t every = 0, byFrustum = 0, byMask = 0;
    // One that remembers sights that are far from each other.
    RenderAction leaping(CullerKind::kMasked);
    for (int sight = 0; sight < 4; ++sight) {
        View view;
        view.position = {u(random), 0.5 * u(random), sight == 3 ? -3.0 : 1.0};
        view.orientation = Quatd(Eigen::AngleAxisd(0.5 * u(random), Vec3d::UnitY()));
        // Larger than a cell, so that some have borders inside of the tile.
        const ScreenCamera camera = cameraOf(1300, 700, {0.3 * u(random), 0.2 * u(random), 1.5}, 3.2, view);
        const PixelRect rect{.x = 400 + static_cast<int>(300 * u(random)), .y = 100, .width = 500, .height = 560};
        const auto drawBy = [&](RenderAction& action, std::uint64_t& triangles) {
            const DrawList list = action.run(all, camera, rect, nullptr);
            auto picture = renderer->draw(blobs, list, camera, rect);
            triangles += renderer->lastCounts().triangles;
            auto ids = renderer->drawNodeIds(blobs, list, camera, rect);
            EXPECT_TRUE(picture && ids);
            return std::pair(std::move(picture->rgb), std::move(*ids));
        };
        const auto draw = [&](CullerKind kind, std::uint64_t& triangles) {
            RenderAction action(kind);
            return drawBy(action, triangles);
        };
        const auto expected = draw(CullerKind::kNone, every);
        EXPECT_TRUE(draw(CullerKind::kFrustum, byFrustum) == expected) << "seed " << GetParam() << ", sight " << sight;
        EXPECT_TRUE(draw(CullerKind::kMasked, byMask) == expected) << "seed " << GetParam() << ", sight " << sight;
        std::uint64_t byLeaping = 0;
        EXPECT_TRUE(drawBy(leaping, byLeaping) == expected) << "seed " << GetParam() << ", sight " << sight;
    }
    // Half of each closed mesh is turned away; what is hidden comes off that.
    EXPECT_LT(byFrustum, 3 * every / 4);
    EXPECT_LT(byMask, byFrustum);
}

/// A hall of large, bumpy shells, many small things inside and behind them: what hides is parts of large meshes alone.
Aspect makeShells(std::mt19937& random) {
    std::uniform_real_distribution<double> u(-1, 1);
    TestScene scene;
    std::vector<ObjectId> shells, small;
    for (int i = 0; i < 3; ++i) {
        MeshData mesh = i == 0 ? makeSphere(1, 70) : i == 1 ? makeTorus(0.7, 0.3, 110, 50) : makeTube(0.9, 0.7, 2, 900);
        for (std::size_t k = 0; k < mesh.positions.size(); k += 3) {
            const auto scale = static_cast<float>(1 + 0.001 * u(random));
            for (std::size_t axis = 0; axis < 3; ++axis) mesh.positions[k + axis] *= scale;
        }
        // Holes, from one triangle to a whole cluster and more.
        for (int hole = 0; hole < 4; ++hole) {
            const std::size_t triangles = mesh.indices.size() / 3, count = std::size_t{1} << random() % 10;
            const auto first = mesh.indices.begin() + static_cast<std::ptrdiff_t>(3 * (random() % (triangles - count)));
            mesh.indices.erase(first, first + static_cast<std::ptrdiff_t>(3 * count));
        }
        mesh.indices = inSpatialOrder(mesh.positions, mesh.indices);
        shells.push_back(scene.add(mesh));
    }
    small.push_back(scene.add(makeTorus(0.7, 0.3, 40, 30)));
    small.push_back(scene.add(makeSphere(1, 24)));
    for (int i = 0; i < 9; ++i)
        scene.place(shells[random() % shells.size()], {3 * u(random), 1.5 * u(random), -3 - 4 * std::abs(u(random))},
                    Quatd(u(random), u(random), u(random), u(random)).normalized(),
                    (1 + std::abs(u(random))) * Vec3d(1, 1, i % 3 == 0 ? -1 : 1));
    for (int i = 0; i < 300; ++i)
        scene.place(small[random() % small.size()], {6 * u(random), 3 * u(random), -3 - 12 * std::abs(u(random))},
                    Quatd(u(random), u(random), u(random), u(random)).normalized(),
                    Vec3d::Constant(0.05 + 0.1 * std::abs(u(random))));
    scene.addDirectionalLight({0.4, -1, -0.5}, Vec3f::Ones(), 2);
    return scene.take();
}

class CulledBehindParts : public testing::TestWithParam<unsigned> {};

TEST_P(CulledBehindParts, LeavesThePictureAndTheNodesAsTheyAre) {
    std::mt19937 random(GetParam());
    std::uniform_real_distribution<double> u(-1, 1);
    const Aspect shells = makeShells(random);
    RenderScene all;
    all.update(shells, nullptr);
    const auto surface = test::pooledSurface();
    const auto renderer = Renderer::create(*surface, {.samples = GetParam() % 2 ? 4 : 1}).value();
    RenderAction none(CullerKind::kNone), masked(CullerKind::kMasked);
    std::uint64_t inFrustum = 0, drawn = 0;
    for (int sight = 0; sight < 6; ++sight) {
        View view;
        view.position = {3 * u(random), u(random), -2 + 4 * u(random)};
        view.orientation = Quatd(Eigen::AngleAxisd(0.7 * u(random), Vec3d::UnitY()));
        const ScreenCamera camera = cameraOf(1300, 700, {0.3 * u(random), 0.2 * u(random), 1.5}, 3.2, view);
        const PixelRect rect{.x = 400 + static_cast<int>(300 * u(random)), .y = 100, .width = 500, .height = 560};
        const auto draw = [&](RenderAction& action) {
            CullCounts counts;
            const DrawList list = action.run(all, camera, rect, &counts);
            auto picture = renderer->draw(shells, list, camera, rect);
            auto ids = renderer->drawNodeIds(shells, list, camera, rect);
            EXPECT_TRUE(picture && ids);
            inFrustum += &action == &masked ? counts.inFrustum : 0;
            drawn += &action == &masked ? counts.drawn : 0;
            return std::pair(std::move(picture->rgb), std::move(*ids));
        };
        const auto expected = draw(none);
        EXPECT_TRUE(draw(masked) == expected) << "seed " << GetParam() << ", sight " << sight;
    }
    RecordProperty("drawn", std::to_string(drawn) + " of " + std::to_string(inFrustum));
    // Of what is in the frustum a part is hidden, by nothing but parts of meshes.
    EXPECT_LT(drawn, 9 * inFrustum / 10);
}

INSTANTIATE_TEST_SUITE_P(Blobs, CulledParts, testing::Range(0u, 5u));
INSTANTIATE_TEST_SUITE_P(Shells, CulledBehindParts, testing::Range(0u, 5u));

}  // namespace
}  // namespace tessera::test

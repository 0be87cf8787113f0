// What may hide what. Each case is one that a careless software depth buffer gets wrong.
#include <random>

#include "client/render/scene/OccluderMesh.h"
#include "common/cores/Image.h"
#include "tests/unit/render/VisibilityOracle.h"

namespace tessera {
namespace {

const CullerKind kMasked = CullerKind::kMasked;

/// A rectangle in the plane z, front towards +z, as a grid of quads.
MeshData sheet(const Vec2d& lower, const Vec2d& upper, double z, int columns = 1, int rows = 1) {
    MeshData mesh;
    for (int j = 0; j <= rows; ++j) {
        for (int i = 0; i <= columns; ++i) {
            mesh.positions.push_back(static_cast<float>(lower.x() + (upper.x() - lower.x()) * i / columns));
            mesh.positions.push_back(static_cast<float>(lower.y() + (upper.y() - lower.y()) * j / rows));
            mesh.positions.push_back(static_cast<float>(z));
        }
    }
    for (int j = 0; j < rows; ++j) {
        for (int i = 0; i < columns; ++i) {
            const auto a = static_cast<std::uint32_t>(j * (columns + 1) + i);
            const auto c = a + static_cast<std::uint32_t>(columns) + 1;
            mesh.indices.insert(mesh.indices.end(), {a, a + 1, c + 1, a, c + 1, c});
        }
    }
    return mesh;
}

/// A small box straight ahead, far behind everything the tests put in between.
ObjectId distantBox(TestScene& scene, const Vec3d& center = {0, 0, -20}, double size = 1) {
    return scene.box(center, Vec3d::Constant(size));
}

TEST(OccluderMesh, WeldsVerticesAndKnowsWhatLiesBehindEachEdge) {
    const MeshData box = makeBox({1, 2, 3});
    const OccluderMesh mesh(box.positions, box.indices);
    EXPECT_EQ(mesh.points().size(), 8u);
    ASSERT_EQ(mesh.triangles().size(), 12u);
    for (const OccluderMesh::Triangle& t : mesh.triangles())
        for (const std::uint32_t other : t.behind) EXPECT_NE(other, OccluderMesh::kNone);
}

TEST(OccluderMesh, EdgesOfOneOrThreeTrianglesOrOfReversedOnesAreBorders) {
    const std::vector<float> points{0, 0, 0, 1, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 1};
    const auto bordersOf = [&](const std::vector<std::uint32_t>& indices) {
        int borders = 0;
        const OccluderMesh mesh(points, indices);
        for (const auto& t : mesh.triangles())
            for (const std::uint32_t other : t.behind) borders += other == OccluderMesh::kNone;
        return borders;
    };
    EXPECT_EQ(bordersOf({0, 1, 2}), 3);
    EXPECT_EQ(bordersOf({0, 1, 2, 1, 0, 3}), 4);
    EXPECT_EQ(bordersOf({0, 1, 2, 0, 1, 3}), 6);           // the second is wound the other way
    EXPECT_EQ(bordersOf({0, 1, 2, 1, 0, 3, 1, 0, 4}), 9);  // three at one edge
    EXPECT_EQ(bordersOf({0, 1, 2, 1, 0, 3, 0, 1, 1}), 4);  // a triangle without area between them
}

TEST(OccluderMesh, ClustersAreThoseOfTheIndicesWithoutWhatHasNoArea) {
    MeshData mesh = makeSphere(1, 40);
    // Two of the second cluster and all of the fourth become points.
    for (const std::size_t t : {300u, 301u}) mesh.indices[3 * t] = mesh.indices[3 * t + 1];
    for (std::size_t t = 768; t < 1024; ++t) mesh.indices[3 * t] = mesh.indices[3 * t + 1];
    const OccluderMesh whole(makeSphere(1, 40).positions, makeSphere(1, 40).indices);
    const OccluderMesh occluder(mesh.positions, mesh.indices);
    const std::size_t clusters = (mesh.indices.size() / 3 + 255) / 256;
    const auto sizeOf = [](OccluderMesh::Run run) { return run.end - run.first; };
    std::uint32_t end = 0;
    for (std::size_t k = 0; k < clusters; ++k) {
        EXPECT_EQ(occluder.cluster(k).first, end) << k;
        end = occluder.cluster(k).end;
        const std::uint32_t before = sizeOf(whole.cluster(k));
        EXPECT_LE(sizeOf(occluder.cluster(k)), k == 3 ? 0 : before);
        if (k != 1 && k != 3) {
            EXPECT_EQ(sizeOf(occluder.cluster(k)), before);
        }
    }
    EXPECT_EQ(sizeOf(occluder.cluster(1)), sizeOf(whole.cluster(1)) - 2);
    EXPECT_EQ(end, occluder.all().end);
}

TEST(Masked, ABoxHidesWhatIsBehindIt) {
    TestScene scene;
    const ObjectId wall = scene.box({0, 0, -5}, {4, 4, 1});
    const ObjectId hidden = distantBox(scene);
    const ObjectId beside = distantBox(scene, {9.6, 0, -20});
    scene.apply();
    CullCounts counts;
    const DrawList list = cull(scene, kMasked, TestCamera(), &counts);
    EXPECT_TRUE(draws(list, wall));
    EXPECT_FALSE(draws(list, hidden));
    EXPECT_TRUE(draws(list, beside));
    EXPECT_EQ(counts.inFrustum, 3u);
    EXPECT_EQ(counts.drawn, 2u);
    EXPECT_EQ(counts.trianglesDrawn, 24u);
}

TEST(Masked, WhatStandsInFrontOrSticksOutStays) {
    TestScene scene;
    scene.box({0, 0, -5}, {4, 4, 1});
    const ObjectId front = scene.box({0, 0, -3}, {0.2, 0.2, 0.2});
    const ObjectId through = scene.box({0, 0, -5}, {0.3, 0.3, 1.2});
    const ObjectId onTheFace = scene.box({0.5, 0, -4.5}, {0.3, 0.3, 0.001});
    const ObjectId sticksOut = scene.box({0, 0, -7}, {8.7, 0.1, 0.1});
    scene.apply();
    const DrawList list = cull(scene, kMasked, TestCamera());
    for (const ObjectId id : {front, through, onTheFace, sticksOut}) EXPECT_TRUE(draws(list, id)) << id.value;
}

TEST(Masked, ASlitNarrowerThanAPixelLetsThroughWhatIsBehindIt) {
    // One pixel is about 0.016 wide at the boxes' front.
    for (const double slit : {0.0, 1e-6, 0.0005, 0.005, 0.02}) {
        for (const double shift : {0.0, 0.003, 0.0077, 0.011}) {
            TestScene scene;
            scene.box({-1 - slit / 2 + shift, 0, -5}, {2, 4, 1});
            scene.box({1 + slit / 2 + shift, 0, -5}, {2, 4, 1});
            const ObjectId behind = distantBox(scene);
            const ObjectId aside = distantBox(scene, {2.2, 0, -20}, 0.5);
            scene.apply();
            const DrawList list = cull(scene, kMasked, TestCamera());
            EXPECT_TRUE(draws(list, behind)) << slit << " " << shift;
            EXPECT_FALSE(draws(list, aside)) << slit << " " << shift;
        }
    }
}

TEST(Masked, AWholeTessellatedSheetHidesAndOneWithATJunctionDoesNotAlongTheJunction) {
    TestScene whole;
    whole.put(whole.geometry(sheet({-2, -2}, {2, 2}, 0, 5, 5)), {0, 0, -5});
    const ObjectId hidden = distantBox(whole);
    whole.apply();
    EXPECT_FALSE(draws(cull(whole, kMasked, TestCamera()), hidden));

    // Three quads on the left of x = 0, two on the right: their corners do not meet.
    TestScene joined;
    MeshData mesh = sheet({-2, -2}, {0, 2}, 0, 1, 3);
    mesh.append(sheet({0, -2}, {2, 2}, 0, 1, 2), Affine3d::Identity());
    joined.put(joined.geometry(mesh), {0, 0, -5});
    const ObjectId behindTheJunction = distantBox(joined);
    const ObjectId behindTheSheet = distantBox(joined, {3, 0, -20});
    joined.apply();
    const DrawList list = cull(joined, kMasked, TestCamera());
    EXPECT_TRUE(draws(list, behindTheJunction));
    EXPECT_FALSE(draws(list, behindTheSheet));
}

TEST(Masked, AHoleMuchSmallerThanAPixelIsAHole) {
    // A fine sheet, one of its triangles missing: about a tenth of a pixel wide.
    TestScene scene;
    MeshData mesh = sheet({-2, -2}, {2, 2}, 0, 3, 3);
    MeshData fine = sheet({-0.003, -0.003}, {0.003, 0.003}, 0, 3, 3);
    fine.indices.erase(fine.indices.begin() + 24, fine.indices.begin() + 27);
    // The middle quad of the coarse sheet gives way to a ring of four quads around the fine one.
    mesh.indices.erase(mesh.indices.begin() + 24, mesh.indices.begin() + 30);
    const double c = 2.0 / 3;
    const auto ring = [&](const std::array<Vec2d, 4>& q) {
        const auto base = static_cast<std::uint32_t>(mesh.positions.size() / 3);
        for (const Vec2d& p : q) {
            mesh.positions.push_back(static_cast<float>(p.x()));
            mesh.positions.push_back(static_cast<float>(p.y()));
            mesh.positions.push_back(0);
        }
        mesh.indices.insert(mesh.indices.end(), {base, base + 1, base + 2, base, base + 2, base + 3});
    };
    const double f = 0.003;
    ring({Vec2d(-c, -c), Vec2d(c, -c), Vec2d(f, -f), Vec2d(-f, -f)});
    ring({Vec2d(c, -c), Vec2d(c, c), Vec2d(f, f), Vec2d(f, -f)});
    ring({Vec2d(c, c), Vec2d(-c, c), Vec2d(-f, f), Vec2d(f, f)});
    ring({Vec2d(-c, c), Vec2d(-c, -c), Vec2d(-f, -f), Vec2d(-f, f)});
    mesh.append(fine, Affine3d::Identity());
    scene.put(scene.geometry(mesh), {0, 0, -5});
    const ObjectId behind = distantBox(scene);
    scene.apply();
    EXPECT_TRUE(draws(cull(scene, kMasked, TestCamera()), behind));
}

TEST(Masked, BackFacesAndTheirMirrorImagesHideNothing) {
    const MeshData front = sheet({-2, -2}, {2, 2}, 0);
    const Quatd turned(Eigen::AngleAxisd(M_PI, Vec3d::UnitY()));
    struct Case {
        Quatd rotation;
        Vec3d scale;
        bool hides;
    };
    for (const Case& c : {Case{Quatd::Identity(), {1, 1, 1}, true}, Case{turned, {1, 1, 1}, false},
                          Case{Quatd::Identity(), {-1, 1, 1}, true}, Case{Quatd::Identity(), {1, 1, -1}, false},
                          Case{turned, {-1, 1, 1}, false}}) {
        TestScene scene;
        scene.put(scene.geometry(front), {0, 0, -5}, c.rotation, c.scale);
        const ObjectId behind = distantBox(scene);
        scene.apply();
        // Reflected to the side a sheet shows the same face; reflected in its own plane, its back.
        EXPECT_EQ(draws(cull(scene, kMasked, TestCamera()), behind), !c.hides) << c.scale.transpose();
    }
}

TEST(Masked, GlassIsHiddenButHidesNothing) {
    TestScene scene;
    const ObjectId glass = scene.material(0.9f);
    const ObjectId pane = scene.put(scene.geometry(makeBox({4, 4, 0.1}), glass), {0, 0, -5});
    const ObjectId behind = distantBox(scene, {0, 0, -20}, 3);
    const ObjectId hiddenPane = scene.put(scene.geometry(makeBox({0.5, 0.5, 0.5}), glass), {0, 0, -40});
    scene.apply();
    const DrawList list = cull(scene, kMasked, TestCamera());
    EXPECT_TRUE(draws(list, pane));
    EXPECT_TRUE(draws(list, behind));
    EXPECT_FALSE(draws(list, hiddenPane));
}

TEST(Masked, ColoursAndImagesWithAlphaHideNothing) {
    for (const std::uint8_t alpha : {std::uint8_t{255}, std::uint8_t{254}}) {
        TestScene colored;
        MeshData wall = makeBox({4, 4, 1});
        wall.colors.assign(wall.positions.size() / 3 * 4, 255);
        wall.colors[7] = alpha;
        colored.put(colored.geometry(wall), {0, 0, -5});
        const ObjectId behindColors = distantBox(colored);
        colored.apply();
        EXPECT_EQ(draws(cull(colored, kMasked, TestCamera()), behindColors), alpha != 255);

        TestScene textured;
        const std::vector<std::uint8_t> pixels{1, 2, 3, 255, 4, 5, 6, alpha};
        const ObjectId image = textured.create(typeOf<Image>());
        textured.edit.set(image, typeOf<Image>(), fieldId<&Image::pixels>,
                          toValue(Blob::of(std::span<const std::uint8_t>(pixels))));
        textured.edit.set(image, typeOf<Image>(), fieldId<&Image::widthPx>, toValue(std::int64_t{2}));
        textured.edit.set(image, typeOf<Image>(), fieldId<&Image::heightPx>, toValue(std::int64_t{1}));
        const ObjectId material = textured.material(1.0f);
        textured.edit.set(material, typeOf<Material>(), fieldId<&Material::baseColorImage>, toValue(image));
        textured.put(textured.geometry(makeBox({4, 4, 1}), material), {0, 0, -5});
        const ObjectId behindImage = distantBox(textured);
        textured.apply();
        EXPECT_EQ(draws(cull(textured, kMasked, TestCamera()), behindImage), alpha != 255);
    }
}

TEST(Masked, AnImagesAlphaCountsAsTheMaterialsModeSays) {
    for (const auto& [mode, hides] : {std::pair(Material::kAutoAlpha, false),
                                      {Material::kOpaque, true},
                                      {Material::kMask, false},
                                      {Material::kBlend, false}}) {
        TestScene scene;
        const std::vector<std::uint8_t> pixels{1, 2, 3, 255, 4, 5, 6, 0};
        const ObjectId image = scene.create(typeOf<Image>());
        scene.edit.set(image, typeOf<Image>(), fieldId<&Image::pixels>,
                       toValue(Blob::of(std::span<const std::uint8_t>(pixels))));
        scene.edit.set(image, typeOf<Image>(), fieldId<&Image::widthPx>, toValue(std::int64_t{2}));
        scene.edit.set(image, typeOf<Image>(), fieldId<&Image::heightPx>, toValue(std::int64_t{1}));
        const ObjectId material = scene.material(1.0f);
        scene.edit.set(material, typeOf<Material>(), fieldId<&Material::baseColorImage>, toValue(image));
        scene.edit.set(material, typeOf<Material>(), fieldId<&Material::alphaMode>, toValue(std::int64_t{mode}));
        scene.put(scene.geometry(makeBox({4, 4, 1}), material), {0, 0, -5});
        const ObjectId behind = distantBox(scene);
        scene.apply();
        const DrawList list = cull(scene, kMasked, TestCamera());
        EXPECT_EQ(draws(list, behind), !hides) << "mode " << mode;
        EXPECT_EQ(list.transparent.size(), mode == Material::kBlend ? 1u : 0u) << "mode " << mode;
    }
}

TEST(Masked, WhatItsCutoffLeavesNothingOfHidesNothing) {
    for (const float cutoff : {0.5f, 1.0f, 1.5f}) {
        TestScene scene;
        const ObjectId material = scene.material(1.0f);
        scene.edit.set(material, typeOf<Material>(), fieldId<&Material::alphaMode>,
                       toValue(std::int64_t{Material::kMask}));
        scene.edit.set(material, typeOf<Material>(), fieldId<&Material::alphaCutoff>, toValue(cutoff));
        scene.put(scene.geometry(makeBox({4, 4, 1}), material), {0, 0, -5});
        const ObjectId behind = distantBox(scene);
        scene.apply();
        EXPECT_EQ(draws(cull(scene, kMasked, TestCamera()), behind), cutoff > 0.5f) << cutoff;
    }
}

TEST(Masked, AWallThatReachesBehindTheEyeStillHidesWhatIsBeyondIt) {
    TestScene scene;
    // Along the left of the eye, from behind it far into the distance.
    scene.box({-1.5, 0, -10}, {1, 40, 60});
    const ObjectId hidden = scene.box({-6, 0, -12}, {1, 1, 1});
    const ObjectId ahead = scene.box({0, 0, -12}, {1, 1, 1});
    scene.apply();
    const DrawList list = cull(scene, kMasked, TestCamera());
    EXPECT_FALSE(draws(list, hidden));
    EXPECT_TRUE(draws(list, ahead));
}

TEST(Masked, WhatHoldsTheEyeOrReachesTheNearPlaneIsVisibleAndHidesNothingBehindTheCut) {
    TestScene scene;
    const ObjectId around = scene.box({0, 0, 0}, {0.2, 0.2, 0.2});
    const ObjectId room = scene.put(scene.geometry(makeBox({80, 80, 80})), {0, 0, 0}, Quatd::Identity(), {-1, 1, 1});
    // The near plane, 0.05 m off, opens the front of this one.
    const ObjectId cut = scene.box({0, 0, -0.5}, {3, 3, 0.92});
    const ObjectId seenThroughTheCut = scene.box({0, 0, -20}, {1, 1, 1});
    const ObjectId justBeyondTheNearPlane = scene.box({0.005, 0.003, -0.06}, {0.01, 0.01, 0.01});
    scene.apply();
    const DrawList list = cull(scene, kMasked, TestCamera());
    for (const ObjectId id : {around, room, cut, seenThroughTheCut, justBeyondTheNearPlane})
        EXPECT_TRUE(draws(list, id)) << id.value;
}

TEST(Masked, AFloorSeenAtAGrazingAngleDoesNotHideWhatStandsOnIt) {
    TestScene scene;
    scene.box({0, -0.12, -30}, {80, 0.2, 60});
    std::vector<ObjectId> standing;
    for (int i = 1; i < 50; ++i) standing.push_back(scene.box({0.1 * i, -0.0195, -1.0 * i}, {0.05, 0.001, 0.05}));
    const ObjectId below = scene.box({0, -1.5, -50}, {1, 1, 1});
    scene.apply();
    const DrawList list = cull(scene, kMasked, TestCamera());
    for (const ObjectId id : standing) EXPECT_TRUE(draws(list, id));
    EXPECT_FALSE(draws(list, below));
}

TEST(Masked, AnInnerLayerDoesNotCutItsHousingOpenAndDoesNotPushItBack) {
    TestScene scene;
    // One mesh: a plate in front, small ones behind whose outlines lie within the plate's.
    MeshData mesh = sheet({-2, -2}, {2, 2}, 0);
    for (int i = 1; i < 6; ++i)
        mesh.append(sheet({-0.3 * i, -0.3 * i}, {0.3 * i, 0.3 * i}, -0.5 * i), Affine3d::Identity());
    scene.put(scene.geometry(mesh), {0, 0, -5});
    const ObjectId inside = scene.box({0.1, 0.1, -5.2}, {0.5, 0.5, 0.1});
    const ObjectId behind = distantBox(scene);
    scene.apply();
    const DrawList list = cull(scene, kMasked, TestCamera());
    EXPECT_FALSE(draws(list, inside));
    EXPECT_FALSE(draws(list, behind));
}

TEST(Masked, ATinyMeshManyTrianglesPerPixelIsNoDangerToWhatIsBehind) {
    TestScene scene;
    scene.put(scene.geometry(makeTorus(0.6, 0.25, 200, 100)), {0, 0, -6},
              Quatd(Eigen::AngleAxisd(M_PI / 2, Vec3d::UnitX())));
    const ObjectId throughTheRing = distantBox(scene, {0, 0, -30}, 0.1);
    scene.apply();
    EXPECT_TRUE(draws(cull(scene, kMasked, TestCamera(100, 60)), throughTheRing));
}

TEST(Masked, WhereSinglePrecisionIsTooCoarseNothingIsHidden) {
    // Far away by a transform, which is combined with the camera's in double, or by the vertices' own coordinates.
    struct Case {
        double away;
        bool baked;
        bool hides;
    };
    for (const Case& c :
         {Case{1e3, false, true}, Case{1e8, false, true}, Case{10, true, true}, Case{1e6, true, false}}) {
        TestScene scene;
        const Vec3d shift(c.away, 0, 0);
        const auto put = [&](const Vec3d& at, const Vec3d& size) {
            if (!c.baked) return scene.box(shift + at, size);
            MeshData mesh;
            mesh.append(makeBox(size), Affine3d(Eigen::Translation3d(shift)));
            return scene.put(scene.geometry(mesh), at);
        };
        put({0, 0, -5}, {4, 4, 1});
        const ObjectId behind = put({0, 0, -20}, {1, 1, 1});
        scene.apply();
        TestCamera camera;
        camera.view.position += shift;
        EXPECT_EQ(draws(cull(scene, kMasked, camera), behind), !c.hides) << c.away;
    }
}

// The gate: whatever a supersampling oracle sees is in the list, in random scenes from random places.
TEST(Masked, NeverHidesWhatTheOracleSees) {
    std::uint64_t hidden = 0;
    std::uint64_t invisible = 0;
    for (unsigned seed = 0; seed < 24; ++seed) {
        std::mt19937 random(seed);
        const auto uniform = [&](double from, double to) {
            return std::uniform_real_distribution<double>(from, to)(random);
        };
        TestScene scene;
        const ObjectId glass = scene.material(0.5f);
        const ObjectId sheetMaterial = scene.material(1.0f);
        scene.edit.set(sheetMaterial, typeOf<Material>(), fieldId<&Material::doubleSided>, true);
        std::vector<ObjectId> cores;
        for (const ObjectId material : {ObjectId{}, sheetMaterial, glass}) {
            cores.push_back(scene.geometry(makeBox({1, 1, 1}), material));
            cores.push_back(scene.geometry(makeBox({2, 2, 0.1}), material));
            cores.push_back(scene.geometry(makeSphere(0.8, 10), material));
            cores.push_back(scene.geometry(makeTorus(0.8, 0.3, 12, 8), material));
            cores.push_back(scene.geometry(sheet({-1, -1}, {1, 1}, 0, 3, 3), material));
        }
        for (int i = 0; i < 70; ++i) {
            const std::size_t core = random() % (i % 4 == 0 ? cores.size() : 2);
            const bool axisAligned = random() % 3 == 0;
            const Quatd rotation = axisAligned ? Quatd::Identity()
                                               : Quatd(uniform(0.1, 1), uniform(-1, 1), uniform(-1, 1), uniform(-1, 1));
            const Vec3d at(uniform(-4, 4), uniform(-2, 2), uniform(-12, 0.5));
            const Vec3d scale(uniform(0.2, 2.2), uniform(0.2, 2.2), (random() % 5 == 0 ? -1 : 1) * uniform(0.2, 2.2));
            scene.put(cores[core], at, rotation, scale);
            if (random() % 10 == 0) scene.put(cores[core], at, rotation, scale);
        }
        scene.apply();
        TestCamera camera(75, 43, 2, 1);
        camera.user.position += Vec3d(uniform(-0.4, 0.4), uniform(-0.3, 0.3), uniform(-1, 1));
        camera.view.orientation =
            Quatd(Eigen::AngleAxisd(uniform(-0.3, 0.3), Vec3d(uniform(-1, 1), 1, uniform(-1, 1)).normalized()));
        RenderScene all;
        all.update(scene.aspect, nullptr);
        RenderAction frustum(CullerKind::kFrustum);
        // One for all steps and both tiles: what it remembers is then often wrong, and must not matter.
        RenderAction masked(kMasked);
        for (int step = 0; step < 4; ++step) {
            camera.user.position += Vec3d(uniform(-0.2, 0.2), uniform(-0.1, 0.1), uniform(-0.2, 0.2));
            const ScreenCamera view = camera.camera();
            const PixelRect tile = camera.tile(step % 2, 0);
            const DrawList whole = frustum.run(all, view, tile, nullptr);
            const DrawList culled = masked.run(all, view, tile, nullptr);
            const std::set<ObjectId> visible = visibleNodes(scene.aspect, whole, view, tile);
            const std::vector<ObjectId> drawn = nodesOf(culled);
            const std::set<ObjectId> kept(drawn.begin(), drawn.end());
            for (const ObjectId id : visible)
                EXPECT_TRUE(kept.contains(id)) << "seed " << seed << " step " << step << " node " << id.value;
            hidden += nodesOf(whole).size() - drawn.size();
            invisible += nodesOf(whole).size() - visible.size();
        }
    }
    // It is of use, too: a good share of what the oracle does not see is left away, though a pixel is coarse here.
    EXPECT_GT(hidden, invisible / 3);
    RecordProperty("hidden", static_cast<int>(hidden));
    RecordProperty("invisible", static_cast<int>(invisible));
}

}  // namespace
}  // namespace tessera

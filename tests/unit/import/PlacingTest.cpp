// Where what is loaded comes to stand.
#include "common/cores/Camera.h"
#include "common/cores/Geometry.h"
#include "common/cores/Transform.h"
#include "tests/unit/import/ImportFixture.h"

#include "common/drawable/SceneBounds.h"
#include "common/scene/Action.h"
#include "common/scenefile/SceneFile.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/GltfText.h"
#include "tests/unit/import/Picture.h"

namespace tessera {
namespace {

// A slab, 4 along X, 2 along Y, 1 along Z, its corner at (10, 20, 30): no two of its sides are alike.
std::string slabOff() {
    return "OFF\n8 6 0\n10 20 30\n14 20 30\n14 22 30\n10 22 30\n10 20 31\n14 20 31\n14 22 31\n10 22 31\n"
           "4 3 2 1 0\n4 4 5 6 7\n4 0 1 5 4\n4 1 2 6 5\n4 2 3 7 6\n4 3 0 4 7\n";
}

std::string slabObj() {
    return "v 10 20 30\nv 14 20 30\nv 14 22 30\nv 10 22 30\nv 10 20 31\nv 14 20 31\nv 14 22 31\nv 10 22 31\n"
           "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
}

struct PlacedFile {
    Box box;
    std::vector<std::string> notes;
    std::string error;
    bool hasTransform = false;
};

PlacedFile placedFile(const std::string& path, const std::optional<Placing>& placing) {
    ImportOptions options = importOptions();
    options.placing = placing;
    Expected<ImportedScene> scene = importScene(path, kRootNode, options);
    if (!scene) return {.box = {}, .notes = {}, .error = scene.error().message};
    PlacedFile placed{.box = {}, .notes = scene->notes, .error = {}};
    const ImportedAspect aspect(std::move(*scene));
    placed.box = sceneBounds(*aspect);
    const Node& top = *aspect->get<Node>(*aspect->get<Node>(kRootNode)->children.begin());
    placed.hasTransform = aspect->coreOf<Transform>(top) != nullptr;
    return placed;
}

bool hasNote(const PlacedFile& placed, std::string_view part) {
    return std::ranges::any_of(placed.notes,
                               [&](const std::string& note) { return note.find(part) != std::string::npos; });
}

std::string notesIn(const PlacedFile& placed) {
    return fmt::format("{}", fmt::join(placed.notes, "\n"));
}

void expectBox(const Box& box, const Vec3d& lower, const Vec3d& upper) {
    const double within = 1e-6 * upper.cwiseAbs().cwiseMax(lower.cwiseAbs()).maxCoeff();
    EXPECT_LT((box.lower - lower).cwiseAbs().maxCoeff(), within) << box.lower.transpose();
    EXPECT_LT((box.upper - upper).cwiseAbs().maxCoeff(), within) << box.upper.transpose();
}

/// Of a scene and of a model: whether a file's camera is enabled where the file stands so.
TEST(Placing, CamerasOfWhatStandsInMetresDoNotTakeTheView) {
    const Scratch scratch;
    const std::string scene = scratch.write(
        "room.tsct", "node { name: \"camera\" camera {} }\nnode { name: \"box\" box { size { x: 1 y: 1 z: 1 } } }\n");
    const auto cameraOf = [&](const std::string& path, const Placing& placing) {
        ImportOptions options = importOptions();
        options.placing = placing;
        Expected<ImportedScene> imported = importScene(path, kRootNode, options);
        EXPECT_TRUE(imported) << imported.error().message;
        const bool told = std::ranges::any_of(imported->notes, [](const std::string& note) {
            return note.find("its cameras do not take the view") != std::string::npos;
        });
        const ImportedAspect aspect(std::move(*imported));
        const std::vector<const Camera*> cameras = allOf<Camera>(aspect);
        EXPECT_EQ(cameras.size(), 1u);
        EXPECT_EQ(told, !cameras.front()->enabled) << "it is said where it is so";
        return cameras.front()->enabled;
    };
    const Placing fit{.fit = 2.0}, at{.at = Vec3d(0, 1, -1)}, up{.up = UpAxis::kZ}, radius{.pointRadius = 0.5};
    EXPECT_TRUE(cameraOf(scene, {}));
    EXPECT_TRUE(cameraOf(scene, up));
    EXPECT_TRUE(cameraOf(scene, radius));
    EXPECT_FALSE(cameraOf(scene, at));
    EXPECT_FALSE(cameraOf(scene, fit));
}

TEST(Placing, NobodySaidAnythingLeavesModelsAsTheyAre) {
    const Scratch scratch;
    const PlacedFile off = placedFile(scratch.write("slab.off", slabOff()), std::nullopt);
    expectBox(off.box, {10, 20, 30}, {14, 22, 31});
    EXPECT_FALSE(off.hasTransform);
}

TEST(Placing, UpIsAsTheFileSaysOrAsItsKindMostlyHasIt) {
    const Scratch scratch;
    const std::string offFile = scratch.write("slab.OFF", slabOff()), objFile = scratch.write("slab.obj", slabObj());
    const PlacedFile off = placedFile(offFile, Placing());
    expectBox(off.box, {10, 30, -22}, {14, 31, -20});  // Z comes to Y, Y to -Z
    EXPECT_WORDS(notesIn(off)) << "it was guessed";
    EXPECT_TRUE(off.hasTransform);
    expectBox(placedFile(offFile, Placing{.up = UpAxis::kY}).box, {10, 20, 30}, {14, 22, 31});
    EXPECT_FALSE(hasNote(placedFile(offFile, Placing{.up = UpAxis::kZ}), "taken to be")) << "it was said";

    const PlacedFile obj = placedFile(objFile, Placing());
    expectBox(obj.box, {10, 20, 30}, {14, 22, 31});
    EXPECT_WORDS(notesIn(obj));
    EXPECT_TRUE(obj.hasTransform) << "so that it can be moved";
    expectBox(placedFile(objFile, Placing{.up = UpAxis::kZ}).box, {10, 30, -22}, {14, 31, -20});
}

TEST(Placing, OfFormatsThatSayWhichWayIsUpNothingIsGuessed) {
    const std::string models = kDebianModels;
    for (const char* file :
         {"/3DS/fels.3ds", "/FBX/box.fbx", "/FBX/embedded_ascii/box.FBX", "/3MF/box.3mf", "/Collada/COLLADA.dae"}) {
        ASSERT_TRUE(std::filesystem::exists(models + file)) << file;
        const PlacedFile placed = placedFile(models + file, Placing());
        EXPECT_EQ(placed.error, "") << file;
        EXPECT_FALSE(hasNote(placed, "way is up")) << file;
        // 3MF has +Z up, and so says one FBX; assimp has turned 3DS and Collada.
        const bool turned = std::string_view(file).ends_with(".3mf") || std::string_view(file).ends_with(".FBX");
        const Box plain = placedFile(models + file, Placing{.up = UpAxis::kY}).box;
        const Box asZ = placedFile(models + file, Placing{.up = UpAxis::kZ}).box;
        EXPECT_EQ(placed.box.lower, turned ? asZ.lower : plain.lower) << file;
        EXPECT_EQ(placed.box.upper, turned ? asZ.upper : plain.upper) << file;
    }
    const PlacedFile gltf = placedFile(kEngine, Placing());
    EXPECT_FALSE(hasNote(gltf, "way is up"));
}

/// A hill as a plane scans it: 200 m by 120 m, 20 m high, the sky's birds and the ground's echoes among the points.
std::string hillPly(char up, double height = 20) {
    std::string points;
    std::size_t count = 0;
    const auto add = [&](double x, double y, double h) {
        points += up == 'z' ? fmt::format("{} {} {}\n", x, y, h) : fmt::format("{} {} {}\n", x, h, -y);
        ++count;
    };
    for (int i = 0; i < 40; ++i)
        for (int k = 0; k < 30; ++k)
            add(5 * i, 4 * k, height * std::exp(-0.01 * ((i - 20) * (i - 20) + (k - 15) * (k - 15))));
    add(100, 60, 900);
    add(30, 20, -400);
    return fmt::format(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float "
        "z\nend_header\n{}",
        count, points);
}

TEST(Placing, AFlatCloudWasScannedFromAbove) {
    const Scratch scratch;
    const PlacedFile hill = placedFile(scratch.write("hill.ply", hillPly('z')), Placing());
    ASSERT_EQ(hill.error, "");
    EXPECT_LT(hill.box.lower.y(), -399) << "its heights stand up";
    EXPECT_GT(hill.box.upper.y(), 899);
    EXPECT_WORDS(notesIn(hill));
    const PlacedFile told = placedFile(scratch.write("told.ply", hillPly('z')), Placing{.up = UpAxis::kY});
    EXPECT_GT(told.box.upper.z(), 899) << "who says so is believed";
    EXPECT_FALSE(hasNote(told, "way is up"));
    // The same hill of somebody whose Y is up, a hall, which is as high as it is wide, and a surface of faces are as
    // they were.
    for (const std::string& other :
         {scratch.write("yhill.ply", hillPly('y')), scratch.write("hall.ply", hillPly('z', 100)),
          scratch.write("plate.obj", "v 0 0 0\nv 9 0 0\nv 9 9 0\nv 0 9 1\nf 1 2 3 4\n")}) {
        const PlacedFile placed = placedFile(other, Placing());
        EXPECT_EQ(placed.error, "") << other;
        EXPECT_WORDS(notesIn(placed)) << other;
    }
}

TEST(Placing, AMastOnAFlatFieldDoesNotStandItUp) {
    const Scratch scratch;
    std::string points;
    for (int i = 0; i < 2000; ++i)
        points += fmt::format("{} {} {}\n", 100.0 * (i % 50) / 50, 60.0 * (i / 50) / 40, 4.0 * (i * 7 % 11) / 11);
    for (int i = 0; i < 80; ++i) points += fmt::format("50 30 {}\n", 0.5 * i);
    const PlacedFile field = placedFile(scratch.write("mast.ply",
                                                      "ply\nformat ascii 1.0\nelement vertex 2080\nproperty float "
                                                      "x\nproperty float y\nproperty float z\nend_header\n" +
                                                          points),
                                        Placing());
    EXPECT_WORDS(notesIn(field));
    EXPECT_GT(field.box.upper.y(), 39.5) << "the mast stands up";
    EXPECT_LT(field.box.upper.x(), 102);
}

TEST(Placing, PointsHaveTheRadiusThatAPersonSays) {
    const Scratch scratch;
    const auto radiusOf = [&](const std::string& path, std::optional<double> radius) {
        ImportOptions options = importOptions();
        options.placing = Placing{.pointRadius = radius};
        Expected<ImportedScene> scene = importScene(path, kRootNode, options);
        EXPECT_TRUE(scene) << messageOf(scene);
        if (!scene) return -1.0;
        const ImportedAspect aspect(std::move(*scene));
        for (const ObjectId id : aspect->ids())
            if (const auto* geometry = aspect->get<Geometry>(id); geometry && geometry->primitive == Geometry::kPoints)
                return geometry->pointRadius;
        return -1.0;
    };
    const std::string hill = scratch.write("hill.ply", hillPly('z'));
    EXPECT_NE(radiusOf(hill, std::nullopt), 0.75);
    EXPECT_EQ(radiusOf(hill, 0.75), 0.75);
    const std::string scene =
        scratch.write("dots.tsct", "node { name: \"dots\" points { radius: 0.1 point {} point { x: 1 } } }\n");
    EXPECT_EQ(radiusOf(scene, std::nullopt), 0.1);
    EXPECT_EQ(radiusOf(scene, 0.75), 0.75);
    EXPECT_EQ(radiusOf(scratch.write("imports.tsct", "node { import { uri: \"hill.ply\" } }\n"), 0.5), 0.5)
        << "what a scene imports too";
    EXPECT_NE(placedFile(hill, Placing{.pointRadius = 0.0}).error, "");
}

TEST(Placing, ARadiusOfPointsWithoutAnyIsNamed) {
    const Scratch scratch;
    const char* const note = "point radius: the file has no points";
    const std::string obj = scratch.write("slab.obj", slabObj()), hill = scratch.write("hill.ply", hillPly('z'));
    EXPECT_WORDS(notesIn(placedFile(obj, Placing{.pointRadius = 0.1})));
    EXPECT_FALSE(hasNote(placedFile(obj, Placing()), note)) << "nobody asked for one";
    EXPECT_FALSE(hasNote(placedFile(hill, Placing{.pointRadius = 0.1}), note));
    EXPECT_FALSE(hasNote(placedFile(scratch.write("imports.tsct", "node { import { uri: \"hill.ply\" } }\n"),
                                    Placing{.pointRadius = 0.1}),
                         note))
        << "of what a scene imports too";
    Expected<ImportedScene> whole = importScene(hill, kRootNode, importOptions());
    ASSERT_TRUE(whole && saveScene(scratch.path("saved.tsct"), *ImportedAspect(std::move(*whole))));
    EXPECT_FALSE(hasNote(placedFile(scratch.path("saved.tsct"), Placing{.pointRadius = 0.1}), note))
        << "of what was saved";
    EXPECT_WORDS(notesIn(placedFile(scratch.write("box.tsct", "node { box { size { x: 1 y: 1 z: 1 } } }\n"),
                                    Placing{.pointRadius = 0.1})));
    ImportOptions options = importOptions();
    options.placing = Placing{.pointRadius = 0.1};
    const std::string both[] = {hill, obj};
    const Expected<ImportedScene> scene = importScenes(both, kRootNode, options);
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_TRUE(std::ranges::none_of(scene->notes, [&](const std::string& each) {
        return each.find(note) != std::string::npos;
    })) << "one of them has";
}

TEST(Placing, ASizeThatIsTooSmallIsRefusedAsASize) {
    const Scratch scratch;
    const std::string obj = scratch.write("slab.obj", slabObj());
    const std::string error = placedFile(obj, Placing{.fit = 1e-12}).error;
    EXPECT_WORDS(error);
}

TEST(Placing, AtScaleAndFit) {
    const Scratch scratch;
    const std::string obj = scratch.write("slab.obj", slabObj());
    expectBox(placedFile(obj, Placing{.at = Vec3d(-10, -20, -30)}).box, {0, 0, 0}, {4, 2, 1});
    expectBox(placedFile(obj, Placing{.at = Vec3d(1, 2, 3), .scale = 0.5}).box, {6, 12, 18}, {8, 13, 18.5});
    // The middle of the underside comes to `at`; 4 long becomes 1.
    expectBox(placedFile(obj, Placing{.at = Vec3d(7, 8, 9), .fit = 1.0}).box, {6.5, 8, 8.875}, {7.5, 8.5, 9.125});
    // Lying, then fitted: the side that was 1 high stands up.
    expectBox(placedFile(obj, Placing{.fit = 8.0, .up = UpAxis::kZ}).box, {-4, 0, -2}, {4, 2, 2});
    for (const double fit : {1e-11, 1e11}) {
        const Box box = placedFile(obj, Placing{.fit = fit}).box;
        EXPECT_NEAR(box.size().maxCoeff() / fit, 1, 1e-5);
        EXPECT_NEAR(box.lower.y() / fit, 0, 1e-5);
    }
}

TEST(Placing, ScenesGetANodeOnlyWhereSomethingIsSaid) {
    const Scratch scratch;
    const std::string scene = scratch.write("boxes.tsct", R"(
        node { name: "a" transform { translation { x: 5 } } node { box { size { x: 2 y: 2 z: 2 } } }
          node { motion { target: "/a" key { time: 0 } key { time: 1 transform { translation { x: 9 } } } } } }
        node { name: "b" transform { translation { x: 9 } } node { box { size { x: 2 y: 2 z: 2 } } } })");
    ImportOptions options = importOptions();
    options.placing = Placing();
    const Expected<ImportedScene> plain = importScene(scene, kRootNode, options);
    ASSERT_TRUE(plain) << messageOf(plain);
    EXPECT_EQ(plain->tops.size(), 2u);
    options.placing->fit = 1;
    Expected<ImportedScene> fitted = importScene(scene, kRootNode, options);
    ASSERT_TRUE(fitted) << messageOf(fitted);
    const ImportedAspect aspect(std::move(*fitted));
    expectBox(sceneBounds(*aspect), {-0.5, 0, -1.0 / 6}, {0.5, 1.0 / 3, 1.0 / 6});
    EXPECT_NE(aspect.core<Transform>("/boxes"), nullptr);
    EXPECT_NE(aspect.core<Transform>("/boxes/b"), nullptr) << "names inside are found as ever";
}

/// As `load` asks for it: one thing that can be moved and removed.
TEST(Placing, ScenesOfSeveralNodesAreGatheredWhereThatIsAskedFor) {
    const Scratch scratch;
    const std::string one =
        scratch.write("one.tsct", "node { name: \"a\" transform {} node { box { size { x: 1 y: 1 z: 1 } } } }\n");
    const std::string two = scratch.write("two.tsct",
                                          "node { name: \"a\" transform {} node { box { size { x: 1 y: 1 z: 1 } } } "
                                          "}\nnode { name: \"b\" box { size { x: 1 y: 1 z: 1 } } }\n");
    const auto topsOf = [&](const std::string& path, bool gathers) {
        ImportOptions options = importOptions();
        options.placing = Placing();
        options.gathers = gathers;
        Expected<ImportedScene> scene = importScene(path, kRootNode, options);
        EXPECT_TRUE(scene);
        const ImportedAspect aspect(std::move(*scene));
        std::vector<std::string> names;
        for (const ObjectId child : aspect->get<Node>(kRootNode)->children)
            names.push_back(aspect->get<Node>(child)->name +
                            (aspect->coreOf<Transform>(*aspect->get<Node>(child)) ? " T" : ""));
        return names;
    };
    EXPECT_EQ(topsOf(one, true), std::vector<std::string>{"a T"});
    EXPECT_EQ(topsOf(two, true), std::vector<std::string>{"two T"});
    EXPECT_EQ(topsOf(two, false), (std::vector<std::string>{"a T", "b"}));
}

TEST(Placing, WhatCannotBeIsRefusedInWords) {
    const Scratch scratch;
    const std::string obj = scratch.write("slab.obj", slabObj());
    const std::string point = scratch.write("point.obj", "v 1 2 3\nv 1 2 3\nv 1 2 3\nf 1 2 3\n");
    const double nan = std::nan("");
    for (const Placing& bad :
         {Placing{.at = Vec3d(nan, 0, 0)}, Placing{.at = Vec3d(0, nan, 0)}, Placing{.at = Vec3d(0, 1e16, 0)},
          Placing{.scale = 0.0}, Placing{.scale = nan}, Placing{.scale = -1.0}, Placing{.fit = 0.0},
          Placing{.fit = 1e300}, Placing{.scale = 1.0, .fit = 1.0}})
        EXPECT_NE(placedFile(obj, bad).error, "");
    EXPECT_WORDS(placedFile(point, Placing{.fit = 1.0}).error);
}

}  // namespace
}  // namespace tessera

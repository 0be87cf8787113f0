/// What a person chooses: a part of the scene, without motion, how fine.
#include <set>

#include "common/cores/Camera.h"
#include "common/cores/Glyphs.h"
#include "common/cores/PointLight.h"
#include "common/cores/SubdivisionSurface.h"
#include "common/drawable/SceneBounds.h"
#include "common/export/ExportNotes.h"
#include "tests/support/words/Words.h"
#include "tests/unit/export/BuiltScene.h"
#include "tests/unit/export/ExportFixture.h"

namespace tessera {
namespace {

TEST(ExportOptions, UnderANodeIsWhatIsBelowItWhereItStands) {
    const Scratch scratch;
    BuiltScene built;
    Transform hall;
    hall.translation = Vec3d(10, 0, 0);
    Transform crane;
    crane.translation = Vec3d(0, 5, 0);
    const ObjectId mesh = built.add(triangleGeometry());
    const ObjectId top = built.node("hall", built.add(hall));
    built.node("wall", mesh, top);
    built.node("hook", mesh, built.node("crane", built.add(crane), top));
    const Aspect scene = built.take();
    const std::string out = scratch.path("out.glb");
    ASSERT_TRUE(exportScene(out, scene, {.under = "/hall/crane"}));
    const ImportedAspect again = readBack(out);
    EXPECT_FALSE(findNode(*again, "/hall/wall"));
    const Expected<ObjectId> hook = findNode(*again, "/hall/crane/hook");
    ASSERT_TRUE(hook) << hook.error().message;
    EXPECT_TRUE(worldTransform(*again, *hook).translation().isApprox(Vec3d(10, 5, 0)));

    const Expected<ExportReport> missing = exportScene(out, scene, {.under = "/hall/cran"});
    ASSERT_FALSE(missing);
    EXPECT_EQ(missing.error().code, ErrorCode::kNotFound);
}

TEST(ExportOptions, StillHasNoAnimations) {
    const Scratch scratch;
    const std::string model = std::string(TESSERA_SOURCE_DIR) + "/tests/data/models/arm.glb";
    const ImportedAspect scene = readBack(model);
    const std::string out = scratch.path("out.glb");
    ASSERT_TRUE(exportScene(out, *scene, {.still = true}));
    const ImportedAspect again = readBack(out);
    EXPECT_FALSE(findNode(*again, "/arm/wave"));
    ASSERT_TRUE(exportScene(out, *scene));
    const ImportedAspect moving = readBack(out);
    EXPECT_TRUE(findNode(*moving, "/arm/wave"));
}

bool hasNote(const std::vector<std::string>& notes, std::string_view words) {
    return std::ranges::any_of(notes, [&](const std::string& note) { return note.find(words) != note.npos; });
}

TEST(ExportOptions, AToleranceBeyondWhatIsMadeOfASurfaceIsSaid) {
    const Scratch scratch;
    const ImportedAspect scene = readBack(std::string(TESSERA_SOURCE_DIR) + "/deploy/scenes/gallery/16-nurbs.tsct");
    const Expected<ExportReport> report = exportScene(scratch.path("out.stl"), *scene, {.tolerance = 1e-12});
    ASSERT_TRUE(report);
    EXPECT_WORDS(fmt::format("{}", fmt::join(report->notes, "\n")));
}

TEST(ExportOptions, AToleranceOfNothingSmoothIsSaid) {
    const Scratch scratch;
    BuiltScene built;
    built.node("triangle", built.add(triangleGeometry()));
    const Expected<ExportReport> report = exportScene(scratch.path("out.glb"), built.take(), {.tolerance = 1});
    ASSERT_TRUE(report);
    EXPECT_WORDS(fmt::format("{}", fmt::join(report->notes, "\n")));
}

TEST(ExportOptions, TrianglesCountWhereTheyStandWhateverAFormatShares) {
    const Scratch scratch;
    const ImportedAspect scene = readBack(std::string(TESSERA_SOURCE_DIR) + "/deploy/scenes/gallery/64-glyphs.tsct");
    std::set<std::size_t> counts;
    for (const char* out : {"out.glb", "out.gltf", "out.usda", "out.wrl", "out.obj", "out.stl", "out.ply"}) {
        const Expected<ExportReport> report = exportScene(scratch.path(out), *scene);
        ASSERT_TRUE(report) << out;
        counts.insert(report->triangles);
    }
    EXPECT_EQ(counts.size(), 1u) << fmt::format("{}", fmt::join(counts, ", "));
}

TEST(ExportOptions, AToleranceMakesSmoothSurfacesFiner) {
    const Scratch scratch;
    BuiltScene built;
    SubdivisionSurface cube;
    cube.points = blobOf<float>({-1, -1, -1, 1, -1, -1, 1, 1, -1, -1, 1, -1, -1, -1, 1, 1, -1, 1, 1, 1, 1, -1, 1, 1});
    cube.faceSizes = blobOf<std::uint32_t>({4, 4, 4, 4, 4, 4});
    cube.faceVertices = blobOf<std::uint32_t>({0, 3, 2, 1, 4, 5, 6, 7, 0, 1, 5, 4, 2, 3, 7, 6, 1, 2, 6, 5, 0, 4, 7, 3});
    cube.level = 1;
    cube.screenError = 0;
    built.node("ball", built.add(cube));
    const Aspect scene = built.take();
    std::vector<std::string> notes;
    const auto triangles = [&](double tolerance) {
        const Expected<ExportReport> report = exportScene(scratch.path("out.stl"), scene, {.tolerance = tolerance});
        EXPECT_TRUE(report);
        if (report) notes = report->notes;
        return report ? report->triangles : 0;
    };
    EXPECT_EQ(triangles(0), 48u);
    EXPECT_FALSE(hasNote(notes, "surfaces and letters are"));
    EXPECT_EQ(triangles(1), 48u);
    EXPECT_WORDS(fmt::format("{}", fmt::join(notes, "\n")));
    EXPECT_GE(triangles(1e-3), 4 * 48u);
    EXPECT_FALSE(hasNote(notes, "surfaces and letters are"));
    EXPECT_GT(triangles(1e-4), triangles(1e-2));
    EXPECT_GT(triangles(1e-30), 48u);
    EXPECT_WORDS(fmt::format("{}", fmt::join(notes, "\n")));
    const Expected<ExportReport> smooth = exportScene(scratch.path("out.usda"), scene, {.tolerance = 1});
    ASSERT_TRUE(smooth);
    EXPECT_WORDS(fmt::format("{}", fmt::join(smooth->notes, "\n")));
    EXPECT_FALSE(hasNote(smooth->notes, "surfaces and letters are"));
    const Expected<bool> negative = leadsOut("out.stl", {.tolerance = -1});
    ASSERT_FALSE(negative);
    EXPECT_EQ(negative.error().code, ErrorCode::kUsage);
}

TEST(ExportOptions, AreForForeignFormatsAlone) {
    EXPECT_TRUE(leadsOut("scene.GLB", {}).value_or(false));
    EXPECT_FALSE(leadsOut("scene.tsct", {}).value_or(true));
    EXPECT_FALSE(leadsOut("scene.tsct", {.under = "/hall"}));
    EXPECT_FALSE(leadsOut("scene.tsc", {.still = true}));
    const Expected<bool> unknown = leadsOut("scene.step", {});
    ASSERT_FALSE(unknown);
    EXPECT_EQ(unknown.error().message.find(
                  "scene.step: a scene is written as .tsct (text) or .tsc (binary), for other programs as .glb, .gltf"),
              0u)
        << unknown.error().message;
}

TEST(ExportOptions, CamerasAndLightsOfOurOwnComeBackWhereTheyWere) {
    const Scratch scratch;
    BuiltScene built;
    Transform stand;
    stand.translation = Vec3d(1, 2, 3);
    const ObjectId place = built.node("stand", built.add(stand));
    built.node("view", built.add(Camera()), place);
    PointLight lamp;
    lamp.color = Vec3f(2, 1, 0);
    lamp.intensity = 3;
    built.node("lamp", built.add(lamp), place);
    built.node("triangle", built.add(triangleGeometry()));
    const Aspect scene = built.take();
    const std::string out = scratch.path("out.glb");
    ASSERT_TRUE(exportScene(out, scene));
    const ImportedAspect again = readBack(out);
    const PointLight* read = again.core<PointLight>("/stand/lamp/lamp");
    ASSERT_NE(read, nullptr);
    EXPECT_TRUE((read->color * read->intensity).isApprox(Vec3f(6, 3, 0)));
    // The eye is 2.4 m before the window's middle, as it was.
    const Expected<ObjectId> camera = findNode(*again, "/stand/view/view/view/camera");
    ASSERT_TRUE(camera) << camera.error().message;
    const Camera* wall = again->coreOf<Camera>(*again->get<Node>(*camera));
    const Vec3d eye = worldTransform(*again, *camera) * Vec3d(Vec3d(0, 1.5, 2.4) * wall->worldUnitsPerMetre);
    EXPECT_TRUE(eye.isApprox(Vec3d(1, 3.5, 5.4), 1e-6)) << eye.transpose();
}

TEST(ExportOptions, GlyphsAreOneMeshAtManyPlaces) {
    const Scratch scratch;
    BuiltScene built;
    Glyphs glyphs;
    glyphs.positions = blobOf<float>({0, 0, 0, 5, 0, 0});
    glyphs.vectors = blobOf<float>({0, 1, 0, 2, 0, 0});
    glyphs.size = 1;
    built.node("flow", built.add(glyphs));
    const Aspect scene = built.take();
    ASSERT_TRUE(exportScene(scratch.path("out.gltf"), scene));
    const ImportedAspect again = readBack(scratch.path("out.gltf"));
    const Box box = sceneBounds(*again);
    EXPECT_NEAR(box.upper.x(), 7, 1e-5);  // the second arrow is two long, and points along X
    EXPECT_NEAR(box.upper.y(), 1, 1e-5);
    EXPECT_NE(again.core<Glyphs>("/flow/part 0"), nullptr);

    // As many places as turns, in numbers.
    std::ifstream file(scratch.path("out.gltf"), std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    const std::size_t at = text.find("\"ROTATION\":");
    ASSERT_NE(at, std::string::npos);
    std::string bad = text;
    bad.replace(at, text.find(',', at) - at, "\"ROTATION\":3");
    const Expected<ImportedScene> refused = importScene(scratch.write("bad.gltf", bad), kRootNode, importOptions());
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::kBadInput);
    EXPECT_WORDS(refused.error().message);
}

/// A mesh of one's own, with an image, in colours: through both formats that know instances.
TEST(ExportOptions, GlyphsKeepTheirImagesAndColours) {
    for (const char* name : {"out.glb", "out.usda"}) {
        SCOPED_TRACE(name);
        const Scratch scratch;
        BuiltScene built;
        Glyphs glyphs;
        glyphs.positions = blobOf<float>({0, 0, 0, 5, 0, 0});
        glyphs.colors = blobOf<std::uint8_t>({255, 0, 0, 255, 0, 128, 255, 255});
        glyphs.shape = Glyphs::kMesh;
        glyphs.shapePositions = blobOf<float>({0, 0, 0, 1, 0, 0, 0, 1, 0});
        glyphs.shapeNormals = blobOf<float>({0, 0, 1, 0, 0, 1, 0, 0, 1});
        glyphs.shapeIndices = blobOf<std::uint32_t>({0, 1, 2});
        glyphs.shapeTexcoords = blobOf<float>({0, 0, 1, 0, 0.25f, 0.75f});
        Material material;
        Image image;
        image.pixels = blobOf<std::uint8_t>({9, 200, 30, 255});
        image.widthPx = image.heightPx = 1;
        material.baseColorImage = built.add(image);
        material.doubleSided = true;
        glyphs.material = built.add(material);
        built.node("leaves", built.add(glyphs));
        ASSERT_TRUE(exportScene(scratch.path(name), built.take()));
        const ImportedAspect again = readBack(scratch.path(name));
        const Glyphs* read = nullptr;
        for (const ObjectId id : again->ids())
            if (const auto* found = again->get<Glyphs>(id)) read = found;
        ASSERT_NE(read, nullptr);
        EXPECT_TRUE(again->get<Material>(read->material)->doubleSided);
        const std::span<const float> uv = read->shapeTexcoords.as<float>();
        EXPECT_EQ(std::vector<float>(uv.begin(), uv.end()), (std::vector<float>{0, 0, 1, 0, 0.25f, 0.75f}));
        const std::span<const std::uint8_t> colors = read->colors.as<std::uint8_t>();
        EXPECT_EQ(std::vector<std::uint8_t>(colors.begin(), colors.end()),
                  (std::vector<std::uint8_t>{255, 0, 0, 255, 0, 128, 255, 255}));
    }
}

TEST(ExportOptions, NotesNameTenLossesAndCountTheOthers) {
    BuiltScene built;
    std::vector<ObjectId> nodes;
    for (int i = 0; i < 5; ++i) nodes.push_back(built.node(fmt::format("node {}", i)));
    const Aspect scene = built.take();
    ExportNotes notes;
    for (int kind = 0; kind < 12; ++kind)
        for (const ObjectId node : nodes) notes.add(fmt::format("loss {}", kind), node);
    const std::vector<std::string> lines = notes.lines(scene);
    ASSERT_EQ(lines.size(), 11u);
    EXPECT_EQ(lines.front(), "loss 0: /node 0, /node 1, /node 2 and 2 more");
    EXPECT_EQ(lines.back(), "and 2 kinds of losses more");
}

}  // namespace
}  // namespace tessera

/// Scenes that nobody would write by hand: every format writes them, or says why not, and never half a file.
#include <fcntl.h>
#include <sys/stat.h>

#include <future>

#include "common/cores/Image.h"
#include "common/cores/PointLight.h"
#include "common/cores/Transform.h"
#include "common/drawable/SceneBounds.h"
#include "common/export/LeavingPictures.h"
#include "tests/support/words/Words.h"
#include "tests/unit/export/BuiltScene.h"
#include "tests/unit/export/ExportFixture.h"

namespace tessera {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> allEndings() {
    std::vector<std::string> endings;
    for (const ExportFormat& format : exportFormats()) endings.push_back("." + std::string(format.endings));
    return endings;
}

std::string contentOf(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

/// In every format; each glTF is looked at by the validator.
void expectWritten(const Aspect& scene, const Scratch& scratch) {
    std::vector<std::string> gltf;
    for (const std::string& ending : allEndings()) {
        const std::string path = scratch.path("out" + ending);
        const Expected<ExportReport> report = exportScene(path, scene);
        // Of what has a place and no sound mesh, files of meshes alone hold nothing.
        if (!report && report.error().message.find("nothing of the scene") != std::string::npos) continue;
        ASSERT_TRUE(report) << ending << ": " << (report ? "" : report.error().message);
        EXPECT_LE(report->notes.size(), 11u);
        const std::string content = contentOf(path);
        const bool isText = ending != ".glb" && ending != ".stl" && ending != ".ply";
        for (const char* word : {"nan", "inf,", "inf]", "-inf"}) {
            EXPECT_TRUE(!isText || content.find(word) == std::string::npos) << ending << " holds " << word;
        }
        if (ending == ".glb" || ending == ".gltf") gltf.push_back(path);
    }
    const Validated said = validated(gltf);
    EXPECT_TRUE(said.good || !said.there) << said.said;
}

TEST(HostileScene, AnEmptyOneIsRefusedAndLeavesWhatWasThere) {
    const Scratch scratch;
    for (const std::string& ending : allEndings()) {
        const std::string path = scratch.write("kept" + ending, "kept");
        const Expected<ExportReport> report = exportScene(path, Aspect());
        ASSERT_FALSE(report) << ending;
        EXPECT_EQ(report.error().code, ErrorCode::kRefused);
        EXPECT_WORDS(report.error().message);
        EXPECT_EQ(contentOf(path), "kept");
    }
}

TEST(HostileScene, NumbersThatAreNoneAreNeverWritten) {
    const Scratch scratch;
    BuiltScene built;
    const float nan = std::numeric_limits<float>::quiet_NaN(), infinite = std::numeric_limits<float>::infinity();
    Image image;
    image.pixels = blobOf<std::uint8_t>({1, 2, 3, 4});
    image.widthPx = image.heightPx = 1;
    Material material;
    material.baseColorImage = built.add(image);
    Geometry geometry = triangleGeometry();
    geometry.normals = blobOf<float>({nan, 0, 1, 0, 0, 0, infinite, 1, 1});
    geometry.texcoords = blobOf<float>({nan, 0, infinite, 1, 0, -infinite});
    geometry.tangents = blobOf<float>({nan, 0, 0, 1, 0, 0, 0, 0, 1, 1, 1, 7});
    geometry.material = built.add(material);
    built.node("odd", built.add(geometry));
    expectWritten(built.take(), scratch);
}

TEST(HostileScene, NamesMayBeAnything) {
    const Scratch scratch;
    BuiltScene built;
    const ObjectId core = built.add(triangleGeometry());
    for (const char* name : {"", "a/b", "\"quoted\" \\ 'name'", "two\nlines\r\t", "{}[]<>#@;", "ünï—码", "1st", "def",
                             "part 0", "../../etc", "\x01\x7f", "same", "same"})
        built.node(name, core);
    const Aspect scene = built.take();
    expectWritten(scene, scratch);
    const Expected<ImportedScene> again = importScene(scratch.path("out.glb"), kRootNode, importOptions());
    ASSERT_TRUE(again) << messageOf(again);
    EXPECT_EQ(again->triangles, 13u);
}

TEST(HostileScene, MeshesOfNothingAndShearsAndPointsOfNoSizeAreWritten) {
    const Scratch scratch;
    BuiltScene built;
    built.node("nothing", built.add(Geometry()));
    Transform flat;
    flat.scale = Vec3d(1, 0, 1);
    flat.rotation = Quatd(0, 0, 0, 3);
    const ObjectId pressed = built.node("pressed", built.add(flat));
    Transform turned;
    turned.rotation = Quatd(1, 1, 0, 0);
    turned.scale = Vec3d(-1, 2, 3);
    const ObjectId below = built.node("turned", built.add(turned), pressed);
    built.node("triangle", built.add(triangleGeometry()), below);
    Geometry points = triangleGeometry();
    points.indices = {};
    points.primitive = Geometry::kPoints;
    built.node("points", built.add(points), below);
    Geometry lines = triangleGeometry();
    lines.indices = {};
    lines.primitive = Geometry::kLineLoop;
    built.node("loop", built.add(lines), below);
    expectWritten(built.take(), scratch);
}

/// Our own importer refuses what stands beyond 1e15, or puts it to 0.
TEST(HostileScene, WhatStandsTooFarOffIsNamedAndAllElseIsWritten) {
    const Scratch scratch;
    BuiltScene built;
    const ObjectId mesh = built.add(triangleGeometry());
    Transform far, large;
    far.translation = Vec3d(1e39, 0, 0);
    large.scale = Vec3d::Constant(1e200);
    built.node("near", mesh);
    built.node("below", mesh, built.node("far", built.add(far)));
    const ObjectId core = built.add(large);
    built.node("huge", mesh, built.node("inner", core, built.node("large", core)));
    // Where what is above turns it back, files of trees cannot say it, and those of triangles can.
    Transform outer, inner;
    outer.scale = Vec3d::Constant(1e-10);
    inner.translation = Vec3d(0, 1e20, 0);
    built.node("distant", mesh, built.node("within", built.add(inner), built.node("outer", built.add(outer))));
    const Aspect scene = built.take();
    expectWritten(scene, scratch);
    for (const std::string& ending : allEndings()) {
        const std::string path = scratch.path("out" + ending);
        const Expected<ExportReport> report = exportScene(path, scene);
        ASSERT_TRUE(report) << ending << ": " << report.error().message;
        const std::string notes = fmt::format("{}", fmt::join(report->notes, "\n"));
        EXPECT_NE(notes.find("(move them within 1e15 m): /far"), std::string::npos) << ending << ": " << notes;
        EXPECT_NE(notes.find("less): /large"), std::string::npos) << ending << ": " << notes;
        if (ending == ".csv") continue;
        const ImportedAspect again = readBack(path);
        const Box box = sceneBounds(*again);
        EXPECT_LE(box.upper.cwiseAbs().maxCoeff(), 1e11) << ending;
        EXPECT_GE(box.upper.x(), 1) << ending;
        const bool isTree = ending == ".glb" || ending == ".gltf" || ending == ".usda" || ending == ".wrl";
        EXPECT_EQ(notes.find("/outer/within") != std::string::npos, isTree) << ending << ": " << notes;
        EXPECT_EQ(box.upper.y() > 1e9, !isTree) << ending;
    }
}

TEST(HostileScene, WhereNothingIsLeftItIsSaidWhy) {
    const Scratch scratch;
    BuiltScene built;
    Transform far;
    far.translation = Vec3d(0, -2e15, 0);
    built.node("below", built.add(triangleGeometry()), built.node("far", built.add(far)));
    Geometry wide = triangleGeometry();
    wide.positions = blobOf<float>({0, 0, 0, 3e38f, 0, 0, 0, 1, 0});
    Transform large;
    large.scale = Vec3d::Constant(1e10);
    const ObjectId grown = built.node("grown", built.add(large));
    built.node("wide", built.add(wide), grown);
    const Aspect scene = built.take();
    for (const char* ending : {".glb", ".stl", ".ply", ".obj"}) {
        const bool isTree = std::string(ending) == ".glb";
        const Expected<ExportReport> report =
            exportScene(scratch.path(std::string("out") + ending), scene, {.under = isTree ? "/far/below" : ""});
        ASSERT_FALSE(report) << ending;
        EXPECT_EQ(report.error().code, ErrorCode::kRefused);
        EXPECT_WORDS(report.error().message);
        EXPECT_EQ(report.error().message.find("/grown/wide") != std::string::npos, !isTree) << report.error().message;
    }
}

TEST(HostileScene, AsDeepAsAScene) {
    const Scratch scratch;
    BuiltScene built;
    ObjectId above = kRootNode;
    for (std::size_t depth = 1; depth < SceneLimits().maxDepth - 1; ++depth)
        above = built.node(fmt::format("{}", depth), {}, above);
    built.node("leaf", built.add(triangleGeometry()), above);
    expectWritten(built.take(), scratch);
}

TEST(HostileScene, AHundredThousandNodesShareOneMesh) {
    const Scratch scratch;
    BuiltScene built;
    const ObjectId core = built.add(triangleGeometry());
    Transform place;
    for (int i = 0; i < 50'000; ++i) {
        place.translation.x() = i;
        built.node("triangle", core, built.node(fmt::format("place {}", i), built.add(place)));
    }
    const Aspect scene = built.take();
    const Expected<ExportReport> report = exportScene(scratch.path("many.glb"), scene);
    ASSERT_TRUE(report);
    EXPECT_EQ(report->nodes, 100'000u);
    EXPECT_EQ(report->triangles, 50'000u);
    // A mesh for all of them: what a node costs is its place and its name.
    EXPECT_LT(report->bytes, 20'000'000u);
    const Expected<ImportedScene> again = importScene(scratch.path("many.glb"), kRootNode, importOptions());
    ASSERT_TRUE(again) << messageOf(again);
    EXPECT_EQ(again->geometries, 1u);
    EXPECT_EQ(again->triangles, 50'000u);
}

TEST(HostileScene, WhatIsTooLargeIsRefusedAndTheFileBeforeStays) {
    const Scratch scratch;
    BuiltScene built;
    built.node("triangle", built.add(triangleGeometry()));
    const Aspect scene = built.take();
    for (const std::string& ending : allEndings()) {
        if (ending == ".csv") continue;
        const std::string path = scratch.write("before" + ending, "before");
        const Expected<ExportReport> report = exportScene(path, scene, {.maxFileBytes = 10});
        ASSERT_FALSE(report) << ending;
        EXPECT_EQ(report.error().code, ErrorCode::kLimit) << report.error().message;
        EXPECT_WORDS(report.error().message);
        EXPECT_EQ(contentOf(path), "before");
    }
    // Nothing lies about.
    for (const auto& entry : fs::directory_iterator(scratch.path("")))
        EXPECT_TRUE(entry.path().filename().string().starts_with("before.")) << entry.path();
}

TEST(HostileScene, WhatIsNotHereIsRefused) {
    const Scratch scratch;
    BuiltScene built;
    Geometry geometry = triangleGeometry();
    geometry.positions = Blob::absent(geometry.positions.id(), geometry.positions.sizeBytes());
    built.node("triangle", built.add(geometry));
    const Aspect scene = built.take();
    const Expected<ExportReport> report = exportScene(scratch.path("out.glb"), scene);
    ASSERT_FALSE(report);
    EXPECT_EQ(report.error().code, ErrorCode::kRefused);
    EXPECT_WORDS(report.error().message);
    EXPECT_FALSE(fs::exists(scratch.path("out.glb")));
}

TEST(HostileScene, PlacesThatCannotBeWrittenAreNamed) {
    const Scratch scratch;
    fs::create_directory(scratch.path("folder.glb"));
    BuiltScene built;
    built.node("triangle", built.add(triangleGeometry()));
    const Aspect scene = built.take();
    const Expected<ExportReport> folder = exportScene(scratch.path("folder.glb"), scene);
    ASSERT_FALSE(folder);
    EXPECT_WORDS(folder.error().message);
    const Expected<ExportReport> none = exportScene(scratch.path("none/out.glb"), scene);
    ASSERT_FALSE(none);
    EXPECT_WORDS(none.error().message);
    const Expected<ExportReport> ending = exportScene(scratch.path("out.step"), scene);
    ASSERT_FALSE(ending);
    EXPECT_EQ(ending.error().code, ErrorCode::kUsage);
    EXPECT_WORDS(ending.error().message);
}

/// Whoever opens a pipe to look into it waits for ever.
TEST(HostileScene, NoPipeIsWaitedFor) {
    const Scratch scratch;
    BuiltScene built;
    built.node("triangle", built.add(triangleGeometry()));
    const Aspect scene = built.take();
    for (const std::string& ending : allEndings()) {
        const std::string path = scratch.path("pipe" + ending);
        ASSERT_EQ(::mkfifo(path.c_str(), 0600), 0);
        // So that a failure of this test is one.
        const int reader = ::open(path.c_str(), O_RDWR | O_NONBLOCK);
        std::string filler("x");
        ASSERT_EQ(::write(reader, filler.data(), 1), 1);
        auto saved = std::async(std::launch::async, [&] { return exportScene(path, scene); });
        const bool ended = saved.wait_for(std::chrono::seconds(5)) == std::future_status::ready;
        EXPECT_TRUE(ended) << ending;
        ::close(reader);
        const Expected<ExportReport> report = saved.get();
        ASSERT_FALSE(report) << ending;
        EXPECT_WORDS(report.error().message);
    }
}

TEST(HostileScene, FilesOfTwoSavesAtOnceBelongTogether) {
    const Scratch scratch;
    const std::string path = scratch.path("out.gltf");
    const auto scene = [](int triangles) {
        BuiltScene built;
        for (int i = 0; i < triangles; ++i) {
            Geometry geometry = triangleGeometry();
            geometry.positions = blobOf<float>({0, 0, 0, 1, 0, 0, 0, 1, static_cast<float>(i)});
            built.node("triangle", built.add(geometry));
        }
        return built.take();
    };
    const Aspect small = scene(1), large = scene(3);
    for (int round = 0; round < 300; ++round) {
        auto other = std::async(std::launch::async, [&] { return exportScene(path, small); });
        const Expected<ExportReport> report = exportScene(path, large);
        ASSERT_TRUE(report) << report.error().message;
        ASSERT_TRUE(other.get());
        const std::string said = fmt::format("\"byteLength\":{}}}]", fs::file_size(path + ".bin"));
        ASSERT_NE(contentOf(path).find(said), std::string::npos) << "round " << round;
    }
}

TEST(HostileScene, LightsAndViewsAloneComeBack) {
    const Scratch scratch;
    BuiltScene built;
    built.node("lamp", built.add(PointLight()));
    const Aspect scene = built.take();
    for (const char* ending : {".glb", ".usda", ".wrl"}) {
        const std::string path = scratch.path(std::string("out") + ending);
        ASSERT_TRUE(exportScene(path, scene));
        const Expected<ImportedScene> again = importScene(path, kRootNode, importOptions());
        EXPECT_TRUE(again) << messageOf(again);
    }
}

TEST(HostileScene, AUsdaOfOursThatSomebodyHasChangedKeepsAllItHas) {
    const Scratch scratch;
    const std::string head =
        "#usda 1.0\n(\n    customLayerData = {\n        string creator = \"Tessera\"\n    }\n"
        "    metersPerUnit = 1\n)\n";
    const std::string mesh =
        "{\n    point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]\n    int[] faceVertexCounts = [3]\n"
        "    int[] faceVertexIndices = [0, 1, 2]\n    uniform token subdivisionScheme = \"none\"\n}\n";
    const std::string moved =
        "def Xform \"top\"\n{\n    double3 xformOp:translate = (5, 0, 0)\n"
        "    uniform token[] xformOpOrder = [\"xformOp:translate\"]\n    def Mesh \"m\"\n    " +
        mesh + "}\n";
    for (const std::string& body : {"def Mesh \"m\"\n" + mesh, moved, "def Mesh \"m\"\n" + mesh + moved}) {
        const ImportedAspect read = readBack(scratch.write("edited.usda", head + body));
        const Box box = sceneBounds(*read);
        EXPECT_EQ(box.upper.x(), body.find("translate") == std::string::npos ? 1 : 6);
        EXPECT_EQ(box.lower.x(), body.starts_with("def Xform") ? 5 : 0);
    }
}

TEST(HostileScene, ImagesThatHaveAnArrayWithoutPixelsAreLeftOut) {
    Image image;
    image.widthPx = image.heightPx = 2;
    image.pixels = Blob::of(std::span<const std::uint8_t>());
    ExportNotes notes;
    EXPECT_FALSE(pngOf(image, notes, kRootNode));
    EXPECT_EQ(notes.lines(Aspect()).size(), 1u);
}

}  // namespace
}  // namespace tessera

/// What was written, read and written again has the same nodes, under the same names: whatever readers make of a file
/// becomes that file again.
#include <cstring>
#include <nlohmann/json.hpp>

#include "common/cores/Camera.h"
#include "common/cores/Glyphs.h"
#include "common/cores/PointLight.h"
#include "tests/unit/export/BuiltScene.h"
#include "tests/unit/export/ExportFixture.h"

namespace tessera {
namespace {

constexpr const char* kTrees[] = {".glb", ".gltf", ".usda", ".wrl"};

std::string wholeTextOf(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

/// A line for each node of a glTF: its name, what it bears, indented by its depth.
void addGltfNode(const nlohmann::json& file, std::size_t index, std::size_t depth, std::string& skeleton) {
    const nlohmann::json& node = file["nodes"][index];
    skeleton += std::string(depth, ' ') + node.value("name", std::string());
    for (const char* bears : {"mesh", "camera", "skin", "extensions"})
        if (node.contains(bears)) skeleton += fmt::format(" ({})", bears);
    skeleton += '\n';
    for (const std::size_t child : node.value("children", std::vector<std::size_t>()))
        addGltfNode(file, child, depth + 1, skeleton);
}

/// Of a file what says nodes: their kinds, names, and who is below whom.
std::string skeletonOf(const std::string& path) {
    std::string text = wholeTextOf(path), skeleton;
    if (path.ends_with(".glb") || path.ends_with(".gltf")) {
        if (path.ends_with(".glb")) {
            std::uint32_t bytes = 0;
            std::memcpy(&bytes, text.data() + 12, sizeof(bytes));
            text = text.substr(20, bytes);
        }
        const nlohmann::json file = nlohmann::json::parse(text);
        for (const std::size_t top : file["scenes"][0]["nodes"].get<std::vector<std::size_t>>())
            addGltfNode(file, top, 0, skeleton);
        return skeleton;
    }
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);)
        for (const char* word :
             {" def ", "displayName", "Transform {", "Shape {", "Light {", "Viewpoint {", "WorldInfo"})
            if ((' ' + line).find(word) != std::string::npos) {
                skeleton += line.substr(0, line.find('{')) + (line.starts_with("WorldInfo") ? line : "") + '\n';
                break;
            }
    return skeleton;
}

/// Three rounds of each format, each in a folder of its own, so that nothing is named after the file.
void expectFixed(const Aspect& scene, const std::string& what) {
    for (const char* ending : kTrees) {
        const Scratch scratch;
        std::string path = scratch.path(std::string("out") + ending);
        Expected<ExportReport> report = exportScene(path, scene);
        ASSERT_TRUE(report) << what << ending << ": " << (report ? "" : report.error().message);
        const std::string first = skeletonOf(path);
        for (const int round : {2, 3}) {
            const ImportedAspect again = readBack(path);
            std::filesystem::create_directory(scratch.path(fmt::format("{}", round)));
            path = scratch.path(fmt::format("{}/out{}", round, ending));
            report = exportScene(path, *again);
            ASSERT_TRUE(report) << what << ending << ": " << (report ? "" : report.error().message);
            EXPECT_EQ(skeletonOf(path), first) << what << ending << ", round " << round;
        }
    }
}

TEST(FixedPoint, RoomsOfTheGalleryAreTheSameAfterEachRound) {
    for (const char* room : {"08-sharing", "11-lines", "14-text", "15-subdivision", "18-skin", "20-point-light",
                             "22-beacon", "33-images", "50-animation", "64-glyphs"})
        expectFixed(*readBack(fmt::format("{}/deploy/scenes/gallery/{}.tsct", std::string(TESSERA_SOURCE_DIR), room)),
                    room);
}

TEST(FixedPoint, ModelsOfOthersAreTheSameAfterEachRound) {
    for (const char* model : {"arm.glb", "sunlit.glb", "stall.gltf"})
        expectFixed(*readBack(fmt::format("{}/tests/data/models/{}", TESSERA_SOURCE_DIR, model)), model);
}

TEST(FixedPoint, NodesOfEveryKindBesideAndInsideEachOther) {
    BuiltScene built;
    Transform place;
    place.translation = Vec3d(1, 2, 3);
    place.rotation = Quatd(1, 0.5, 0, 0).normalized();
    const ObjectId mesh = built.add(triangleGeometry());
    const ObjectId hall = built.node("hall", built.add(place));
    for (const ObjectId above : {kRootNode, hall, built.node("bare", {}, hall), built.node("mesh", mesh, hall)}) {
        built.node("camera", built.add(Camera()), above);
        built.node("view", built.add(Camera()), built.node("view", built.add(place), above));
        built.node("lamp", built.add(PointLight()), above);
        built.node("light", built.add(PointLight()), built.node("lamp", built.add(place), above));
        built.node("bulb", built.add(PointLight()), built.node("lamp", built.add(place), above));
        built.node("mesh", mesh, above);
        built.node("part 0", mesh, built.node("mesh", mesh, built.node("mesh", built.add(place), above)));
        built.node("nothing", {}, above);
        Glyphs glyphs;
        glyphs.positions = blobOf<float>({0, 0, 0, 1, 0, 0, 2, 0, 0});
        built.node("glyphs", built.add(glyphs), above);
        built.node("empty", built.add(Geometry()), above);
    }
    expectFixed(built.take(), "kinds");
}

TEST(FixedPoint, NodesThatAreFlat) {
    BuiltScene built;
    const ObjectId mesh = built.add(triangleGeometry());
    for (const Vec3d& scale : {Vec3d(0, 1, 1), Vec3d(1, 0, 2), Vec3d(0, 0, 1), Vec3d(0, -2, 0), Vec3d(0, 0, 0)}) {
        Transform flat;
        flat.scale = scale;
        flat.rotation = Quatd(1, 0.25, -0.5, 0.75).normalized();
        built.node("part", mesh, built.node("flat", built.add(flat)));
    }
    expectFixed(built.take(), "flat");
}

TEST(FixedPoint, NamesOfAllLettersComeBack) {
    const std::vector<std::string> names = {"plain",
                                            "two words",
                                            "1st",
                                            "def",
                                            "part 0",
                                            "ünï—码",
                                            "\"quoted\" \\ 'n'",
                                            "{}[]<>#@;",
                                            "same",
                                            "same",
                                            "same_2",
                                            "Looks",
                                            "DEF",
                                            "a=b",
                                            "s",
                                            "node",
                                            "Xform",
                                            "\xF0\x9F\x8F\x97",
                                            std::string(1023, 'x') + "a",
                                            std::string(1023, 'x') + "b"};
    BuiltScene built;
    const ObjectId mesh = built.add(triangleGeometry());
    for (const std::string& name : names) built.node(name, mesh, built.node(name, built.add(Transform())));
    const Aspect scene = built.take();
    expectFixed(scene, "names");
    for (const char* ending : kTrees) {
        const Scratch scratch;
        const std::string path = scratch.path(std::string("out") + ending);
        ASSERT_TRUE(exportScene(path, scene));
        const ImportedAspect again = readBack(path);
        std::vector<std::string> read;
        for (const ObjectId top : again->root().children) read.push_back(again->get<Node>(top)->name);
        EXPECT_EQ(read, names) << ending;
    }
}

TEST(FixedPoint, AFileWithOneTopAndItsMotionIsOneThing) {
    const Scratch scratch;
    const ImportedAspect arm = readBack(std::string(TESSERA_SOURCE_DIR) + "/tests/data/models/arm.glb");
    for (const char* ending : kTrees) {
        const std::string path = scratch.path(std::string("out") + ending);
        ASSERT_TRUE(exportScene(path, *arm));
        ImportOptions options = importOptions();
        options.placing.emplace();
        options.gathers = true;
        Expected<ImportedScene> loaded = importScene(path, kRootNode, options);
        ASSERT_TRUE(loaded) << messageOf(loaded);
        const ImportedAspect scene(std::move(*loaded));
        ASSERT_EQ(scene->root().children.size(), 1u) << ending;
        EXPECT_EQ(scene->get<Node>(scene->root().children.front())->name, "arm") << ending;
    }
}

}  // namespace
}  // namespace tessera

/// tessera-convert and tessera-check as people call them, and scene files from another language.
#include <fmt/format.h>
#include <sys/wait.h>

#include <algorithm>
#include <cstdio>

#include "common/cores/Transform.h"
#include "common/scenefile/SceneFile.h"
#include "server/tools/CheckCommand.h"
#include "server/tools/ConvertCommand.h"
#include "server/tools/SceneImport.h"
#include "tests/support/SceneStructure.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/ImportFixture.h"

namespace tessera {
namespace {

struct Ran {
    int code = -1;
    std::string said;  ///< stdout and stderr
};
Ran run(const std::string& command) {
    Ran ran;
    FILE* pipe = ::popen((command + " 2>&1").c_str(), "r");
    if (pipe == nullptr) return ran;
    char buffer[4096];
    for (std::size_t got = 0; (got = std::fread(buffer, 1, sizeof(buffer), pipe)) > 0;) ran.said.append(buffer, got);
    const int status = ::pclose(pipe);
    ran.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    return ran;
}
std::string program(const std::string& name) {
    return std::string(TESSERA_BIN_DIR) + "/" + name;
}

constexpr const char* kSmall =
    R"(node { name: "box" transform { translation { x: 1 } } box { size { x: 1 y: 2 z: 3 } } })";

TEST(Convert, WritesWhatItReads) {
    const Scratch scratch;
    const std::string in = scratch.write("in.tsct", kSmall);
    const Ran binary = run(program("tessera-convert") + " " + in + " " + scratch.path("out.tsc"));
    EXPECT_EQ(binary.code, 0) << binary.said;
    EXPECT_EQ(binary.said, scratch.path("out.tsc") + ": 2 nodes, 2 other objects, 12 triangles\n");
    const Ran text = run(program("tessera-convert") + " " + scratch.path("out.tsc") + " " + scratch.path("out.tsct"));
    EXPECT_EQ(text.code, 0) << text.said;
    const Expected<FileScene> first = importAsScene(in, importOptions());
    const Expected<FileScene> last = importAsScene(scratch.path("out.tsct"), importOptions());
    ASSERT_TRUE(first && last);
    EXPECT_EQ(structureDifference(first->scene, last->scene), "");
}

TEST(Convert, SaysWhatIsWrongInOneLine) {
    const Scratch scratch;
    const Ran usage = run(program("tessera-convert") + " a.tsct b.step");
    EXPECT_EQ(usage.code, 2);
    EXPECT_EQ(usage.said.find("tessera-convert: b.step: a scene is written as .tsct (text) or .tsc (binary), for other "
                              "programs as .glb, .gltf, "),
              0u)
        << usage.said;
    const Ran missing =
        run(program("tessera-convert") + " " + scratch.path("none.glb") + " " + scratch.path("out.tsc"));
    EXPECT_EQ(missing.code, 3);
    EXPECT_EQ(missing.said.find("tessera-convert: " + scratch.path("none.glb") + ": there is no such file"), 0u)
        << missing.said;
    const Ran later = run(program("tessera-convert") + " " + scratch.write("later.tsct", "version: 7") + " " +
                          scratch.path("out.tsc"));
    EXPECT_EQ(later.code, 3);
    EXPECT_EQ(later.said, "tessera-convert: " + scratch.path("later.tsct") +
                              ": it is a scene of version 7; this program reads version 1\n");
    EXPECT_FALSE(std::filesystem::exists(scratch.path("out.tsc")));
}

TEST(Convert, WritesForOtherProgramsAndNamesWhatIsLost) {
    const Scratch scratch;
    const std::string in =
        scratch.write("in.tsct", std::string(kSmall) + " node { name: \"sky\" environment {} } node { name: \"hall\" " +
                                     kSmall + " }");
    const std::string out = scratch.path("out.glb");
    const Ran whole = run(program("tessera-convert") + " " + in + " " + out);
    EXPECT_EQ(whole.code, 0) << whole.said;
    EXPECT_EQ(whole.said.find("tessera-convert: note: " + out + ": surroundings are left out: /sky\n" + out + ": "), 0u)
        << whole.said;
    EXPECT_WORDS(whole.said);
    const Ran part = run(program("tessera-convert") + " " + in + " " + out + " --under /hall");
    EXPECT_WORDS(part.said);
    EXPECT_EQ(part.said.find("note"), std::string::npos) << part.said;
    const Ran missing = run(program("tessera-convert") + " " + in + " " + out + " --under /halls");
    EXPECT_EQ(missing.code, 3);
    EXPECT_WORDS(missing.said);
    EXPECT_EQ(std::ranges::count(missing.said, '\n'), 1) << missing.said;
    const Ran none = run(program("tessera-convert") + " " + in + " " + out + " --under ''");
    EXPECT_EQ(none.code, 2);
    EXPECT_WORDS(none.said);
    const Ran empty = run(program("tessera-convert") + " " + in + " " + out + " --tolerance ''");
    EXPECT_EQ(empty.code, 2);
    EXPECT_WORDS(empty.said);
    const Ran ours = run(program("tessera-convert") + " " + in + " " + scratch.path("out.tsc") + " --still");
    EXPECT_EQ(ours.code, 2);
    EXPECT_WORDS(ours.said);
    EXPECT_FALSE(std::filesystem::exists(scratch.path("out.tsc")));
}

TEST(Check, NamesFileLineAndColumn) {
    const Scratch scratch;
    const std::string good = scratch.write("good.tsct", kSmall);
    const std::string bad = scratch.write("bad.tsct", "node {\n  nam: \"x\" }");
    const std::string wall = scratch.write("bad.wall", "screens {\n  nam: \"front\" }");
    const Ran ran = run(program("tessera-check") + " " + good + " " + bad + " " + wall + " " + TESSERA_SOURCE_DIR +
                        "/deploy/walls/cave4.wall");
    EXPECT_EQ(ran.code, 3);
    EXPECT_WORDS(ran.said);
    EXPECT_EQ(run(program("tessera-check") + " " + good).code, 0);
    EXPECT_EQ(run(program("tessera-check")).code, 2);
    const Ran json = run(program("tessera-check") + " --json " + good);
    EXPECT_EQ(json.said.find("{\"file\":\"" + good + "\",\"good\":true,"), 0u) << json.said;
}

TEST(Check, APictureThatIsNotThereIsWrongAndConvertKeepsNothingOfIt) {
    const Scratch scratch;
    const std::string file =
        scratch.write("bare.tsct", "image { name: \"i\" uri: \"none.png\" }\n image { name: \"j\" uri: \"no.png\" }\n" +
                                       std::string(kSmall));
    const std::string first =
        file +
        ":1:1: the image 'i' cannot be had: 'none.png': No such file or directory; what names it is drawn without\n";
    const Ran check = run(program("tessera-check") + " " + file);
    EXPECT_EQ(check.code, 3);
    EXPECT_TRUE(check.said.starts_with(first + file + ":2:2: the image 'j' cannot be had: ")) << check.said;
    EXPECT_EQ(std::ranges::count(check.said, '\n'), 2) << check.said;
    const Ran json = run(program("tessera-check") + " --json " + file);
    EXPECT_EQ(json.code, 3);
    EXPECT_NE(json.said.find("\"good\":false"), std::string::npos) << json.said;
    const Ran convert = run(program("tessera-convert") + " " + file + " " + scratch.path("out.tsc"));
    EXPECT_EQ(convert.code, 3);
    EXPECT_EQ(convert.said, "tessera-convert: " + first);
    EXPECT_FALSE(std::filesystem::exists(scratch.path("out.tsc")));
}

TEST(Check, ANumberOutOfItsBoundsIsWrongAndConvertMendsIt) {
    const Scratch scratch;
    const std::string file = scratch.write(
        "rough.tsct",
        "material { name: \"m\"\n  roughness: 9 }\nnode { material: \"m\" box { size { x: 1 y: 1 z: 1 } } }");
    const std::string what = file + ":2:3: material 'm': roughness 9 is not between 0 and 1: 1 is taken\n";
    const Ran check = run(program("tessera-check") + " " + file);
    EXPECT_EQ(check.code, 3);
    EXPECT_EQ(check.said, what);
    const Ran convert = run(program("tessera-convert") + " " + file + " " + scratch.path("out.tsct"));
    EXPECT_EQ(convert.code, 0);
    EXPECT_TRUE(convert.said.starts_with("tessera-convert: note: " + what)) << convert.said;
    const Ran mended = run(program("tessera-check") + " " + scratch.path("out.tsct"));
    EXPECT_EQ(mended.code, 0) << mended.said;
}

TEST(SceneTools, HelpFitsATerminalAndVersionsAreSaid) {
    for (const std::string& name : {std::string("tessera-convert"), std::string("tessera-check")}) {
        const Ran help = run(program(name) + " --help");
        EXPECT_EQ(help.code, 0);
        std::size_t from = 0;
        for (std::size_t end = 0; (end = help.said.find('\n', from)) != std::string::npos; from = end + 1)
            EXPECT_LE(end - from, 80u) << help.said.substr(from, end - from);
        EXPECT_NE(run(program(name) + " --version").said.find(name + " "), std::string::npos);
    }
}

TEST(SceneFile, IsWrittenAndReadInPython) {
    const std::string python = "/usr/bin/python3";
    if (run(python + " -c 'import google.protobuf'").code != 0)
        GTEST_SKIP() << "python3-protobuf is missing (./deploy/set-up installs it)";
    if (run("protoc --version").code != 0) GTEST_SKIP() << "protoc is missing (Debian package protobuf-compiler)";
    const Scratch scratch;
    const std::string folder = scratch.path("");
    ASSERT_EQ(run(program("tessera-check") + " --schema > " + folder + "scene.proto").code, 0);
    const Ran compiled = run("cd " + folder + " && protoc --python_out=. scene.proto");
    ASSERT_EQ(compiled.code, 0) << compiled.said;
    const auto script = [&](const std::string& words) {
        return run("PYTHONPATH=" + folder + " " + python + " " + TESSERA_SOURCE_DIR +
                   "/tests/unit/tools/scene_file.py " + words);
    };
    // Python writes, Tessera reads.
    const Ran written = script("write " + folder + "python.tsc");
    ASSERT_EQ(written.code, 0) << written.said;
    const Expected<FileScene> read = importAsScene(folder + "python.tsc", importOptions());
    ASSERT_TRUE(read) << read.error().message;
    const Expected<ObjectId> node = findNode(read->scene, "/Größe");
    ASSERT_TRUE(node);
    const Transform* place = read->scene.coreOf<Transform>(*read->scene.get<Node>(*node));
    ASSERT_NE(place, nullptr);
    EXPECT_EQ(place->translation, Vec3d(0.1, -2, 1e-300));
    EXPECT_EQ(place->scale, Vec3d::Ones());
    EXPECT_EQ(read->imported.triangles, 1u);
    // Tessera writes, Python reads.
    ASSERT_TRUE(saveScene(folder + "ours.tsc", read->scene));
    const Ran shown = script("read " + folder + "ours.tsc");
    EXPECT_EQ(shown.code, 0);
    EXPECT_EQ(shown.said,
              "(unnamed) -\n  Größe transform 0.1 -2.0 1e-300\n    (unnamed) geometry 36 bytes\n"
              "    (unnamed) motion MODE_PING_PONG\n");
}

}  // namespace
}  // namespace tessera

/// The rules themselves: what they must find, in small trees made for the purpose.
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "tests/architecture/Rules.h"

namespace tessera::architecture {
namespace {

namespace fs = std::filesystem;

const char* const kLayers = R"(# a comment
common/base:
common/math: common/base
common/codec: common/base proto
server: common/base common/math
client: common/base   # and another
third-party Eigen/: common/math
third-party fmt/: *
system: sys/ unistd.h
word std::mutex: common/base
)";

class Rules : public testing::Test {
protected:
    Rules() {
        std::string pattern = testing::TempDir() + "tessera-rules-XXXXXX";
        root_ = ::mkdtemp(pattern.data());
        write("common/base/Error.h", "#pragma once\n#include <string>\n");
        write("common/math/Box.h", "#pragma once\n#include \"common/base/Error.h\"\n#include <Eigen/Core>\n");
    }
    ~Rules() override { fs::remove_all(root_); }

    void write(const std::string& path, const std::string& text) {
        fs::create_directories((root_ / path).parent_path());
        std::ofstream(root_ / path) << text;
    }
    [[nodiscard]] std::vector<SourceFile> tree() const { return readTree(root_, {"common", "server", "client"}); }
    [[nodiscard]] std::string includes() const { return report(checkIncludes(root_, tree(), layers_)); }

    fs::path root_;
    Layers layers_ = *parseLayers(kLayers, "layers.txt");
};

TEST_F(Rules, AcceptAGoodTree) {
    EXPECT_EQ(includes(), "");
    EXPECT_EQ(report(checkThirdParty(tree(), layers_)), "");
    EXPECT_EQ(report(checkAcyclic(tree(), layers_)), "");
    EXPECT_EQ(report(checkSides(tree(), layers_)), "");
    EXPECT_EQ(report(checkWords(tree(), layers_)), "");
}

TEST_F(Rules, FindAnIncludeAgainstTheLayers) {
    write("common/base/Bad.h", "\n\n  #  include \"common/math/Box.h\"\n");
    EXPECT_EQ(includes(),
              "common/base/Bad.h:3: common/base may not include common/math (\"common/math/Box.h\"); allowed:  "
              "(layers.txt:2)\n");
}

TEST_F(Rules, IgnoreIncludesInCommentsAndTexts) {
    write("common/base/Quiet.cpp",
          "// #include \"common/math/Box.h\"\n/*\n#include \"common/math/Box.h\"\n*/ const char* t = \"x\"; // \"\n");
    EXPECT_EQ(includes(), "");
}

TEST_F(Rules, FindAFolderWithoutALine) {
    write("common/secret/Thing.cpp", "");
    write("common/secret/Other.cpp", "");
    EXPECT_EQ(includes(), "common/secret/Other.cpp:1: folder common/secret has code but no line in layers.txt\n");
    write("common/base/deeper/Thing.cpp", "");
    EXPECT_NE(includes().find("folder common/base/deeper"), std::string::npos);
}

TEST_F(Rules, FindAnIncludeThatDoesNotStartAtTheRoot) {
    write("common/math/Near.cpp", "#include \"Box.h\"\n");
    EXPECT_EQ(includes(), "common/math/Near.cpp:1: \"Box.h\" is not a path from the root of the tree\n");
}

TEST_F(Rules, LetGeneratedHeadersToThoseWhoMay) {
    write("common/codec/Good.cpp", "#include \"proto/wall.pb.h\"\n");
    write("server/main.cpp", "#include \"proto/wall.pb.h\"\n");
    EXPECT_EQ(includes(),
              "server/main.cpp:1: server may not include proto (\"proto/wall.pb.h\"); allowed: common/base, "
              "common/math (layers.txt:5)\n");
}

TEST_F(Rules, FindThirdPartyHeadersOutsideOfTheirOwners) {
    write("server/main.cpp",
          "#include <vector>\n#include <sys/types.h>\n#include <unistd.h>\n#include <fmt/format.h>\n#include "
          "<Eigen/Dense>\n#include <zlib.h>\n");
    EXPECT_EQ(report(checkThirdParty(tree(), layers_)),
              "server/main.cpp:5: <Eigen/Dense> is for common/math alone (layers.txt:7)\n"
              "server/main.cpp:6: <zlib.h> has no owner in layers.txt\n");
}

TEST_F(Rules, FindCirclesOfFiles) {
    write("common/base/A.h", "#include \"common/base/B.h\"\n");
    write("common/base/B.h", "#include <string>\n#include \"common/base/C.h\"\n");
    write("common/base/C.h", "#include \"common/base/A.h\"\n");
    EXPECT_EQ(report(checkAcyclic(tree(), layers_)),
              "common/base/A.h:1: includes go in a circle: common/base/A.h -> common/base/B.h -> common/base/C.h -> "
              "common/base/A.h\n");
    write("common/base/A.h", "");
    EXPECT_EQ(report(checkAcyclic(tree(), layers_)), "");
    write("common/base/Self.h", "#include \"common/base/Self.h\"\n");
    EXPECT_NE(report(checkAcyclic(tree(), layers_)), "");
}

TEST_F(Rules, FindAHeaderThatReachesTooMuchOfTheCode) {
    write("common/base/Wide.h", "");
    write("common/base/Over.h", "#include \"common/base/Wide.h\"\n");
    write("common/base/One.cpp", "#include \"common/base/Over.h\"\n\n");
    write("common/base/Other.cpp", "\n\n\n\n\n\n\n\n");
    EXPECT_EQ(report(checkReach(tree(), "common/base", {"common/base/Over.h"}, 10)),
              "common/base/Wide.h:1: 20 % of the code includes it; at most 10 may\n");
    EXPECT_EQ(report(checkReach(tree(), "common/base", {}, 20)), "");
    EXPECT_EQ(report(checkReach(tree(), "common/math", {}, 0)), "");
}

TEST_F(Rules, FindCirclesOfLayers) {
    const Layers circle = *parseLayers("a: b\nb: c\nc: a\n", "layers.txt");
    EXPECT_EQ(report(checkAcyclic(tree(), circle)),
              "layers.txt:1: allowed includes go in a circle: a -> b -> c -> a\n");
}

TEST_F(Rules, KeepServerAndClientApartWhateverTheLayersSay) {
    write("client/Look.h", "");
    write("server/main.cpp", "#include \"client/Look.h\"\n");
    write("common/base/Up.cpp", "#include \"server/Thing.h\"\n");
    const Layers permissive =
        *parseLayers("client:\nserver: client\ncommon/base: server\ncommon/math: common/base\n", "layers.txt");
    EXPECT_EQ(report(checkSides(tree(), permissive)),
              "common/base/Up.cpp:1: common never includes server (\"server/Thing.h\")\n"
              "server/main.cpp:1: server never includes client (\"client/Look.h\")\n"
              "layers.txt:3: common/base must not be allowed server\n"
              "layers.txt:2: server must not be allowed client\n");
}

TEST_F(Rules, FindLocksOutsideOfBase) {
    write("common/base/Lock.h", "std::mutex fine;\n");
    write("server/main.cpp",
          "// std::mutex in a comment\nconst char* t = \"std::mutex\"; long n = 1'000; char q = '\"';\nint "
          "std::mutex_like;\nstd::mutex bad;\n");
    EXPECT_EQ(report(checkWords(tree(), layers_)),
              "server/main.cpp:4: std::mutex is for common/base alone (layers.txt:10)\n");
}

TEST_F(Rules, FindFoldersWithoutAReadme) {
    write("common/math/README.md", "# math\n\nBoxes.\n");
    const std::string missing = report(checkReadmes(root_, tree(), {"proto"}));
    EXPECT_NE(missing.find("common/base/README.md:1: is missing"), std::string::npos) << missing;
    EXPECT_NE(missing.find("proto/README.md:1: is missing"), std::string::npos) << missing;
    EXPECT_EQ(missing.find("common/math"), std::string::npos) << missing;
    write("common/base/README.md", std::string(61, '\n'));
    EXPECT_NE(report(checkReadmes(root_, tree(), {})).find("more than a screen"), std::string::npos);
    write("common/base/README.md", "# base\n");
    EXPECT_NE(report(checkReadmes(root_, tree(), {})).find("says nothing"), std::string::npos);
}

TEST_F(Rules, FindLongFiles) {
    write("common/base/Long.cpp", std::string(601, '\n'));
    write("common/base/Full.cpp", std::string(600, '\n'));
    EXPECT_EQ(report(checkLengths(tree(), 600)),
              "common/base/Long.cpp:600: has 601 lines: at most 600 are allowed; it holds two ideas\n");
}

TEST_F(Rules, FindLinesAboutWhatIsGone) {
    const std::string unused = report(checkLayersAreUsed(tree(), layers_));
    EXPECT_NE(unused.find("layers.txt:6: client is no folder with code"), std::string::npos) << unused;
    EXPECT_NE(unused.find("layers.txt:8: nobody includes fmt/"), std::string::npos) << unused;
    EXPECT_EQ(unused.find("Eigen"), std::string::npos) << unused;
}

TEST_F(Rules, FindEdgesThatNobodyUses) {
    write("common/codec/Code.cpp", "#include \"proto/wall.pb.h\"\n");
    write("server/main.cpp", "#include \"common/math/Box.h\"\n// #include \"common/base/Error.h\"\n");
    const Layers edges = *parseLayers(
        "common/base:\ncommon/math: common/base\ncommon/codec: common/base proto\nserver: common/base common/math\n"
        "third-party Eigen/: common/math server\nthird-party fmt/: *\n",
        "layers.txt");
    const std::string unused = report(checkLayersAreUsed(tree(), edges));
    EXPECT_EQ(unused,
              "layers.txt:3: common/codec may include common/base, and nothing in it does\n"
              "layers.txt:4: server may include common/base, and nothing in it does\n"
              "layers.txt:5: server may include Eigen/, and nothing in it does\n"
              "layers.txt:6: nobody includes fmt/\n");
}

TEST(LayersFile, SaysWhatIsWrongWithIt) {
    const auto error = [](const char* text) {
        const Expected<Layers> layers = parseLayers(text, "layers.txt");
        return layers ? std::string() : layers.error().message;
    };
    EXPECT_EQ(error("a:\nb c d\n").substr(0, 13), "layers.txt:2:");
    EXPECT_EQ(error("a:\na:\n"), "layers.txt:2: a second line for a");
    EXPECT_EQ(error("a: b\n"), "layers.txt:1: a may include b, which has no line of its own");
    EXPECT_EQ(error("odd words here: b\n").substr(0, 13), "layers.txt:1:");
    EXPECT_EQ(error("word std::mutex: a\na:\n"), "");
}

TEST_F(Rules, FindTwoClassesOfOneName) {
    write("server/Table.h", "namespace tessera {\nclass Table final : public Base {\n    struct Entry {};\n};\n}\n");
    write("client/Table.h", "namespace tessera {\nnamespace {\nstruct Table {};\n}\nclass Table;\nstruct Other { struct Table {}; };\n}\n");
    EXPECT_EQ(report(checkNamesAreUnique(tree())), "");
    write("common/base/Table.h", "namespace tessera {\ntemplate <typename T>\nstruct Table {};\n}\n");
    EXPECT_EQ(report(checkNamesAreUnique(tree())), "server/Table.h:2: tessera::Table is defined in common/base/Table.h too\n");
    write("common/base/Table.h", "namespace tessera::base {\nstruct Table {};\n}\n");
    EXPECT_EQ(report(checkNamesAreUnique(tree())), "");
}

}  // namespace
}  // namespace tessera::architecture

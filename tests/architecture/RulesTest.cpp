/// The rules themselves: what they must find, in small trees made for the purpose.
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "tests/architecture/Functions.h"
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
word std::views:
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

TEST_F(Rules, FindWhatNobodyMaySay) {
    write("server/main.cpp", "for (int i : std::views::iota(0, 2)) use(i);\n");
    EXPECT_EQ(report(checkWords(tree(), layers_)), "server/main.cpp:1: std::views is for nobody (layers.txt:11)\n");
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

TEST_F(Rules, FindLongLinesByTheirCharacters) {
    write("client/Wide.h", "// \u00bd\u00bd\u00bd\u00bd\n");
    write("client/Wider.h", "\nconst char* const kText = R\"(\n12345678901\n)\";\n");
    write("server/tool.py", "# 5678901\n");
    const auto longLines = [&](int most) {
        return report(checkColumns(root_, pathsBelow(root_, {"client", "server"}, {".h", ".py"}), most));
    };
    EXPECT_EQ(longLines(29), "");
    EXPECT_EQ(longLines(28), "client/Wider.h:2: has 29 columns: at most 28 are allowed\n");
    EXPECT_EQ(longLines(7).find("Wide.h"), std::string::npos) << "bytes were counted";
    EXPECT_NE(longLines(7).find("server/tool.py:1: has 9"), std::string::npos);
    EXPECT_NE(longLines(7).find("client/Wider.h:3: has 11"), std::string::npos) << "texts count";
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
    write(
        "client/Table.h",
        "namespace tessera {\nnamespace {\nstruct Table {};\n}\nclass Table;\nstruct Other { struct Table {}; };\n}\n");
    EXPECT_EQ(report(checkNamesAreUnique(tree())), "");
    write("common/base/Table.h", "namespace tessera {\ntemplate <typename T>\nstruct Table {};\n}\n");
    EXPECT_EQ(report(checkNamesAreUnique(tree())),
              "server/Table.h:2: tessera::Table is defined in common/base/Table.h too\n");
    write("common/base/Table.h", "namespace tessera::base {\nstruct Table {};\n}\n");
    EXPECT_EQ(report(checkNamesAreUnique(tree())), "");
}

/// What checkFunctionsAreCalled says, with the lines of a list.
class CalledFunctions : public Rules {
protected:
    [[nodiscard]] std::string uncalled(const std::string& list = "") const {
        Findings findings;
        const std::vector<Uncalled> known = parseUncalled(list, "uncalled.txt", findings);
        EXPECT_EQ(report(findings), "");
        return report(checkFunctionsAreCalled(tree(), known, "uncalled.txt"));
    }
};

TEST_F(CalledFunctions, FindOneThatNobodyCalls) {
    write("common/base/Thing.h",
          "namespace tessera {\n[[nodiscard]] int used(int x);\nint forgotten(int x);\nclass Thing {\npublic:\n"
          "    Thing();\n    ~Thing();\n    Thing& operator=(const Thing&) = delete;\n"
          "    [[nodiscard]] int size() const { return size_; }\n    void clear();\n"
          "private:\n    int size_ = 0;\n    std::function<void(int)> told_;\n};\n}\n");
    write("common/base/Thing.cpp",
          "namespace tessera {\n// forgotten(clear)\nThing::Thing() : size_{used(1)} {}\nThing::~Thing() { clear(); }\n"
          "int used(int x) { return x; }\nint forgotten(int x) { return x > 0 ? forgotten(x - 1) : x; }\n"
          "void Thing::clear() { size_ = 0; }\n}\n");
    EXPECT_EQ(uncalled(),
              "common/base/Thing.h:3: no product code calls forgotten\n"
              "common/base/Thing.h:9: no product code calls size\n");
    write("server/main.cpp", "int main() { return forgotten(Thing().size()); }\n");
    EXPECT_EQ(uncalled(), "");
}

TEST_F(CalledFunctions, FindAChainThatBeginsNowhere) {
    write("common/base/Chain.h", "int first();\nint second();\ninline int third() { return 3; }\n");
    write("common/base/Chain.cpp",
          "int first() { return second(); }\nnamespace {\nint hidden() { return third(); }\n}\n"
          "int second() { return hidden(); }\n");
    const std::string all =
        "common/base/Chain.h:1: no product code calls first\n"
        "common/base/Chain.h:2: no product code calls second\n"
        "common/base/Chain.h:3: no product code calls third\n";
    EXPECT_EQ(uncalled(), all);
    EXPECT_EQ(uncalled("common/base/Chain.h first: users of the library call it\n"), "") << "and what it calls";
    write("server/main.cpp", "const int table[] = {first()};\n");
    EXPECT_EQ(uncalled(), "");
}

TEST_F(CalledFunctions, LetWhatOverridesToItsBase) {
    write("common/base/Reader.h",
          "struct Reader {\n    virtual ~Reader() = default;\n    virtual int read() = 0;\n    virtual int skip() = "
          "0;\n};\n"
          "struct FileReader final : Reader, std::streambuf {\n    int read() override;\n    int skip() override;\n"
          "    int underflow() override { return helper(); }\n    int helper();\n};\n");
    EXPECT_EQ(uncalled(),
              "common/base/Reader.h:3: no product code calls read\n"
              "common/base/Reader.h:4: no product code calls skip\n")
        << "what the standard library calls is called, and what that calls";
    write("server/main.cpp", "int main() { Reader& reader = open(); return reader.read() + reader.skip(); }\n");
    EXPECT_EQ(uncalled(), "");
}

TEST_F(CalledFunctions, DoNotTakeOtherThingsForFunctions) {
    write("common/base/Others.h",
          "#define DO(X) X(a) {\nTESSERA_WORD(Others)\nstruct Values {\n    int a = f(1), b{g(2)};\n    int "
          "(*pointer)(int);\n"
          "    std::function<int(double)> callable;\n    enum class Kind { kOne = h(1) };\n    alignas(64) char "
          "room[sizeof(int)];\n"
          "    explicit(true) Values(int a) : a{a}, b(a) {}\n    std::array<int, 3> list{1, 2, 3};\n};\nusing Function "
          "= int(int);\n"
          "inline constexpr auto kLambda = [](int x) { return x; };\nstatic_assert(sizeof(Values) > 4);\n");
    EXPECT_EQ(uncalled(), "");
}

TEST_F(CalledFunctions, TakeAllOfOneNameForOne) {
    write("common/base/Both.h", "int both(int x);\nint both(double x);\nstruct Other { int both() const; };\n");
    EXPECT_EQ(uncalled(),
              "common/base/Both.h:1: no product code calls both\n"
              "common/base/Both.h:2: no product code calls both\n"
              "common/base/Both.h:3: no product code calls both\n");
    write("server/main.cpp", "int main() { return both(1); }\n");
    EXPECT_EQ(uncalled(), "");
}

TEST_F(CalledFunctions, HaveAListThatSpeaksOfWhatIsThere) {
    write("common/base/Listed.h", "int listed();\nint called();\n");
    write("server/main.cpp", "int main() { return called(); }\n");
    EXPECT_EQ(uncalled("# why\n\ncommon/base/Listed.h listed: users of the library call it\n"), "");
    EXPECT_EQ(
        uncalled("common/base/Listed.h listed: so\ncommon/base/Listed.h called: so\ncommon/base/Box.h gone: so\n"),
        "uncalled.txt:2: called is called: it needs no line\nuncalled.txt:3: common/base/Box.h declares no gone\n");
    Findings findings;
    (void)parseUncalled("common/base/Listed.h listed\n", "uncalled.txt", findings);
    EXPECT_EQ(report(findings), "uncalled.txt:1: a line is FILE NAME: REASON\n");
}

}  // namespace
}  // namespace tessera::architecture

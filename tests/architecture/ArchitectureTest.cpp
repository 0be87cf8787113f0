/// The tree as it is, against the rules.
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cctype>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <regex>
#include <set>
#include <sstream>

#include "tests/architecture/Functions.h"
#include "tests/architecture/Rules.h"

namespace tessera::architecture {
namespace {

const char* const kRoot = TESSERA_SOURCE_DIR;

/// Where code lies, and its tests.
const std::vector<std::string> kSources = {"common", "server", "client", "deploy", "tests"};

class Architecture : public testing::Test {
protected:
    static void SetUpTestSuite() {
        std::ifstream in(std::string(kRoot) + "/tests/architecture/layers.txt");
        const std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
        Expected<Layers> parsed = parseLayers(text, "tests/architecture/layers.txt");
        ASSERT_TRUE(parsed) << parsed.error().message;
        layers = std::move(*parsed);
        product = readTree(kRoot, {"common", "server", "client", "deploy/wall"});
        ASSERT_GT(product.size(), 50u) << "the tree was not found in " << kRoot;
    }

    static inline Layers layers;
    static inline std::vector<SourceFile> product;
};

TEST_F(Architecture, IncludesFollowTheLayers) {
    EXPECT_EQ(report(checkIncludes(kRoot, product, layers)), "");
}

TEST_F(Architecture, ThirdPartyHeadersStayWithTheirOwners) {
    EXPECT_EQ(report(checkThirdParty(product, layers)), "");
}

TEST_F(Architecture, IncludesHaveNoCircles) {
    EXPECT_EQ(report(checkAcyclic(product, layers)), "");
}

// All that traverses a scene knows nodes, and everybody the names of types. A field more in another type is not
// everybody's affair.
TEST_F(Architecture, CoresAreKnownToThoseWhoUseThem) {
    const std::string cores = "common/cores";
    EXPECT_EQ(
        report(checkReach(product, cores, {cores + "/Node.h", cores + "/ChildList.h", cores + "/ShippedTypes.h"}, 15)),
        "");
}

TEST_F(Architecture, ServerAndClientDoNotKnowEachOther) {
    EXPECT_EQ(report(checkSides(product, layers)), "");
}

TEST_F(Architecture, ThreadsShareNothingButChannels) {
    ASSERT_FALSE(layers.words.empty());
    EXPECT_EQ(report(checkWords(product, layers)), "");
}

TEST_F(Architecture, EveryFolderExplainsItself) {
    EXPECT_EQ(report(checkReadmes(kRoot, product,
                                  {"common", "server", "client", "deploy", "deploy/walls", "deploy/scenes", "proto",
                                   "tests", "tests/architecture"})),
              "");
}

// What the table says; it is measured by ./deploy/run-tests --times, so that no busy machine decides.
TEST_F(Architecture, NoEntryTakesMoreThanAMinuteOfProcessorTime) {
    std::ifstream in(std::string(kRoot) + "/tests/times.txt");
    ASSERT_TRUE(in) << "tests/times.txt is missing";
    int lineNumber = 0;
    for (std::string line; std::getline(in, line);) {
        ++lineNumber;
        if (line.empty() || line.starts_with('#')) continue;
        std::istringstream words(line);
        std::string entry;
        double processor = 0, clock = 0;
        words >> entry;
        if (entry == "speed") continue;
        ASSERT_TRUE(words >> processor >> clock) << "tests/times.txt:" << lineNumber << ": an entry, seconds, seconds";
        EXPECT_LE(processor, 60) << "tests/times.txt:" << lineNumber << ": " << entry;
    }
}

TEST_F(Architecture, FilesAreShort) {
    EXPECT_EQ(report(checkLengths(product, 600)), "");
    EXPECT_EQ(report(checkLengths(readTree(kRoot, {"tests"}), 600)), "");
}

TEST_F(Architecture, LinesHave120ColumnsAtMost) {
    std::vector<std::string> folders = kSources;
    folders.emplace_back("proto");
    std::vector<std::string> paths = pathsBelow(kRoot, folders,
                                                {".cpp", ".h", ".inl", ".glsl", ".py", ".sh", ".js", ".mjs", ".css",
                                                 ".html", ".proto", ".cmake", ".in", ".txt"});
    std::erase_if(paths,
                  [](const std::string& path) { return path.ends_with(".txt") && !path.ends_with("/CMakeLists.txt"); });
    EXPECT_GT(paths.size(), 2700u) << "they were not found";
    EXPECT_EQ(report(checkColumns(kRoot, paths, 120)), "");
}

// As .clang-format says, by the version that wrote them: another one may see it in another way.
TEST_F(Architecture, FilesAreFormatted) {
    const std::string program = "clang-format-14";
    if (std::system(("command -v " + program + " >/dev/null").c_str()) != 0)
        GTEST_SKIP() << program << " is not installed (apt-get install " << program << ")";
    const std::string list = testing::TempDir() + "tessera-sources." + std::to_string(::getpid());
    {
        std::ofstream out(list);
        for (const std::string& path : pathsBelow(kRoot, kSources, {".cpp", ".h", ".inl"})) out << path << '\n';
        ASSERT_TRUE(out) << list;
    }
    const std::string command = "cd '" + std::string(kRoot) + "' && xargs -a '" + list + "' -n 40 -P \"$(nproc)\" " +
                                program + " --dry-run -Werror 2>&1";
    std::FILE* said = ::popen(command.c_str(), "r");
    ASSERT_TRUE(said);
    std::string findings;
    std::array<char, 4096> line;
    while (std::fgets(line.data(), line.size(), said))
        if (std::string_view(line.data()).find(": error: ") != std::string_view::npos) findings += line.data();
    const int status = ::pclose(said);
    std::filesystem::remove(list);
    EXPECT_EQ(findings, "") << "clang-format-14 -i FILE mends it";
    EXPECT_EQ(status, 0) << command;
}

// A new request is its description, the printed schema, what the desk does and a function of Application. Comments
// count.
TEST_F(Architecture, ARequestsNameStandsInFourFilesAtMost) {
    std::map<std::string, std::string> textOf;
    for (const SourceFile& file : product) textOf[file.path];
    textOf["proto/application.proto"];
    std::set<std::string> requests;
    const std::regex described("RequestInfo kInfo\\{\\s*\\.number = \\d+,\\s*\\.name = \"(\\w+)\"");
    for (auto& [path, text] : textOf) {
        std::ifstream in(std::string(kRoot) + "/" + path);
        text.assign(std::istreambuf_iterator<char>(in), {});
        if (!path.starts_with("common/request/")) continue;
        for (std::sregex_iterator at(text.begin(), text.end(), described), end; at != end; ++at)
            requests.insert(at->str(1));
    }
    ASSERT_GE(requests.size(), 15u) << "the descriptions were not found";

    const auto isPartOfWord = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_'; };
    const auto holds = [&](const std::string& text, const std::string& name) {
        for (std::size_t at = text.find(name); at != std::string::npos; at = text.find(name, at + 1)) {
            const std::size_t end = at + name.size();
            if ((at == 0 || !isPartOfWord(text[at - 1])) && (end == text.size() || !isPartOfWord(text[end])))
                return true;
        }
        return false;
    };
    for (const std::string& name : requests) {
        std::set<std::string> files;
        for (const auto& [path, text] : textOf)
            if (holds(text, name)) files.insert(path);
        std::string list;
        for (const std::string& file : files) list += "\n  " + file;
        EXPECT_LE(files.size(), 4u) << name << " stands in" << list;
    }
}

// What a new reader reads first. A shape more is a reason more, or another one less.
TEST_F(Architecture, TheWayOfAnEditHasTwentyShapesAtMostAndEachIsWhereItIsSaidToBe) {
    constexpr int kMostLines = 60, kMostShapes = 20;
    const std::string readme = std::string(kRoot) + "/server/sim/EDIT.md";
    std::ifstream in(readme);
    ASSERT_TRUE(in) << readme << " is missing";
    const std::regex row("\\| (\\d+) \\| `(\\w+)` \\| `([^`]+)` \\| \\S.*\\|");
    std::set<std::string> seen;
    int lines = 0, shapes = 0;
    for (std::string line; std::getline(in, line); ++lines) {
        std::smatch match;
        if (!std::regex_match(line, match, row)) continue;
        const std::string name = match[2], path = match[3];
        EXPECT_EQ(std::stoi(match[1]), ++shapes) << line;
        EXPECT_TRUE(seen.insert(path + name).second) << name << " is named twice";
        std::ifstream file(std::string(kRoot) + "/" + path);
        ASSERT_TRUE(file) << path << " is missing";
        const std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
        EXPECT_TRUE(std::regex_search(text, std::regex("\\b(struct " + name + " (final )?[:{]|using " + name + " =)")))
            << path << " defines no " << name;
    }
    EXPECT_GT(shapes, 0) << "the table was not found";
    EXPECT_LE(shapes, kMostShapes);
    EXPECT_LE(lines, kMostLines);
}

// What only tests call is no feature.
TEST_F(Architecture, ProductCodeCallsEachFunctionOfItsHeaders) {
    const std::string listFile = "tests/architecture/uncalled.txt";
    std::ifstream in(std::string(kRoot) + "/" + listFile);
    ASSERT_TRUE(in) << listFile << " is missing";
    Findings findings;
    const std::vector<Uncalled> known =
        parseUncalled(std::string(std::istreambuf_iterator<char>(in), {}), listFile, findings);
    EXPECT_EQ(report(findings), "");
    std::size_t functions = 0;
    for (const SourceFile& file : product)
        if (file.path.ends_with(".h")) functions += functionsOf(file).size();
    EXPECT_GT(functions, 3000u) << "they were not found";
    const std::vector<SourceFile> all = readTree(kRoot, {"common", "server", "client", "deploy"});
    EXPECT_EQ(report(checkFunctionsAreCalled(all, known, listFile)), "");
}

TEST_F(Architecture, NoTwoFilesDefineOneName) {
    EXPECT_EQ(report(checkNamesAreUnique(product)), "");
}

TEST_F(Architecture, LayersSpeakOfWhatIsThere) {
    EXPECT_EQ(report(checkLayersAreUsed(product, layers)), "");
}

}  // namespace
}  // namespace tessera::architecture

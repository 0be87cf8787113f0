/// Models that others wrote, written as glTF 2.0: the validator of its makers finds no error, and our importer gets the
/// same scene as of the original.
#include "tests/unit/export/ExportFixture.h"

namespace tessera {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> gltfFilesBelow(const std::string& folder) {
    std::vector<std::string> files;
    if (folder.empty() || !fs::exists(folder)) return files;
    for (const auto& entry : fs::recursive_directory_iterator(folder))
        if (entry.is_regular_file() && (entry.path().extension() == ".glb" || entry.path().extension() == ".gltf"))
            files.push_back(entry.path().string());
    std::sort(files.begin(), files.end());
    return files;
}

/// Reads a file, writes it to `out`, and claims that `out` is read as the same scene.
void expectRoundTrip(const std::string& file, const std::string& out) {
    Expected<ImportedScene> read = importScene(file, kRootNode, importOptions());
    if (!read) return;  // what is no glTF: other tests say why
    // Such a camera is one in perspective from here on, before the middle of what there was.
    const bool orthographic = std::any_of(read->notes.begin(), read->notes.end(), [](const std::string& note) {
        return note.find("orthographic") != std::string::npos;
    });
    const ImportedAspect first(std::move(*read));
    const Expected<ExportReport> report = exportScene(out, *first);
    ASSERT_TRUE(report) << file << ": " << (report ? "" : report.error().message);
    Expected<ImportedScene> again = importScene(out, kRootNode, importOptions());
    ASSERT_TRUE(again) << file << ": " << messageOf(again);
    const ImportedAspect second(std::move(*again));
    if (orthographic) return;
    EXPECT_EQ(Likeness(*first, *second).below(kRootNode, kRootNode), "") << file;
}

void expectAll(const std::string& folder, const std::string& ending) {
    const std::vector<std::string> files = gltfFilesBelow(folder);
    if (files.empty()) GTEST_SKIP() << "there are no models in '" << folder << "'";
    const Scratch scratch;
    for (std::size_t i = 0; i < files.size(); ++i)
        expectRoundTrip(files[i], scratch.path(fmt::format("{}{}", i, ending)));
}

/// Writes what is read of each file, and returns the paths.
std::vector<std::string> writtenAgain(const std::vector<std::string>& files, const std::string& ending,
                                      const Scratch& scratch) {
    std::vector<std::string> written;
    for (const std::string& file : files) {
        Expected<ImportedScene> read = importScene(file, kRootNode, importOptions());
        if (!read) continue;
        const ImportedAspect scene(std::move(*read));
        const std::string out = scratch.path(fmt::format("{}{}", written.size(), ending));
        const Expected<ExportReport> report = exportScene(out, *scene);
        EXPECT_TRUE(report) << file << ": " << (report ? "" : report.error().message);
        written.push_back(out);
    }
    return written;
}

/// Claims that a reader of npm's finds no fault. `set-up --world` unpacks these packages.
void expectGood(const Validated& said) {
    if (!said.there) GTEST_SKIP() << said.said;
    EXPECT_TRUE(said.good) << said.said;
}
void expectValid(const std::string& folder, const std::string& ending) {
    const std::vector<std::string> files = gltfFilesBelow(folder);
    if (files.empty()) GTEST_SKIP() << "there are no models in '" << folder << "'";
    const Scratch scratch;
    expectGood(validated(writtenAgain(files, ending, scratch)));
}

TEST(GltfRoundTrip, KeepsTheModelsOfTheTests) {
    expectAll(std::string(TESSERA_SOURCE_DIR) + "/tests/data/models", ".glb");
}
TEST(GltfRoundTrip, KeepsThemAsTextWithABufferBesideToo) {
    expectAll(std::string(TESSERA_SOURCE_DIR) + "/tests/data/models", ".gltf");
}
TEST(GltfRoundTrip, KeepsTheModelsBesideTheProject) {
    expectAll(testData().empty() ? "" : testData() + "/gltf", ".glb");
}
TEST(GltfRoundTrip, KeepsTheModelsOfDebian) {
    expectAll(std::string(kDebianModels) + "/glTF2", ".glb");
}

TEST(Validators, GltfFindNoErrorInTheModelsOfTheTests) {
    expectValid(std::string(TESSERA_SOURCE_DIR) + "/tests/data/models", ".glb");
}
TEST(Validators, GltfFindNoErrorInTextWithABufferBeside) {
    expectValid(std::string(TESSERA_SOURCE_DIR) + "/tests/data/models", ".gltf");
}
TEST(Validators, GltfFindNoErrorInTheModelsBesideTheProject) {
    expectValid(testData().empty() ? "" : testData() + "/gltf", ".glb");
}
TEST(Validators, GltfFindNoErrorInTheModelsOfDebian) {
    expectValid(std::string(kDebianModels) + "/glTF2", ".glb");
}
TEST(Validators, TinyUsdzReadsEachUsdaThatIsWritten) {
    const Scratch scratch;
    const std::string source(TESSERA_SOURCE_DIR);
    std::vector<std::string> files = gltfFilesBelow(source + "/tests/data/models");
    for (const char* room : {"14-text", "15-subdivision", "64-glyphs"})
        for (const auto& entry : fs::directory_iterator(source + "/deploy/scenes/gallery"))
            if (entry.path().stem() == room) files.push_back(entry.path().string());
    expectGood(validated(writtenAgain(files, ".usda", scratch), "read-usda.mjs"));
}

}  // namespace
}  // namespace tessera

// Files that others made: every real model loads or says why not; every malformed one ends in bounded time.

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <map>
#include <mutex>
#include <thread>

#include "common/scene/Action.h"
#include "tests/unit/import/ImportFixture.h"

namespace tessera {
namespace {

std::vector<std::string> filesBelow(const std::string& folder) {
    std::vector<std::string> files;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
        if (entry.is_regular_file()) files.push_back(entry.path().string());
    std::sort(files.begin(), files.end());
    return files;
}

std::string extensionOf(const std::string& path) {
    std::string extension = std::filesystem::path(path).extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return extension;
}

struct Outcome {
    std::string file;
    Expected<ImportedScene> scene;
    std::chrono::milliseconds time{};
};

/// Imports them all, a few at a time.
std::vector<Outcome> importAll(const std::vector<std::string>& files, const ImportOptions& options) {
    std::vector<Outcome> outcomes(files.size(), Outcome{{}, fail(ErrorCode::kFailed, "not tried"), {}});
    std::atomic<std::size_t> next = 0;
    std::vector<std::thread> threads;
    for (int i = 0; i < 3; ++i)
        threads.emplace_back([&] {
            for (std::size_t at = next++; at < files.size(); at = next++) {
                const auto start = std::chrono::steady_clock::now();
                outcomes[at].file = files[at];
                outcomes[at].scene = importScene(files[at], kRootNode, options);
                outcomes[at].time =
                    std::chrono::duration_cast<std::chrono::milliseconds>(std::chrono::steady_clock::now() - start);
            }
        });
    for (std::thread& thread : threads) thread.join();
    return outcomes;
}

std::string skipReason() {
    return "no folder of real models (TESSERA_TEST_DATA, or shared/data beside the project)";
}

TEST(RealModels, LoadOrSayWhyNot) {
    const std::string data = testData();
    if (data.empty()) GTEST_SKIP() << skipReason();
    std::vector<std::string> files;
    for (const char* folder : {"plant", "scan", "meshes", "cad", "collision", "subdiv", "gltf"})
        for (const std::string& file : filesBelow(data + "/" + folder)) {
            const std::string extension = extensionOf(file);
            for (const char* readable : {".obj", ".ply", ".stl", ".gltf", ".glb", ".off", ".3mf"})
                if (extension == readable) files.push_back(file);
        }
    ASSERT_GT(files.size(), 100u);
    std::size_t loaded = 0;
    for (const Outcome& outcome : importAll(files, importOptions())) {
        if (outcome.scene) {
            ++loaded;
            Aspect aspect;
            ImportedScene scene = *outcome.scene;
            replaceIds(scene.list,
                       [](ObjectId id) { return isPlaceholder(id) ? ObjectId{id.value - kFirstPlaceholder + 2} : id; });
            const Expected<void> applied = aspect.apply(scene.list);
            EXPECT_TRUE(applied) << outcome.file << ": " << (applied ? "" : applied.error().message);
            EXPECT_GT(scene.triangles, 0u) << outcome.file;
            continue;
        }
        EXPECT_EQ(outcome.scene.error().message.compare(0, outcome.file.size(), outcome.file), 0)
            << outcome.scene.error().message;
        std::fprintf(stderr, "not loaded: %s\n", outcome.scene.error().message.c_str());
    }
    // What does not load: a curve, empty OBJ shells of an export, a 3MF of an unknown dialect and the like.
    EXPECT_GE(loaded * 100, files.size() * 90) << loaded << " of " << files.size();
}

TEST(RealModels, MalformedFilesEndInASceneOrAClearError) {
    const std::string data = testData();
    if (data.empty()) GTEST_SKIP() << skipReason();
    const std::vector<std::string> all = filesBelow(data + "/malformed");
    ASSERT_GT(all.size(), 300u);
    // All glTF and assimp files; of the several hundred mutations of one FBX file, every fourth.
    std::vector<std::string> files;
    std::size_t mutation = 0;
    for (const std::string& file : all) {
        if (file.find("/ufbx_fuzz/") != std::string::npos && mutation++ % 4 != 0) continue;
        files.push_back(file);
    }
    ImportOptions options = importOptions();
    options.deadline = std::chrono::seconds(20);
    std::map<std::string, int> kinds;
    for (const Outcome& outcome : importAll(files, options)) {
        EXPECT_LT(outcome.time, std::chrono::seconds(25)) << outcome.file;
        if (outcome.scene) {
            ++kinds["loaded"];
            Aspect aspect;
            ImportedScene scene = *outcome.scene;
            replaceIds(scene.list,
                       [](ObjectId id) { return isPlaceholder(id) ? ObjectId{id.value - kFirstPlaceholder + 2} : id; });
            const Expected<void> applied = aspect.apply(scene.list);
            EXPECT_TRUE(applied) << outcome.file << ": " << (applied ? "" : applied.error().message);
            continue;
        }
        const std::string& message = outcome.scene.error().message;
        EXPECT_EQ(message.compare(0, outcome.file.size(), outcome.file), 0) << message;
        EXPECT_GT(message.size(), outcome.file.size() + 8) << message;
        EXPECT_EQ(message.find("its reader's answer is damaged"), std::string::npos) << message;
        ++kinds[message.find("crashed") != std::string::npos ? "crashed the child" : "refused"];
    }
    for (const auto& [kind, count] : kinds) std::fprintf(stderr, "%s: %d\n", kind.c_str(), count);
}

}  // namespace
}  // namespace tessera

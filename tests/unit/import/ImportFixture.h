/// What the import tests share: a scratch folder, the programs, the data folders, and a scene made of an import.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "common/scene/Aspect.h"
#include "server/import/Importer.h"
#include "tests/unit/Sanitized.h"

namespace tessera {

inline constexpr const char* kDebianModels = "/usr/share/assimp/models";
inline constexpr const char* kEngine = "/usr/share/assimp/models/glTF2/2CylinderEngine-glTF-Binary/2CylinderEngine.glb";

inline ImportOptions importOptions() {
    ImportOptions options;
    options.importerProgram = std::string(TESSERA_BIN_DIR) + "/tessera-import";
    options.assetFolders = {kDebianModels};
    return options;
}

/// The folder of real models beside the project, or empty.
inline std::string testData() {
    const char* set = std::getenv("TESSERA_TEST_DATA");
    const std::string folder = set != nullptr ? set : std::string(TESSERA_SOURCE_DIR) + "/../shared/data";
    return std::filesystem::exists(folder) ? folder : std::string();
}

/// A folder of its own that goes away with the test.
class Scratch {
public:
    Scratch() {
        std::string pattern = testing::TempDir() + "tessera-test-XXXXXX";
        const char* made = ::mkdtemp(pattern.data());
        if (made == nullptr) std::abort();
        folder_ = std::filesystem::canonical(made).string();
    }
    ~Scratch() { std::filesystem::remove_all(folder_); }
    Scratch(const Scratch&) = delete;
    Scratch& operator=(const Scratch&) = delete;

    [[nodiscard]] std::string path(const std::string& name) const { return folder_ + "/" + name; }
    /// Writes a file and returns its path.
    std::string write(const std::string& name, std::string_view content) const {
        const std::string where = path(name);
        std::filesystem::create_directories(std::filesystem::path(where).parent_path());
        // Anew: for what is written over, some file systems wait for their disk.
        if (!std::filesystem::is_symlink(where)) std::filesystem::remove(where);
        std::ofstream(where, std::ios::binary).write(content.data(), static_cast<std::streamsize>(content.size()));
        return where;
    }

private:
    std::string folder_;
};

/// The list with real ids instead of placeholders, applied to an empty scene.
class ImportedAspect {
public:
    explicit ImportedAspect(ImportedScene scene) {
        replaceIds(scene.list, [](ObjectId id) {
            return isPlaceholder(id) ? ObjectId{id.value - kFirstPlaceholder + kRootNode.value + 1} : id;
        });
        const Expected<void> applied = aspect_.apply(scene.list);
        EXPECT_TRUE(applied) << (applied ? "" : applied.error().message);
    }
    [[nodiscard]] const Aspect& operator*() const { return aspect_; }
    [[nodiscard]] const Aspect* operator->() const { return &aspect_; }
    /// The core of the node at a path, or null.
    template <typename Core>
    [[nodiscard]] const Core* core(std::string_view path) const {
        const Expected<ObjectId> node = findNode(aspect_, path);
        EXPECT_TRUE(node) << (node ? "" : node.error().message);
        return node ? aspect_.coreOf<Core>(*aspect_.get<Node>(*node)) : nullptr;
    }

private:
    Aspect aspect_;
};

inline std::string messageOf(const Expected<ImportedScene>& scene) {
    return scene ? "(imported)" : scene.error().message;
}

/// Its notes, one below the other.
inline std::string notesIn(const ImportedScene& scene) {
    std::string all;
    for (const std::string& note : scene.notes) all += (all.empty() ? "" : "\n") + note;
    return all;
}

}  // namespace tessera

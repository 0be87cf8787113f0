/// Which files can be imported, as far as their names say: as the importer itself tells it.
#include "server/import/ModelEndings.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <regex>

#include "server/import/Importer.h"
#include "tests/unit/import/ImportFixture.h"

namespace tessera {
namespace {

TEST(ModelEndings, AreThoseThatTheImporterReads) {
    const std::string path = testing::TempDir() + "tessera-endings.nothing";
    std::ofstream(path) << "of no kind";
    const Expected<ImportedScene> scene = importScene(path, kRootNode, {.allowUnconfined = true});
    std::filesystem::remove(path);
    ASSERT_FALSE(scene);
    const std::string& says = scene.error().message;
    const std::regex ending("\\.([a-z0-9]+)(?=[,;. ]|$)");
    const std::string list = says.substr(std::min(says.find(".3d"), says.size()));
    std::size_t count = 0;
    for (std::sregex_iterator at(list.begin(), list.end(), ending), end; at != end; ++at, ++count)
        EXPECT_TRUE(isModelEnding((*at)[1].str())) << (*at)[1].str() << " in: " << says;
    EXPECT_GT(count, 60u) << says;
    for (const char* none : {"", "nothing", "png", "mtl", "bin", "txt", "GLB", "panel"})
        EXPECT_FALSE(isModelEnding(none)) << none;
}

}  // namespace
}  // namespace tessera

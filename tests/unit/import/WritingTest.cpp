// The scene with which the guide to writing scenes begins is one.
#include <fstream>

#include "tests/unit/import/ImportFixture.h"

namespace tessera {
namespace {

TEST(WritingGuide, BeginsWithAScene) {
    std::ifstream guide(TESSERA_SOURCE_DIR "/server/import/WRITING.md");
    std::string text, line;
    int lines = 0;
    while (std::getline(guide, line) && (lines == 0 || line.starts_with("    "))) {
        if (!line.starts_with("    ")) continue;
        text += line.substr(4) + "\n";
        ++lines;
    }
    EXPECT_EQ(lines, 15);
    const Scratch scratch;
    const Expected<ImportedScene> scene = importScene(scratch.write("table.tsct", text), kRootNode, importOptions());
    ASSERT_TRUE(scene) << scene.error().message;
    EXPECT_EQ(scene->notes, std::vector<std::string>());
    EXPECT_EQ(scene->triangles, 6636u);
}

}  // namespace
}  // namespace tessera

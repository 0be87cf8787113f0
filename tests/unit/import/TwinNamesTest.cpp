// Names that several nodes have: who refers to one of them is told which it is.
#include "tests/unit/import/ImportFixture.h"

namespace tessera {
namespace {

std::vector<std::string> notesOfText(const std::string& text) {
    const Scratch scratch;
    const std::string path = scratch.write("scene.tsct", text);
    const Expected<ImportedScene> scene = importScene(path, kRootNode, importOptions());
    if (!scene) return {scene.error().message};
    std::vector<std::string> notes;
    for (const std::string& note : scene->notes) notes.push_back(note.substr(std::min(note.size(), path.size() - 10)));
    return notes;
}

const std::string kTwoPumps =
    "node { name: \"pump\" transform {} box { size { x: 1 y: 1 z: 1 } } }\n"
    "node { name: \"pump\" transform {} box { size { x: 1 y: 1 z: 1 } } }\n";

TEST(TwinNames, AreToldWhereAnInterestNamesOne) {
    EXPECT_EQ(notesOfText(kTwoPumps + "node {\n  interest { object: \"pump\" } }"),
              std::vector<std::string>{
                  "scene.tsct:4:3: 'pump' names the first of several nodes called 'pump'; 'pump[1]' is the second"});
    EXPECT_EQ(notesOfText(kTwoPumps + "node {\n  interest { object: \"/pump[1]\" against: \"pump[0]\" } }"),
              std::vector<std::string>());
}

TEST(TwinNames, AreToldOfAnyStepOfAPath) {
    const std::string row = "node { name: \"row\" node { name: \"seat\" transform {} } }\n";
    EXPECT_EQ(notesOfText(row + row + "node { motion { target: \"/row/seat\" key {} } }"),
              std::vector<std::string>{
                  "scene.tsct:3:8: '/row/seat' names the first of several nodes called 'row'; 'row[1]' is the second"});
    EXPECT_EQ(notesOfText(row + "node { motion { target: \"/row/seat\" key {} } }"), std::vector<std::string>());
}

/// A repeated node means itself, not the first of them.
TEST(TwinNames, OfCopiesThatMeanThemselvesAreNotTold) {
    EXPECT_EQ(notesOfText("node { name: \"cart\" transform {} repeat { count: 3 step { x: 2 } }\n"
                          "  node { interest { object: \"cart\" } } }"),
              std::vector<std::string>());
}

}  // namespace
}  // namespace tessera

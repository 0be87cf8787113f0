/// Several files with an Environment each: which of them holds, and what people are told.
#include "server/sim/desk/Surroundings.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "common/base/Channel.h"
#include "common/cores/Environment.h"
#include "server/sim/StartScene.h"
#include "server/sim/commit/Committer.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/ImportFixture.h"

namespace tessera {
namespace {

constexpr const char* kBox = "node { name: \"box\" box { size { x: 1 y: 1 z: 1 } } }\n";
constexpr const char* kYard = R"(node { name: "yard" environment { sky { r: 0.5 g: 0.25 b: 0.125 } } })";

class SurroundingsOfFiles : public testing::Test {
protected:
    SurroundingsOfFiles() {
        std::filesystem::copy_file(std::string(TESSERA_SOURCE_DIR) + "/tests/data/models/sunlit.glb", sunlit);
        scratch.write("yard.tsct", std::string(kBox) + kYard);
        scratch.write("box.tsct", kBox);
    }
    /// A server's scene before its first frame, whose log is `said` then.
    Aspect started(const std::vector<std::string>& paths) {
        Channel<Preparation> finished(8);
        const auto files = std::make_shared<SceneFiles>(importOptions(), std::vector<std::string>(), paths);
        Loader loader(importOptions(), files, [&](Preparation done) { finished.push(std::move(done)); });
        const std::string text = scratch.path("log");
        std::FILE* const out = std::fopen(text.c_str(), "w");
        Committer committer;
        {
            Log log("surroundings", out, "");
            StartScene scene(paths);
            EXPECT_TRUE(scene.order(loader, 0));
            std::optional<std::vector<ChangeList>> lists;
            while (!lists) {
                Expected<std::optional<std::vector<ChangeList>>> taken =
                    scene.take(std::move(*finished.pop()), loader, log);
                if (!taken) {
                    ADD_FAILURE() << taken.error().message;
                    break;
                }
                lists = std::move(*taken);
            }
            if (lists)
                for (ChangeList& list : *lists) EXPECT_TRUE(committer.apply(std::move(list)));
        }
        std::fclose(out);
        std::ostringstream all;
        all << std::ifstream(text).rdbuf();
        said = all.str();
        Aspect copy;
        EXPECT_TRUE(copy.apply(snapshot(committer.scene())));
        return copy;
    }
    /// A file that is loaded into this scene below a node.
    Preparation loaded(const std::string& path, ObjectId below) {
        Channel<Preparation> finished(1);
        const auto files = std::make_shared<SceneFiles>(
            importOptions(), std::vector<std::string>{std::filesystem::path(path).parent_path()});
        Loader loader(importOptions(), files, [&](Preparation done) { finished.push(std::move(done)); });
        EXPECT_TRUE(loader.order({.ticket = 1, .node = below, .path = path}));
        Preparation made = std::move(*finished.pop());
        EXPECT_FALSE(made.refused) << made.refused->message;
        return made;
    }
    static std::vector<std::string> environmentsOf(const Aspect& scene) {
        std::vector<std::string> paths;
        for (const ObjectId id : scene.ids())
            if (const Node* node = scene.get<Node>(id); node && node->core && scene.coreOf<Environment>(*node))
                paths.push_back(pathOf(scene, id));
        return paths;
    }
    Scratch scratch;
    const std::string sunlit = scratch.path("sunlit.glb"), yard = scratch.path("yard.tsct"),
                      box = scratch.path("box.tsct");
    std::string said;
};

TEST_F(SurroundingsOfFiles, AreThoseThatSomebodyHasWrittenWhateverComesFirst) {
    const std::vector<std::string> model = {"/sunlit/exposure"}, written = {"/yard"};
    EXPECT_EQ(environmentsOf(started({sunlit, box})), model);
    EXPECT_EQ(said.find("says how"), std::string::npos) << said;
    const Aspect scene = started({sunlit, box, yard});
    EXPECT_EQ(environmentsOf(scene), written);
    EXPECT_TRUE(findNode(scene, "/sunlit/sun") || findNode(scene, "/sunlit")) << "all else is there";
    EXPECT_WORDS(said);
    // What comes later does not count anyway.
    EXPECT_EQ(environmentsOf(started({yard, sunlit})).front(), "/yard");
    EXPECT_WORDS(said);
}

TEST_F(SurroundingsOfFiles, AreTheFirstOnesOfTwoThatSomebodyHasWritten) {
    const std::string garden = scratch.write("garden.tsct", R"(node { name: "garden" environment { metered: true } })");
    EXPECT_EQ(environmentsOf(started({yard, garden})).size(), 2u) << "it is there, for whoever removes the first";
    EXPECT_WORDS(said);
}

TEST_F(SurroundingsOfFiles, ThatAreLoadedWhileTheWallRunsSayWhichHold) {
    const auto noteOf = [&](const Aspect& scene, const std::string& path, const std::string& below) {
        const ObjectId node = below.empty() ? kRootNode : *findNode(scene, below);
        return surroundingsNote(scene, loaded(path, node)).value_or("");
    };
    const Aspect boxes = started({box}), yardAlone = started({yard});
    EXPECT_EQ(noteOf(boxes, sunlit, ""), "") << "nobody else says anything of it";
    EXPECT_EQ(noteOf(yardAlone, box, ""), "");
    EXPECT_EQ(noteOf(yardAlone, sunlit, ""), "its Environment does not count: that of /yard comes first");
    // Below the box, which stands before the yard.
    EXPECT_EQ(noteOf(yardAlone, sunlit, "/box"),
              "its Environment comes before that of /yard, which does not count any more");
    EXPECT_EQ(noteOf(yardAlone, sunlit, "/yard"), "its Environment does not count: that of /yard comes first");
}

}  // namespace
}  // namespace tessera

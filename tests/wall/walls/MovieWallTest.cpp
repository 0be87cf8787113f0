/// A film on walls: the same picture on all tiles, led by tessera-ctl, failed in words.
#include <gtest/gtest.h>

#include <filesystem>

#include "tests/support/wall/AskedWall.h"

namespace tessera::simulation {
namespace {

const std::string kFilm = std::string(TESSERA_SOURCE_DIR) + "/deploy/scenes/gallery/1b-movie.tsct";

class MovieWall : public AskedWall {
public:
    explicit MovieWall(const std::string& wall, const std::string& scene = kFilm)
        : AskedWall({.wall = wall, .scene = scene}) {}
    [[nodiscard]] nlohmann::json film() {
        const nlohmann::json told = ask({"animations"});
        for (const nlohmann::json& entry : told["animations"])
            if (entry["kind"] == "Movie") return entry;
        ADD_FAILURE() << "no film is listed";
        return {};
    }
    /// As the wall is once the picture of that time is there.
    [[nodiscard]] Picture at(const std::string& seconds) {
        tell({"pause", "/film"});
        tell({"seek", "/film", seconds});
        (void)waitForRest();
        return settledPicture();
    }
};

TEST(MovieWall, TwoByTwoShowsWhatOneByOneShowsWhateverPlayedBefore) {
    Picture early, late;
    {
        MovieWall wall("2x2");
        EXPECT_EQ(wall.film()["playing"], true);
        EXPECT_EQ(wall.film()["problem"], "");
        EXPECT_NEAR(wall.film()["length"].get<double>(), 3.0, 0.01) << "36 pictures, twelve a second";
        const std::string undoable = wall.ask({"status"})["undo_depth"].dump();
        const double before = wall.film()["time"];
        for (int i = 0; i < 100 && wall.film()["time"] == before; ++i) wall.settle();
        EXPECT_NE(wall.film()["time"], before) << "it plays";
        EXPECT_EQ(wall.ask({"status"})["undo_depth"].dump(), undoable) << "playing is no step";
        early = wall.at("0.04");
        late = wall.at("1.55");
        EXPECT_GT(pixelsThatDiffer(early, late), 500u);
        wall.tell({"undo"});  // the seek
        (void)wall.waitForRest();
        EXPECT_EQ(pixelsThatDiffer(wall.settledPicture(), early), 0u);
        wall.tell({"redo"});
        wall.tell({"speed", "/film", "-3"});
        wall.tell({"play", "/film"});
        for (int i = 0; i < 30; ++i) wall.settle();
        EXPECT_EQ(pixelsThatDiffer(wall.at("1.55"), late), 0u);
        // Saved as it stands, and loaded again.
        wall.tell({"save", wall.folder() + "/saved.tsct"});
        wall.tell({"set", "/film", "file", "/none/such.avi"});
        for (int i = 0; i < 100 && wall.film()["problem"] == ""; ++i) wall.settle();
        EXPECT_NE(wall.film()["problem"], "") << "what cannot be read is said";
        EXPECT_TRUE(wall.film()["length"].is_null()) << "and nothing is known of it";
        EXPECT_EQ(pixelsThatDiffer(wall.settledPicture(), late), 0u) << "the last picture stays";
        MovieWall saved("1x1", wall.folder() + "/saved.tsct");
        EXPECT_EQ(saved.film()["time"], 1.55);
        EXPECT_EQ(pixelsThatDiffer(saved.settledPicture(), late), 0u);
        (void)saved.finish();
        EXPECT_EQ(wall.finish()["replication"]["state_hash_mismatches"], 0);
    }
    MovieWall one("1x1");
    EXPECT_EQ(pixelsThatDiffer(one.at("1.55"), late), 0u);
    EXPECT_EQ(pixelsThatDiffer(one.at("0.04"), early), 0u);
    (void)one.finish();
}

}  // namespace
}  // namespace tessera::simulation

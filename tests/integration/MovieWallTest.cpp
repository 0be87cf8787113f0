/// A film on walls of real processes: the same picture on all tiles, led by tessera-ctl, failed in words.
#include <gtest/gtest.h>

#include <filesystem>

#include "tests/integration/AskedWall.h"

namespace tessera::test {
namespace {

const std::string kFilm = std::string(TESSERA_SOURCE_DIR) + "/deploy/scenes/gallery/1b-movie.tsct";

class MovieWall : public AskedWall {
public:
    explicit MovieWall(const std::string& wall, const std::string& scene = kFilm)
        : AskedWall({.wall = wall, .scene = scene}), ready(start()) {}
    [[nodiscard]] nlohmann::json film() const {
        const nlohmann::json told = ask({"animations"});
        for (const nlohmann::json& entry : told["animations"])
            if (entry["kind"] == "Movie") return entry;
        ADD_FAILURE() << "no film is listed";
        return {};
    }
    /// As the wall is once the picture of that time is there.
    [[nodiscard]] Picture at(const std::string& seconds, const std::string& name) const {
        tell({"pause", "/film"});
        tell({"seek", "/film", seconds});
        (void)waitForRest();
        return picture(name);
    }
    const bool ready;
};

TEST(MovieWall, TwoByTwoShowsWhatOneByOneShowsWhateverPlayedBefore) {
    Picture early, late;
    {
        MovieWall wall("2x2");
        ASSERT_TRUE(wall.ready) << wall.logs();
        EXPECT_EQ(wall.film()["playing"], true);
        EXPECT_EQ(wall.film()["problem"], "");
        EXPECT_NEAR(wall.film()["length"].get<double>(), 3.0, 0.01) << "36 pictures, twelve a second";
        const std::string undoable = wall.ask({"status"})["undo_depth"].dump();
        const double before = wall.film()["time"];
        for (int i = 0; i < 100 && wall.film()["time"] == before; ++i) wall.settle();
        EXPECT_NE(wall.film()["time"], before) << "it plays";
        EXPECT_EQ(wall.ask({"status"})["undo_depth"].dump(), undoable) << "playing is no step";
        early = wall.at("0.04", "early");
        late = wall.at("1.55", "late");
        EXPECT_GT(pixelsThatDiffer(early, late), 500u);
        wall.tell({"undo"});  // the seek
        (void)wall.waitForRest();
        EXPECT_EQ(pixelsThatDiffer(wall.picture("back"), early), 0u);
        wall.tell({"redo"});
        wall.tell({"speed", "/film", "-3"});
        wall.tell({"play", "/film"});
        for (int i = 0; i < 30; ++i) wall.settle();
        EXPECT_EQ(pixelsThatDiffer(wall.at("1.55", "again"), late), 0u);
        // Saved as it stands, and loaded again.
        wall.tell({"save", wall.folder() + "/saved.tsct"});
        wall.tell({"set", "/film", "file", "/none/such.avi"});
        for (int i = 0; i < 100 && wall.film()["problem"] == ""; ++i) wall.settle();
        EXPECT_NE(wall.film()["problem"], "") << "what cannot be read is said";
        EXPECT_TRUE(wall.film()["length"].is_null()) << "and nothing is known of it";
        EXPECT_EQ(pixelsThatDiffer(wall.picture("left"), late), 0u) << "the last picture stays";
        MovieWall saved("1x1", wall.folder() + "/saved.tsct");
        ASSERT_TRUE(saved.ready) << saved.logs();
        EXPECT_EQ(saved.film()["time"], 1.55);
        EXPECT_EQ(pixelsThatDiffer(saved.picture("saved"), late), 0u);
        (void)saved.finish();
        EXPECT_EQ(wall.finish()["replication"]["state_hash_mismatches"], 0);
    }
    MovieWall one("1x1");
    ASSERT_TRUE(one.ready) << one.logs();
    EXPECT_EQ(pixelsThatDiffer(one.at("1.55", "late"), late), 0u);
    EXPECT_EQ(pixelsThatDiffer(one.at("0.04", "early"), early), 0u);
    (void)one.finish();
}

}  // namespace
}  // namespace tessera::test

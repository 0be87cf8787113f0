/// Letters on a wall: the server sets them, and what it sets travels. Hosts know no fonts (tests/architecture).
#include <gtest/gtest.h>

#include "tests/support/wall/AskedWall.h"
#include "tests/support/words/Words.h"

namespace tessera::simulation {
namespace {

class TextWall : public AskedWall {
public:
    explicit TextWall(const std::string& wall)
        : AskedWall({.wall = wall, .scene = std::string(TESSERA_SOURCE_DIR) + "/tests/data/scenes/sign.tsct"}) {}
};

TEST(TextWall, TwoByTwoShowsTheLettersThatTheServerSets) {
    Picture changed;
    {
        TextWall wall("2x2");
        const Picture hello = wall.settledPicture();
        wall.tell({"set", "/sign/text", "text", "Bye"});
        changed = wall.settledPicture();
        EXPECT_GT(pixelsThatDiffer(hello, changed), 200u) << "the letters are others";
        wall.tell({"undo"});
        EXPECT_EQ(pixelsThatDiffer(wall.settledPicture(), hello), 0u) << "one step takes text and letters back";
        wall.tell({"redo"});
        EXPECT_EQ(pixelsThatDiffer(wall.settledPicture(), changed), 0u);

        const CommandOutcome refused = wall.ctl({"set", "/sign/text", "text", std::string(20000, 'x')});
        EXPECT_NE(refused.exitCode, 0);
        EXPECT_WORDS(refused.output);

        // Letters are solid: what comes from the front stops at them, and not where there are none.
        const AskedWall::Moved stopped = wall.move("/ball", {"0", "0", "-4", "--by"});
        EXPECT_TRUE(stopped.stopped);
        EXPECT_NEAR(stopped.place.z(), 0.1, 2e-3) << "its radius in front of the letter's face";
        EXPECT_EQ(wall.finish()["replication"]["state_hash_mismatches"], 0);
    }
    TextWall one("1x1");
    one.tell({"set", "/sign/text", "text", "Bye"});
    EXPECT_EQ(pixelsThatDiffer(one.settledPicture(), changed), 0u) << "four hosts and one draw the same letters";
    (void)one.finish();
}

}  // namespace
}  // namespace tessera::simulation

/// Letters on a wall whose hosts have no fonts: the server sets them, and what it sets travels.
#include <gtest/gtest.h>

#include <cstdlib>

#include "tests/integration/AskedWall.h"

namespace tessera::test {
namespace {

/// What is started from here on finds no font.
class WithoutFonts {
public:
    WithoutFonts() { ::setenv("FONTCONFIG_FILE", "/dev/null", 1); }
    ~WithoutFonts() { ::unsetenv("FONTCONFIG_FILE"); }
};

class TextWall : public AskedWall {
public:
    explicit TextWall(const std::string& wall)
        : AskedWall({.wall = wall, .scene = std::string(TESSERA_SOURCE_DIR) + "/tests/data/scenes/sign.tsct"}) {
        const WithoutFonts hosts;
        ready = start();
    }
    bool ready = false;
};

TEST(TextWall, HostsWithoutFontsDrawWhatTheServerSets) {
    Picture changed;
    {
        TextWall wall("2x2");
        ASSERT_TRUE(wall.ready) << wall.logs();
        const Picture hello = wall.picture("hello");
        wall.tell({"set", "/sign/text", "text", "Bye"});
        changed = wall.picture("bye");
        EXPECT_GT(pixelsThatDiffer(hello, changed), 200u) << "the letters are others";
        wall.tell({"undo"});
        EXPECT_EQ(pixelsThatDiffer(wall.picture("undone"), hello), 0u) << "one step takes text and letters back";
        wall.tell({"redo"});
        EXPECT_EQ(pixelsThatDiffer(wall.picture("redone"), changed), 0u);

        const Outcome refused = wall.wall().ctl({"set", "/sign/text", "text", std::string(20000, 'x')});
        EXPECT_NE(refused.exitCode, 0);
        EXPECT_NE(refused.output.find("more than the limit of 4096"), std::string::npos) << refused.output;

        // Letters are solid: what comes from the front stops at them, and not where there are none.
        const AskedWall::Moved stopped = wall.move("/ball", {"0", "0", "-4", "--by"});
        EXPECT_TRUE(stopped.stopped);
        EXPECT_NEAR(stopped.place.z(), 0.1, 2e-3) << "its radius in front of the letter's face";
        EXPECT_EQ(wall.finish()["replication"]["state_hash_mismatches"], 0);
    }
    TextWall one("1x1");
    ASSERT_TRUE(one.ready) << one.logs();
    one.tell({"set", "/sign/text", "text", "Bye"});
    EXPECT_EQ(pixelsThatDiffer(one.picture("one"), changed), 0u) << "four processes and one draw the same letters";
    (void)one.finish();
}

}  // namespace
}  // namespace tessera::test

/// A budget of milliseconds that is none.
#include <gtest/gtest.h>

#include "tests/support/wall/AskedWall.h"
#include "tests/support/words/Words.h"

namespace tessera::simulation {
namespace {

const std::string kRestless = std::string(TESSERA_SOURCE_DIR) + "/deploy/scenes/moving.tsct";

TEST(Budget, WhatIsNoneIsRefusedInWords) {
    AskedWall wall({.wall = "1x1", .scene = kRestless});
    for (const char* wrong : {"-1", "nan", "0.01", "60001", "many", "1e999"}) {
        const CommandOutcome outcome = wall.ctl({"budget", wrong});
        EXPECT_NE(outcome.exitCode, 0) << wrong;
        EXPECT_WORDS(outcome.output);
    }
    EXPECT_FALSE(wall.finish().is_null()) << wall.logs();
}

}  // namespace
}  // namespace tessera::simulation

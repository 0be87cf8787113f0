#include "common/base/SystemRandom.h"

#include <gtest/gtest.h>

#include <set>

namespace tessera {
namespace {

TEST(SystemRandom, SaysNothingTwice) {
    std::set<Hash128> seen;
    for (int i = 0; i < 1000; ++i) {
        const Hash128 bits = systemRandom();
        EXPECT_TRUE(bits);
        EXPECT_TRUE(seen.insert(bits).second);
    }
}

}  // namespace
}  // namespace tessera

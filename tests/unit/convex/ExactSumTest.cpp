#include "server/collision/convex/ExactSum.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/unit/collision/RationalOracle.h"

namespace tessera {
namespace {

using exact::Sum;
using oracle::Wide;

Sum toSum(Wide v) {
    Sum out;
    while (v != 0) {
        const double part = static_cast<double>(v);
        out = out + Sum(part);
        v -= static_cast<Wide>(part);
    }
    return out;
}

TEST(ExactSum, AddsAndMultipliesAsIntegersDo) {
    std::mt19937_64 random(4);
    const auto number = [&](int bits) {
        const Wide v = static_cast<Wide>(random() >> (64 - bits));
        return random() & 1 ? v : -v;
    };
    for (int trial = 0; trial < 50'000; ++trial) {
        const Wide a = number(40), b = number(1 + trial % 40), c = number(40), d = number(60), e = number(59);
        // Nearly equal products, so that all but the last bits cancel.
        const Wide truth = a * b * c - (a * c - 1) * b + d * e;
        const Sum sum =
            toSum(a) * toSum(b) * toSum(c) - (toSum(a) * toSum(c) - Sum(1.0)) * toSum(b) + toSum(d) * toSum(e);
        const Sum difference = sum - toSum(truth);
        ASSERT_EQ(sum.sign(), oracle::sign(truth)) << trial;
        ASSERT_EQ(difference.sign(), 0) << trial;
        ASSERT_EQ((sum * Sum(1e-30)).sign(), oracle::sign(truth)) << trial;
        const double rounded = static_cast<double>(truth);
        ASSERT_NEAR(sum.rounded(), rounded, 2.3e-16 * std::abs(rounded)) << trial;
    }
}

TEST(ExactSum, KeepsWhatADoubleWouldLose) {
    const Sum tiny = Sum::difference(1e200, 1e200 - 1e184) * Sum(1e-200);
    EXPECT_EQ((Sum(1.0) + tiny - Sum(1.0) - tiny).sign(), 0);
    EXPECT_EQ((Sum(1e20) * Sum(1e20) + Sum(1e-20) * Sum(1e-20) - Sum(1e20) * Sum(1e20)).sign(), 1);
    EXPECT_EQ(Sum(0.0).sign(), 0);
    EXPECT_EQ((Sum(3.0) - Sum(3.0)).sign(), 0);
}

}  // namespace
}  // namespace tessera

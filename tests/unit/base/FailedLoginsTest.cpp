/// How long refusals wait, at given times.
#include <gtest/gtest.h>

#include <vector>

#include "common/base/FailedLogins.h"

namespace tessera {
namespace {

using namespace std::chrono_literals;

constexpr SourceAddress kA(1), kB(2), kC(3);
constexpr TimePoint kStart{1h};

TEST(FailedLogins, TheFirstWaitForNothingAndEachOneMoreTwiceAsLong) {
    FailedLogins logins;
    TimePoint now = kStart;
    std::vector<std::chrono::seconds> waits;
    for (int i = 0; i < 12; ++i) waits.push_back(logins.failed(kA, now += 1s).wait);
    EXPECT_EQ(waits, (std::vector<std::chrono::seconds>{0s, 0s, 0s, 0s, 0s, 1s, 2s, 4s, 8s, 8s, 8s, 8s}));
    EXPECT_EQ(logins.failed(kB, now).wait, 0s) << "each address has its own";
    for (int i = 0; i < 1000; ++i) EXPECT_LE(logins.failed(kA, now).wait, 8s);
}

TEST(FailedLogins, AnAddressThatIsQuietForAMinuteBeginsAnew) {
    FailedLogins logins;
    for (int i = 0; i < 8; ++i) (void)logins.failed(kA, kStart);
    EXPECT_EQ(logins.failed(kA, kStart + 59s).wait, 8s);
    EXPECT_EQ(logins.failed(kA, kStart + 119s).wait, 0s);
}

TEST(FailedLogins, TooManyThatWaitAreClosed) {
    FailedLogins logins({.maxWaitingOfOne = 2, .maxWaiting = 3});
    for (const SourceAddress from : {kA, kB, kC})
        for (int i = 0; i < 5; ++i) (void)logins.failed(from, kStart);
    std::vector<FailedLogins::Verdict> held;
    const auto closes = [&](SourceAddress from) {
        held.push_back(logins.failed(from, kStart));
        return held.back().close;
    };
    EXPECT_FALSE(closes(kA));
    EXPECT_FALSE(closes(kA));
    EXPECT_TRUE(closes(kA)) << "of one address";
    EXPECT_FALSE(closes(kB));
    EXPECT_TRUE(closes(kC)) << "of all";
    held.erase(held.begin());
    EXPECT_FALSE(closes(kC)) << "one has been answered";
}

TEST(FailedLogins, TheAddressThatFailedLeastRecentlyIsForgotten) {
    FailedLogins logins({.maxAddresses = 2});
    std::vector<FailedLogins::Verdict> held;
    for (int i = 0; i < 6; ++i) held.push_back(logins.failed(kA, kStart));
    for (int i = 0; i < 6; ++i) held.push_back(logins.failed(kB, kStart + 1s));
    (void)logins.failed(kA, kStart + 2s);
    (void)logins.failed(kC, kStart + 3s);
    EXPECT_EQ(logins.failed(kB, kStart + 4s).wait, 0s);
    EXPECT_EQ(logins.failed(kC, kStart + 4s).wait, 0s);
    held.clear();  // of whom nothing is known any more
    for (int i = 0; i < 5; ++i) EXPECT_FALSE(logins.failed(kB, kStart + 5s).close);
}

TEST(FailedLogins, OneAddressInTenSecondsIsToldOf) {
    FailedLogins logins;
    const auto begins = [&](SourceAddress from, TimePoint now) {
        int told = 0;
        for (int i = 0; i < 10; ++i) told += logins.failed(from, now).begins ? 1 : 0;
        return told;
    };
    EXPECT_EQ(begins(kA, kStart), 1);
    EXPECT_EQ(begins(kB, kStart + 9s), 0);
    EXPECT_EQ(begins(kC, kStart + 10s), 1);
}

}  // namespace
}  // namespace tessera

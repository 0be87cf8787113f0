/// Runs a property from many seeds; a failure says how to run its seed again.
#pragma once

#include <gtest/gtest.h>

#include <cerrno>
#include <cstdlib>
#include <random>
#include <string>

namespace tessera {

using Random = std::mt19937_64;

/// Calls `property(random)` once per seed, or once for the seed in TESSERA_SEED. Stops at the first failing seed.
template <typename Property>
void forSeeds(std::uint64_t count, Property&& property) {
    const char* only = std::getenv("TESSERA_SEED");
    const std::uint64_t first = only ? std::strtoull(only, nullptr, 10) : 1;
    const std::uint64_t end = only ? first + 1 : first + count;
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    for (std::uint64_t seed = first; seed < end; ++seed) {
        SCOPED_TRACE("run it again: TESSERA_SEED=" + std::to_string(seed) + " bin/" + program_invocation_short_name +
                     " --gtest_filter=" + test->test_suite_name() + "." + test->name());
        Random random(seed);
        property(random);
        if (testing::Test::HasFailure()) return;
    }
}

/// 0 … count-1.
inline std::size_t below(Random& random, std::size_t count) {
    return count == 0 ? 0 : random() % count;
}
inline bool oneIn(Random& random, std::size_t n) {
    return below(random, n) == 0;
}

}  // namespace tessera

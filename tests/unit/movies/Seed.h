/// The seed of a run, and how to have it again.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <cstdlib>
#include <string>

namespace tessera::test {

[[nodiscard]] inline std::uint64_t seedOfRun() {
    const char* said = std::getenv("TESSERA_SEED");
    return said ? std::strtoull(said, nullptr, 10) : 1;
}
[[nodiscard]] inline std::string againWith(std::uint64_t seed) {
    const testing::TestInfo* test = testing::UnitTest::GetInstance()->current_test_info();
    return fmt::format("again: TESSERA_SEED={} build/bin/unit_movies --gtest_filter={}.{}", seed,
                       test->test_suite_name(), test->name());
}

}  // namespace tessera::test

/// Hostile edits into a running simulation, whose choices the input makes.
#include "tests/fuzz/FuzzInput.h"
#include "tests/fuzz/HostileShow.h"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    tessera::fuzz::FuzzInput in(data, size);
    tessera::test::HostileCounts counts;
    // Instrumented, a step of a search takes a quarter of a millisecond, which counts as a hundred tests.
    const tessera::CollisionLimits limits{.maxTests = 200'000};
    const std::string wrong =
        tessera::test::hostileShow([&](std::size_t n) { return in.below(n); },
                                   1 + static_cast<int>(std::min<std::size_t>(size / 8, 40)), counts, limits);
    tessera::fuzz::must(wrong.empty(), wrong.c_str());
    return 0;
}

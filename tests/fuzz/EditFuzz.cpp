/// Hostile edits into a running simulation, whose choices the input makes.
#include "tests/fuzz/FuzzInput.h"
#include "tests/fuzz/HostileShow.h"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    tessera::fuzz::FuzzInput in(data, size);
    tessera::test::HostileCounts counts;
    const std::string wrong =
        tessera::test::hostileShow([&](std::size_t n) { return in.below(n); }, 1 + static_cast<int>(std::min<std::size_t>(size / 8, 40)), counts);
    tessera::fuzz::must(wrong.empty(), wrong.c_str());
    return 0;
}

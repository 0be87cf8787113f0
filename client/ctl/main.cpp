/// tessera-ctl: one question or command to a running wall.
#include <cstdio>

#include "client/ctl/Verbs.h"
#include "common/base/RunProgram.h"

namespace {

int run(int argc, char** argv) {
    const tessera::CtlOutcome outcome = tessera::runCtl({argv + 1, argv + argc}, [](const std::string& lines) {
        std::fwrite(lines.data(), 1, lines.size(), stdout);
        std::fflush(stdout);
    });
    std::fwrite(outcome.out.data(), 1, outcome.out.size(), stdout);
    std::fwrite(outcome.err.data(), 1, outcome.err.size(), stderr);
    return outcome.exitCode;
}

}  // namespace

int main(int argc, char** argv) {
    return tessera::runProgram("tessera-ctl", [&] { return run(argc, argv); });
}

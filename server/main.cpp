/// tessera-server: the authority over one scene and one wall.
#include <malloc.h>

#include <csignal>
#include <cstdio>
#include <optional>
#include <stop_token>
#include <thread>

#include "common/base/PrintText.h"
#include "common/base/RunProgram.h"
#include "server/Serving.h"

namespace {

using namespace tessera;

/// Large edits are made and let go again in each frame. Their blocks stay in the heap: mapped anew each time, page by
/// page, they cost a frame of 10,000 moves as much as all else (tests/bench/figures.md). No more stays than that: with
/// a pad of a whole heap (64 MiB) glibc's heaps of threads would never be given back, and a refused load would keep its
/// gigabyte.
void keepBlocks() {
    constexpr int kLargest = 32 << 20, kSpare = 32 << 20, kStep = 4 << 20;
    mallopt(M_MMAP_THRESHOLD, kLargest);
    mallopt(M_TRIM_THRESHOLD, kSpare);
    mallopt(M_TOP_PAD, kStep);
}

/// SIGINT and SIGTERM end the show in order, and SIGHUP, unless who started this ignores it (nohup). They are blocked
/// in every thread but the one that waits for them.
class Signals {
public:
    void block() {
        sigemptyset(&ending_);
        sigaddset(&ending_, SIGINT);
        sigaddset(&ending_, SIGTERM);
        struct sigaction hangUp = {};
        if (sigaction(SIGHUP, nullptr, &hangUp) == 0 && hangUp.sa_handler != SIG_IGN) sigaddset(&ending_, SIGHUP);
        pthread_sigmask(SIG_BLOCK, &ending_, nullptr);
        std::signal(SIGPIPE, SIG_IGN);
        std::signal(SIGXFSZ, SIG_IGN);  // a recording as long as the system lets it be is told by write, and ends alone
    }
    [[nodiscard]] std::jthread watch(FrameLoop& loop) const {
        return std::jthread([this, &loop](const std::stop_token& done) {
            // No tick: at the end it gets a signal of its own.
            const std::stop_callback wake(done, [self = pthread_self()] { pthread_kill(self, SIGTERM); });
            while (!done.stop_requested())
                if (sigwaitinfo(&ending_, nullptr) > 0) loop.stop();
        });
    }

private:
    sigset_t ending_{};
};

int run(int argc, char** argv) {
    keepBlocks();
    ServiceNotifier service = ServiceNotifier::ofThisProcess();
    ServerArguments arguments;
    if (const std::optional<int> code = parseServerCommand(argc, argv, arguments)) return *code;
    Log log("tessera-server");
    if (arguments.quiet) log.quieten();
    Signals signals;
    const Expected<void> served = serve(arguments, {.log = log,
                                                    .say =
                                                        [](const std::string& line) {
                                                            printText(line);
                                                            std::fflush(stdout);
                                                        },
                                                    .watch = [&](FrameLoop& loop) { return signals.watch(loop); },
                                                    .threadsBegin = [&] { signals.block(); },
                                                    .service = &service});
    if (served) return 0;
    log.error(served.error().message);
    return exitCode(served.error().code);
}

}  // namespace

int main(int argc, char** argv) {
    return runProgram("tessera-server", [&] { return run(argc, argv); });
}

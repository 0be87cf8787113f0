/// tessera-deform: leads the control points of a running wall's bodies to and fro, frame by frame.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <thread>

#include <fmt/format.h>

#include "client/deform/ControlPoints.h"
#include "common/application/Application.h"
#include "common/base/RunProgram.h"
#include "common/base/Version.h"
#include "common/options/Options.h"

namespace tessera {
namespace {

using namespace std::chrono_literals;

struct DeformOptions {
    std::string server = "127.0.0.1:7000";
    std::vector<std::string> deformings;
    double stagger = 0.35, seconds = 0, wait = 0;
};

int failed(const Error& error) {
    fmt::print(stderr, "tessera-deform: {}\n", error.message);
    return exitCode(error.code);
}

/// Tries again for as long as it may take the wall to start.
Expected<std::unique_ptr<Application>> connected(const DeformOptions& options) {
    const Application::Options how{.address = options.server, .name = "tessera-deform", .wantBlobs = true};
    const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(options.wait);
    for (;;) {
        Expected<std::unique_ptr<Application>> application = Application::connect(how);
        if (application || application.error().code != ErrorCode::kNetwork || std::chrono::steady_clock::now() >= end)
            return application;
        std::this_thread::sleep_for(200ms);
    }
}

/// A body, by what it is led, and how much later than the first of them, in seconds.
struct Led {
    ControlPoints body;
    Deforming by;
    double later = 0;
};

int run(const DeformOptions& options) {
    std::vector<Deforming> deformings;
    for (const std::string& words : options.deformings) {
        Expected<Deforming> deforming = Deforming::parse(words);
        if (!deforming) return failed(deforming.error());
        deformings.push_back(std::move(*deforming));
    }
    Expected<std::unique_ptr<Application>> application = connected(options);
    if (!application) return failed(application.error());
    Application& wall = **application;
    std::vector<Led> all;
    for (const Deforming& deforming : deformings) {
        Expected<std::vector<ControlPoints>> bodies = controlPointsBelow(wall.scene(), deforming.node);
        if (!bodies) return failed(bodies.error());
        for (std::size_t i = 0; i < bodies->size(); ++i)
            all.push_back({std::move((*bodies)[i]), deforming, options.stagger * static_cast<double>(i)});
    }
    fmt::print("tessera-deform: {} bodies\n", all.size());
    std::fflush(stdout);

    constexpr std::uint64_t kGesture = 1;  // one step of undo takes all of it back
    constexpr double kFramesPerSecond = 60;
    std::uint64_t first = 0;
    bool isRefused = false;
    for (bool last = false; !last;) {
        const Expected<notice::Frame> frame = wall.waitForFrame(60s);
        if (!frame) return wall.serverIsOver() ? 0 : failed(frame.error());
        if (first == 0) first = frame->frame.value;
        const double time = static_cast<double>(frame->frame.value - first) / kFramesPerSecond;
        last = options.seconds > 0 && time >= options.seconds;
        ChangeListBuilder list;
        for (const Led& led : all) {
            const double at = time - led.later;
            lead(list, wall.scene(), led.body,
                 at <= 0 || last ? led.body.rest
                                 : deformed(led.body.rest, led.by.kind, led.by.axis, led.by.amountAt(at)));
        }
        const Expected<answer::Committed> committed = wall.propose(list.take(), kGesture);
        if (committed) continue;
        if (wall.serverIsOver()) return 0;
        if (committed.error().code == ErrorCode::kNetwork) {
            if (!wall.connected()) continue;  // it is dialled again
            return failed(committed.error());
        }
        // The next place may be granted.
        if (!isRefused) (void)failed(committed.error());
        isRefused = true;
    }
    return 0;
}

}  // namespace
}  // namespace tessera

int main(int argc, char** argv) {
    using namespace tessera;
    DeformOptions options;
    Options commandLine("tessera-deform",
                        "Leads the control points of a running wall's surfaces and lattices to\nand fro.",
                        versionText("tessera-deform"));
    const auto numberOfSeconds = [](const std::string& text) {
        char* end = nullptr;
        const auto seconds = static_cast<double>(std::strtold(text.c_str(), &end));
        const bool fits = !text.empty() && *end == '\0' && seconds >= 0 && seconds <= 1e6;
        return fits ? std::string() : text + " is not a number of seconds from 0 to 1000000";
    };
    commandLine.option("--server", options.server, "The wall's server").typeName("ADDR:PORT").showDefault();
    commandLine
        .option(
            "deformings", options.deformings,
            "KIND[-AXIS]:AMOUNT:SECONDS:NODE; KIND bend, twist\n(degrees) or swell (per cent); AMOUNT A or\nFROM..TO")
        .required()
        .typeName("HOW");
    commandLine.option("--stagger", options.stagger, "How much later each further body of a NODE begins,\nseconds")
        .check(numberOfSeconds, "0 to 1000000")
        .showDefault();
    commandLine
        .option("--seconds", options.seconds,
                "Then all is led back (0: as long as the wall\nruns). Of the wall's own time, 60 frames a second:\na "
                "slow wall takes longer")
        .check(numberOfSeconds, "0 to 1000000");
    commandLine.option("--wait", options.wait, "So many seconds for a wall that is not there yet")
        .check(numberOfSeconds, "0 to 1000000");
    const Expected<std::optional<std::string>> instead =
        commandLine.read(std::vector<std::string>(argv + 1, argv + argc));
    if (!instead) {
        fmt::print(stderr, "{}\nRun with --help for more information.\n", instead.error().message);
        return exitCode(instead.error().code);
    }
    if (*instead) {
        fmt::print("{}", **instead);
        return 0;
    }
    return runProgram("tessera-deform", [&] { return run(options); });
}

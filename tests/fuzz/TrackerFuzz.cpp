/// What trackers send: datagrams of DTrack and OSC, the stream of a VRPN server, and the poses that come of them.
#include "server/sim/tracking/DtrackParser.h"
#include "server/sim/tracking/OscParser.h"
#include "server/sim/tracking/Tracking.h"
#include "server/sim/tracking/VrpnStream.h"
#include "tests/fuzz/FuzzInput.h"

namespace tessera::fuzz {
namespace {

Wall trackedWall() {
    Wall wall;
    wall.users.push_back({.name = "viewer"});
    wall.tracking.trackers = {{.name = "art", .axes = "x z -y"}};
    wall.tracking.heads = {{.user = "viewer", .mount = {.tracker = "art"}}};
    wall.tracking.wands = {{.name = "right", .mount = {.tracker = "art", .sensor = {SensorKind::kFlystick, 0}}}};
    return wall;
}

void run(FuzzInput in) {
    Tracking tracking(trackedWall());
    VrpnStream stream({.tracker = "Tracker0"});
    TimePoint at = TimePoint{} + std::chrono::hours(1);
    const auto take = [&](Expected<std::vector<SensorReport>> reports) {
        if (!reports) return must(!reports.error().message.empty(), "a refusal has words");
        must(reports->size() <= 4 * kMostReports, "what one read says is bounded");
        tracking.take({.tracker = 0, .at = at, .reports = std::move(*reports)});
        (void)tracking.advance(at, at + std::chrono::milliseconds(16));
        for (const TrackedHead& head : tracking.heads())
            must(head.position.allFinite() && std::abs(head.orientation.norm() - 1) < 1e-6, "a head is somewhere");
        for (const WandState& wand : tracking.wands())
            must(wand.position.allFinite() && wand.axes.size() <= kMostAxes, "a wand is somewhere");
    };
    bool streaming = true;
    for (int packets = 0; !in.empty() && packets < 100; ++packets) {
        at += std::chrono::milliseconds(in.below(64));
        const std::size_t kind = in.below(3);
        const std::size_t size = in.number<std::uint16_t>() % 2048;
        const ByteSpan bytes = in.bytes(size);
        if (kind == 0) take(parseDtrack(bytes));
        if (kind == 1) take(parseOsc(bytes));
        if (kind == 2 && streaming) {
            Expected<std::vector<SensorReport>> reports = stream.take(bytes);
            streaming = reports.has_value();
            take(std::move(reports));
        }
    }
}

}  // namespace
}  // namespace tessera::fuzz

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    tessera::fuzz::run({data, size});
    return 0;
}

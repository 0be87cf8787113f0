#include "tests/sim/Trouble.h"

namespace tessera::simulation {

void Trouble::live() {
    comeInAnyOrder();
    plan();
    cluster_.run(3'200ms);
    repairAll();
    // The slowest way back: a dead link that only the client can notice (1.5 s), or a mismatch nobody looks at (sync
    // deadline 1 s) after blobs that came late (800 ms); then the dial, a name still taken (250 ms), snapshot and
    // blobs.
    cluster_.run(2'800ms);
    cluster_.server().nobodyMayFail();
    const std::uint64_t before = cluster_.server().released();
    cluster_.run(700ms);
    cluster_.requireEverybodyInStep();
    // A frame takes its interval, drawing, and four ways over the slowest link: Begin, Ready, Swap, Shown.
    const ClusterConfig& config = cluster_.config();
    const Duration longest = 15ms + 2 * config.drawTime + 4 * (config.latency + config.jitter) + 5ms;
    if (cluster_.server().released() < before + static_cast<std::uint64_t>(700ms / longest))
        throw Violation("a healthy wall stands still");
    cluster_.server().finish();
    cluster_.run(1'000ms);
    cluster_.requireEverybodyFinished();
}

void Trouble::comeInAnyOrder() {
    cluster_.startServer();
    for (std::size_t i = 0; i < cluster_.hostCount(); ++i) {
        const Duration when = random_.chance(0.8) ? random_.between(0ms, 300ms) : sometime();
        cluster_.timeline().after(when, [this, i] {
            if (!cluster_.host(i).running()) cluster_.host(i).start();
        });
    }
    for (std::size_t i = 0; i < cluster_.applicationCount(); ++i)
        cluster_.timeline().after(sometime(), [this, i] { cluster_.application(i).start(); });
}

void Trouble::plan() {
    for (std::uint64_t n = random_.below(24); n > 0; --n) cluster_.timeline().after(sometime(), [this] { strike(); });
    for (std::uint64_t n = random_.below(8); n > 0; --n)
        cluster_.timeline().after(sometime(), [this] { cluster_.server().announceBlobs(); });
    for (std::uint64_t n = random_.below(3); n > 0; --n)
        cluster_.timeline().after(sometime(), [this] { cluster_.server().requestImages(); });
    for (std::size_t i = 0; i < cluster_.applicationCount(); ++i)
        for (std::uint64_t n = random_.below(4); n > 0; --n)
            cluster_.timeline().after(sometime(), [this, i] { cluster_.application(i).ask(); });
}

void Trouble::later(Duration low, Duration high, std::function<void()> what) {
    cluster_.timeline().after(random_.between(low, high), [this, what = std::move(what)] {
        if (!over_) what();
    });
}

void Trouble::strike() {
    const std::size_t index = random_.below(cluster_.hostCount());
    switch (random_.below(8)) {
        case 0: {
            const auto manner = static_cast<Stranger::Manner>(random_.below(Stranger::kManners));
            // Where the name is free at that moment, the stranger is taken for the host until it is found silent.
            if (manner == Stranger::Manner::kDouble || manner == Stranger::Manner::kVanishing)
                cluster_.server().mayFail(Cluster::hostName(index));
            return cluster_.addStranger(manner, Cluster::hostName(index));
        }
        case 1:
            if (random_.chance(0.5)) return cluster_.server().freeze(random_.between(20ms, 700ms));
            return cluster_.server().stall(random_.between(20ms, 700ms));
        case 2:
            if (cluster_.applicationCount() > 0) {
                Peer& application = cluster_.application(random_.below(cluster_.applicationCount()));
                application.freeze();
                later(50ms, 1'500ms, [&application] { application.thaw(); });
            }
            return;
        default:
            return strikeHost(index);
    }
}

void Trouble::strikeHost(std::size_t index) {
    Peer& host = cluster_.host(index);
    cluster_.server().mayFail(host.name());
    switch (random_.below(12)) {
        case 0:
            host.crash(random_.chance(0.5));
            return later(0ms, 500ms, [&host] {
                if (!host.running()) host.start();
            });
        case 1:
            host.freeze();
            return later(30ms, 1'500ms, [&host] { host.thaw(); });
        case 2:
            return host.hangDrawing(random_.between(20ms, 1'500ms));
        case 3:
            host.drawSlower(static_cast<double>(2 + random_.below(30)));
            return later(50ms, 1'000ms, [&host] { host.drawSlower(1); });
        case 4:
            return host.cutCable();
        case 5:
            return host.breakBulk();
        case 6:
            return host.muteBulk();
        case 7:
            return host.corrupt();
        case 8:
            host.stopShowing();
            return later(20ms, 1'000ms, [&host] { host.showAgain(); });
        case 9:
            host.loseReadies(true);
            return later(20ms, 1'500ms, [&host] { host.loseReadies(false); });
        case 10:
            host.showLater(random_.between(100ms, 500ms));
            return later(20ms, 1'500ms, [&host] { host.showLater({}); });
        default: {
            const Message rude[] = {message::Ready{.frame = FrameNumber(~std::uint64_t{0})},
                                    message::Synced{.sequence = Sequence(~std::uint64_t{0})},
                                    message::Request{},
                                    message::BlobRequest{},
                                    message::Welcome{},
                                    message::Hello{}};
            return host.misbehave(rude[random_.below(std::size(rude))]);
        }
    }
}

void Trouble::repairAll() {
    over_ = true;
    for (std::size_t i = 0; i < cluster_.hostCount(); ++i) {
        Peer& host = cluster_.host(i);
        host.thaw();
        host.drawSlower(1);
        host.showAgain();
        host.loseReadies(false);
        host.showLater({});
        if (!host.running()) host.start();
    }
    for (std::size_t i = 0; i < cluster_.applicationCount(); ++i) cluster_.application(i).thaw();
}

}  // namespace tessera::simulation

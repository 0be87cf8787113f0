#include "server/sim/desk/StatusAnswers.h"

#include <algorithm>

#include <fmt/format.h>

#include "server/sim/frame/Simulation.h"

namespace tessera {

namespace {

/// "art: dtrack, 2 of 3 sensors at 60 Hz".
std::string lineOf(const TrackerInfo& tracker) {
    std::size_t speaking = 0;
    double rate = 0;
    for (const SensorInfo& sensor : tracker.sensors) {
        if (sensor.ageMs < 0 || sensor.ageMs > 1000) continue;
        ++speaking;
        rate = std::max(rate, sensor.rateHz);
    }
    return fmt::format("{}: {}, {} of {} sensors speak{}{}", tracker.name, tracker.protocol, speaking,
                       tracker.sensors.size(), speaking > 0 ? fmt::format(", {:.0f} Hz", rate) : std::string(),
                       tracker.trouble.empty() ? "" : "; " + tracker.trouble);
}

}  // namespace

answer::Status statusOf(const DeskSurroundings& around) {
    const ServerSession& session = around.session;
    const Simulation& simulation = around.simulation;
    answer::Status status;
    status.wallName = around.wall.name;
    status.epoch = session.epoch();
    status.frame = session.nextFrame();
    status.sequence = simulation.sequence();
    status.stateHash = simulation.scene().stateHash();
    status.hosts = hostsOf(session);
    status.waitingFor = session.waitingFor();
    status.objects = simulation.scene().objectCount();
    status.nodes = simulation.nodeCount();
    status.undoDepth = simulation.history().undoDepth();
    status.redoDepth = simulation.history().redoDepth();
    status.journal = around.journal;
    if (const std::optional<Error> why = around.whyNoEdit()) status.journalTrouble = why->message;
    if (around.describeWaits) around.describeWaits(status);
    if (around.describePrograms) status.programs = around.describePrograms();
    if (around.budget) {
        status.budgetMs = around.budget->milliseconds();
        status.detail = around.budget->step();
    }
    if (around.exposure) {
        status.exposure = around.exposure->exposure().wish;
        if (around.exposure->meters()) status.meteredStops = around.exposure->exposure().foundStops();
    }
    for (const TrackerInfo& tracker : trackersOf(around).trackers) status.trackers.push_back(lineOf(tracker));
    if (around.steering && around.steering->takesInput()) {
        status.navigation = std::string(nameOf(around.steering->mode()));
        status.steering = around.steering->active();
    }
    return status;
}

std::vector<answer::HostInfo> hostsOf(const ServerSession& session) {
    std::vector<answer::HostInfo> hosts;
    for (const ServerSession::HostStatus& host : session.hosts())
        hosts.push_back({.name = host.name,
                         .state = std::string(nameOf(host.state)),
                         .lastShown = host.lastShown,
                         .roundTripMs = toMilliseconds(host.roundTrip)});
    return hosts;
}

answer::Trackers trackersOf(const DeskSurroundings& around) {
    return around.describeTrackers ? around.describeTrackers() : answer::Trackers();
}

}  // namespace tessera

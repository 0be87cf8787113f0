#include "tests/drill/DrillWall.h"

#include <fmt/format.h>
#include <signal.h>

#include <algorithm>
#include <thread>

namespace tessera::drill {

using namespace std::chrono_literals;
using nlohmann::json;

namespace {

std::chrono::milliseconds toMs(Duration d) {
    return std::chrono::duration_cast<std::chrono::milliseconds>(d);
}

std::string endOf(const std::string& text) {
    constexpr std::size_t kMost = 600;
    return text.size() > kMost ? "…" + text.substr(text.size() - kMost) : text;
}

}  // namespace

DrillWall::DrillWall(DrillWallOptions options) : options_(std::move(options)) {
    if (options_.machines > 0) {
        network_ = std::make_unique<SwitchedNetwork>(options_.machines);
    } else {
        try {
            loopback_ = std::make_unique<NetworkNamespace>();  // its bytes are this wall's alone
        } catch (const RowSkipped&) {
            loopback_ = nullptr;
        }
    }
    if (network_) makeKeys();
    startServer();
    for (const std::string& name : options_.hosts) startHost(name);
    {
        const NetworkNamespace::Inside inside(serverMachine());
        watch_ = std::make_unique<FrameWatch>(address_);
    }
    (void)waitUntilAllBack(now(), 60s);
    watch(700ms);  // whoever has just come is still warming up
}

void DrillWall::startServer() {
    const std::string host = network_ ? network_->serverAddress() : "127.0.0.1";
    std::vector<std::string> command = {test::program("tessera-server"),
                                        "--wall",
                                        options_.wall,
                                        "--scene",
                                        options_.scene,
                                        "--rate",
                                        fmt::format("{:.0f}", kRateHz),
                                        "--listen",
                                        address_.empty() ? host + ":0" : address_,
                                        "--report",
                                        folder() + "/report.json"};
    if (network_) command.insert(command.end(), {"--keys", keys()});
    command.insert(command.end(), options_.server.begin(), options_.server.end());
    server_ = start("server", command);
    const auto listening = server_->waitForText("listening on ", 30s);
    if (!listening && server_->waitForExit(1s) == 2)
        throw RowNotAvailable("tessera-server says: " + endOf(server_->output()));
    if (!listening) throw RowBroken("the server does not listen: " + endOf(server_->output()));
    address_ = *listening;
}

/// From machines of their own nobody comes in without one.
void DrillWall::makeKeys() {
    std::vector<std::vector<std::string>> verbs = {{"init", "--wall", options_.wall},
                                                   {"person", "ada", "--role", "editor"}};
    for (const std::string& name : kFourHosts) verbs.push_back({"host", name});
    for (std::vector<std::string>& words : verbs) {
        words.insert(words.begin(), {test::program("tessera-keys"), "--keys", keys()});
        const test::Outcome made = test::run(folder(), words);
        if (made.exitCode != 0) throw RowBroken("tessera-keys says: " + endOf(made.output));
    }
}

void DrillWall::startHost(const std::string& name) {
    std::vector<std::string> command = {test::program("tessera-client"),
                                        "--server",
                                        address_,
                                        "--host",
                                        name,
                                        "--surface",
                                        "none",
                                        "--output",
                                        folder() + "/out"};
    if (const auto more = options_.clients.find(name); more != options_.clients.end())
        command.insert(command.end(), more->second.begin(), more->second.end());
    if (network_) command.insert(command.end(), {"--keys", keys()});
    machines_.try_emplace(name, machines_.size());
    const NetworkNamespace::Inside inside(machineOf(name));
    hosts_[name] = std::make_unique<test::Process>(folder(), name, command);
}

std::unique_ptr<test::Process> DrillWall::start(const std::string& name, std::vector<std::string> command) {
    const NetworkNamespace::Inside inside(serverMachine());
    return std::make_unique<test::Process>(folder(), name, std::move(command));
}

std::unique_ptr<test::Process> DrillWall::startOn(std::size_t machine, const std::string& name,
                                                  std::vector<std::string> command) {
    const NetworkNamespace::Inside inside(&network_->host(machine));
    return std::make_unique<test::Process>(folder(), name, std::move(command));
}

std::unique_ptr<test::Process> DrillWall::startGuest(const std::string& kind, bool nice) {
    std::vector<std::string> command = {test::program("tessera-drill"), "--guest", kind, address_};
    if (nice) command.insert(command.begin(), {"/usr/bin/nice", "-n", "19"});
    return start("guest", std::move(command));
}

test::Outcome DrillWall::ctl(std::vector<std::string> words) {
    words.insert(words.begin(), {test::program("tessera-ctl"), "--server", address_});
    const auto process = start("ctl", std::move(words));
    const bool ended = waitForExit(*process, 60s);
    return {.exitCode = ended ? process->waitForExit(0ms).value_or(-1) : -1, .output = process->output()};
}

const NetworkNamespace* DrillWall::machineOf(const std::string& host) const {
    return network_ ? &network_->host(machines_.at(host)) : serverMachine();
}

const NetworkNamespace* DrillWall::serverMachine() const {
    return network_ ? &network_->server() : loopback_.get();
}

void DrillWall::takeSeen() {
    while (watch_) {
        auto seen = watch_->take();
        if (!seen) return;
        if (auto* frame = std::get_if<SeenFrame>(&*seen))
            timeline_.add(std::move(*frame));
        else
            lost_.push_back(std::get<FrameWatch::Lost>(*seen).at);
    }
}

const FrameTimeline& DrillWall::timeline() {
    takeSeen();
    return timeline_;
}

void DrillWall::watch(Duration time) {
    std::this_thread::sleep_for(time);
    takeSeen();
}

void DrillWall::watchUndisturbed(Measurement& measured, Duration time) {
    const TimePoint from = now();
    watch(time);
    const Duration gap = timeline_.longestGap(from, now());
    measured.usualMissed = std::max(measured.usualMissed, timeline_.framesOf(gap));
    measured.usualGapMs = std::max(measured.usualGapMs, toMilliseconds(gap));
}

template <typename Found>
TimePoint DrillWall::waitFor(const std::string& what, Duration timeout, const Found& found) {
    const TimePoint deadline = now() + timeout;
    for (;;) {
        takeSeen();
        if (const std::optional<TimePoint> at = found()) return *at;
        if (!server_->running()) throw RowBroken("the server ended: " + what + "\n" + logs());
        if (now() > deadline)
            throw RowBroken(fmt::format("not within {:.0f} s: {}\n{}", toMilliseconds(timeout) / 1e3, what, logs()));
        std::this_thread::sleep_for(5ms);
    }
}

TimePoint DrillWall::waitUntilGone(const std::string& host, TimePoint since, Duration timeout) {
    return waitFor(host + " was given up", timeout, [&] { return timeline_.firstWithout(host, since); });
}

TimePoint DrillWall::waitUntilBack(const std::string& host, TimePoint since, Duration timeout) {
    return waitFor(host + " came back", timeout, [&] { return timeline_.firstWith(host, since); });
}

TimePoint DrillWall::waitUntilAllBack(TimePoint since, Duration timeout) {
    return waitFor("all hosts showed a frame", timeout, [&]() -> std::optional<TimePoint> {
        const std::vector<SeenFrame>& frames = timeline_.frames();
        for (auto frame = frames.rbegin(); frame != frames.rend() && frame->at >= since; ++frame)
            if (std::ranges::all_of(hosts_, [&](const auto& host) {
                    return std::ranges::find(frame->hosts, host.first) != frame->hosts.end();
                }))
                return frame->at;
        return std::nullopt;
    });
}

std::optional<TimePoint> DrillWall::connectionLost(TimePoint since) {
    takeSeen();
    for (const TimePoint at : lost_)
        if (at >= since) return at;
    return std::nullopt;
}

bool DrillWall::waitForExit(test::Process& process, Duration timeout) {
    const bool ended = process.waitForExit(toMs(timeout)).has_value();
    takeSeen();
    return ended;
}

std::string DrillWall::stateHash() {
    const test::Outcome status = ctl({"--json", "status"});
    const json parsed = json::parse(status.output, nullptr, false);
    if (status.exitCode != 0 || parsed.is_discarded()) throw RowBroken("no status: " + endOf(status.output));
    return parsed.value("state_hash", "");
}

void DrillWall::conclude(Measurement& measured, const std::vector<std::string>& expectedFaults) {
    if (!serverMachine()) measured.bytes.reset();  // others' bytes would be among them
    (void)waitUntilAllBack(now(), 20s);
    measured.stateHash = stateHash();
    watch_.reset();
    server_->signal(SIGTERM);
    if (server_->waitForExit(20s) != 0) measured.broken.push_back("the server did not end in order:\n" + logs());
    for (auto& [name, process] : hosts_)
        if (process->waitForExit(10s) != 0) measured.broken.push_back(name + " did not end in order");
    const json left = report();
    if (left.is_discarded()) {
        measured.broken.push_back("there is no report");
        return;
    }
    if (const auto wrong = left["replication"]["state_hash_mismatches"].get<int>(); wrong != 0)
        measured.broken.push_back(fmt::format("{} times a host had another state than the server", wrong));
    for (const json& fault : left["faults"]) {
        const auto host = fault["host"].get<std::string>();
        if (std::ranges::find(expectedFaults, host) == expectedFaults.end())
            measured.broken.push_back(fmt::format("{} was lost: {}", host, fault["kind"].get<std::string>()));
    }
}

json DrillWall::report() const {
    return json::parse(test::readText(folder() + "/report.json"), nullptr, false);
}

std::string DrillWall::logs() const {
    std::string all = "server: " + endOf(server_->output());
    for (const auto& [name, process] : hosts_) all += name + ": " + endOf(process->output());
    return all;
}

}  // namespace tessera::drill

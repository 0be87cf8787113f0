/// A wall of real processes to do something to: a server at 60 frames a second, hosts that draw nothing, and somebody
/// who writes down what it shows.
#pragma once

#include <chrono>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tests/drill/FrameTimeline.h"
#include "tests/drill/FrameWatch.h"
#include "tests/drill/Judgement.h"
#include "tests/drill/Network.h"
#include "tests/integration/LiveWall.h"
#include "tests/integration/Process.h"

namespace tessera::drill {

using test::kFourHosts;

/// Thrown where a row cannot go on: a promise was broken so far that nothing can be measured any more.
struct RowBroken : std::runtime_error {
    using std::runtime_error::runtime_error;
};
/// Thrown where these programs refuse what the row needs.
struct RowNotAvailable : std::runtime_error {
    using std::runtime_error::runtime_error;
};

struct DrillWallOptions {
    std::string wall = "2x2";
    std::vector<std::string> hosts = kFourHosts;  ///< that are started at once
    std::string scene = {};
    std::vector<std::string> server = {};                          ///< more options of tessera-server
    std::map<std::string, std::vector<std::string>> clients = {};  ///< more options of a host's tessera-client
    std::size_t machines = 0;  ///< > 0: so many machines on a switch, the hosts' first; else all on one's loopback
};

class DrillWall {
public:
    static constexpr double kRateHz = 60;

    /// Starts everything; returns once all hosts show frames and the wall has settled. Throws RowBroken with what the
    /// processes said, RowSkipped without the network it needs, RowNotAvailable when the server knows an option not.
    explicit DrillWall(DrillWallOptions options);

    [[nodiscard]] test::Process& server() { return *server_; }
    [[nodiscard]] test::Process& host(const std::string& name) { return *hosts_.at(name); }
    [[nodiscard]] SwitchedNetwork& network() { return *network_; }
    [[nodiscard]] const std::string& folder() const { return folder_.path(); }
    [[nodiscard]] const std::string& address() const { return address_; }

    /// None where everything runs in the drill's own network.
    [[nodiscard]] const NetworkNamespace* serverMachine() const;

    /// Of the wall, its hosts, and an editor, ada.
    void makeKeys();
    [[nodiscard]] std::string keys() const { return folder() + "/keys"; }
    [[nodiscard]] std::string personsKey() const { return keys() + "/person-ada.pem"; }
    /// The same command as before, at the address of the first one.
    void startServer();
    void startHost(const std::string& name);
    /// Any program, on the server's machine.
    [[nodiscard]] std::unique_ptr<test::Process> start(const std::string& name, std::vector<std::string> command);
    /// On another one of its network.
    [[nodiscard]] std::unique_ptr<test::Process> startOn(std::size_t machine, const std::string& name,
                                                         std::vector<std::string> command);
    /// See Guest.h. `nice`: at the lowest priority.
    [[nodiscard]] std::unique_ptr<test::Process> startGuest(const std::string& kind, bool nice = false);
    [[nodiscard]] test::Outcome ctl(std::vector<std::string> words);

    // All of these write down frames meanwhile.
    void watch(Duration time);
    /// Watches a while in which nothing is done and notes the longest gap.
    void watchUndisturbed(Measurement& measured, Duration time);
    /// When a frame came without, or with, this host since then. Throws RowBroken when none does in time.
    [[nodiscard]] TimePoint waitUntilGone(const std::string& host, TimePoint since, Duration timeout);
    [[nodiscard]] TimePoint waitUntilBack(const std::string& host, TimePoint since, Duration timeout);
    /// All of the hosts that run.
    [[nodiscard]] TimePoint waitUntilAllBack(TimePoint since, Duration timeout);
    /// When the watching application found its connection gone since then.
    [[nodiscard]] std::optional<TimePoint> connectionLost(TimePoint since);
    [[nodiscard]] bool waitForExit(test::Process& process, Duration timeout);
    [[nodiscard]] const FrameTimeline& timeline();

    [[nodiscard]] std::uint64_t networkBytes() const { return networkBytesOf(server_->pid()); }
    /// Of the scene as it is now: status' state hash.
    [[nodiscard]] std::string stateHash();
    /// Ends the wall and checks what holds for every row: all hosts are live and at the server's state, none was ever
    /// at another, every process ends in order. `expectedFaults`: hosts that may have been lost; nobody else may.
    void conclude(Measurement& measured, const std::vector<std::string>& expectedFaults);
    /// What the server has left behind, once it has concluded.
    [[nodiscard]] nlohmann::json report() const;

    /// The end of what everybody has said, for messages.
    [[nodiscard]] std::string logs() const;

private:
    void takeSeen();
    [[nodiscard]] const NetworkNamespace* machineOf(const std::string& host) const;
    template <typename Found>
    TimePoint waitFor(const std::string& what, Duration timeout, const Found& found);

    DrillWallOptions options_;
    test::TemporaryFolder folder_;
    std::unique_ptr<SwitchedNetwork> network_;
    std::unique_ptr<NetworkNamespace> loopback_;  ///< none without root
    std::string address_;
    std::unique_ptr<test::Process> server_;
    std::map<std::string, std::unique_ptr<test::Process>> hosts_;
    std::map<std::string, std::size_t> machines_;
    FrameTimeline timeline_{kRateHz};
    std::vector<TimePoint> lost_;
    std::unique_ptr<FrameWatch> watch_;
};

[[nodiscard]] inline TimePoint now() {
    return std::chrono::steady_clock::now();
}

}  // namespace tessera::drill

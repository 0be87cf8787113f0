/// One server and many peers on one time line, from a seed; and the laws that bind them to each other.
#pragma once

#include <deque>
#include <memory>

#include "tests/sim/Owner.h"
#include "tests/sim/Peer.h"
#include "tests/sim/Stranger.h"

namespace tessera::simulation {

struct ClusterConfig {
    std::uint64_t seed = 1;
    std::size_t hosts = 4;
    std::size_t applications = 0;
    LateFramePolicy lateFrame = LateFramePolicy::kWait;
    bool ignoresMismatches = false;
    std::uint64_t damagedChunkEvery = 0;
    Duration latency = 1ms;  ///< at most, each link its own
    Duration jitter = 1ms;
    Duration drawTime = 5ms;
};

class Cluster : public Witness {
public:
    explicit Cluster(ClusterConfig config);
    [[nodiscard]] const ClusterConfig& config() const { return config_; }

    void startServer() { owner_.start(); }
    /// Server and everybody at once.
    void startAll();
    void run(Duration time);
    /// Runs until all hosts of the wall are in the barrier and have shown something there; false after `limit`.
    [[nodiscard]] bool runUntilAllInStep(Duration limit);
    void addStranger(Stranger::Manner manner, const std::string& hostName);

    [[nodiscard]] Timeline& timeline() { return timeline_; }
    [[nodiscard]] Random& random() { return random_; }
    [[nodiscard]] Owner& server() { return owner_; }
    [[nodiscard]] Peer& host(std::size_t index) { return *hosts_.at(index); }
    [[nodiscard]] Peer& application(std::size_t index) { return *applications_.at(index); }
    [[nodiscard]] std::size_t hostCount() const { return hosts_.size(); }
    [[nodiscard]] std::size_t applicationCount() const { return applications_.size(); }
    [[nodiscard]] const std::deque<Stranger>& strangers() const { return strangers_; }
    /// Longest time between two releases since the last call.
    [[nodiscard]] Duration longestGap();

    /// All hosts are live and close to the newest frame, all applications close to the newest list.
    void requireEverybodyInStep() const;
    /// Everybody was told of the end and has exited.
    void requireEverybodyFinished() const;

    /// The last lines of what happened, oldest first.
    [[nodiscard]] std::string story() const;
    /// Changes with every single thing that happens.
    [[nodiscard]] std::uint64_t fingerprint() const { return fingerprint_; }

    static std::string hostName(std::size_t index) { return "host" + std::to_string(index); }
    static constexpr std::uint64_t kSchema = 99;

    // Witness
    void shows(const std::string& host, FrameNumber frame) override;
    void heard(const std::string& host, FrameNumber frame, TimePoint shownAt) override;
    void trace(const std::string& line) override;

private:
    static OwnerConfig ownerConfig(const ClusterConfig& config);
    PeerConfig peerConfig(const std::string& name, PeerRole role);
    [[nodiscard]] const Peer& peer(const std::string& host) const;

    ClusterConfig config_;
    Random random_;
    Timeline timeline_;
    Network network_;
    Owner owner_;
    std::vector<std::unique_ptr<Peer>> hosts_;
    std::vector<std::unique_ptr<Peer>> applications_;
    std::deque<Stranger> strangers_;
    std::deque<std::string> story_;
    std::uint64_t fingerprint_ = 0;
    std::uint64_t seenReleased_ = 0;
    TimePoint lastRelease_{};
    Duration longestGap_{};
};

}  // namespace tessera::simulation

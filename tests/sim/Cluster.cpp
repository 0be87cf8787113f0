#include "tests/sim/Cluster.h"

#include <algorithm>

namespace tessera::simulation {

namespace {
constexpr std::size_t kStoryLines = 60;
}  // namespace

OwnerConfig Cluster::ownerConfig(const ClusterConfig& config) {
    OwnerConfig owner;
    for (std::size_t i = 0; i < config.hosts; ++i) owner.session.hosts.push_back(hostName(i));
    owner.session.sync.lateFrame = config.lateFrame;
    owner.session.sync.frameDeadline = 600ms;
    owner.session.sync.firstFrameDeadline = 600ms;
    owner.session.sync.heartbeat = 50ms;
    owner.session.maxMismatches =
        1'000;  // strikes come more often than a wall's; who is sent away does not come back by itself
    owner.session.sync.lostAfter = 250ms;
    owner.session.sync.lateAfter = 30ms;
    owner.session.sync.startDeadline = 1'500ms;
    owner.session.schema = kSchema;
    owner.session.newToken = [random = Random(config.seed)]() mutable {
        return SessionToken{random.next(), random.next()};
    };
    owner.session.helloDeadline = 400ms;
    owner.session.syncDeadline = 1'000ms;
    owner.session.blobDeadline = 800ms;
    owner.session.applicationLostAfter = 800ms;
    owner.ignoresMismatches = config.ignoresMismatches;
    owner.damagedChunkEvery = config.damagedChunkEvery;
    return owner;
}

PeerConfig Cluster::peerConfig(const std::string& name, PeerRole role) {
    PeerConfig peer;
    peer.name = name;
    peer.role = role;
    peer.schema = kSchema;
    peer.wantBlobs = role == PeerRole::kHost || random_.chance(0.5);
    peer.link = {.latency = random_.between(50us, config_.latency),
                 .jitter = random_.between(0ms, config_.jitter),
                 .bytesPerSecond = random_.chance(0.2) ? 5e6 : 100e6};
    peer.drawTime = config_.drawTime;
    peer.applyTime = random_.between(100us, 2ms);
    peer.clockAhead = random_.between(0s, 600s) - 300s;
    return peer;
}

Cluster::Cluster(ClusterConfig config)
    : config_(config),
      random_(config.seed),
      network_(timeline_, random_.fork()),
      owner_(ownerConfig(config), timeline_, network_, *this, random_.fork()) {
    for (std::size_t i = 0; i < config.hosts; ++i)
        hosts_.push_back(std::make_unique<Peer>(peerConfig(hostName(i), PeerRole::kHost), timeline_, network_, *this,
                                                random_.fork()));
    for (std::size_t i = 0; i < config.applications; ++i)
        applications_.push_back(std::make_unique<Peer>(peerConfig("viewer" + std::to_string(i), PeerRole::kApplication),
                                                       timeline_, network_, *this, random_.fork()));
    lastRelease_ = timeline_.now();
}

void Cluster::startAll() {
    startServer();
    for (auto& host : hosts_) host->start();
    for (auto& application : applications_) application->start();
}

void Cluster::run(Duration time) {
    const TimePoint end = timeline_.now() + time;
    while (timeline_.now() < end) {
        timeline_.runUntil(std::min(end, timeline_.now() + 1ms));
        if (owner_.released() != seenReleased_) {
            longestGap_ = std::max(longestGap_, owner_.lastReleased() - lastRelease_);
            seenReleased_ = owner_.released();
            lastRelease_ = owner_.lastReleased();
        }
    }
}

bool Cluster::runUntilAllInStep(Duration limit) {
    const TimePoint end = timeline_.now() + limit;
    while (owner_.inStep().size() < hosts_.size()) {
        if (timeline_.now() >= end) return false;
        run(1ms);
    }
    return true;
}

Duration Cluster::longestGap() {
    return std::exchange(longestGap_, Duration{});
}

void Cluster::addStranger(Stranger::Manner manner, const std::string& hostName) {
    strangers_.emplace_back(manner, hostName, kSchema, network_, random_.fork());
}

const Peer& Cluster::peer(const std::string& host) const {
    return **std::find_if(hosts_.begin(), hosts_.end(), [&](const auto& peer) { return peer->name() == host; });
}

void Cluster::shows(const std::string& host, FrameNumber frame) {
    fingerprint_ =
        (fingerprint_ ^ frame.value ^ static_cast<std::uint64_t>(timeline_.now().time_since_epoch().count())) *
        0x9E3779B97F4A7C15ull;
    owner_.showed(host);
    std::uint64_t oldest = ~std::uint64_t{0}, newest = 0;
    for (const std::string& name : owner_.inStep()) {
        oldest = std::min(oldest, peer(name).shown().value);
        newest = std::max(newest, peer(name).shown().value);
    }
    if (!owner_.inStep().empty() && newest - oldest > 1)
        throw Violation("frames " + std::to_string(oldest) + " and " + std::to_string(newest) +
                        " are shown at the same time");
}

void Cluster::heard(const std::string& host, FrameNumber frame, TimePoint shownAt) {
    const Peer& shower = peer(host);
    if (!shower.everShown() || shower.shown() != frame) return;
    const Duration error = shownAt > shower.shownAt() ? shownAt - shower.shownAt() : shower.shownAt() - shownAt;
    // Half the round trip, with both ways at their slowest. A heartbeat that lay in the socket of a server that stood
    // still looks as if it had been under way for so long; a better one follows soon.
    if (error > config_.latency + config_.jitter + owner_.excuse(timeline_.now() - 1s))
        throw Violation(host + " misjudges the server's clock");
}

void Cluster::trace(const std::string& line) {
    story_.push_back(std::to_string(toMilliseconds(timeline_.now().time_since_epoch() - 1'000s)) + " ms  frame " +
                     std::to_string(owner_.released()) + "  " + line);
    if (story_.size() > kStoryLines) story_.pop_front();
    fingerprint_ = (fingerprint_ ^ std::hash<std::string>{}(story_.back())) * 0x9E3779B97F4A7C15ull;
}

std::string Cluster::story() const {
    std::string all;
    for (const std::string& line : story_) all += line + "\n";
    return all;
}

void Cluster::requireEverybodyInStep() const {
    for (const auto& status : owner_.session().hosts()) {
        // Where links are more jittery than hosts may be late, a healthy one may miss every frame.
        const bool jittery = config_.lateFrame != LateFramePolicy::kWait && config_.jitter > 10ms;
        const bool mayBeDropped = config_.lateFrame == LateFramePolicy::kDrop && status.state == HostState::kSyncing;
        if (status.state != HostState::kLive && status.state != HostState::kLate && !mayBeDropped)
            throw Violation(status.name + " is " + std::string(nameOf(status.state)) + " and should be live again");
        const Peer& host = peer(status.name);
        if (!jittery && host.shown().value + 10 < owner_.released())
            throw Violation(status.name + " shows an old frame");
    }
    for (const auto& application : applications_)
        if (application->scene().sequence.value + 10 < owner_.scene().sequence.value)
            throw Violation(application->name() + " has fallen behind");
}

void Cluster::requireEverybodyFinished() const {
    for (const auto& host : hosts_)
        if (!host->finished()) throw Violation(host->name() + " was not told of the end");
    for (const auto& application : applications_)
        if (!application->finished()) throw Violation(application->name() + " was not told of the end");
}

}  // namespace tessera::simulation

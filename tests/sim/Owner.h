/// The server process: a ServerSession, a frame loop with a model scene, and the laws that every release has to keep.
#pragma once

#include <deque>
#include <map>
#include <optional>
#include <set>

#include "common/session/ServerSession.h"
#include "tests/sim/Model.h"
#include "tests/sim/Network.h"
#include "tests/sim/Peer.h"

namespace tessera::simulation {

struct OwnerConfig {
    ServerSessionConfig session;
    Duration frameInterval = 15ms;
    /// The frame loop never answers a mismatch: the sync deadline has to.
    bool ignoresMismatches = false;
    /// Every so many chunks one is damaged on the way; 0: none.
    std::uint64_t damagedChunkEvery = 0;
};

class Owner final : public End {
public:
    Owner(OwnerConfig config, Timeline& timeline, Network& network, Witness& witness, Random random);

    void start() { work(); }
    /// The frame loop does nothing for so long; the network's thread goes on taking in bytes and noting when they came.
    void stall(Duration duration);
    /// The whole process does nothing for so long (kill -STOP): what comes meanwhile is read afterwards, bit by bit.
    void freeze(Duration duration);
    void announceBlobs();
    void requestImages();
    void finish();
    /// Whatever happens to this host from now on may be noticed. A fault of any other host is a false alarm.
    void mayFail(const std::string& host) { mayFail_.insert(host); }
    void nobodyMayFail() { mayFail_.clear(); }

    [[nodiscard]] const ServerSession& session() const { return session_; }
    [[nodiscard]] std::uint64_t released() const { return released_; }
    [[nodiscard]] TimePoint lastReleased() const { return lastReleased_; }
    [[nodiscard]] std::uint64_t faults(FaultKind kind) const;
    [[nodiscard]] std::uint64_t entries() const { return entries_; }
    [[nodiscard]] std::uint64_t images() const { return images_; }
    [[nodiscard]] std::uint64_t requests() const { return requests_; }
    /// Hosts whose shown images are bound to each other: in the barrier, not behind, and shown something since.
    [[nodiscard]] const std::set<std::string>& inStep() const { return inStep_; }
    void showed(const std::string& host) {
        if (members_.contains(host) && !behind_.contains(host)) inStep_.insert(host);
    }
    /// How much later than it should a deadline that began to run at `since` may be seen: our own standstills, and a
    /// moment after each.
    [[nodiscard]] Duration excuse(TimePoint since) const;
    [[nodiscard]] const ModelScene& scene() const { return scene_; }

    // End
    void opened(ConnectionId connection) override;
    void received(ConnectionId connection, Epoch epoch, std::shared_ptr<const Message> message) override;
    void undecodable(ConnectionId connection) override;
    void closed(ConnectionId connection) override;

private:
    struct Event {
        TimePoint at;
        std::function<ServerActions(TimePoint)> say;
    };
    /// What is known of the open frame, from what went over the wire.
    struct Frame {
        FrameNumber number;
        StateHash stateHash;
        TimePoint begun;
        std::map<std::string, TimePoint> ready;  ///< with the right hash
        std::map<std::string, TimePoint> wrong;  ///< with another hash
        std::set<std::string> drawing;           ///< told to draw it, and not gone since
        bool open = false;
    };

    [[nodiscard]] TimePoint now() const { return timeline_.now(); }
    void post(std::function<ServerActions(TimePoint)> say);
    void work();
    void drain();
    void planWork();
    void maybeBegin();
    void prepare();
    void carryOut(ServerActions actions);
    void on(const server_action::Send& action);
    void on(const server_action::Close& action);
    void on(const server_action::SnapshotWanted& action);
    void on(const server_action::HostEntered& action);
    void on(const server_action::Fault& action);
    void on(const server_action::FrameReleased& action);
    void on(const server_action::FrameStats& action);
    void on(const server_action::FrameShown& action);
    void on(const server_action::StateMismatch& action);
    void on(const server_action::HashesReceived& action);
    void on(const server_action::RequestReceived& action);
    void on(const server_action::ApplicationJoined&) {}
    void on(const server_action::ApplicationLeft&) {}
    void on(const server_action::InputReceived&) { violated("tells of input that no host of this simulation sends"); }
    void on(const server_action::InputEnded&) {}
    void on(const server_action::LoginsSlowed&) { violated("slows logins down though nobody shows a word"); }
    void on(const server_action::UploadReceived&) {
        violated("tells of arrays that no application of this simulation uploads");
    }
    void on(const server_action::BlobsEverywhere& action);
    void on(const server_action::BlobRequested& action);
    void on(const server_action::ImageReceived&) { ++images_; }
    void on(const server_action::EpochRaised&) { violated("raises its epoch though nobody has seen another"); }
    void on(const server_action::PixelsDiffer&) { violated("pixels differ though all probes are alike"); }
    void left(const std::string& host);
    void checkQuiet() const;
    void checkDetection(const server_action::Fault& fault) const;
    [[noreturn]] void violated(const std::string& what) const { throw Violation("the server: " + what); }

    OwnerConfig config_;
    Timeline& timeline_;
    Network& network_;
    Witness& witness_;
    Random random_;
    ServerSession session_;

    std::deque<Event> inbox_;
    TimePoint stalledUntil_{};
    TimePoint unreadUntil_{};  ///< after a freeze: when the last byte that lay in the sockets will have been read
    std::vector<std::pair<TimePoint, TimePoint>> stalls_;
    TimePoint workPlanned_ = TimePoint::max();
    std::set<ConnectionId> open_;
    std::map<ConnectionId, std::string> hostOf_;

    ModelScene scene_;  ///< committed; may be ahead of the frames that have begun
    std::optional<message::Begin> prepared_;
    TimePoint nextBegin_{};
    std::map<BlobId, Blob> blobs_;
    std::map<std::uint64_t, std::vector<BlobInfo>> announced_;
    std::vector<BlobInfo> everywhere_;  ///< to be named by the next list
    std::uint64_t tokens_ = 0, chunks_ = 0, imageRequests_ = 0;

    Frame frame_;
    std::uint64_t released_ = 0;
    TimePoint lastReleased_{};
    std::set<std::string> mayFail_, members_, behind_, inStep_, answered_;
    std::map<std::string, std::uint32_t> toProve_;  ///< frames that a host has still to show before it is waited for
    std::map<std::string, TimePoint> drawingSince_;
    std::map<std::string, FrameNumber> toldToDraw_;  ///< the frame of the last Begin
    std::map<std::string, std::pair<FrameNumber, TimePoint>>
        toldToShow_;  ///< and has not said that it does: that frame, since
    Duration longestFrame_{};
    std::vector<BlobInfo> sceneBlobs_;
    std::map<FaultKind, std::uint64_t> faults_;
    TimePoint sayingAt_{};  ///< the instant of the event that the session is told of
    std::uint64_t entries_ = 0, images_ = 0, requests_ = 0;
    bool finished_ = false;
};

}  // namespace tessera::simulation

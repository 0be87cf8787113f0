/// A simulated process with a ClientSession: a render host or an application, with a thread that applies and draws.
#pragma once

#include <deque>
#include <optional>
#include <set>

#include "common/session/ClientSession.h"
#include "tests/sim/Model.h"
#include "tests/sim/Network.h"

namespace tessera::simulation {

/// What the cluster wants to know of its peers at once.
class Witness {
public:
    virtual ~Witness() = default;
    virtual void shows(const std::string& host, FrameNumber frame) = 0;
    /// The server heard when the host showed this frame, on the server's clock as the host estimates it.
    virtual void heard(const std::string& host, FrameNumber frame, TimePoint shownAt) = 0;
    virtual void trace(const std::string& line) = 0;
};

struct PeerConfig {
    std::string name;
    PeerRole role = PeerRole::kHost;
    std::uint64_t schema = 0;
    bool wantBlobs = true;
    Link link;
    Duration drawTime = 5ms;  ///< at least; up to twice that
    Duration applyTime = 1ms;
    Duration clockAhead{};  ///< of its own clock, against the server's
};

class Peer final : public End {
public:
    Peer(PeerConfig config, Timeline& timeline, Network& network, Witness& witness, Random random);

    void start();
    /// kill -9: its sockets close, everything in memory is gone. The cache on its disk may survive.
    void crash(bool loseCache);
    /// kill -STOP: nothing is read, sent or drawn until `thaw`.
    void freeze();
    void thaw();
    /// The draw thread stands still for so long; the session's thread goes on.
    void hangDrawing(Duration duration) { drawFree_ = std::max(drawFree_, now() + duration); }
    /// The session's thread says that it lives and shows nothing any more, until it is told to again: then the last
    /// image.
    void stopShowing() { showsNothing_ = true; }
    void showAgain();
    /// All it says gets through but that it has drawn a frame.
    void loseReadies(bool lost) { losesReadies_ = lost; }
    /// It shows what it is told to so much later.
    void showLater(Duration delay) { showDelay_ = delay; }
    void drawSlower(double factor) { slowness_ = factor; }
    /// One bit of the replica flips.
    void corrupt() {
        if (!std::exchange(corrupted_, true)) scene_.hash.value ^= 1;
    }
    void cutCable();
    void breakBulk();
    /// Half-open: what is sent on it vanishes, the control connection lives.
    void muteBulk();
    /// Says something that no host may say.
    void misbehave(const Message& message);
    /// An application's request.
    void ask();

    [[nodiscard]] bool running() const { return running_; }
    [[nodiscard]] bool frozen() const { return frozen_; }
    [[nodiscard]] bool finished() const { return finished_; }
    [[nodiscard]] const std::string& name() const { return config_.name; }
    [[nodiscard]] const ModelScene& scene() const { return scene_; }
    [[nodiscard]] bool everShown() const { return everShown_; }
    [[nodiscard]] FrameNumber shown() const { return shown_; }
    [[nodiscard]] const std::string& exitReason() const { return exitReason_; }
    [[nodiscard]] std::uint64_t replies() const { return replies_; }
    /// True instants, on the simulation's clock, at which frames were shown.
    [[nodiscard]] TimePoint shownAt() const { return shownAt_; }

    // End
    void opened(ConnectionId connection) override;
    void received(ConnectionId connection, Epoch epoch, std::shared_ptr<const Message> message) override;
    void closed(ConnectionId connection) override;

private:
    [[nodiscard]] TimePoint now() const { return timeline_.now(); }
    [[nodiscard]] TimePoint localNow() const { return timeline_.now() + config_.clockAhead; }
    [[nodiscard]] std::optional<ChannelKind> channelOf(ConnectionId connection) const;
    void dial();
    void open(ChannelKind channel);
    void giveUpUnopened(ChannelKind channel, ConnectionId connection);
    void hangUp();
    /// Now, or when thawed; not at all when the process or the connection attempt it belongs to is gone.
    void inSession(std::function<void()> what);
    void carryOut(ClientActions actions);
    void on(client_action::Send action);
    void on(const client_action::OpenBulk&) { open(ChannelKind::kBulk); }
    void on(const client_action::Configured&) {}
    void on(const client_action::ApplySnapshot& action);
    void on(const client_action::ApplyChanges& action);
    void on(const client_action::Draw& action);
    void on(const client_action::Show& action);
    void on(const client_action::StoreBlob& action);
    void on(const client_action::DescribeState& action);
    void on(const client_action::SendImages& action);
    void on(const client_action::ReplyReceived&) { ++replies_; }
    void on(const client_action::NoticeReceived&) {}
    void on(const client_action::MeetNeighbours&) {}
    void on(const client_action::Disconnect& action);
    void on(const client_action::Finish& action);
    /// After so long, on the session's thread, if it is still the same attempt.
    void soon(Duration after, std::function<void()> what);
    /// A job of the draw thread; `done` runs on the session's thread afterwards.
    void onDrawThread(Duration work, std::function<void()> done);
    void apply(const ModelList& list);
    void requireBlobs(const std::vector<BlobInfo>& blobs, const std::string& when) const;
    void lookAtClock();
    void planLook();
    [[noreturn]] void violated(const std::string& what) const;

    PeerConfig config_;
    Timeline& timeline_;
    Network& network_;
    Witness& witness_;
    Random random_;

    std::unique_ptr<ClientSession> session_;
    std::uint64_t attempt_ = 0;  ///< connection attempts and process starts, so that late answers find nobody
    std::optional<ConnectionId> connections_[2];
    bool open_[2] = {false, false};
    std::size_t chunksAsked_ = 0;
    TimePoint lookPlanned_ = TimePoint::max();

    bool running_ = false, frozen_ = false, finished_ = false;
    std::string exitReason_;
    std::deque<std::function<void()>> inbox_;  ///< what waits while frozen
    TimePoint drawFree_{};
    double slowness_ = 1;
    bool showsNothing_ = false, losesReadies_ = false;
    Duration showDelay_{};
    std::function<void()> unshown_;  ///< what it was told to show meanwhile

    std::set<BlobId> store_;
    ModelScene scene_;
    bool haveScene_ = false, corrupted_ = false;
    bool everShown_ = false;
    FrameNumber shown_;
    TimePoint shownAt_{};
    std::uint64_t asked_ = 0, replies_ = 0;
};

}  // namespace tessera::simulation

/// The session thread's side of a render host: dials, speaks the protocol, hands out work, answers with outcomes.
#pragma once

#include <atomic>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <variant>

#include "client/replica/BlobShelf.h"
#include "client/replica/DiskCache.h"
#include "client/replica/WorkQueue.h"
#include "client/share/SharedArrays.h"
#include "common/base/Channel.h"
#include "common/base/Log.h"
#include "common/base/ServiceNotifier.h"
#include "common/net/Platform.h"
#include "common/session/ClientSession.h"
#include "common/tls/KeyRing.h"

namespace tessera {

struct ServerLinkOptions {
    Address server;
    std::string name;  ///< of the host in the wall
    std::function<std::string(const std::string& peer)> access =
        {};                 ///< the word that lets it in: see ClientSessionConfig
    CurrentKeys keys = {};  ///< empty: links are plain
    std::uint64_t pixelProbe = 0;
    std::string machine, board;  ///< for neighbours (message::Hello)
    std::chrono::milliseconds connectTimeout{2'000};
    /// At windows more may be done than a server wants to hear: states in between are left out.
    std::chrono::milliseconds inputEvery{4};
    std::chrono::milliseconds firstPause{50}, longestPause{1'000};
    /// How long the draw thread may take to finish once all is over.
    std::chrono::milliseconds finishDeadline{15'000};
    /// From 0 to 1: the part of a large blob's sources that it begins with; less than 0: another one in each process.
    double firstShare = -1;
    Platform platform = {};
    /// Does a piece of work at once if it takes no time, else nothing. Called on the session thread, while the draw
    /// thread has no work at all. May be empty.
    std::function<std::optional<Outcome>(const Work&)> atOnce;
    /// Whether the threads that hear when to show, this one and the network's, ask to run before those that draw.
    bool ahead = false;
    /// From this frame on it says that it lives and shows nothing: a fault to be injected.
    std::optional<FrameNumber> showsNothingFrom;
    /// That watches this program: null: nobody does. It hears that the host works where this thread turns, and the draw
    /// thread has nothing in hand or has gone a step further.
    ServiceNotifier* service = nullptr;
    const std::atomic<std::uint64_t>* drawSteps = nullptr;  ///< null: nobody counts them
};

/// Why a host is done.
struct HostEnd {
    bool over = false;  ///< the server said so; else `error` says why
    Error error;
};

/// Runs on one thread of its own, and never waits for the draw thread: heartbeats go on whatever that does, and what
/// that has drawn is shown here, in the instant in which the server says so. Dials until the server says that it is
/// over or refuses for good; a lost connection is dialled again.
class ServerLink {
public:
    using Event = std::variant<LinkEvent, Outcome>;

    /// `events` carries what the network and the draw thread say (by `tell`); `work` goes to the draw thread, but for
    /// what `atOnce` does. `cache` and `arrays` may be null.
    ServerLink(ServerLinkOptions options, BlobShelf& blobs, DiskCache* cache, SharedArrays* arrays,
               Channel<Event>& events, WorkQueue& work, Log& log);

    /// From any thread: what the draw thread says, while `run` runs or after it.
    void tell(Outcome outcome);

    /// Returns when all is over and the draw thread has said its last word. kFailed without that word: the draw thread
    /// does not come back.
    [[nodiscard]] HostEnd run();
    /// `run` step by step, for whoever drives more than one host in a thread: `begin`, then `turn` until it is `over`,
    /// then `finish`. A turn waits for what happens next, at the longest until `nextWake`.
    void begin();
    void turn();
    [[nodiscard]] bool over() const { return end_ && (drawThreadEnded_ || givenUp_); }
    [[nodiscard]] TimePoint nextWake() const { return events_.empty() ? nextDeadline() : options_.platform.now(); }
    [[nodiscard]] HostEnd finish();
    [[nodiscard]] bool drawThreadEnded() const { return drawThreadEnded_; }

private:
    void dial();
    void on(const LinkEvent& event);
    void on(Outcome outcome);
    void answer(Outcome outcome);
    void take(const InputState& state);
    void sendInput(TimePoint now);
    void carryOut(ClientActions actions);
    void carryOut(client_action::Send&& send);
    void carryOut(client_action::OpenBulk&&);
    void carryOut(client_action::Configured&& configured);
    void carryOut(client_action::StoreBlob&& blob);
    void carryOut(client_action::Disconnect&& broken);
    void carryOut(client_action::Finish&& finished);
    void carryOut(client_action::Show&& show);
    // Replies and notices are for applications.
    void carryOut(client_action::ReplyReceived&&) {}
    void carryOut(client_action::NoticeReceived&&) {}
    /// The rest is the draw thread's.
    template <typename DrawThreads>
    void carryOut(DrawThreads&& work) {
        give(std::forward<DrawThreads>(work));
    }
    void askToRunAhead();
    /// Where blobs are looked for before they are fetched; empty: nowhere.
    [[nodiscard]] std::function<Blob(const BlobInfo&)> elsewhere();
    /// Where those that are fetched come to lie; empty: anywhere.
    [[nodiscard]] std::function<std::unique_ptr<BlobPlace>(const BlobInfo&)> place();
    void hangUp(const std::string& reason);
    void retryLater(const std::string& reason);
    void noWayIn(const Error& why);
    void end(HostEnd end);
    void give(decltype(Work::what) what);
    void tellService(TimePoint now);
    [[nodiscard]] std::string describe(TimePoint now);
    [[nodiscard]] TimePoint nextDeadline() const;
    [[nodiscard]] std::optional<Event> nextEvent(Duration wait);
    [[nodiscard]] std::optional<ChannelKind> channelOf(LinkId link) const;

    ServerLinkOptions options_;
    BlobShelf& blobs_;
    DiskCache* cache_;
    SharedArrays* arrays_;
    Channel<Event>& events_;
    WorkQueue& work_;
    Log& log_;

    Attempt attempt_;
    std::unique_ptr<ClientSession> session_;  ///< null between attempts
    BlobFetcher::Parts fetchedParts_;         ///< of blobs, by the attempt before
    std::map<ChannelKind, LinkId> links_;
    Epoch seenEpoch_;                             ///< the highest so far
    std::map<std::uint32_t, InputState> inputs_;  ///< the newest of each window
    std::set<std::uint32_t> unsaid_;              ///< windows whose newest the server has not been told
    bool welcomed_ = false;
    TimePoint inputSaidAt_{};
    std::vector<ReadyFrame> drawn_;  ///< pictures of the frame drawn last, until they are shown
    std::deque<Outcome> doneHere_;   ///< of work that was done at once, until it is answered
    std::optional<TimePoint> dialAt_;
    std::chrono::milliseconds pause_;
    std::string lastReason_;  ///< a server that is not there is mentioned once, not once a second
    std::optional<HostEnd> end_;
    TimePoint giveUpAt_{};
    bool drawThreadEnded_ = false, givenUp_ = false;
    std::uint64_t stepsSeen_ = 0;           ///< of the draw thread
    PaceOfFrames pace_;                     ///< of those shown
    std::unique_ptr<Transport> transport_;  ///< last: its thread speaks into `events_`
};

}  // namespace tessera

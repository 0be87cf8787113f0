#include "common/session/ClientSession.h"

#include <algorithm>
#include <deque>
#include <optional>
#include <utility>
#include <variant>
#include <vector>

#include "common/session/HeartbeatClock.h"
#include "common/session/ReplicaSteps.h"

namespace tessera {

struct ClientSession::Impl {
    enum class Stage : std::uint8_t { kUnconnected, kGreeting, kWelcomed, kDead };
    enum class Bulk : std::uint8_t { kUnwanted, kClosed, kOpening, kOpen };
    enum class Work : std::uint8_t { kNone, kApplying, kDrawing, kShowing, kDescribing };

    /// `held` blobs from the front are known to be here.
    struct Notice {
        message::BlobNotice notice;
        std::size_t held = 0;
    };

    explicit Impl(ClientSessionConfig c)
        : config(std::move(c)),
          fetcher({config.maxBlobBytes, config.chunkBytes, config.chunksInFlight, config.elsewhere, config.place,
                   config.firstShare, config.maxUnwantedBytes}) {}

    void opened(ChannelKind channel, TimePoint now, const std::string& peer);
    void received(ChannelKind channel, Epoch said, const Message& message, TimePoint now);
    [[nodiscard]] bool mayHear(const MessageInfo& info, ChannelKind channel) const;
    void misplaced(const MessageInfo& said, ChannelKind channel);
    void closed(ChannelKind channel, TimePoint now);
    void advance(TimePoint now);
    [[nodiscard]] std::chrono::milliseconds mostSilence() const;
    [[nodiscard]] TimePoint nextDeadline() const;
    [[nodiscard]] TimePoint bulkStuckAt() const;
    // What the server says. A message that is for peers and has no `on` does not compile.
    void on(const message::Heartbeat& beat, TimePoint now);
    void on(const message::Welcome& welcome, TimePoint now);
    void on(const message::Refused& refused, TimePoint now);
    void on(const message::Over& over, TimePoint now);
    void on(const message::Snapshot& snapshot, TimePoint) { enqueue(snapshot); }
    void on(const message::Changes& changes, TimePoint) { enqueue(changes); }
    void on(const message::Begin& begin, TimePoint) { enqueue(begin); }
    void on(const message::Swap& swap, TimePoint) { enqueue(swap); }
    void on(const message::HashQuery& query, TimePoint) { enqueue(query); }
    void on(const message::BlobNotice& notice, TimePoint now);
    void on(const message::BlobChunk& chunk, TimePoint now);
    void on(const message::ImageRequest& images, TimePoint) { out.push_back(client_action::SendImages{images}); }
    void on(const message::Reply& reply, TimePoint) { out.push_back(client_action::ReplyReceived{reply}); }
    void on(const message::Notice& notice, TimePoint) { out.push_back(client_action::NoticeReceived{notice}); }
    void on(const message::Neighbours& hosts, TimePoint) { out.push_back(client_action::MeetNeighbours{hosts}); }
    /// An announced blob that no list names is gone again: what it was for has been cancelled.
    void withdrawn(const BlobId& blob);
    void enqueue(ReplicaSteps::Message message);
    [[nodiscard]] bool want(const std::vector<BlobInfo>& blobs);
    [[nodiscard]] bool allHeld(const std::vector<BlobInfo>& blobs, std::size_t& held) const;
    void fetch();
    /// A snapshot has come as a blob; its list names more of them.
    void opened(const Blob& content);
    void openBulk();
    void reportHeld();
    /// Hands out the next step if its turn has come.
    void pump();
    void start(const message::Snapshot& snapshot);
    void start(const message::Changes& changes);
    void start(const message::Begin& begin);
    void start(const message::Swap& swap);
    void start(const message::HashQuery& query);
    void startApplying(const CommittedList& list);
    void applied(Sequence at, StateHash hash);
    void image(message::TileImage image);
    void request(message::Request request);
    void upload(message::Upload upload) {
        if (stage == Stage::kWelcomed) return send(ChannelKind::kControl, std::move(upload));
        unsaid.emplace_back(std::move(upload));
    }
    void disconnect(std::string reason, bool retry = true, ErrorCode code = ErrorCode::kNetwork);

    [[nodiscard]] bool dead() const { return stage == Stage::kDead; }
    [[nodiscard]] Duration heartbeatInterval() const {
        return std::max<Duration>(heartbeatEvery, std::chrono::milliseconds(1));
    }
    void send(ChannelKind channel, Message message) { out.push_back(client_action::Send{channel, std::move(message)}); }
    ClientActions take() { return std::exchange(out, {}); }

    ClientSessionConfig config;
    BlobFetcher fetcher;
    Stage stage = Stage::kUnconnected;
    Bulk bulk = Bulk::kUnwanted;
    TimePoint bulkRetryAt{};
    TimePoint bulkProgress{};
    SessionToken token;
    Epoch epoch;
    bool isWelcome = false;

    ReplicaSteps steps;
    std::deque<Notice> notices;
    Work work = Work::kNone;
    Sequence applying;  ///< kApplying: the list that `work` is about, and its hash
    StateHash applyingHash;
    FrameNumber workFrame;  ///< kDrawing, kShowing
    bool everDrawn = false;
    FrameNumber lastDrawn;
    bool reportSynced = false;  ///< something was applied off the barrier since the last Synced
    Sequence sequence;
    StateHash stateHash;

    std::deque<message::TileImage> waitingImages;
    /// For the welcome, in their order: a request may need what was uploaded before it.
    std::vector<std::variant<message::Upload, message::Request>> unsaid;
    std::size_t waitingRequests = 0;  ///< of them

    HeartbeatClock clock;
    std::optional<HeartbeatClock::Sample> best;
    std::chrono::milliseconds heartbeatEvery{100};
    TimePoint nextHeartbeat{};
    TimePoint lastByte{};
    std::optional<TimePoint> lastAdvance;
    TimePoint graceUntil{};
    ClientActions out;
};

void ClientSession::Impl::opened(ChannelKind channel, TimePoint now, const std::string& peer) {
    message::Hello hello{.schema = config.schema,
                         .role = config.role,
                         .channel = channel,
                         .name = config.name,
                         .token = token,
                         .pixelProbe = config.pixelProbe,
                         .wantBlobs = config.wantBlobs,
                         .follows = config.follows,
                         .seenEpoch = config.seenEpoch,
                         .machine = config.machine,
                         .board = config.board,
                         .access = channel == ChannelKind::kControl && config.access ? config.access(peer) : ""};
    send(channel, hello);
    if (channel == ChannelKind::kControl) {
        stage = Stage::kGreeting;
        lastByte = now;
        nextHeartbeat = now;
        return;
    }
    bulk = Bulk::kOpen;
    bulkProgress = now;
    fetch();
    for (message::TileImage& waiting : waitingImages) send(ChannelKind::kBulk, std::move(waiting));
    waitingImages.clear();
}

void ClientSession::Impl::received(ChannelKind channel, Epoch said, const Message& message, TimePoint now) {
    lastByte = std::max(lastByte, now);
    // A server that raises its epoch says farewell to those that it has welcomed in the one before.
    if (stage == Stage::kWelcomed && said != epoch && !std::holds_alternative<message::Refused>(message))
        return disconnect("the server said " + std::string(nameOf(message)) + " in epoch " +
                              std::to_string(said.value) + ", and welcomed this peer in epoch " +
                              std::to_string(epoch.value),
                          true, ErrorCode::kBadInput);
    std::visit(
        [&]<Described M>(const M& m) {
            if constexpr (includes(M::kInfo.to, Party::kPeers)) {
                if (mayHear(M::kInfo, channel)) return on(m, now);
            }
            misplaced(M::kInfo, channel);
        },
        message);
}

bool ClientSession::Impl::mayHear(const MessageInfo& info, ChannelKind channel) const {
    if (!info.goes(Party::kServer, partyOf(config.role), channel)) return false;
    const bool ofTheScene =
        info.number == message::Snapshot::kInfo.number || info.number == message::Changes::kInfo.number;
    if (ofTheScene && !config.follows) return false;
    if (channel == ChannelKind::kBulk) return true;
    return info.when != (stage == Stage::kGreeting ? SaidWhen::kLater : SaidWhen::kFirst);
}

void ClientSession::Impl::misplaced(const MessageInfo& said, ChannelKind channel) {
    const std::string where = channel == ChannelKind::kBulk ? " on the bulk connection"
                              : stage == Stage::kGreeting   ? " before Welcome"
                                                            : ", which it must not say to this peer";
    disconnect("the server said " + std::string(said.name) + where, true, ErrorCode::kBadInput);
}

void ClientSession::Impl::on(const message::Refused& refused, TimePoint) {
    disconnect(refused.reason, refused.retry, refused.code);
}

void ClientSession::Impl::on(const message::Over& over, TimePoint) {
    stage = Stage::kDead;
    out.push_back(client_action::Finish{over.reason});
}

void ClientSession::Impl::on(const message::BlobChunk& chunk, TimePoint) {
    bulkProgress = lastByte;
    Expected<std::optional<Blob>> blob = fetcher.chunk(chunk);
    if (!blob && blob.error().code == ErrorCode::kNotFound && !steps.need(chunk.id)) return withdrawn(chunk.id);
    if (!blob) return disconnect(blob.error().message, true, blob.error().code);
    fetch();
    if (!*blob) return;
    if (steps.awaitContent((*blob)->id())) return opened(**blob);
    out.push_back(client_action::StoreBlob{std::move(**blob)});
    reportHeld();
    pump();
}

void ClientSession::Impl::withdrawn(const BlobId& blob) {
    std::erase_if(notices, [&](const Notice& waiting) {
        const std::vector<BlobInfo>& blobs = waiting.notice.blobs;
        return std::ranges::find(blobs, blob, &BlobInfo::id) != blobs.end();
    });
    fetch();
}

void ClientSession::Impl::closed(ChannelKind channel, TimePoint now) {
    if (channel == ChannelKind::kControl) return disconnect("the server closed the connection");
    if (bulk != Bulk::kOpen && bulk != Bulk::kOpening) return;
    bulk = Bulk::kClosed;
    bulkRetryAt = now + config.bulkRetry;
    fetcher.interrupted();
}

void ClientSession::Impl::advance(TimePoint now) {
    if (stage == Stage::kUnconnected) return;
    // Where this process itself stood still, what the server said meanwhile may lie unread in a queue.
    if (lastAdvance && now - *lastAdvance > mostSilence() / 2) graceUntil = now + heartbeatInterval();
    lastAdvance = now;
    if (now >= nextHeartbeat) {
        nextHeartbeat = now + heartbeatInterval();
        send(ChannelKind::kControl, clock.next(now));
    }
    if (now >= lastByte + mostSilence() && now >= graceUntil)
        return disconnect("the server was silent for " +
                          std::to_string((now - lastByte) / std::chrono::milliseconds(1)) + " ms");
    if (now >= bulkStuckAt() && now >= graceUntil)
        return disconnect("no data came on the bulk connection for " +
                          std::to_string((now - bulkProgress) / std::chrono::milliseconds(1)) + " ms");
    if (bulk == Bulk::kClosed && now >= bulkRetryAt) {
        bulk = Bulk::kOpening;
        out.push_back(client_action::OpenBulk{});
    }
}

std::chrono::milliseconds ClientSession::Impl::mostSilence() const {
    return isWelcome ? config.serverLostAfter : std::max(config.serverLostAfter, config.welcomeAfter);
}

TimePoint ClientSession::Impl::nextDeadline() const {
    if (stage == Stage::kUnconnected || dead()) return TimePoint::max();
    TimePoint next = std::min(nextHeartbeat, std::max(graceUntil, std::min(lastByte + mostSilence(), bulkStuckAt())));
    if (bulk == Bulk::kClosed) next = std::min(next, bulkRetryAt);
    return next;
}

TimePoint ClientSession::Impl::bulkStuckAt() const {
    return bulk == Bulk::kOpen && fetcher.waiting() ? bulkProgress + config.bulkStuckAfter : TimePoint::max();
}

void ClientSession::Impl::on(const message::Welcome& welcome, TimePoint) {
    if (welcome.epoch < config.seenEpoch)
        return disconnect("the server is at epoch " + std::to_string(welcome.epoch.value) + ", and one at epoch " +
                              std::to_string(config.seenEpoch.value) +
                              " has welcomed this host before: that one started later",
                          true, ErrorCode::kRefused);
    stage = Stage::kWelcomed;
    isWelcome = true;
    token = welcome.token;
    epoch = welcome.epoch;
    heartbeatEvery = welcome.heartbeat;
    out.push_back(client_action::Configured{welcome.epoch, welcome.configuration, welcome.heartbeat});
    if (config.role == PeerRole::kHost || config.wantBlobs) openBulk();
    for (auto& each : std::exchange(unsaid, {}))
        std::visit([&](auto& message) { send(ChannelKind::kControl, std::move(message)); }, each);
    waitingRequests = 0;
}

void ClientSession::Impl::on(const message::Heartbeat& beat, TimePoint now) {
    const auto sample = clock.received(beat, now);
    if (sample && (!best || sample->roundTrip <= best->roundTrip)) best = sample;
}

void ClientSession::Impl::enqueue(ReplicaSteps::Message message) {
    const bool whole = std::holds_alternative<message::Snapshot>(message);
    const ReplicaSteps::Step& step = steps.append(std::move(message));
    if (step.content.sizeBytes > 0) {
        openBulk();
        const Expected<std::vector<Blob>> wanted = fetcher.wantScene(step.content);
        if (!wanted)
            return disconnect(wanted.error().message, wanted.error().code != ErrorCode::kLimit, wanted.error().code);
        if (!wanted->empty()) return opened(wanted->front());
        return fetch();
    }
    if (steps.behind() > config.maxQueuedMessages || steps.bytesBehind() > config.maxQueuedBytes)
        return disconnect("fell too far behind the server; starting over from a snapshot");
    if (!want(step.list().blobs)) return;
    if (whole) fetcher.sceneIsKnown();
    pump();
}

void ClientSession::Impl::openBulk() {
    if (bulk != Bulk::kUnwanted) return;
    bulk = Bulk::kOpening;
    out.push_back(client_action::OpenBulk{});
}

void ClientSession::Impl::opened(const Blob& content) {
    fetcher.drop(content.id());  // it is no part of the scene
    if (!config.openContent) return disconnect("a snapshot came as a blob, which nobody here can read", false);
    Expected<CommittedListPtr> list = config.openContent(content);
    if (!list) return disconnect("the snapshot makes no sense: " + list.error().message, true, ErrorCode::kBadInput);
    if (!steps.opened(content.id(), *list))
        return disconnect("the snapshot that came is not the one that was announced", true, ErrorCode::kBadInput);
    if (!want((*list)->blobs)) return;
    fetcher.sceneIsKnown();
    pump();
}

void ClientSession::Impl::on(const message::BlobNotice& notice, TimePoint) {
    if (notices.size() >= config.maxQueuedMessages)
        return disconnect("the server announces data faster than it can be fetched");
    notices.push_back({notice});
    if (!want(notice.blobs)) return;
    reportHeld();
}

/// False when that ended the connection.
bool ClientSession::Impl::want(const std::vector<BlobInfo>& blobs) {
    if (!config.wantBlobs) return true;
    Expected<std::vector<Blob>> wanted = fetcher.want(blobs);
    if (!wanted) {
        // A blob that is too large now is too large after the next attempt as well.
        disconnect(wanted.error().message, wanted.error().code != ErrorCode::kLimit, wanted.error().code);
        return false;
    }
    for (Blob& complete : *wanted) out.push_back(client_action::StoreBlob{std::move(complete)});
    fetch();
    return true;
}

bool ClientSession::Impl::allHeld(const std::vector<BlobInfo>& blobs, std::size_t& held) const {
    if (!config.wantBlobs) return true;
    while (held < blobs.size() && fetcher.holds(blobs[held].id)) ++held;
    return held == blobs.size();
}

void ClientSession::Impl::fetch() {
    if (bulk != Bulk::kOpen) return;
    if (!fetcher.waiting()) bulkProgress = std::max(bulkProgress, lastByte);
    for (const message::BlobRequest& wanted : fetcher.requests()) send(ChannelKind::kBulk, wanted);
    std::vector<Blob> found = fetcher.takeFound();
    if (found.empty()) return;
    for (Blob& blob : found)
        if (!steps.awaitContent(blob.id())) out.push_back(client_action::StoreBlob{blob});
    reportHeld();
    for (const Blob& blob : found)
        if (steps.awaitContent(blob.id())) opened(blob);
    pump();
}

void ClientSession::Impl::reportHeld() {
    std::erase_if(notices, [&](Notice& waiting) {
        if (!allHeld(waiting.notice.blobs, waiting.held)) return false;
        send(ChannelKind::kControl, message::BlobsHeld{waiting.notice.token});
        return true;
    });
}

void ClientSession::Impl::pump() {
    if (work != Work::kNone) return;
    if (steps.empty()) {
        if (!reportSynced) return;
        reportSynced = false;
        fetcher.forgetParts();
        send(ChannelKind::kControl, message::Synced{sequence, stateHash});
        return;
    }
    ReplicaSteps::Step& next = steps.front();
    if (next.content.sizeBytes > 0 || !allHeld(next.list().blobs, next.held)) return;
    const ReplicaSteps::Message message = steps.pop();
    std::visit([this](const auto& step) { start(step); }, message);
}

void ClientSession::Impl::start(const message::Snapshot& snapshot) {
    startApplying(*snapshot.list);
    out.push_back(client_action::ApplySnapshot{snapshot});
}

void ClientSession::Impl::start(const message::Changes& changes) {
    startApplying(*changes.list);
    out.push_back(client_action::ApplyChanges{changes});
}

void ClientSession::Impl::startApplying(const CommittedList& list) {
    work = Work::kApplying;
    applying = list.sequence;
    applyingHash = list.stateHash;
}

void ClientSession::Impl::start(const message::Begin& begin) {
    work = Work::kDrawing;
    workFrame = begin.frame;
    reportSynced = false;  // it is in the barrier: nobody waits for that any more
    out.push_back(client_action::Draw{begin});
}

void ClientSession::Impl::start(const message::Swap& swap) {
    if (!everDrawn || swap.frame != lastDrawn)
        return disconnect(
            "the server released frame " + std::to_string(swap.frame.value) + ", which is not the one drawn last", true,
            ErrorCode::kBadInput);
    work = Work::kShowing;
    workFrame = swap.frame;
    out.push_back(client_action::Show{swap.frame});
}

void ClientSession::Impl::start(const message::HashQuery& query) {
    work = Work::kDescribing;
    out.push_back(client_action::DescribeState{query});
}

void ClientSession::Impl::applied(Sequence at, StateHash hash) {
    TESSERA_CHECK(work == Work::kApplying && applying == at, "`applied` answers the list handed out last");
    if (hash != applyingHash)
        return disconnect("the replica differs from the server's scene after list " + std::to_string(at.value), true,
                          ErrorCode::kFailed);
    work = Work::kNone;
    sequence = at;
    stateHash = hash;
    reportSynced = true;
    pump();
}

void ClientSession::Impl::image(message::TileImage image) {
    if (bulk == Bulk::kOpen) return send(ChannelKind::kBulk, std::move(image));
    waitingImages.push_back(std::move(image));
    if (waitingImages.size() > config.maxWaitingImages) waitingImages.pop_front();
}

void ClientSession::Impl::request(message::Request request) {
    if (stage == Stage::kWelcomed) return send(ChannelKind::kControl, std::move(request));
    if (waitingRequests >= config.maxWaitingRequests) {
        out.push_back(client_action::ReplyReceived{
            {request.id, ErrorCode::kLimit, "too many requests wait for the connection to the server", nullptr}});
        return;
    }
    ++waitingRequests;
    unsaid.emplace_back(std::move(request));
}

void ClientSession::Impl::disconnect(std::string reason, bool retry, ErrorCode code) {
    stage = Stage::kDead;
    steps.clear();
    notices.clear();
    out.push_back(client_action::Disconnect{std::move(reason), retry, code});
}

// ---- the public face -----------------------------------------------------------------------------------------------

ClientSession::ClientSession(ClientSessionConfig config) : impl_(std::make_unique<Impl>(std::move(config))) {}
ClientSession::~ClientSession() = default;

ClientActions ClientSession::channelOpened(ChannelKind channel, TimePoint now, const std::string& peer) {
    if (!impl_->dead()) impl_->opened(channel, now, peer);
    return impl_->take();
}

ClientActions ClientSession::received(ChannelKind channel, Epoch epoch, const Message& message, TimePoint now) {
    if (!impl_->dead()) impl_->received(channel, epoch, message, now);
    return impl_->take();
}

Epoch ClientSession::epoch() const {
    return impl_->epoch;
}

ClientActions ClientSession::malformed(ChannelKind, const std::string& reason) {
    if (!impl_->dead()) impl_->disconnect("what the server sent makes no sense: " + reason, true, ErrorCode::kBadInput);
    return impl_->take();
}

ClientActions ClientSession::channelClosed(ChannelKind channel, TimePoint now) {
    if (!impl_->dead()) impl_->closed(channel, now);
    return impl_->take();
}

void ClientSession::heard(ChannelKind channel, TimePoint now) {
    impl_->lastByte = std::max(impl_->lastByte, now);
    if (channel == ChannelKind::kBulk) impl_->bulkProgress = impl_->lastByte;
}

ClientActions ClientSession::advance(TimePoint now) {
    if (!impl_->dead()) impl_->advance(now);
    return impl_->take();
}

TimePoint ClientSession::nextDeadline() const {
    return impl_->nextDeadline();
}

void ClientSession::holdBlob(const BlobId& id) {
    impl_->fetcher.hold(id);
}
void ClientSession::dropBlob(const BlobId& id) {
    impl_->fetcher.drop(id);
}

BlobFetcher::Parts ClientSession::takeParts() {
    return impl_->fetcher.takeParts();
}
void ClientSession::resume(BlobFetcher::Parts parts) {
    impl_->fetcher.resume(std::move(parts));
}

ClientActions ClientSession::applied(Sequence sequence, StateHash stateHash) {
    if (!impl_->dead()) impl_->applied(sequence, stateHash);
    return impl_->take();
}

ClientActions ClientSession::applyFailed(const std::string& reason) {
    if (!impl_->dead()) impl_->disconnect("a list could not be applied: " + reason, true, ErrorCode::kFailed);
    return impl_->take();
}

ClientActions ClientSession::drawn(FrameNumber frame, StateHash stateHash, ByteSlice stats) {
    if (impl_->dead()) return {};
    TESSERA_CHECK(impl_->work == Impl::Work::kDrawing && impl_->workFrame == frame,
                  "`drawn` answers the frame handed out last");
    impl_->work = Impl::Work::kNone;
    impl_->everDrawn = true;
    impl_->lastDrawn = frame;
    impl_->send(ChannelKind::kControl, message::Ready{frame, stateHash, std::move(stats)});
    impl_->pump();
    return impl_->take();
}

ClientActions ClientSession::shown(FrameNumber frame, TimePoint at) {
    if (impl_->dead()) return {};
    TESSERA_CHECK(impl_->work == Impl::Work::kShowing && impl_->workFrame == frame,
                  "`shown` answers the Show handed out last");
    impl_->work = Impl::Work::kNone;
    impl_->send(ChannelKind::kControl, message::Shown{frame, toNs(at) + clockOffsetNs()});
    impl_->pump();
    return impl_->take();
}

ClientActions ClientSession::hashes(message::HashAnswer answer) {
    if (impl_->dead()) return {};
    TESSERA_CHECK(impl_->work == Impl::Work::kDescribing, "`hashes` answers DescribeState");
    impl_->work = Impl::Work::kNone;
    impl_->send(ChannelKind::kControl, std::move(answer));
    impl_->pump();
    return impl_->take();
}

ClientActions ClientSession::image(message::TileImage image) {
    if (!impl_->dead()) impl_->image(std::move(image));
    return impl_->take();
}

ClientActions ClientSession::upload(message::Upload upload) {
    if (!impl_->dead()) impl_->upload(std::move(upload));
    return impl_->take();
}

ClientActions ClientSession::request(message::Request request) {
    if (!impl_->dead()) impl_->request(std::move(request));
    return impl_->take();
}

std::int64_t ClientSession::clockOffsetNs() const {
    return impl_->best ? impl_->best->offsetNs : 0;
}

}  // namespace tessera

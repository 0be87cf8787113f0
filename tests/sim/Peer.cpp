#include "tests/sim/Peer.h"

#include <algorithm>

namespace tessera::simulation {

namespace {
constexpr std::uint32_t kChunkBytes = 8 * 1024;
constexpr std::uint32_t kChunksInFlight = 4;
constexpr std::size_t index(ChannelKind channel) {
    return static_cast<std::size_t>(channel);
}
}  // namespace

Peer::Peer(PeerConfig config, Timeline& timeline, Network& network, Witness& witness, Random random)
    : config_(std::move(config)), timeline_(timeline), network_(network), witness_(witness), random_(random) {}

void Peer::start() {
    running_ = true;
    haveScene_ = false;
    everShown_ = false;
    showsNothing_ = false;
    unshown_ = nullptr;
    drawFree_ = now();
    dial();
}

void Peer::crash(bool loseCache) {
    if (!running_) return;
    witness_.trace(config_.name + " crashes");
    running_ = frozen_ = false;
    inbox_.clear();
    hangUp();
    if (loseCache) store_.clear();
}

void Peer::freeze() {
    if (running_) frozen_ = true;
    witness_.trace(config_.name + " freezes");
}

void Peer::thaw() {
    if (!frozen_) return;
    witness_.trace(config_.name + " thaws");
    frozen_ = false;
    // Either may come first after SIGCONT: the timer, or what lies in the sockets.
    if (random_.chance(0.5)) lookAtClock();
    while (!inbox_.empty() && !frozen_) {
        const std::function<void()> what = std::move(inbox_.front());
        inbox_.pop_front();
        what();
    }
    lookAtClock();
}

void Peer::cutCable() {
    for (const auto& connection : connections_)
        if (connection) network_.cut(*connection);
}

void Peer::breakBulk() {
    if (const auto bulk = connections_[index(ChannelKind::kBulk)]) network_.sever(*bulk);
}

void Peer::muteBulk() {
    if (const auto bulk = connections_[index(ChannelKind::kBulk)]) network_.cut(*bulk);
}

void Peer::misbehave(const Message& message) {
    if (running_ && open_[0]) network_.toServer(*connections_[0], session_->epoch(), message);
}

void Peer::ask() {
    if (session_ && !frozen_) carryOut(session_->request({++asked_, nullptr}));
}

std::optional<ChannelKind> Peer::channelOf(ConnectionId connection) const {
    for (const ChannelKind channel : {ChannelKind::kControl, ChannelKind::kBulk})
        if (connections_[index(channel)] == connection) return channel;
    return std::nullopt;
}

void Peer::dial() {
    ++attempt_;
    lookPlanned_ = TimePoint::max();
    session_ = std::make_unique<ClientSession>(ClientSessionConfig{.name = config_.name,
                                                                   .role = config_.role,
                                                                   .schema = config_.schema,
                                                                   .pixelProbe = 1,
                                                                   .wantBlobs = config_.wantBlobs,
                                                                   .maxBlobBytes = 1 << 20,
                                                                   .chunkBytes = kChunkBytes,
                                                                   .chunksInFlight = kChunksInFlight,
                                                                   .serverLostAfter = 1'500ms,
                                                                   .bulkRetry = 50ms,
                                                                   .bulkStuckAfter = 1'000ms});
    for (const BlobId& id : store_) session_->holdBlob(id);
    open(ChannelKind::kControl);
}

void Peer::open(ChannelKind channel) {
    const ConnectionId connection = network_.connect(config_.link, *this);
    connections_[index(channel)] = connection;
    open_[index(channel)] = false;
    timeline_.after(500ms, [this, channel, connection] { giveUpUnopened(channel, connection); });
}

void Peer::giveUpUnopened(ChannelKind channel, ConnectionId connection) {
    if (connections_[index(channel)] != connection || open_[index(channel)]) return;
    network_.closeByClient(connection);
    closed(connection);
}

void Peer::hangUp() {
    ++attempt_;
    session_.reset();
    chunksAsked_ = 0;
    for (const ChannelKind channel : {ChannelKind::kControl, ChannelKind::kBulk}) {
        auto& connection = connections_[index(channel)];
        if (connection) network_.closeByClient(*connection);
        connection.reset();
        open_[index(channel)] = false;
    }
}

void Peer::inSession(std::function<void()> what) {
    std::function<void()> guarded = [this, attempt = attempt_, what = std::move(what)] {
        if (attempt == attempt_ && session_) what();
    };
    if (frozen_)
        inbox_.push_back(std::move(guarded));
    else
        guarded();
}

void Peer::opened(ConnectionId connection) {
    inSession([this, connection] {
        const auto channel = channelOf(connection);
        if (!channel) return;
        open_[index(*channel)] = true;
        carryOut(session_->channelOpened(*channel, localNow()));
    });
}

void Peer::received(ConnectionId connection, Epoch epoch, std::shared_ptr<const Message> message) {
    const TimePoint arrived = localNow();
    inSession([this, connection, epoch, message, arrived] {
        const auto channel = channelOf(connection);
        if (!channel) return;
        if (std::holds_alternative<message::BlobChunk>(*message)) --chunksAsked_;
        // A host in the barrier never waits for bulk data: what a frame's list names has been announced.
        if (const auto* begin = std::get_if<message::Begin>(&*message))
            requireBlobs(begin->list->blobs, "as a frame begins");
        carryOut(session_->received(*channel, epoch, *message, arrived));
    });
}

void Peer::closed(ConnectionId connection) {
    inSession([this, connection] {
        const auto channel = channelOf(connection);
        if (!channel) return;
        connections_[index(*channel)].reset();
        open_[index(*channel)] = false;
        if (*channel == ChannelKind::kBulk) chunksAsked_ = 0;
        carryOut(session_->channelClosed(*channel, localNow()));
    });
}

void Peer::carryOut(ClientActions actions) {
    const std::uint64_t attempt = attempt_;
    for (ClientAction& action : actions) {
        if (attempt != attempt_) violated("an action follows the end of its session");
        std::visit([this](auto& a) { on(std::move(a)); }, action);
    }
    planLook();
}

void Peer::on(client_action::Send action) {
    const auto connection = connections_[index(action.channel)];
    if (!connection || !open_[index(action.channel)])
        violated("sends " + std::string(nameOf(action.message)) + " on a closed channel");
    if (std::holds_alternative<message::BlobRequest>(action.message) && ++chunksAsked_ > kChunksInFlight)
        violated("has more chunks under way than its window");
    if (losesReadies_ && std::holds_alternative<message::Ready>(action.message)) return;
    network_.toServer(*connection, session_->epoch(), std::move(action.message));
}

void Peer::on(const client_action::ApplySnapshot& action) {
    onDrawThread(config_.applyTime * 4, [this, list = action.snapshot.list] {
        requireBlobs(list->blobs, "with a snapshot");
        Numbers in(list->encoded);
        scene_.sequence = Sequence(in.get());
        scene_.hash = StateHash(in.get());
        haveScene_ = true;
        corrupted_ = false;
        carryOut(session_->applied(list->sequence, scene_.hash));
    });
}

void Peer::on(const client_action::ApplyChanges& action) {
    onDrawThread(config_.applyTime, [this, list = action.changes.list] {
        requireBlobs(list->blobs, "with a list");
        Numbers in(list->encoded);
        apply(getList(in));
        carryOut(session_->applied(list->sequence, scene_.hash));
    });
}

void Peer::on(const client_action::Draw& action) {
    const auto most = static_cast<std::int64_t>(2 * slowness_ * static_cast<double>(config_.drawTime.count()));
    onDrawThread(random_.between(Duration(most / 2), Duration(most)), [this, begin = action.begin] {
        for (Numbers in(begin.list->encoded); !in.done();) apply(getList(in));
        if (scene_.sequence != begin.list->sequence) violated("stands at another list than the frame it draws");
        if ((scene_.hash != begin.list->stateHash) != corrupted_) violated("has drawn another scene than the server's");
        Numbers stats;
        stats.put(begin.frame.value);
        carryOut(session_->drawn(begin.frame, scene_.hash, stats.share()));
    });
}

void Peer::on(const client_action::Show& action) {
    // Whatever the draw thread is at.
    const auto show = [this, frame = action.frame] {
        if (everShown_ && frame <= shown_) violated("shows an older frame than it did");
        everShown_ = true;
        shown_ = frame;
        shownAt_ = now();
        witness_.shows(config_.name, frame);
        carryOut(session_->shown(frame, localNow()));
    };
    if (showsNothing_)
        unshown_ = [this, attempt = attempt_, show] {
            if (attempt == attempt_) inSession(show);
        };
    else
        soon(showDelay_ + random_.between(0ms, 1ms), show);
}

void Peer::showAgain() {
    showsNothing_ = false;
    if (const auto show = std::exchange(unshown_, nullptr)) show();
}

void Peer::soon(Duration after, std::function<void()> what) {
    timeline_.after(after, [this, attempt = attempt_, what = std::move(what)] {
        if (attempt == attempt_) inSession(what);
    });
}

void Peer::on(const client_action::StoreBlob& action) {
    if (blobIdOf(action.blob.bytes()) != action.blob.id()) violated("was handed a damaged blob");
    store_.insert(action.blob.id());
}

void Peer::on(const client_action::DescribeState& action) {
    onDrawThread(config_.applyTime, [this, query = action.query] {
        carryOut(session_->hashes(
            {.sequence = scene_.sequence, .objects = query.objects, .entries = {{query.leaf, scene_.hash.value}}}));
    });
}

void Peer::on(const client_action::SendImages& action) {
    carryOut(session_->image(
        {.request = action.request.request, .frame = shown_, .tile = config_.name, .picture = Numbers().share()}));
}

void Peer::on(const client_action::Disconnect& action) {
    witness_.trace(config_.name + " disconnects: " + action.reason);
    hangUp();
    if (action.retry) {
        timeline_.after(random_.between(20ms, 150ms), [this, attempt = attempt_] {
            if (frozen_)
                inbox_.push_back([this, attempt] {
                    if (attempt == attempt_) dial();
                });
            else if (attempt == attempt_)
                dial();
        });
    } else {
        running_ = false;
        exitReason_ = action.reason;
    }
}

void Peer::on(const client_action::Finish&) {
    hangUp();
    running_ = false;
    finished_ = true;
}

void Peer::onDrawThread(Duration work, std::function<void()> done) {
    drawFree_ = std::max(drawFree_, now()) + work;
    timeline_.at(drawFree_, [this, attempt = attempt_, done = std::move(done)] {
        if (attempt == attempt_) inSession(done);
    });
}

void Peer::apply(const ModelList& list) {
    if (!haveScene_) violated("gets a list before any snapshot");
    if (list.sequence != scene_.sequence.next())
        violated("is given list " + std::to_string(list.sequence.value) + " at list " +
                 std::to_string(scene_.sequence.value));
    if (config_.wantBlobs)
        for (const BlobId& id : list.blobs)
            if (!store_.contains(id)) violated("applies a list without a blob that it names");
    scene_.apply(list);
}

void Peer::requireBlobs(const std::vector<BlobInfo>& blobs, const std::string& when) const {
    if (!config_.wantBlobs) return;
    for (const BlobInfo& blob : blobs)
        if (!store_.contains(blob.id)) violated("lacks a blob " + when);
}

void Peer::lookAtClock() {
    if (!session_ || frozen_) return;
    carryOut(session_->advance(localNow()));
}

void Peer::planLook() {
    if (!session_) return;
    const TimePoint next = session_->nextDeadline();
    if (next == TimePoint::max()) return;
    const TimePoint when = std::max(next - config_.clockAhead, now());
    if (lookPlanned_ > now() && lookPlanned_ <= when) return;
    lookPlanned_ = when;
    timeline_.at(when, [this, attempt = attempt_, when] {
        if (lookPlanned_ == when) lookPlanned_ = TimePoint::max();
        if (attempt == attempt_) lookAtClock();
    });
}

void Peer::violated(const std::string& what) const {
    throw Violation("'" + config_.name + "' " + what);
}

}  // namespace tessera::simulation

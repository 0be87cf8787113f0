#include "common/application/Connection.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "common/codec/ChangeCodec.h"
#include "common/codec/MessageCodec.h"
#include "common/codec/SnapshotCodec.h"
#include "common/scene/FieldTable.h"

namespace tessera {

namespace {

using namespace std::chrono_literals;

constexpr std::size_t kMaxEvents = 16'384;
/// Replies, the end and whatever else must find room behind the lists that wait.
constexpr std::size_t kSpareRoom = 4096;

ClientSessionConfig sessionConfig(const ConnectionOptions& options) {
    ClientSessionConfig config;
    config.name = options.name;
    config.role = PeerRole::kApplication;
    config.schema = schemaHash();
    config.wantBlobs = options.blobs;
    config.openContent = decodeSnapshot;
    config.follows = options.lists;
    config.access = options.access;
    config.seenEpoch = options.seenEpoch;
    return config;
}

}  // namespace

Connection::Connection(ConnectionOptions options)
    : options_(std::move(options)),
      events_(kMaxEvents),
      out_(options_.maxWaiting + kSpareRoom),
      session_(sessionConfig(options_)) {
    TransportLimits limits;
    limits.maxPayload = maxPayloadBytes;
    limits.maxSendQueueBytes = 2 * limits::kMaxUploadBytes;  // they lie where they are
    transport_ =
        std::make_unique<Transport>(std::move(limits), [this](LinkEvent event) { events_.push(std::move(event)); });
    open(ChannelKind::kControl);
    thread_ = std::thread([this] { run(); });
}

Connection::~Connection() {
    events_.close();
    thread_.join();
    transport_.reset();
}

std::optional<Incoming> Connection::next(Duration timeout) {
    std::optional<Incoming> value = out_.popFor(timeout);
    if (value) {
        --waiting_;
        if (const auto* list = std::get_if<incoming::List>(&*value)) waitingBytes_ -= list->committed->encoded.size();
        if (const auto* notice = std::get_if<incoming::Notice>(&*value)) waitingBytes_ -= notice->encodedBytes;
    }
    return value;
}

void Connection::request(std::uint64_t id, ByteSlice body) {
    events_.push(message::Request{id, std::move(body)});
}

void Connection::upload(std::span<const Blob> blobs) {
    constexpr std::size_t kMostOfAPiece = 4096;  // blobs
    message::Upload piece;
    Bytes small;  // several arrays in one piece
    const auto send = [&] {
        if (!small.empty()) piece.bytes = std::exchange(small, {});
        if (!piece.blobs.empty() || !piece.bytes.empty()) events_.push(std::exchange(piece, {}));
    };
    for (const Blob& blob : blobs) {
        const ByteSpan all = blob.bytes();
        const bool alone = all.size() > limits::kUploadPieceBytes / 2;
        if (alone || small.size() + all.size() > limits::kUploadPieceBytes || piece.blobs.size() >= kMostOfAPiece) send();
        piece.blobs.push_back({blob.id(), blob.sizeBytes()});
        if (!alone) {
            small.insert(small.end(), all.begin(), all.end());
            continue;
        }
        for (std::size_t at = 0; at < all.size(); at += limits::kUploadPieceBytes) {
            piece.bytes = blob.slice().slice(all.subspan(at, std::min(limits::kUploadPieceBytes, all.size() - at)));
            send();
        }
    }
    send();
}

void Connection::run() {
    while (!ended_) {
        const Duration idle = std::clamp<Duration>(session_.nextDeadline() - clockNow(), 0ns, 1s);
        std::optional<Event> event = events_.popFor(idle);
        if (!event && events_.closed()) return;
        if (event) {
            if (const auto* link = std::get_if<LinkEvent>(&*event))
                on(*link);
            else if (auto* upload = std::get_if<message::Upload>(&*event))
                carryOut(session_.upload(std::move(*upload)));
            else
                carryOut(session_.request(std::get<message::Request>(std::move(*event))));
        }
        if (clockNow() >= session_.nextDeadline()) carryOut(session_.advance(clockNow()));
    }
}

void Connection::on(const LinkEvent& event) {
    const auto channelOf = [&](LinkId link) -> std::optional<ChannelKind> {
        for (const auto& [channel, id] : links_)
            if (id == link) return channel;
        return std::nullopt;
    };
    if (const auto* opened = std::get_if<link_event::Opened>(&event.what)) {
        if (const auto channel = channelOf(opened->link))
            carryOut(session_.channelOpened(*channel, event.at, opened->peer));
    } else if (const auto* received = std::get_if<link_event::Received>(&event.what)) {
        const auto channel = channelOf(received->link);
        if (!channel) return;
        const Expected<Message> message = decodeMessage(received->type, received->payload);
        carryOut(message ? session_.received(*channel, received->epoch, *message, event.at)
                         : session_.malformed(*channel, message.error().message));
    } else if (const auto* heard = std::get_if<link_event::Heard>(&event.what)) {
        if (const auto channel = channelOf(heard->link)) session_.heard(*channel, event.at);
    } else if (const auto* closed = std::get_if<link_event::Closed>(&event.what)) {
        const auto channel = channelOf(closed->link);
        if (!channel) return;
        links_.erase(*channel);
        // The transport knows better than the session why.
        if (*channel == ChannelKind::kControl) return end({.error = {ErrorCode::kNetwork, closed->reason}, .retry = true});
        carryOut(session_.channelClosed(*channel, event.at));
    }
}

void Connection::carryOut(ClientActions actions) {
    std::move(actions.begin(), actions.end(), std::back_inserter(pending_));
    while (!pending_.empty() && !ended_) {
        const ClientAction action = std::move(pending_.front());
        pending_.pop_front();
        std::visit([this](const auto& what) { carryOut(what); }, action);
    }
}

void Connection::carryOut(const client_action::Send& action) {
    const auto link = links_.find(action.channel);
    if (link != links_.end())
        transport_->send(link->second, wireType(action.message), session_.epoch(),
                         share(encodeMessage(action.message)));
}

void Connection::carryOut(const client_action::OpenBulk&) {
    open(ChannelKind::kBulk);
}

void Connection::carryOut(const client_action::Configured& action) {
    welcomed_ = true;
    // Decoding a large scene takes this thread longer than a server waits to hear of us.
    const Message life = message::Heartbeat{};
    transport_->keepAlive(links_.at(ChannelKind::kControl), action.heartbeat, wireType(life), action.epoch,
                          share(encodeMessage(life)));
    give(incoming::Configured{action.configuration, action.epoch});
}

void Connection::carryOut(const client_action::ApplySnapshot& action) {
    apply(true, action.snapshot.list, action.snapshot.current);
}

void Connection::carryOut(const client_action::ApplyChanges& action) {
    apply(false, action.changes.list, {});
}

void Connection::carryOut(const client_action::StoreBlob& action) {
    store(action.blob);
}

void Connection::carryOut(const client_action::ReplyReceived& action) {
    give(incoming::Reply{action.reply});
}

void Connection::carryOut(const client_action::NoticeReceived& action) {
    Expected<ApplicationNotice> decoded = decodeNotice(action.notice.body);
    // One who does not poll misses notices, the newest first; lists it must not miss.
    const std::size_t bytes = action.notice.body.size();
    if (!decoded || waiting_ >= options_.maxWaiting || waitingBytes_ + bytes > options_.maxWaitingBytes / 2) return;
    waitingBytes_ += bytes;
    give(incoming::Notice{std::move(*decoded), bytes});
}

void Connection::carryOut(const client_action::Disconnect& action) {
    end({.error = {action.code, action.reason}, .retry = action.retry});
}

void Connection::carryOut(const client_action::Finish& action) {
    end({.error = {ErrorCode::kNetwork, action.reason}, .over = true});
}

void Connection::apply(bool whole, const CommittedListPtr& committed, Sequence current) {
    Expected<ChangeListPtr> list = decode(committed->encoded);
    ClientActions next;
    if (list) {
        handOut({whole, committed, std::move(*list), current});
        next = session_.applied(committed->sequence, committed->stateHash);
    } else {
        next = session_.applyFailed(list.error().message);
    }
    std::ranges::move(next, std::back_inserter(pending_));
}

void Connection::open(ChannelKind channel) {
    links_[channel] = transport_->connect(options_.address, options_.connectTimeout);
}

void Connection::store(const Blob& blob) {
    arrived_.push_back(store_.add(blob));
    arrivedBytes_ += blob.sizeBytes();
    while (arrivedBytes_ > options_.maxBlobBytes && arrived_.size() > 1) {
        arrivedBytes_ -= arrived_.front().sizeBytes();
        session_.dropBlob(arrived_.front().id());
        arrived_.erase(arrived_.begin());
    }
}

Expected<ChangeListPtr> Connection::decode(ByteSpan bytes) {
    // A blob that went with its last object and came back by an undo may be gone here: its handle is absent then.
    Expected<ChangeList> list = decodeChangeList(bytes, store_, AbsentBlobs::kKeepAbsent);
    if (!list) return tl::unexpected(list.error());
    return std::make_shared<const ChangeList>(std::move(*list));
}

void Connection::give(Incoming incoming) {
    ++waiting_;
    out_.tryPush(std::move(incoming));
    if (options_.arrived) options_.arrived();
}

void Connection::handOut(incoming::List list) {
    if (waiting_ >= options_.maxWaiting || waitingBytes_ > options_.maxWaitingBytes)
        return end({.error = {ErrorCode::kLimit,
                              fmt::format("{} changes waited for the application to poll, which is the most that may",
                                          waiting_.load())}});
    waitingBytes_ += list.committed->encoded.size();
    give(std::move(list));
}

void Connection::end(incoming::Ended end) {
    if (ended_) return;
    ended_ = true;
    Error& error = end.error;
    const std::string address = toString(options_.address);
    if (end.over)
        error.message = fmt::format("the server at {} is over: {}", address, error.message);
    else if (welcomed_)
        error.message = fmt::format("the connection to the server at {} ended: {}", address, error.message);
    else if (error.code != ErrorCode::kNetwork)
        error.message = fmt::format("the server at {} refuses: {}", address, error.message);
    else if (error.message.find(address) == std::string::npos)
        error.message = fmt::format("no Tessera server at {}: {}", address, error.message);
    give(std::move(end));
    for (const auto& [channel, link] : links_) transport_->close(link, "");
    events_.close();
}

}  // namespace tessera

#include "common/application/ApplicationSession.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "common/codec/ChangeCodec.h"
#include "common/codec/MessageCodec.h"
#include "common/codec/SnapshotCodec.h"
#include "common/scene/FieldTable.h"

namespace tessera {

namespace {

ClientSessionConfig sessionConfig(const ApplicationSessionOptions& options) {
    ClientSessionConfig config;
    config.name = options.name;
    config.role = PeerRole::kApplication;
    config.schema = schemaHash();
    config.wantBlobs = options.blobs;
    config.openContent = decodeSnapshot;
    config.follows = options.lists;
    config.access = options.access;
    config.seenEpoch = options.seenEpoch;
    // A frame may take long, and until its end nobody is welcomed: who is patient gets in. Later the network says that
    // the server lives (Peers).
    constexpr std::chrono::seconds kMostPatient{30};
    config.welcomeAfter = std::min<std::chrono::milliseconds>(2 * options.connectTimeout, kMostPatient);
    return config;
}

}  // namespace

ApplicationSession::ApplicationSession(ApplicationSessionOptions options, Transport& transport, Give give)
    : options_(std::move(options)), transport_(transport), give_(std::move(give)), session_(sessionConfig(options_)) {
    open(ChannelKind::kControl);
}

ApplicationSession::~ApplicationSession() {
    for (const auto& [channel, link] : links_) transport_.close(link, "");
}

TransportLimits ApplicationSession::limits(CurrentKeys keys) {
    TransportLimits limits;
    limits.tls = std::move(keys);
    limits.maxPayload = maxPayloadBytes;
    limits.maxSendQueueBytes = 2 * limits::kMaxUploadBytes;  // they lie where they are
    return limits;
}

bool ApplicationSession::owns(LinkId link) const {
    return std::ranges::any_of(links_, [&](const auto& open) { return open.second == link; });
}

void ApplicationSession::advance(TimePoint now) {
    if (now >= session_.nextDeadline()) carryOut(session_.advance(now));
}

void ApplicationSession::request(std::uint64_t id, ByteSlice body, std::string from) {
    carryOut(session_.request({id, std::move(body), std::move(from)}));
}

void ApplicationSession::upload(message::Upload piece) {
    carryOut(session_.upload(std::move(piece)));
}

void ApplicationSession::on(const LinkEvent& event) {
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
        if (*channel == ChannelKind::kControl)
            return end({.error = {ErrorCode::kNetwork, closed->reason}, .retry = closed->code != ErrorCode::kRefused});
        carryOut(session_.channelClosed(*channel, event.at));
    }
}

void ApplicationSession::carryOut(ClientActions actions) {
    std::move(actions.begin(), actions.end(), std::back_inserter(pending_));
    while (!pending_.empty() && !ended_) {
        const ClientAction action = std::move(pending_.front());
        pending_.pop_front();
        std::visit([this](const auto& what) { carryOut(what); }, action);
    }
}

void ApplicationSession::carryOut(const client_action::Send& action) {
    const auto link = links_.find(action.channel);
    if (link != links_.end())
        transport_.send(link->second, wireType(action.message), session_.epoch(), share(encodeMessage(action.message)));
}

void ApplicationSession::carryOut(const client_action::OpenBulk&) {
    open(ChannelKind::kBulk);
}

void ApplicationSession::carryOut(const client_action::Configured& action) {
    welcomed_ = true;
    // Decoding a large scene takes this thread longer than a server waits to hear of us.
    const Message life = message::Heartbeat{};
    transport_.keepAlive(links_.at(ChannelKind::kControl), action.heartbeat, wireType(life), action.epoch,
                         share(encodeMessage(life)));
    give_(incoming::Configured{action.configuration, action.epoch});
}

void ApplicationSession::carryOut(const client_action::ApplySnapshot& action) {
    apply(true, action.snapshot.list, action.snapshot.current);
}

void ApplicationSession::carryOut(const client_action::ApplyChanges& action) {
    apply(false, action.changes.list, {});
}

void ApplicationSession::carryOut(const client_action::StoreBlob& action) {
    store(action.blob);
}

void ApplicationSession::carryOut(const client_action::ReplyReceived& action) {
    give_(incoming::Reply{action.reply});
}

void ApplicationSession::carryOut(const client_action::NoticeReceived& action) {
    Expected<ApplicationNotice> decoded = decodeNotice(action.notice.body);
    if (decoded) give_(incoming::Notice{std::move(*decoded), action.notice.body.size()});
}

void ApplicationSession::carryOut(const client_action::Disconnect& action) {
    end({.error = {action.code, action.reason}, .retry = action.retry});
}

void ApplicationSession::carryOut(const client_action::Finish& action) {
    end({.error = {ErrorCode::kNetwork, action.reason}, .over = true});
}

void ApplicationSession::apply(bool whole, const CommittedListPtr& committed, Sequence current) {
    Expected<ChangeListPtr> list = decode(committed->encoded);
    ClientActions next;
    if (list) {
        give_(incoming::List{whole, committed, std::move(*list), current});
        next = session_.applied(committed->sequence, committed->stateHash);
    } else {
        next = session_.applyFailed(list.error().message);
    }
    std::ranges::move(next, std::back_inserter(pending_));
}

void ApplicationSession::open(ChannelKind channel) {
    links_[channel] = transport_.connect(options_.address, options_.connectTimeout);
}

void ApplicationSession::store(const Blob& blob) {
    arrived_.push_back(store_.add(blob));
    arrivedBytes_ += blob.sizeBytes();
    while (arrivedBytes_ > options_.maxBlobBytes && arrived_.size() > 1) {
        arrivedBytes_ -= arrived_.front().sizeBytes();
        session_.dropBlob(arrived_.front().id());
        arrived_.erase(arrived_.begin());
    }
}

Expected<ChangeListPtr> ApplicationSession::decode(ByteSpan bytes) {
    // A blob that went with its last object and came back by an undo may be gone here: its handle is absent then.
    Expected<ChangeList> list = decodeChangeList(bytes, store_, AbsentBlobs::kKeepAbsent);
    if (!list) return tl::unexpected(list.error());
    return std::make_shared<const ChangeList>(std::move(*list));
}

std::string addressText(const ApplicationSessionOptions& options) {
    const std::string address = toString(options.address);
    return options.addressNamedBy.empty() ? address : fmt::format("{} (named by {})", address, options.addressNamedBy);
}

void ApplicationSession::end(incoming::Ended end) {
    if (ended_) return;
    ended_ = true;
    Error& error = end.error;
    const std::string address = addressText(options_);
    if (end.over)
        error.message = fmt::format("the server at {} is over: {}", address, error.message);
    else if (welcomed_)
        error.message = fmt::format("the connection to the server at {} ended: {}", address, error.message);
    else if (error.code != ErrorCode::kNetwork || !end.retry)
        error.message = fmt::format("no way in at the server at {}: {}", address, error.message);
    else if (const std::string bare = toString(options_.address); error.message.find(bare) != std::string::npos)
        error.message.replace(error.message.find(bare), bare.size(), address);
    else
        error.message = fmt::format("no Tessera server at {}: {}", address, error.message);
    give_(std::move(end));
    for (const auto& [channel, link] : links_) transport_.close(link, "");
}

void forEachUpload(std::span<const Blob> blobs, const std::function<void(message::Upload)>& send) {
    constexpr std::size_t kMostOfAPiece = 4096;  // blobs
    message::Upload piece;
    Bytes small;  // several arrays in one piece
    const auto flush = [&] {
        if (!small.empty()) piece.bytes = std::exchange(small, {});
        if (!piece.blobs.empty() || !piece.bytes.empty()) send(std::exchange(piece, {}));
    };
    for (const Blob& blob : blobs) {
        const ByteSpan all = blob.bytes();
        const bool alone = all.size() > limits::kUploadPieceBytes / 2;
        if (alone || small.size() + all.size() > limits::kUploadPieceBytes || piece.blobs.size() >= kMostOfAPiece)
            flush();
        piece.blobs.push_back({blob.id(), blob.sizeBytes()});
        if (!alone) {
            small.insert(small.end(), all.begin(), all.end());
            continue;
        }
        for (std::size_t at = 0; at < all.size(); at += limits::kUploadPieceBytes) {
            piece.bytes = blob.slice().slice(all.subspan(at, std::min(limits::kUploadPieceBytes, all.size() - at)));
            flush();
        }
    }
    flush();
}

}  // namespace tessera

#include "server/sim/peers/Peers.h"

#include <algorithm>
#include <optional>

#include "common/base/Descriptors.h"
#include "common/base/ThreadPriority.h"
#include "common/codec/MessageCodec.h"
#include "common/codec/WallCodec.h"
#include "common/scene/FieldTable.h"

namespace tessera {
namespace {

constexpr std::uint32_t kMaxChunkBytes = 1024 * 1024;

TransportLimits::LastWord noRoom() {
    const Message word = message::Refused{ErrorCode::kLimit, "as many connections are open as may be: try again", true};
    return {wireType(word), share(encodeMessage(word))};
}

}  // namespace

ServerSessionConfig sessionConfigOf(const Wall& wall, Epoch epoch) {
    ServerSessionConfig config;
    for (const WallHost& host : wall.hosts) config.hosts.push_back(host.name);
    config.sync = wall.sync;
    config.epoch = epoch;
    config.schema = schemaHash();
    config.configuration = share(encodeWall(wall));
    return config;
}

Peers::Peers(ServerSessionConfig config, const BlobStore& blobs, std::function<void(LinkEvent)> deliver,
             const Platform& platform, std::shared_ptr<KeyRing> keys, std::function<void(const std::string&)> onKeys)
    : blobs_(blobs),
      time_(*platform.time),
      keys_(std::move(keys)),
      insecure_(config.insecure),
      heartbeat_(config.sync.heartbeat),
      session_([&] {
          if (keys_)
              config.passOf = [keys = keys_, time = platform.time](std::string_view word) {
                  return keys->current()->passOf(word, time->date());
              };
          if (keys_)
              config.panelOf = [keys = keys_, own = config.panelOf](const std::string& panel) {
                  std::shared_ptr<const std::string> text = own ? own(panel) : nullptr;
                  return text ? text : keys->current()->panelOf(panel);
              };
          config.unsentBytes = [this](ConnectionId connection) {
              return transport_->queuedBytes(LinkId{connection.value});
          };
          return std::move(config);
      }()),
      transport_(platform.transport({.maxStrangers = withinDescriptors(TransportLimits().maxStrangers, 8),
                                     .lastWord = noRoom(),
                                     .maxUntakenBytes = kMaxUnhandledBytes,
                                     .tls = keys_ ? CurrentKeys([this] { return keys_->current(); }) : nullptr,
                                     .maxPayload = maxPayloadBytesFromPeer},
                                    std::move(deliver))) {
    if (keys_) keys_->watch([this] { transport_->judgeAgain(); }, std::move(onKeys));
}

void Peers::describe(answer::Status& status) const {
    const Transport::Traffic traffic = transport_->traffic();
    status.sentBytes = traffic.sent;
    status.receivedBytes = traffic.received;
    if (insecure_) status.keys.emplace_back("--insecure: whoever comes from another machine may do all");
    if (!keys_) return;
    const DateTime now = time_.date();
    const std::shared_ptr<const TlsContext> keys = keys_->current();
    for (const KeyEnd& end : keys->endsSoon(now)) status.keys.push_back(toText(end, now));
    using Days = std::chrono::duration<double, std::ratio<86'400>>;
    status.keyDays = std::max(0.0, Days(keys->ends().front().until - now).count());
}

Peers::~Peers() {
    if (keys_) keys_->rest();
}

ServerActions Peers::handle(const LinkEvent& event) {
    if (const auto* opened = std::get_if<link_event::Opened>(&event.what)) {
        const ConnectionId connection{opened->link.value};
        open_.emplace(connection, opened->peer);
        return perform(session_.connectionOpened(connection, event.at, opened->near, opened->source));
    }
    if (const auto* secured = std::get_if<link_event::Secured>(&event.what)) {
        session_.connectionSecured(ConnectionId{secured->link.value}, secured->peer);
        return {};
    }
    if (const auto* closed = std::get_if<link_event::Closed>(&event.what)) {
        const ConnectionId connection{closed->link.value};
        if (open_.erase(connection) == 0) return {};
        return perform(session_.connectionClosed(connection, event.at));
    }
    if (const auto* heard = std::get_if<link_event::Heard>(&event.what)) {
        session_.heard(ConnectionId{heard->link.value}, event.at);
        return {};
    }
    const auto& message = std::get<link_event::Received>(event.what);
    ServerActions wanted = received(message, event.at);
    transport_->taken(message.link, message.payload.size());
    return wanted;
}

std::size_t Peers::hostCount() const {
    return static_cast<std::size_t>(
        std::ranges::count_if(open_, [&](const auto& peer) { return session_.isHost(peer.first); }));
}

std::string Peers::addressOf(ConnectionId connection) const {
    const auto found = open_.find(connection);
    return found == open_.end() ? std::string() : found->second;
}

ServerActions Peers::received(const link_event::Received& received, TimePoint at) {
    const ConnectionId connection{received.link.value};
    if (!open_.contains(connection)) return {};
    const Expected<Message> message = decodeMessage(received.type, received.payload);
    if (!message) return perform(session_.malformed(connection, message.error().message, at));
    return perform(session_.received(connection, received.epoch, *message, at));
}

ServerActions Peers::perform(ServerActions actions) {
    ServerActions left;
    std::optional<AheadForNow> ahead;
    for (ServerAction& action : actions) {
        if (const auto* wanted = std::get_if<server_action::Send>(&action)) {
            // Whoever is woken by the first Swap must not take the processor from under the others'.
            if (!ahead && std::holds_alternative<message::Swap>(*wanted->message)) ahead.emplace();
            send(wanted->connection, wanted->message);
        } else if (const auto* close = std::get_if<server_action::Close>(&action)) {
            transport_->close(LinkId{close->connection.value}, close->reason);
            open_.erase(close->connection);
        } else if (const auto* blob = std::get_if<server_action::BlobRequested>(&action)) {
            send(blob->connection, std::make_shared<const Message>(chunkFor(blob->request)));
        } else {
            left.push_back(std::move(action));
        }
    }
    return left;
}

void Peers::send(ConnectionId connection, const MessagePtr& message) {
    if (last_.message != message) last_ = {.message = message, .encoded = share(encodeMessage(*message))};
    const LinkId link{connection.value};
    transport_->send(link, wireType(*message), session_.epoch(), last_.encoded);
    if (!std::holds_alternative<message::Welcome>(*message)) return;
    // The session's heartbeats come from the frame thread, which may be away for long. Then the network speaks for us.
    const Message life = message::Heartbeat{};
    transport_->keepAlive(link, heartbeat_, wireType(life), session_.epoch(), share(encodeMessage(life)));
}

message::BlobChunk Peers::chunkFor(const message::BlobRequest& request) const {
    message::BlobChunk chunk{.id = request.id, .offset = request.offset, .totalBytes = 0, .bytes = {}};
    const Blob blob = blobs_.find(request.id);
    if (!blob.resident() || request.offset > blob.sizeBytes()) return chunk;
    chunk.totalBytes = blob.sizeBytes();
    const std::uint64_t length =
        std::min<std::uint64_t>({request.length, kMaxChunkBytes, blob.sizeBytes() - request.offset});
    chunk.bytes = blob.slice().slice(blob.bytes().subspan(request.offset, length));
    return chunk;
}

}  // namespace tessera

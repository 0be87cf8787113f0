#include "server/sim/Peers.h"

#include <algorithm>

#include "common/codec/MessageCodec.h"

namespace tessera {
namespace {

constexpr std::uint32_t kMaxChunkBytes = 1024 * 1024;

/// Number and content by which two messages for everybody are known to be the same; no content: not for everybody.
std::pair<std::uint64_t, SharedBytes> broadcastKey(const Message& message) {
    if (const auto* begin = std::get_if<message::Begin>(&message)) return {begin->frame.value, begin->payload};
    if (const auto* changes = std::get_if<message::Changes>(&message)) return {changes->sequence.value, changes->list};
    return {0, nullptr};
}

}  // namespace

Peers::Peers(const ServerSessionConfig& config, const BlobStore& blobs, std::function<void(LinkEvent)> deliver)
    : blobs_(blobs),
      epoch_(config.epoch),
      session_(config),
      transport_({.maxPayload = maxPayloadBytesFromPeer}, std::move(deliver)) {}

ServerActions Peers::handle(const LinkEvent& event) {
    if (const auto* opened = std::get_if<link_event::Opened>(&event.what)) {
        const ConnectionId connection{opened->link.value};
        open_.emplace(connection, opened->peer);
        return perform(session_.connectionOpened(connection, event.at));
    }
    if (const auto* closed = std::get_if<link_event::Closed>(&event.what)) {
        const ConnectionId connection{closed->link.value};
        if (open_.erase(connection) == 0) return {};
        return perform(session_.connectionClosed(connection, event.at));
    }
    const auto& received = std::get<link_event::Received>(event.what);
    const ConnectionId connection{received.link.value};
    if (!open_.contains(connection)) return {};
    const Expected<Message> message = decodeMessage(received.type, received.payload);
    if (!message) return perform(session_.malformed(connection, message.error().message, event.at));
    return perform(session_.received(connection, *message, event.at));
}

ServerActions Peers::perform(ServerActions actions) {
    ServerActions left;
    for (ServerAction& action : actions) {
        if (const auto* wanted = std::get_if<server_action::Send>(&action)) {
            send(wanted->connection, wanted->message);
        } else if (const auto* close = std::get_if<server_action::Close>(&action)) {
            transport_.close(LinkId{close->connection.value}, close->reason);
            open_.erase(close->connection);
        } else if (const auto* blob = std::get_if<server_action::BlobRequested>(&action)) {
            send(blob->connection, chunkFor(blob->request));
        } else {
            if (std::holds_alternative<server_action::ApplicationJoined>(action)) ++applications_;
            if (std::holds_alternative<server_action::ApplicationLeft>(action)) --applications_;
            left.push_back(std::move(action));
        }
    }
    return left;
}

void Peers::send(ConnectionId connection, const Message& message) {
    const std::uint16_t type = wireType(message);
    const auto [key, content] = broadcastKey(message);
    if (!content) {
        transport_.send(LinkId{connection.value}, type, epoch_, share(encodeMessage(message)));
        return;
    }
    if (last_.type != type || last_.key != key || last_.content != content)
        last_ = {.type = type, .key = key, .content = content, .encoded = share(encodeMessage(message))};
    transport_.send(LinkId{connection.value}, type, epoch_, last_.encoded);
}

message::BlobChunk Peers::chunkFor(const message::BlobRequest& request) const {
    message::BlobChunk chunk{.id = request.id, .offset = request.offset, .totalBytes = 0, .bytes = nullptr};
    const Blob blob = blobs_.find(request.id);
    if (!blob.resident() || request.offset > blob.sizeBytes()) return chunk;
    chunk.totalBytes = blob.sizeBytes();
    const std::uint64_t length =
        std::min<std::uint64_t>({request.length, kMaxChunkBytes, blob.sizeBytes() - request.offset});
    const ByteSpan part = blob.bytes().subspan(request.offset, length);
    chunk.bytes = share(Bytes(part.begin(), part.end()));
    return chunk;
}

std::size_t Peers::queuedBytes() const {
    std::size_t sum = 0;
    for (const auto& [connection, peer] : open_) sum += transport_.queuedBytes(LinkId{connection.value});
    return sum;
}

}  // namespace tessera

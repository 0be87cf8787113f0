#include "server/sim/Peers.h"

#include <algorithm>

#include "common/codec/MessageCodec.h"

namespace tessera {
namespace {

constexpr std::uint32_t kMaxChunkBytes = 1024 * 1024;

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
            send(blob->connection, std::make_shared<const Message>(chunkFor(blob->request)));
        } else {
            if (std::holds_alternative<server_action::ApplicationJoined>(action)) ++applications_;
            if (std::holds_alternative<server_action::ApplicationLeft>(action)) --applications_;
            left.push_back(std::move(action));
        }
    }
    return left;
}

void Peers::send(ConnectionId connection, const MessagePtr& message) {
    if (last_.message != message) last_ = {.message = message, .encoded = share(encodeMessage(*message))};
    transport_.send(LinkId{connection.value}, wireType(*message), epoch_, last_.encoded);
}

message::BlobChunk Peers::chunkFor(const message::BlobRequest& request) const {
    message::BlobChunk chunk{.id = request.id, .offset = request.offset, .totalBytes = 0, .bytes = {}};
    const Blob blob = blobs_.find(request.id);
    if (!blob.resident() || request.offset > blob.sizeBytes()) return chunk;
    chunk.totalBytes = blob.sizeBytes();
    const std::uint64_t length =
        std::min<std::uint64_t>({request.length, kMaxChunkBytes, blob.sizeBytes() - request.offset});
    chunk.bytes = ByteSlice(blob.shared(), blob.bytes().subspan(request.offset, length));
    return chunk;
}

std::size_t Peers::queuedBytes() const {
    std::size_t sum = 0;
    for (const auto& [connection, peer] : open_) sum += transport_.queuedBytes(LinkId{connection.value});
    return sum;
}

}  // namespace tessera

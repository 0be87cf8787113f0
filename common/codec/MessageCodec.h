/// Session messages as the type and payload of a net frame (proto/session.proto).
#pragma once

#include "common/base/ByteSlice.h"
#include "common/base/Error.h"
#include "common/session/Messages.h"

namespace tessera {

struct MessageLimits {
    std::size_t maxTextBytes = 1024;
    std::size_t maxEntries = 1'000'000;  ///< blobs of a snapshot, hash entries
};

/// The number in a net frame's header; 0 is never used.
[[nodiscard]] std::uint16_t wireType(const Message& message);
/// Large byte fields (lists, chunks, images) stand raw behind a small protobuf head. They are not copied: the chain
/// holds the very bytes of the message, behind a head that is made here. Reasons and errors are cut to
/// `MessageLimits::maxTextBytes`.
[[nodiscard]] ByteChain encodeMessage(const Message& message);
/// Never crashes whatever the bytes are; takes no memory out of proportion to them. Byte fields are slices of `payload`
/// and keep it; lists are never null. A Hello of another protocol version is read too: whoever refuses it can name both
/// versions. kBadInput, kLimit.
[[nodiscard]] Expected<Message> decodeMessage(std::uint16_t type, const ByteSlice& payload,
                                              const MessageLimits& limits = {});

/// Largest payload that a message of this type may have, known before memory is taken; 0 for unknown types.
[[nodiscard]] std::size_t maxPayloadBytes(std::uint16_t type);
/// The same for a server's port: 0 for what only servers say.
[[nodiscard]] std::size_t maxPayloadBytesFromPeer(std::uint16_t type);

}  // namespace tessera

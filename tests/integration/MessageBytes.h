/// A session message as the bytes of a whole net frame, for tests that speak through a bare socket.
#pragma once

#include "common/codec/MessageCodec.h"
#include "common/net/FrameHeader.h"

namespace tessera::test {

[[nodiscard]] inline Bytes messageBytes(Epoch epoch, const Message& message) {
    const ByteChain payload = encodeMessage(message);
    const auto header = encodeHeader(wireType(message), epoch, payload);
    Bytes bytes(header.begin(), header.end());
    const Bytes body = payload.joined();
    bytes.insert(bytes.end(), body.begin(), body.end());
    return bytes;
}

}  // namespace tessera::test

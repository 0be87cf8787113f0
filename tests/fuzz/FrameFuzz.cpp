/// The bytes of a connection, as they arrive: in pieces of any size. Whole frames become messages.
#include "common/codec/MessageCodec.h"
#include "common/net/FrameReader.h"
#include "tests/fuzz/FuzzInput.h"

namespace tessera::fuzz {
namespace {

/// Frames whose headers are right, of any type and payload; or whatever the bytes are.
Bytes stream(FuzzInput& in) {
    Bytes all;
    while (!in.empty()) {
        if (in.below(8) == 0) {
            const ByteSpan bytes = in.bytes(in.below(64));
            all.insert(all.end(), bytes.begin(), bytes.end());
            continue;
        }
        const auto type = static_cast<std::uint16_t>(in.below(32));
        const ByteSpan bytes = in.bytes(in.below(512));
        const Bytes payload(bytes.begin(), bytes.end());
        const auto header = encodeHeader(type, Epoch(in.below(3)), ByteChain(share(Bytes(payload))));
        all.insert(all.end(), header.begin(), header.end());
        all.insert(all.end(), payload.begin(), payload.end());
    }
    return all;
}

void run(FuzzInput in) {
    FrameReader reader([](std::uint16_t type) { return maxPayloadBytesFromPeer(type); });
    std::vector<ReceivedFrame> frames;
    const std::size_t piece = 1 + in.below(256);
    const Bytes bytes = stream(in);
    for (std::size_t at = 0; at < bytes.size();) {
        const std::span<std::byte> room = reader.room();
        must(!room.empty(), "there is always room for more");
        const ByteSpan some = ByteSpan(bytes).subspan(at, std::min({piece, room.size(), bytes.size() - at}));
        std::copy(some.begin(), some.end(), room.begin());
        at += some.size();
        if (!reader.filled(some.size(), frames)) return;
    }
    for (const ReceivedFrame& frame : frames) {
        must(frame.payload.size() <= maxPayloadBytesFromPeer(frame.type), "no frame is longer than its type allows");
        (void)decodeMessage(frame.type, frame.payload);
    }
}

}  // namespace
}  // namespace tessera::fuzz

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    tessera::fuzz::run({data, size});
    return 0;
}

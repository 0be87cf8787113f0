/// The payload of any message. What can be read says the same when it is written and read again; what it carries is
/// looked into, as its receiver would.
#include "common/codec/ApplicationCodec.h"
#include "common/codec/ChangeCodec.h"
#include "common/codec/FrameCodec.h"
#include "common/codec/MessageCodec.h"
#include "common/codec/WallCodec.h"
#include "tests/fuzz/FuzzInput.h"

namespace tessera::fuzz {
namespace {

void lookInto(const Message& message) {
    if (const auto* request = std::get_if<message::Request>(&message)) (void)decodeRequest(request->body);
    if (const auto* welcome = std::get_if<message::Welcome>(&message)) (void)decodeWall(welcome->configuration.bytes());
    if (const auto* ready = std::get_if<message::Ready>(&message)) (void)decodeStats(ready->stats.bytes());
    if (const auto* reply = std::get_if<message::Reply>(&message)) (void)decodeAnswer(reply->body);
    if (const auto* notice = std::get_if<message::Notice>(&message)) (void)decodeNotice(notice->body);
    if (const auto* begin = std::get_if<message::Begin>(&message)) {
        if (const auto frame = decodeFrame(begin->payload.bytes()))
            must(frame->view.position.allFinite() && frame->view.worldUnitsPerMetre > 0,
                 "a view that is read can be drawn");
    }
}

void run(FuzzInput in) {
    const auto type = static_cast<std::uint16_t>(in.number<std::uint8_t>());
    const ByteSpan bytes = in.rest();
    if (bytes.size() > maxPayloadBytes(type)) return;
    const Expected<Message> message = decodeMessage(type, share(Bytes(bytes.begin(), bytes.end())));
    if (!message) return;
    must(wireType(*message) == type, "a message has the type that it came as");
    const Bytes written = encodeMessage(*message).joined();
    const Expected<Message> again = decodeMessage(type, share(Bytes(written)));
    must(again.has_value(), "what was read can be written and read again");
    must(encodeMessage(*again).joined() == written, "and is the same then");
    lookInto(*message);
}

}  // namespace
}  // namespace tessera::fuzz

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    tessera::fuzz::run({data, size});
    return 0;
}
